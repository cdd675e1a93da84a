// Fetches manifests and objects, checks what came, and gets round caches that serve what is old or altered.

import { Broken, readChapter, readManifest, type Chapter, type Manifest, type ObjectName, type Passage } from './manifest';

/** A file that cannot be had now. */
export class Missing extends Error {}

export type Fetch = (url: URL, options: RequestInit) => Promise<Response>;

const MANIFEST = 'manifest.json';
/** A manifest of a day takes a part of it. */
const MOST_MANIFEST_BYTES = 64 * 2 ** 20;

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
    const size = Number(response.headers.get('content-length') ?? 0);
    if (size > MOST_MANIFEST_BYTES) throw new Broken('manifest.json is too large');
    const text = await response.text();
    this.receivedBytes += text.length;
    try {
      return readManifest(text);
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
   * An object whose hash is its name. The browser compares them, in pages without TLS too. One that is missing or altered is asked for
   * again past the browser's cache, and then past all.
   */
  async object(name: ObjectName, signal: AbortSignal): Promise<Uint8Array> {
    const integrity = `sha256-${base64(name.sha256)}`;
    const tries: [URL, RequestCache][] = [
      [new URL(name.path, this.folder), 'default'],
      [new URL(name.path, this.folder), 'reload'],
      [this.#fresh(name.path), 'reload'],
    ];
    for (const [url, cache] of tries) {
      const response = await this.fetch(url, { integrity, cache, signal }).catch(() => null);
      const bytes = response?.ok ? await response.arrayBuffer().catch(() => null) : null;
      if (signal.aborted) throw new Missing('no longer wanted');
      this.receivedBytes += bytes?.byteLength ?? 0;
      if (bytes?.byteLength === name.bytes) return new Uint8Array(bytes);
      ++this.refusedFiles;
    }
    // Whatever was wrong, the browser tells no script; without the comparison it does.
    const response = await this.#get(this.#fresh(name.path), { cache: 'reload', signal });
    await response.body?.cancel();
    throw new Broken(`${name.path} is not what its name says`);
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

function base64(hex: string): string {
  let bytes = '';
  for (let i = 0; i < hex.length; i += 2) bytes += String.fromCharCode(parseInt(hex.slice(i, i + 2), 16));
  return btoa(bytes);
}
