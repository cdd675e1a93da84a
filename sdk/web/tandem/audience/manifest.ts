// The text of manifests and chapters (idl/AUDIENCE.md). It is untrusted.

/** Something that is not what it should be, and may be right the next time: cut short, or altered on the way. */
export class Broken extends Error {}
/** Something that this page cannot play, whole as it is. */
export class Unplayable extends Error {}

/** A file that never changes. */
export interface ObjectName {
  /** 64 hex digits. */
  sha256: string;
  bytes: number;
  /** From the folder of the manifest. */
  path: string;
}

export interface Segment {
  object: ObjectName;
  /** The first that it has. */
  frame: number;
  frames: number;
  /** On the time line, as all times here. */
  fromMs: number;
  ms: number;
}

/** A snapshot and the segments that follow it. */
export interface Passage {
  run: number;
  /** Of the snapshot. */
  frame: number;
  fromMs: number;
  toMs: number;
  snapshot: ObjectName;
  segments: Segment[];
}

export interface Chapter {
  object: ObjectName;
  fromMs: number;
  toMs: number;
}

/** One stream of one epoch. */
export interface Run {
  run: number;
  epoch: number;
  stream: number;
  generation: number;
  session: ObjectName;
}

export interface Manifest {
  /** When its writer began, ms since 1970; a later writer has a higher one. */
  writer: number;
  /** Counts the writer's manifests. */
  number: number;
  live: boolean;
  session: string;
  /** The server's wall clock at the newest frame, ms since 1970. */
  newestMs: number;
  runs: Map<number, Run>;
  chapters: Chapter[];
  passages: Passage[];
}

export const FORMAT_VERSION = 1;
export const PROTOCOL_VERSION = 4;

/** Above all that a server may send in a second, and below what a page has memory for. */
const MOST_OBJECT_BYTES = 400 * 2 ** 20;
const MOST_ROWS = 1_000_000;
const MOST_MS = Number.MAX_SAFE_INTEGER;

type Fields = Record<string, unknown>;

export function readManifest(text: string): Manifest {
  const json = fields(parse(text));
  if (json['format'] !== 'tandem-audience') throw new Unplayable('the manifest is not one of Tandem');
  const version = json['version'];
  if (version !== FORMAT_VERSION) {
    throw new Unplayable(`the files are of version ${say(version)}, and this page reads version ${FORMAT_VERSION}`);
  }
  const protocol = json['protocol'];
  if (protocol !== PROTOCOL_VERSION) {
    throw new Unplayable(`the session is of protocol version ${say(protocol)}, and this page plays version ${PROTOCOL_VERSION}`);
  }
  const state = json['state'];
  if (state !== 'live' && state !== 'ended') throw new Broken('"state" is neither live nor ended');
  const session = json['session'];
  if (typeof session !== 'string' || session.length > 64) throw new Broken('"session" is no name');
  const runs = new Map<number, Run>();
  for (const row of list(json['runs']).map(fields)) {
    const run: Run = {
      run: whole(row['run']),
      epoch: whole(row['epoch']),
      stream: whole(row['stream']),
      generation: whole(row['generation']),
      session: object(list(row['session']), 'bin'),
    };
    runs.set(run.run, run);
  }
  const chapters = list(json['chapters']).map((row) => {
    const [sha256, bytes, fromMs, toMs] = list(row);
    return { object: object([sha256, bytes], 'json'), fromMs: whole(fromMs), toMs: whole(toMs) };
  });
  const passages = readPassages(json['passages']);
  const manifest = {
    writer: whole(json['writer']),
    number: whole(json['number']),
    live: state === 'live',
    session,
    newestMs: whole(json['newest_ms']),
    runs,
    chapters,
    passages,
  };
  inOrder([...chapters, ...passages]);
  if (passages.length === 0) throw new Broken('it has no passage');
  for (const { run } of passages) if (!runs.has(run)) throw new Broken(`run ${run} is missing`);
  return manifest;
}

export function readChapter(text: string): Passage[] {
  const passages = readPassages(fields(parse(text))['passages']);
  inOrder(passages);
  return passages;
}

function readPassages(value: unknown): Passage[] {
  return list(value).map((each) => {
    const row = fields(each);
    const frame = whole(row['frame']);
    const fromMs = whole(row['from_ms']);
    const segments: Segment[] = [];
    let [atMs, atFrame] = [fromMs, frame + 1];
    for (const segment of list(row['segments']).map(list)) {
      const [frames, ms] = [whole(segment[2]), whole(segment[3])];
      if (frames === 0) throw new Broken('a segment without frames');
      segments.push({ object: object(segment, 'bin'), frame: atFrame, frames, fromMs: atMs, ms });
      atMs += ms;
      atFrame += frames;
    }
    return { run: whole(row['run']), frame, fromMs, toMs: atMs, snapshot: object(list(row['snapshot']), 'bin'), segments };
  });
}

function inOrder(spans: { fromMs: number; toMs: number }[]): void {
  let atMs = 0;
  for (const { fromMs, toMs } of spans) {
    if (fromMs < atMs || toMs < fromMs) throw new Broken('times that go back');
    atMs = toMs;
  }
}

function parse(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch {
    throw new Broken('it is cut short, or no JSON');
  }
}

function fields(value: unknown): Fields {
  if (typeof value !== 'object' || value === null || Array.isArray(value)) throw new Broken('an object is missing');
  return value as Fields;
}

function list(value: unknown): unknown[] {
  if (!Array.isArray(value) || value.length > MOST_ROWS) throw new Broken('a list is missing, or too long');
  return value;
}

function whole(value: unknown): number {
  if (!Number.isSafeInteger(value) || (value as number) < 0 || (value as number) > MOST_MS) throw new Broken('a number is missing');
  return value as number;
}

function object([sha256, bytes]: unknown[], ending: 'bin' | 'json'): ObjectName {
  if (typeof sha256 !== 'string' || !/^[0-9a-f]{64}$/.test(sha256)) throw new Broken('the name of an object is missing');
  const size = whole(bytes);
  if (size > MOST_OBJECT_BYTES) throw new Broken('an object is too large');
  return { sha256, bytes: size, path: `objects/${sha256}.${ending}` };
}

const say = (value: unknown): string => (typeof value === 'number' ? String(value) : 'unknown');
