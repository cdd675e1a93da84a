// A client that plays the files of an audience, with the real module, on recorded sessions and with timers that the test moves.

import { createHash } from 'node:crypto';

import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { Broken, Unplayable, readManifest } from '../audience/manifest';
import { Kind, readSegment, readWhole } from '../audience/messages';
import { Pace } from '../audience/pace';
import { digest, sha256 } from '../audience/sha256';
import { Client } from '../client';
import type { ConnectOptions } from '../types';
import { Origin, Publisher, fold } from './audience_origin';
import { traces, type Trace } from './trace';
import { wasm } from './wasm';

const { field, restarted } = traces() as { field: Trace; restarted: Trace };
const hashes = (trace: Trace) => new Map(trace.told.frames.map(([frame, hash]) => [frame, hash]));

let origin: Origin;
let client: Client | undefined;
let log: string[];

async function connect(options: Partial<ConnectOptions> = {}): Promise<Client> {
  client = await Client.connect({ from: 'http://test/show/', wasm, fetch: origin.fetch, log: (level, line) => void (level !== 'info' && log.push(line)), ...options });
  return client;
}
const pass = (ms: number) => vi.advanceTimersByTimeAsync(ms);
const status = () => client!.status();

/** All of a trace at once. */
function recorded(trace: Trace): void {
  const publisher = new Publisher(origin, 30, false);
  for (const { bytes } of trace.messages) publisher.add(bytes);
  publisher.finish();
}

/** Adds the messages of a trace as time passes. Returns a function that lets it pass. */
function live(trace: Trace): (ms: number) => Promise<void> {
  const publisher = new Publisher(origin);
  const began = trace.messages[0]!.atMs;
  let now = 0;
  let at = 0;
  return async (ms) => {
    for (const end = now + ms; now < end; now += 10) {
      for (; at < trace.messages.length && trace.messages[at]!.atMs - began <= now; ++at) publisher.add(trace.messages[at]!.bytes);
      await pass(10);
    }
  };
}

function follow(): { frame: number; hash: string; epoch: number; at: number }[] {
  const seen: { frame: number; hash: string; epoch: number; at: number }[] = [];
  client!.on('applied', ({ frame, hash, epoch }) => seen.push({ frame, hash, epoch, at: performance.now() }));
  return seen;
}

beforeEach(() => {
  origin = new Origin();
  log = [];
  // The browser's takes time of the real clock.
  vi.spyOn(globalThis.crypto, 'subtle', 'get').mockReturnValue(undefined as never);
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'performance', 'Date'], now: 1_700_000_000_000 });
});
afterEach(() => {
  client?.close();
  client = undefined;
  vi.useRealTimers();
  vi.restoreAllMocks();
});

describe('a recording', () => {
  test('plays from its begin to its end in its own time, with the hash of every frame', async () => {
    recorded(field);
    await connect();
    const seen = follow();
    await pass(500);
    expect(status().phase).toBe('playing');
    expect(status().role).toBe('observer');
    const early = seen.length;
    await pass(2000);
    expect(seen.length - early).toBeGreaterThan(55);
    expect(seen.length - early).toBeLessThan(65);
    await pass(12_000);
    expect(seen.at(-1)!.frame).toBe(field.told.frames.at(-1)![0]);
    expect(seen.every(({ frame, hash }) => hashes(field).get(frame) === hash)).toBe(true);
    expect(status().hashMismatches + status().resyncs).toBe(0);
    expect(status().timeLine).toMatchObject({ fromS: 0, ended: true, live: false });
    expect(origin.requests('manifest.json')).toBeLessThan(4);
    await pass(20_000);
    expect(status().phase).toBe('playing');
  });

  test('goes to any time, and back', async () => {
    recorded(field);
    await connect();
    await pass(300);
    client!.seek(7);
    await pass(200);
    const there = status();
    expect(there.phase).toBe('playing');
    expect(there.timeLine!.atS).toBeGreaterThan(7);
    expect(there.timeLine!.atS).toBeLessThan(7.5);
    expect(Math.abs(there.frame - field.told.frames[0]![0] - 7 * 30)).toBeLessThan(20);
    client!.seek(1);
    await pass(200);
    expect(status().timeLine!.atS).toBeLessThan(1.5);
    expect(status().frame).toBeLessThan(60);
    expect(client!.sample()).not.toBeNull();
    client!.seek(1e9);
    await pass(200);
    expect(status().timeLine!.atS).toBeCloseTo(status().timeLine!.toS, 0);
    expect(status().hashMismatches).toBe(0);
  });

  test('has its older part in chapters, which are fetched when they are needed', async () => {
    recorded(field);
    recorded(restarted);
    fold(origin, 1);
    await connect();
    const seen = follow();
    await pass(9000);
    expect(seen.length).toBeGreaterThan(200);
    await pass(9000);
    expect(seen.at(-1)!.epoch).toBe(restarted.told.epoch);
    expect(origin.requests('.json') - origin.requests('manifest.json')).toBe(1);
    expect(status().hashMismatches).toBe(0);
  });
});

describe('a live session', () => {
  test('is shown about two seconds late, without a jerk', async () => {
    const on = live(field);
    await on(3300);
    await connect();
    const seen = follow();
    await on(5000);
    expect(status().phase).toBe('playing');
    expect(status().timeLine).toMatchObject({ live: true, ended: false });
    const published = origin.manifest.passages[0]!.segments.length;
    const lateS = 8.3 - status().timeLine!.atS;
    expect(published).toBe(8);
    expect(lateS).toBeGreaterThan(1.2);
    expect(lateS).toBeLessThan(2.4);
    const gaps = seen.slice(130).map(({ at }, i, all) => (i === 0 ? 0 : at - all[i - 1]!.at));
    expect(Math.max(...gaps)).toBeLessThan(120);
    expect(seen.every(({ frame, hash }) => hashes(field).get(frame) === hash)).toBe(true);
  });

  test('goes on in the epoch of a server that was restarted', async () => {
    const on = live(field);
    await on(4000);
    await connect();
    const seen = follow();
    const sessions: number[] = [];
    client!.on('session', ({ epoch }) => sessions.push(epoch));
    await on(2000);
    const then = live(restarted);
    await then(6000);
    expect(sessions).toEqual([field.told.epoch, restarted.told.epoch]);
    expect(seen.at(-1)!.epoch).toBe(restarted.told.epoch);
    expect(seen.filter(({ epoch }) => epoch === restarted.told.epoch).every(({ frame, hash }) => hashes(restarted).get(frame) === hash)).toBe(true);
    expect(status().phase).toBe('playing');
  });

  test('that ended is taken up again where another writer takes the folder, at the present', async () => {
    const on = live(field);
    await on(3000);
    await connect();
    await on(1000);
    origin.manifest.state = 'ended';
    origin.publish();
    await pass(30_000);
    expect(status().timeLine).toMatchObject({ ended: true });
    const ended = origin.requests('manifest.json');
    await pass(600_000);
    expect(origin.requests('manifest.json') - ended).toBeLessThan(12);
    const before = origin;
    origin = new Origin();
    origin.manifest.writer = 2000;
    before.intercept = (path) => origin.files.get(path) ?? before.files.get(path);
    const then = live(restarted);
    await then(6000);
    await pass(60_000);
    expect(status().epoch).toBe(restarted.told.epoch);
    expect(status().timeLine).toMatchObject({ ended: false });
  });

  test('says when nothing new comes, and goes on when it does', async () => {
    const on = live(field);
    await on(4000);
    await connect();
    await on(2000);
    await pass(12_000);
    expect(status().phase).toBe('lost');
    expect(status().reason).toMatch(/nothing new has come for \d+ s/);
    await on(2500);
    expect(status().phase).toBe('playing');
    expect(status().reason).toBe('');
  });

  test('can be left for the past, and taken up again', async () => {
    const on = live(field);
    await on(6000);
    await connect();
    await on(500);
    client!.seek(0.5);
    await on(500);
    expect(status().timeLine).toMatchObject({ live: false });
    expect(status().timeLine!.atS).toBeLessThan(1.5);
    client!.goLive();
    await on(500);
    expect(status().timeLine!.live).toBe(true);
    expect(status().timeLine!.toS - status().timeLine!.atS).toBeLessThan(3);
  });
});

describe('what is wrong', () => {
  test.each([
    [{ version: 2 }, 'version 2, and this page reads version 1'],
    [{ protocol: 3 }, 'protocol version 3, and this page plays version 4'],
    [{ format: 'something' }, 'not one of Tandem'],
  ])('%j is refused by name', async (change, said) => {
    recorded(field);
    Object.assign(origin.manifest, change);
    origin.publish();
    await connect();
    await pass(100);
    expect(status().phase).toBe('refused');
    expect(status().reason).toContain(said);
  });

  test('no manifest is said with its address, and waited for', async () => {
    await connect();
    await pass(100);
    expect(status().phase).toBe('connecting');
    expect(status().reason).toContain('manifest.json: 404');
    recorded(field);
    await pass(8000);
    expect(status().phase).toBe('playing');
  });

  test('a manifest that is cut short, and a stale one, are passed over', async () => {
    const on = live(field);
    await on(3000);
    const old = origin.files.get('manifest.json')!;
    await on(1000);
    await connect();
    await on(500);
    let asked = 0;
    origin.intercept = (path) => (path === 'manifest.json' ? [old, old.slice(0, old.length / 2), undefined][++asked % 3] : undefined);
    const seen = follow();
    await on(4000);
    expect(status().phase).toBe('playing');
    expect(seen.length).toBeGreaterThan(100);
    expect(status().resyncs).toBe(0);
    expect(status().timeLine!.refusedFiles).toBeGreaterThanOrEqual(2);
  });

  test('a first manifest that is cut short in a cache is fetched past it, or said', async () => {
    recorded(field);
    const half = origin.files.get('manifest.json')!.slice(0, 200);
    origin.intercept = (path, url) => (path === 'manifest.json' && url.search === '' ? half : undefined);
    await connect();
    await pass(500);
    expect(status().phase).toBe('playing');
    expect(status().timeLine!.refusedFiles).toBe(1);
    client!.close();
    origin.intercept = (path) => (path === 'manifest.json' ? half : undefined);
    await connect();
    await pass(500);
    expect(status().phase).toBe('connecting');
    expect(status().reason).toBe('manifest.json: it is cut short, or no JSON');
    origin.intercept = () => undefined; // whole at last
    await pass(8000);
    expect(status().phase).toBe('playing');
  });

  test('a writer of another version that takes the folder is said by name, and what is held is played', async () => {
    const on = live(field);
    await on(4000);
    await connect();
    await on(1000);
    const next = { ...origin.manifest, version: 2, writer: 2000 };
    origin.intercept = (path) => (path === 'manifest.json' ? new TextEncoder().encode(JSON.stringify(next)) : undefined);
    const seen = follow();
    await pass(12_000);
    expect(seen.length).toBeGreaterThan(20);
    expect(status().phase).toBe('lost');
    expect(status().reason).toContain('version 2, and this page reads version 1');
    expect(status().timeLine!.refusedFiles).toBeGreaterThan(5);
    origin.intercept = () => undefined;
    await on(3000);
    expect(status().phase).toBe('playing');
  });

  test('a manifest of an earlier recording of the folder is passed over', async () => {
    const on = live(field);
    await on(4000);
    await connect();
    await on(500);
    const earlier = new Origin();
    const now = origin;
    origin = earlier;
    recorded(restarted);
    origin = now;
    Object.assign(earlier.manifest, { writer: 900, number: 1_000_000 });
    earlier.publish();
    let asked = 0;
    now.intercept = (path) => (path === 'manifest.json' && ++asked % 2 === 0 ? earlier.files.get(path) : undefined);
    await on(4000);
    expect(status().epoch).toBe(field.told.epoch);
    expect(status().phase).toBe('playing');
    expect(status().timeLine).toMatchObject({ live: true, ended: false });
    expect(status().timeLine!.refusedFiles).toBeGreaterThan(0);
  });

  test('a cache that serves an old manifest for ever is passed by', async () => {
    const on = live(field);
    await on(3000);
    const old = origin.files.get('manifest.json')!;
    origin.intercept = (path, url) => (path === 'manifest.json' && url.search === '' ? old : undefined);
    await connect();
    await on(8500);
    expect(status().phase).toBe('playing');
    expect(log.join()).toContain('a cache serves an old manifest');
    expect(origin.requests('manifest.json?fresh')).toBeGreaterThan(2);
    expect(status().timeLine!.toS - status().timeLine!.atS).toBeLessThan(3);
  });

  test('an object that a cache altered is fetched past it', async () => {
    recorded(field);
    const path = `objects/${origin.manifest.passages[0]!.segments[2]![0]}.bin`;
    const altered = origin.files.get(path)!.slice();
    altered[100]! ^= 1;
    origin.intercept = (asked, url) => (asked === path && url.search === '' ? altered : undefined);
    await connect();
    const seen = follow();
    await pass(5000);
    expect(seen.length).toBeGreaterThan(120);
    expect(log).toEqual([]);
    expect(status().timeLine!.refusedFiles).toBe(2); // as the cache has it, and as the browser asks it again
  });

  /** What a cache sends that has no end, and how much of it was read. */
  function endless(): { answer: () => Response; mebibytes: () => number } {
    let count = 0;
    const pull = (to: ReadableStreamDefaultController<Uint8Array>) => {
      ++count;
      to.enqueue(new Uint8Array(2 ** 20).fill(0x20));
    };
    return { answer: () => new Response(new ReadableStream({ pull })), mebibytes: () => count };
  }

  test('a file that is larger than it should be is read no further than that', async () => {
    recorded(field);
    const path = `objects/${origin.manifest.passages[0]!.segments[2]![0]}.bin`;
    const object = endless();
    origin.intercept = (asked, url) => (asked === path && url.search === '' ? object.answer() : undefined);
    await connect();
    const seen = follow();
    await pass(5000);
    expect(seen.length).toBeGreaterThan(120);
    expect(status().timeLine!.refusedFiles).toBe(2);
    expect(object.mebibytes()).toBeLessThan(8);
    client!.close();
    const manifest = endless();
    origin.intercept = (asked, url) => (asked === 'manifest.json' && url.search === '' ? manifest.answer() : undefined);
    await connect();
    await pass(2000);
    expect(status().phase).toBe('playing');
    expect(manifest.mebibytes()).toBeLessThan(70);
  });

  test('a cache that answers 404 for ever for what it once had not is passed by', async () => {
    const on = live(field);
    await on(4000);
    const known = new Set(origin.files.keys());
    origin.intercept = (path, url) => (path.startsWith('objects/') && !known.has(path) && url.search === '' ? 404 : undefined);
    await connect();
    const seen = follow();
    await on(5000);
    expect(status().phase).toBe('playing');
    expect(seen.at(-1)!.frame).toBeGreaterThan(6 * 30);
    expect(status().resyncs + status().hashMismatches).toBe(0);
    expect(status().timeLine!.refusedFiles).toBeGreaterThanOrEqual(6);
  });

  test.each([
    ['missing', 404],
    ['altered', new Uint8Array([1, 2, 3])],
  ])('an object that is %s at its origin is named, and what follows is played', async (said, instead) => {
    recorded(field);
    recorded(restarted);
    const name = origin.manifest.passages[0]!.segments[2]![0];
    origin.intercept = (asked) => (asked === `objects/${name}.bin` ? instead : undefined);
    await connect();
    const seen = follow();
    await pass(4000);
    expect(log.join()).toContain(`objects/${name}.bin${said === 'missing' ? ': 404' : ' is not what its name says'}`);
    expect(seen.at(-1)!.epoch).toBe(restarted.told.epoch);
    expect(status().phase).toBe('playing');
  });

  /** The objects of another recording, beside those of this one. */
  function besides(trace: Trace): Origin {
    const [here, other] = [origin, new Origin()];
    origin = other;
    recorded(trace);
    origin = here;
    for (const [path, bytes] of other.files) if (path !== 'manifest.json') here.files.set(path, bytes);
    return other;
  }

  test('a segment of another recording is left out, whatever its name', async () => {
    recorded(field);
    origin.manifest.passages[0]!.segments[1] = besides(restarted).manifest.passages[0]!.segments[1]!;
    origin.publish();
    await connect();
    await pass(2000);
    expect(status().reason).toContain('another stream');
    expect(status().hashMismatches).toBe(0);
  });

  test.each(['snapshot', 'session'])('a %s of another recording is refused, and nothing of it is shown', async (what) => {
    recorded(field);
    const other = besides(restarted);
    if (what === 'snapshot') origin.manifest.passages[0]!.snapshot = other.manifest.passages[0]!.snapshot;
    else origin.manifest.runs[0]!.session = other.manifest.runs[0]!.session;
    origin.publish();
    await connect();
    await pass(500);
    expect(status().phase).not.toBe('playing');
    expect(status().reason).toBe('another message than the manifest says');
    expect(client!.sample()).toBeNull();
  });

  test('a chapter of another recording is named', async () => {
    recorded(field);
    recorded(restarted);
    fold(origin, 1);
    const other = besides(restarted);
    const passage = { ...other.manifest.passages[0]!, from_ms: 500 };
    const row = origin.put(new TextEncoder().encode(JSON.stringify({ passages: [passage] })), 'json');
    origin.manifest.chapters[0]!.splice(0, 2, ...row);
    origin.publish();
    await connect();
    await pass(500);
    expect(status().phase).not.toBe('playing');
    expect(status().reason).toBe(`objects/${row[0]}.json is not of this manifest`);
  });

  test('a writer that began later is followed', async () => {
    const on = live(field);
    await on(3000);
    await connect();
    await on(1000);
    const before = origin;
    const next = new Origin();
    next.manifest.writer = 2000;
    origin = next;
    recorded(restarted);
    origin = before;
    before.intercept = (path) => next.files.get(path);
    await pass(6000);
    expect(status().epoch).toBe(restarted.told.epoch);
    expect(status().phase).toBe('playing');
  });

  test('anything at all as a manifest is refused without an exception', () => {
    recorded(field);
    const good = new TextDecoder().decode(origin.files.get('manifest.json'));
    expect(readManifest(good).passages.length).toBe(1);
    const bad: unknown[] = ['', '[]', 'null', '{}', good.slice(0, 300), good.replace('"passages"', '"past"')];
    const say = (change: object) => JSON.stringify({ ...JSON.parse(good), ...change });
    bad.push(say({ passages: [] }), say({ passages: [{ run: 9 }] }), say({ writer: -1 }), say({ number: 'x' }), say({ runs: 7 }));
    bad.push(say({ chapters: [['z', 1, 0, 1]] }), say({ newest_ms: 1e300 }), say({ session: {} }));
    bad.push(say({ passages: [{ run: 0, frame: 0, from_ms: 0, snapshot: ['../../x', 1], segments: [] }] }));
    for (const text of bad) expect(() => readManifest(text as string), String(text).slice(0, 60)).toThrow(Error);
  });
});

// A seeded fuzzer; TANDEM_FUZZ_SECONDS=60 lets it run for longer.
describe('damaged files', () => {
  /** mulberry32: the same numbers for the same seed. */
  const dice = (seed: number) => () => {
    seed = (seed + 0x6d2b79f5) | 0;
    let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
  };
  function damaged(bytes: Uint8Array, next: () => number): Uint8Array {
    const out = bytes.slice();
    for (let count = 1 + Math.floor(next() * 4); count > 0; --count) {
      const at = Math.floor(next() ** 3 * out.length);
      out[at] = next() < 0.5 ? Math.floor(next() * 256) : (out[at]! ^ (1 << Math.floor(next() * 8))) & 255;
    }
    return next() < 0.2 ? out.subarray(0, Math.floor(next() * out.length)) : out;
  }

  test('are read or refused, by the name of what is broken', () => {
    recorded(field);
    const text = origin.files.get('manifest.json')!;
    const manifest = readManifest(new TextDecoder().decode(text));
    const passage = manifest.passages[0]!;
    const run = manifest.runs.get(passage.run)!;
    const object = (name: string) => origin.files.get(`objects/${name}.bin`)!;
    const row = origin.manifest.passages[0]!;
    const readers: [string, Uint8Array, (bytes: Uint8Array) => unknown][] = [
      ['manifest', text, (bytes) => readManifest(new TextDecoder().decode(bytes))],
      ['segment', object(row.segments[0]![0]), (bytes) => readSegment(bytes, passage.segments[0]!, run)],
      ['snapshot', object(row.snapshot[0]), (bytes) => readWhole(bytes, Kind.snapshot, run)],
    ];
    const seconds = Number(process.env.TANDEM_FUZZ_SECONDS ?? 0);
    const until = process.hrtime.bigint() + BigInt(Math.round(seconds * 1e9));
    let seed = 0;
    let refused = 0;
    do {
      const next = dice(++seed);
      const [what, bytes, read] = readers[seed % readers.length]!;
      try {
        read(damaged(bytes, next));
      } catch (error) {
        if (!(error instanceof Broken || error instanceof Unplayable)) throw new Error(`seed ${seed}, ${what}: ${String(error)}`, { cause: error });
        ++refused;
      }
    } while (seed < 3000 || process.hrtime.bigint() < until);
    expect(refused).toBeGreaterThan(seed / 10);
  });
});

describe('SHA-256', () => {
  test('without the browser has the same result', async () => {
    for (const size of [0, 1, 55, 56, 63, 64, 65, 119, 120, 1000, 100_000]) {
      const bytes = Uint8Array.from({ length: size + 3 }, (_, i) => (i * i * 7) & 255).subarray(3);
      const hash = createHash('sha256').update(bytes).digest('hex');
      expect(Buffer.from(digest(bytes)).toString('hex'), String(size)).toBe(hash);
      vi.restoreAllMocks();
      expect(await sha256(bytes)).toBe(hash);
    }
  });
});

describe('the pace', () => {
  test('finds two seconds behind the present within half a minute, whatever it began with', () => {
    for (const first of [800, 1250, 3100, 9000]) {
      const pace = new Pace();
      let toMs = 20_000;
      pace.goTo(toMs - first, 0);
      pace.live = true;
      for (let now = 10; now < 40_000; now += 10) {
        if (now % 1000 === 200) pace.grew((toMs += 1000));
        pace.advance(now, toMs);
      }
      // Each segment came 0.2 s after its end.
      const lateMs = 21_000 + 40_000 - pace.atMs;
      expect(lateMs, `from ${first}`).toBeGreaterThan(1500);
      expect(lateMs, `from ${first}`).toBeLessThan(2500);
    }
  });
});
