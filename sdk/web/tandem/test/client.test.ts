// The client over a socket that the test plays, with timers that it moves.

import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { Client } from '../client';
import { Module } from '../module';
import type { ConnectOptions, OutcomeEvent, Phase, SocketLike } from '../types';
import { TandemError } from '../types';
import { Kind, traces } from './trace';
import type { Trace } from './trace';
import { wasm } from './wasm';

const { field, restarted } = traces() as { field: Trace; restarted: Trace };

class Socket implements SocketLike {
  binaryType = '';
  protocol = 'tandem.4';
  readyState = 0;
  onopen: ((event: never) => void) | null = null;
  onmessage: ((event: never) => void) | null = null;
  onclose: ((event: never) => void) | null = null;
  onerror: ((event: never) => void) | null = null;
  readonly sent: Uint8Array[] = [];
  closed: [number | undefined, string | undefined] | null = null;

  send(data: Uint8Array): void {
    this.sent.push(data);
  }
  close(code?: number, reason?: string): void {
    this.readyState = 3;
    this.closed = [code, reason];
  }

  open(): void {
    this.readyState = 1;
    this.onopen?.({} as never);
  }
  give(data: Uint8Array | string): void {
    this.onmessage?.({ data: typeof data === 'string' ? data : data.slice().buffer } as never);
  }
  end(code: number, reason = ''): void {
    this.readyState = 3;
    this.onclose?.({ code, reason } as never);
  }
  async play(trace: Trace, count = trace.messages.length): Promise<void> {
    let before = 0;
    for (const { atMs, bytes } of trace.messages.slice(0, count)) {
      await vi.advanceTimersByTimeAsync(Math.max(0, atMs - before));
      before = atMs;
      if (bytes[0] === Kind.snapshot) await vi.advanceTimersByTimeAsync(50);
      this.give(bytes);
    }
  }
  kinds(): (number | undefined)[] {
    return this.sent.map((each) => each[0]);
  }
}

let sockets: Socket[];
let client: Client;
const latest = () => sockets.at(-1) as Socket;

async function connect(options: Partial<ConnectOptions> = {}): Promise<Client> {
  client = await Client.connect({
    url: 'ws://test/tandem',
    wasm,
    log: () => undefined,
    webSocket: () => {
      sockets.push(new Socket());
      return latest();
    },
    ...options,
  });
  return client;
}

beforeEach(() => {
  sockets = [];
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'performance', 'Date'], now: 1_700_000_000_000 });
});
afterEach(() => {
  client.close();
  vi.useRealTimers();
  vi.restoreAllMocks();
});

describe('a connection', () => {
  test('goes from connecting to playing, and tells each phase', async () => {
    const phases: Phase[] = [];
    await connect();
    expect(client.status()).toMatchObject({ phase: 'connecting', simd: true, restarts: 0, server: null });
    client.on('phase', (phase) => phases.push(phase));
    latest().open();
    expect(client.status().phase).toBe('searching');
    await latest().play(field);
    expect(phases).toEqual(['searching', 'joining', 'playing']);
    expect(latest().kinds()[0]).toBe(Kind.ack);
    const last = field.told.frames.at(-1);
    expect(client.status()).toMatchObject({
      phase: 'playing',
      reason: '',
      frame: last?.[0],
      stateHash: last?.[1],
      bodies: field.told.bodies,
      hashMismatches: 0,
      resyncs: 0,
    });
    expect(client.types().length).toBeGreaterThan(0);
    expect(client.types()).toBe(client.types());
  });

  test('measures what came in the last second', async () => {
    await connect();
    latest().open();
    await latest().play(field);
    const { mbitPerS, receivedMbitPerS, rawMbitPerS } = client.status();
    const bytes = field.messages.slice(-30).reduce((sum, each) => sum + each.bytes.length, 0);
    expect(receivedMbitPerS).toBeCloseTo((bytes * 8) / 1048576, 2);
    expect(mbitPerS).toBeGreaterThan(0);
    expect(mbitPerS).toBeLessThan(receivedMbitPerS);
    expect(rawMbitPerS).toBeCloseTo((300 * 24 * 8 * 30) / 1048576, 5);
    await vi.advanceTimersByTimeAsync(2000);
    expect(client.status().mbitPerS).toBe(0);
  });

  test('compares bodies that turn with their orientations, once it is sampled', async () => {
    await connect();
    latest().open();
    const turning = traces()['orientations'] as Trace;
    await latest().play(turning);
    client.sample();
    const { rawMbitPerS, frameRateHz } = client.status();
    expect(rawMbitPerS).toBeCloseTo((turning.told.bodies * 52 * 8 * frameRateHz) / 1048576, 5);
  });

  test('that is lost is tried again, ever more rarely, and the session goes on', async () => {
    await connect();
    latest().open();
    await latest().play(field, 150);
    const held = client.status().frame;
    latest().end(1006);
    expect(client.status()).toMatchObject({ phase: 'lost', reason: 'the connection was lost' });
    const began = performance.now();
    const tried: number[] = [];
    for (let i = 0; i < 6; ++i) {
      const before = sockets.length;
      while (sockets.length === before) await vi.advanceTimersByTimeAsync(50);
      tried.push(performance.now() - began);
      latest().end(1006);
    }
    expect(tried[0]).toBeLessThanOrEqual(300);
    const waits = tried.map((each, i) => each - (tried[i - 1] ?? 0));
    expect(Math.max(...waits)).toBeLessThanOrEqual(5050);
    expect(waits[5]).toBeGreaterThan(waits[0] as number);
    await vi.advanceTimersByTimeAsync(5000);
    latest().open();
    const frames: number[] = [];
    client.on('applied', (event) => frames.push(event.frame));
    await latest().play(field);
    expect(frames).toEqual(field.told.frames.map(([frame]) => frame).filter((frame) => frame > held)); // it goes on
    expect(client.status()).toMatchObject({ phase: 'playing', reason: '', resyncs: 0 });
  });

  test('that the gateway refuses says why, and is tried again', async () => {
    await connect();
    latest().open();
    latest().end(1008, 'wrong token');
    expect(client.status()).toMatchObject({ phase: 'refused', reason: 'wrong token' });
    await vi.advanceTimersByTimeAsync(300);
    expect(sockets).toHaveLength(2);
    latest().open();
    expect(client.status().phase).toBe('searching');
  });

  test('to something else is refused', async () => {
    await connect();
    latest().protocol = '';
    latest().open();
    expect(latest().closed).not.toBeNull();
    expect(client.status()).toMatchObject({ phase: 'refused', reason: 'the server does not speak tandem.4' });
  });

  test('from which nothing comes while there is a server is dropped', async () => {
    await connect();
    latest().open();
    await latest().play(field, 100);
    await vi.advanceTimersByTimeAsync(9000);
    expect(sockets).toHaveLength(1);
    await vi.advanceTimersByTimeAsync(2500);
    expect(sockets[0]?.closed).not.toBeNull();
    expect(sockets.length).toBeGreaterThan(1);
    expect(client.status()).toMatchObject({ phase: 'lost', reason: 'nothing was received for 10 s' });
  });

  test('stays while the server is gone, and plays its next epoch', async () => {
    const epochs: number[] = [];
    await connect();
    client.on('session', (event) => epochs.push(event.epoch));
    latest().open();
    await latest().play(field, 100);
    latest().give(Uint8Array.of(Kind.absent));
    expect(client.status()).toMatchObject({ phase: 'lost', reason: 'the server is gone' });
    await vi.advanceTimersByTimeAsync(30_000);
    expect(sockets).toHaveLength(1);
    await latest().play(restarted);
    expect(client.status()).toMatchObject({ phase: 'playing', epoch: restarted.told.epoch });
    expect(epochs).toEqual([field.told.epoch, restarted.told.epoch]);
  });

  test('is ended by close(), for good', async () => {
    await connect();
    latest().open();
    await latest().play(field, 100);
    client.close();
    expect(latest().closed?.[0]).toBe(1000);
    expect(client.status().phase).toBe('closed');
    await vi.advanceTimersByTimeAsync(60_000);
    expect(sockets).toHaveLength(1);
    expect(vi.getTimerCount()).toBe(0);
  });
});

describe('inputs', () => {
  test('leave at once while playing, numbered', async () => {
    await connect();
    expect(() => client.sendGravity([0, -1, 0])).toThrow(TandemError);
    latest().open();
    await latest().play(field, 100);
    const before = latest().sent.length;
    expect(client.sendGravity([0, -1, 0])).toBe(1);
    expect(client.sendPush([0, 1, 0], 2, [3, 0, 0])).toBe(2);
    expect(client.sendBytes(Uint8Array.of(1, 2, 3))).toBe(3);
    expect(latest().kinds().slice(before)).toEqual([Kind.input, Kind.input, Kind.input]);
    expect(client.status().inputsSent).toBe(3);
  });

  test('that are not possible say why', async () => {
    await connect();
    latest().open();
    await latest().play(field, 100);
    expect(() => client.sendGravity([0, Number.NaN, 0])).toThrow('not finite');
    expect(() => client.sendBytes(new Uint8Array(1025))).toThrow('1,024');
    expect(client.status().inputsSent).toBe(0);
    client.close();
    expect(() => client.sendGravity([0, 0, 0])).toThrow('can send input only while it plays');
  });

  test('that were under way when the server started again are told as unknown', async () => {
    const outcomes: OutcomeEvent[] = [];
    await connect();
    client.on('outcome', (event) => outcomes.push(event));
    latest().open();
    await latest().play(field, 100);
    const number = client.sendGravity([0, -1, 0]);
    await latest().play(restarted, 1);
    expect(outcomes).toMatchObject([{ number, kind: 'unknown' }]);
  });
});

describe('failures', () => {
  test('of the module start another one, which plays', async () => {
    const lines: string[] = [];
    await connect({ log: (level, line) => level === 'error' && lines.push(line) });
    latest().open();
    await latest().play(field, 100);
    vi.spyOn(Module.prototype, 'poll').mockImplementationOnce(() => {
      throw new WebAssembly.RuntimeError('unreachable');
    });
    await vi.advanceTimersByTimeAsync(100);
    expect(client.status()).toMatchObject({ phase: 'lost', restarts: 1 });
    expect(client.status().reason).toContain('unreachable');
    expect(lines).toHaveLength(1);
    expect(sockets[0]?.closed).not.toBeNull();
    expect(client.sample()).toBeNull();
    await vi.advanceTimersByTimeAsync(300);
    while (sockets.length < 2) await new Promise((resolve) => setImmediate(resolve));
    latest().open();
    await latest().play(field);
    expect(client.status()).toMatchObject({ phase: 'playing', restarts: 1, reason: '' });
  });

  test('of a handler do not reach the client', async () => {
    const error = vi.spyOn(console, 'error').mockImplementation(() => undefined);
    await connect();
    client.on('phase', () => {
      throw new Error('of the application');
    });
    latest().open();
    await latest().play(field, 100);
    expect(client.status().phase).toBe('playing');
    expect(error).toHaveBeenCalled();
  });

  test('to load the module are told', async () => {
    await connect();
    const broken = new Uint8Array(wasm.simd.slice(0, 1000));
    await expect(connect({ wasm: { plain: broken, simd: broken } })).rejects.toThrow(TandemError);
  });

  test('of bytes: texts and junk are skipped', async () => {
    await connect();
    latest().open();
    latest().give('text');
    latest().give(Uint8Array.of(2, 3, 4));
    await latest().play(field);
    expect(client.status()).toMatchObject({ phase: 'playing', refusedMessages: 1 });
  });
});

test('a handler that was taken off hears nothing more', async () => {
  const phases: Phase[] = [];
  await connect();
  const off = client.on('phase', (phase) => phases.push(phase));
  latest().open();
  off();
  latest().end(1006);
  expect(phases).toEqual(['searching']);
});
