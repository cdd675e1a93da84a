// A web server with the files of an audience, made of recorded messages, for tests. It can be slow, silent, or have caches in front.

import { createHash } from 'node:crypto';

import { Kind } from './trace';

const hashOf = (bytes: Uint8Array) => createHash('sha256').update(bytes).digest('hex');

export interface Row {
  run: number;
  frame: number;
  from_ms: number;
  snapshot: [string, number];
  segments: [string, number, number, number][];
}

export const frameOf = (delta: Uint8Array): number => Number(new DataView(delta.buffer, delta.byteOffset).getBigUint64(5 + 8, true));
const snapshotFrameOf = (part: Uint8Array): number => Number(new DataView(part.buffer, part.byteOffset).getBigUint64(5 + 16, true));
export const epochOf = (message: Uint8Array): number => Number(new DataView(message.buffer, message.byteOffset).getBigUint64(5, true));
const lastInputOf = (delta: Uint8Array) => Number(new DataView(delta.buffer, delta.byteOffset).getBigUint64(5 + 16, true));
const numberOf = (input: Uint8Array) => Number(new DataView(input.buffer, input.byteOffset).getBigUint64(5 + 8, true));

/** A row of messages behind their sizes. */
export function packed(messages: Uint8Array[]): Uint8Array {
  const out = Buffer.concat(
    messages.flatMap((message) => {
      const size = Buffer.alloc(4);
      size.writeUInt32LE(message.length);
      return [size, message];
    }),
  );
  return new Uint8Array(out);
}

export class Origin {
  readonly files = new Map<string, Uint8Array>();
  /** Requests by path, with their query. */
  readonly asked: string[] = [];
  /** Looks at each request first, and may answer it. */
  intercept: (path: string, url: URL) => Uint8Array | Response | number | null | undefined = () => undefined;
  manifest = {
    format: 'tandem-audience',
    version: 1 as number,
    protocol: 4 as number,
    writer: 1000,
    number: 0,
    state: 'live',
    session: 'test',
    scene: 'half_pipe',
    frame_rate_hz: 30,
    newest_ms: 0,
    runs: [] as { run: number; epoch: number; stream: number; generation: number; session: [string, number] }[],
    chapters: [] as [string, number, number, number][],
    passages: [] as Row[],
  };

  readonly fetch = async (url: URL, options: RequestInit = {}): Promise<Response> => {
    const path = url.pathname.replace(/^\/show\//, '');
    this.asked.push(path + url.search);
    await Promise.resolve();
    if (options.signal?.aborted) throw new TypeError('aborted');
    const found = this.intercept(path, url) ?? this.files.get(path) ?? 404;
    if (found === null) throw new TypeError('no answer');
    if (found instanceof Response) return found;
    const bytes = typeof found === 'number' ? new Uint8Array() : found;
    return new Response(bytes as BodyInit, { status: typeof found === 'number' ? found : 200 });
  };

  put(bytes: Uint8Array, ending = 'bin'): [string, number] {
    const sha256 = hashOf(bytes);
    this.files.set(`objects/${sha256}.${ending}`, bytes);
    return [sha256, bytes.length];
  }
  publish(): void {
    ++this.manifest.number;
    this.files.set('manifest.json', new TextEncoder().encode(JSON.stringify(this.manifest)));
  }
  requests(part: string): number {
    return this.asked.filter((path) => path.includes(part)).length;
  }
}

/** Publishes the messages of a session bit by bit, a segment each `frames` deltas. */
export class Publisher {
  #inputs: Uint8Array[] = [];
  #segment: Uint8Array[] = [];
  #count = 0;
  #atMs: number;

  constructor(
    readonly origin: Origin,
    private readonly frames = 30,
    private readonly publishes = true,
  ) {
    const last = origin.manifest.passages.at(-1);
    this.#atMs = last ? last.from_ms + last.segments.reduce((sum, row) => sum + row[3], 0) : 0;
  }

  add(message: Uint8Array): void {
    const { manifest } = this.origin;
    if (message[0] === Kind.session) {
      const run = { run: manifest.runs.length, epoch: epochOf(message), stream: 0, generation: 0, session: this.origin.put(packed([message])) };
      manifest.runs.push(run);
    } else if (message[0] === Kind.snapshot) {
      this.endSegment();
      const row = { run: manifest.runs.length - 1, frame: snapshotFrameOf(message), from_ms: this.#atMs, snapshot: this.origin.put(packed([message])), segments: [] };
      manifest.passages.push(row);
    } else if (message[0] === Kind.scheduledInput) {
      this.#inputs.push(message);
    } else if (message[0] === Kind.delta) {
      const counted = this.#inputs.filter((input) => numberOf(input) <= lastInputOf(message));
      this.#inputs = this.#inputs.filter((input) => !counted.includes(input));
      this.#segment.push(...counted, message);
      manifest.newest_ms = Math.round(Number(new DataView(message.buffer, message.byteOffset).getBigInt64(5 + 24, true)) / 1e6);
      if (++this.#count === this.frames) this.endSegment();
    }
  }
  endSegment(): void {
    if (this.#count === 0) return;
    const ms = Math.round((this.#count * 1000) / 30);
    const row = this.origin.put(packed(this.#segment));
    this.origin.manifest.passages.at(-1)!.segments.push([...row, this.#count, ms]);
    this.#atMs += ms;
    this.#segment = [];
    this.#count = 0;
    if (this.publishes) this.origin.publish();
  }
  finish(): void {
    this.endSegment();
    this.origin.manifest.state = 'ended';
    this.origin.publish();
  }
}

/** Moves all passages but the last so many into chapters of one each. */
export function fold(origin: Origin, staying: number): void {
  const { manifest } = origin;
  while (manifest.passages.length > staying) {
    const passage = manifest.passages.shift()!;
    const to = passage.from_ms + passage.segments.reduce((sum, row) => sum + row[3], 0);
    const row = origin.put(new TextEncoder().encode(JSON.stringify({ passages: [passage] })), 'json');
    manifest.chapters.push([...row, passage.from_ms, to]);
  }
  origin.publish();
}
