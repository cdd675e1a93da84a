// Fetches manifests and objects, checks what came, and gets round caches that serve what is old or altered.

import { Broken, readChapter, readManifest, type Chapter, type Manifest, type ObjectName, type Passage } from './manifest';
import { sha256 } from './sha256';

/** A file that cannot be had now. */
export class Missing extends Error {}

export type Fetch = (url: URL, options: RequestInit) => Promise<Response>;

const MANIFEST = 'manifest.json';
/** A manifest of a day takes a part of it. */
const MAX_MANIFEST_BYTES = 64 * 2 ** 20;

export class Store {
  /** Bytes that came, headers not counted. */
  receivedBytes = 0;
  /** Answers that were not what was asked for. */
  refusedFiles = 0;
  #queries = Date.now();

  /** `folder` ends with a slash. */
  constructor(
    readonly folder: URL,
    private readonly fetch: Fetch,
  ) {}

  /** The manifest as a cache has it or, `past` the caches, as its origin has it. */
  async manifest(past: boolean, signal: AbortSignal): Promise<Manifest> {
    return this.#manifest(past, signal).catch((error: unknown) => {
      if (!signal.aborted) ++this.refusedFiles;
      throw error;
    });
  }

  async #manifest(past: boolean, signal: AbortSignal): Promise<Manifest> {
    const url = past ? this.#fresh(MANIFEST) : new URL(MANIFEST, this.folder);
    const response = await this.#get(url, { cache: past ? 'reload' : 'no-cache', signal });
    const bytes = await this.#body(response, MAX_MANIFEST_BYTES);
    if (bytes === null) throw new Missing('manifest.json does not come whole');
    if (bytes === 'large') throw new Broken('manifest.json is too large');
    try {
      return readManifest(new TextDecoder().decode(bytes));
    } catch (error) {
      if (error instanceof Broken) throw new Broken(`manifest.json: ${error.message}`);
      throw error;
    }
  }

  async chapter(chapter: Chapter, signal: AbortSignal): Promise<Passage[]> {
    const bytes = await this.object(chapter.object, signal);
    return this.read(() => {
      const passages = readChapter(new TextDecoder().decode(bytes));
      if (passages.length === 0 || passages[0]!.fromMs !== chapter.fromMs || passages.at(-1)!.toMs !== chapter.toMs) {
        throw new Broken(`${chapter.object.path} is not of this manifest`);
      }
      return passages;
    });
  }

  /** Reads what came; counts it where that throws. */
  read<T>(reader: () => T): T {
    try {
      return reader();
    } catch (error) {
      ++this.refusedFiles;
      throw error;
    }
  }

  /**
   * An object whose hash is its name. One that is missing or altered is asked for again past the browser's cache, and then past all. The
   * browser's own comparison (`integrity`) would read a body to its end, however large it is once it is unpacked.
   */
  async object(name: ObjectName, signal: AbortSignal): Promise<Uint8Array> {
    const tries: [URL, RequestCache][] = [
      [new URL(name.path, this.folder), 'default'],
      [new URL(name.path, this.folder), 'reload'],
      [this.#fresh(name.path), 'reload'],
    ];
    let error: unknown;
    for (const [url, cache] of tries) {
      try {
        const bytes = await this.#body(await this.#get(url, { cache, signal }), name.bytes);
        if (bytes instanceof Uint8Array && bytes.length === name.bytes && (await sha256(bytes)) === name.sha256) return bytes;
        error = new Broken(`${name.path} is not what its name says`);
      } catch (missing) {
        error = missing;
      }
      if (signal.aborted) throw new Missing('no longer wanted');
      ++this.refusedFiles;
    }
    throw error;
  }

  /** What an answer holds, unpacked; `large` where that is more than `most` bytes, of which no more are read. Null: it was cut. */
  async #body(response: Response, most: number): Promise<Uint8Array | 'large' | null> {
    const reader = response.body?.getReader();
    const parts: Uint8Array[] = [];
    let size = 0;
    try {
      for (let part = await reader?.read(); part?.value; part = await reader?.read()) {
        this.receivedBytes += part.value.length;
        size += part.value.length;
        if (size > most) {
          await reader?.cancel();
          return 'large';
        }
        parts.push(part.value);
      }
    } catch {
      return null;
    }
    const whole = new Uint8Array(size);
    let at = 0;
    for (const part of parts) {
      whole.set(part, at);
      at += part.length;
    }
    return whole;
  }

  async #get(url: URL, options: RequestInit): Promise<Response> {
    const file = url.pathname.slice(this.folder.pathname.length);
    const response = await this.fetch(url, options).catch(() => null);
    if (response === null) throw new Missing(`${url.host} does not answer for ${file}`);
    if (!response.ok) throw new Missing(`${file}: ${response.status} ${response.statusText}`.trim());
    return response;
  }

  /** An address that no cache knows. */
  #fresh(path: string): URL {
    const url = new URL(path, this.folder);
    url.search = `?fresh=${++this.#queries}`;
    return url;
  }
}
