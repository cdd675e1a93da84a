import { describe, expect, test } from 'vitest';

import { hasSimd, Module } from '../module';
import type { LogLevel, Role } from '../types';
import { TandemError } from '../types';
import { VARIANTS, wasm } from './wasm';

async function start(variant: 'plain' | 'simd', role: Role = 'participant') {
  const log: [LogLevel, string][] = [];
  const time = { now: 5000 };
  const module = await Module.create(await WebAssembly.compile(wasm[variant]), {
    id: 77n,
    role,
    lead: 1,
    clock: { steady: () => time.now, wall: () => 1_700_000_000_000 + time.now },
    log: (level, text) => log.push([level, text]),
  });
  return { module, log, time };
}

test('node runs SIMD', () => expect(hasSimd()).toBe(true));

describe.each(VARIANTS)('the module, %s', (variant) => {
  test('imports a clock and a log and nothing else', async () => {
    const names = WebAssembly.Module.imports(await WebAssembly.compile(wasm[variant])).map((each) => `${each.module}.${each.name}`);
    expect(names.sort()).toEqual(['tandem.clock_ms', 'tandem.log']);
  });

  // Of this, `rigid` takes about 38 kB and `hard` 20: solvers that no other predictor has. Vector loops of the filter take 15.
  test('is below 600 kB', () => expect(wasm[variant].length).toBeLessThan(600_000));

  test('ends in a trap where its memory does', async () => {
    const { instance } = await WebAssembly.instantiate(wasm[variant], { tandem: { clock_ms: () => 0, log: () => undefined } });
    const { tandem_create, tandem_input, memory, _initialize } = instance.exports as unknown as {
      tandem_create(id: bigint, role: number, lead: number): number;
      tandem_input(self: number, size: number): number;
      memory: WebAssembly.Memory;
      _initialize(): void;
    };
    _initialize();
    const fill = () => {
      for (let i = 0; i < 20; ++i) tandem_input(tandem_create(1n, 1, 1), 40 << 20);
    };
    expect(fill).toThrow(WebAssembly.RuntimeError);
    expect(memory.buffer.byteLength).toBeGreaterThan(400 << 20);
    expect(memory.buffer.byteLength).toBeLessThanOrEqual(512 << 20);
  });

  test('searches until a server is announced', async () => {
    const { module } = await start(variant);
    expect(module.poll()).toBeGreaterThan(5000);
    expect(module.status()).toMatchObject({ phase: 'searching', serverAlive: false, epoch: 0, clientId: '000000000000004d', server: null });
    expect(module.sample('extrapolate')).toBeNull();
    expect(module.types()).toBe('[]');
    expect(module.events()).toEqual([]);
    expect(module.nextMessage()).toBeUndefined();
  });

  test('refuses inputs unless playing, and says so', async () => {
    const { module } = await start(variant);
    expect(() => module.send(1, new Uint8Array(24))).toThrow(TandemError);
    expect(() => module.send(1, new Uint8Array(24))).toThrow('can send input only while it plays');
    const observer = await start(variant, 'observer');
    expect(() => observer.module.send(1, new Uint8Array(24))).toThrow('observers');
  });

  test('refuses bytes that are no message, counts them and goes on', async () => {
    const { module } = await start(variant);
    module.connected();
    expect(module.receive(new Uint8Array(0))).toContain('without a kind');
    expect(module.receive(Uint8Array.of(2, 0, 1, 0, 0))).toContain('TandemDelta');
    expect(module.receive(Uint8Array.of(2, 0, 0, 0, 0))).toContain('not little-endian');
    expect(module.receive(Uint8Array.of(15, 1, 2))).toBe('');
    module.poll();
    expect(module.status()).toMatchObject({ phase: 'searching', refusedMessages: 3 });
  });
});
