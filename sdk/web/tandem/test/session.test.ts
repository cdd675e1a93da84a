// The module plays what a native client played, and agrees with it on every frame.

import { beforeAll, describe, expect, test } from 'vitest';

import { Player } from './player';
import { Kind, traces } from './trace';
import type { Trace } from './trace';
import { VARIANTS } from './wasm';

const recorded = traces();

describe.each(VARIANTS)('%s', (variant) => {
  describe.each(['field', 'orientations', 'lifecycle'])('a session with %s', (name) => {
    const trace = recorded[name] as Trace;
    let player: Player;
    beforeAll(async () => {
      player = await new Player().start(variant);
      for (const message of trace.messages) player.play(message);
    });

    test('is agreed with the native client on every frame', () => {
      expect(trace.told.frames.length).toBeGreaterThanOrEqual(300);
      expect(player.applied.map((each) => [each.frame, each.hash, each.corrected])).toEqual(trace.told.frames);
      expect(player.module.status()).toMatchObject({ phase: 'playing', hashMismatches: 0, resyncs: 0, refusedMessages: 0 });
    });

    test('is told in figures', () => {
      const { told } = trace;
      const last = told.frames.at(-1) as [number, string, number];
      expect(player.module.status()).toMatchObject({
        frame: last[0],
        stateHash: last[1],
        corrected: last[2],
        epoch: told.epoch,
        scene: told.scene,
        capacity: told.capacity,
        bodies: told.bodies,
        atRest: told.at_rest,
        codec: 'tracker',
        frameRateHz: expect.any(Number) as number,
        framesApplied: told.frames.length,
      });
      expect(JSON.parse(player.module.types())).not.toHaveLength(0);
      expect(JSON.parse(player.module.sceneJson())).toHaveProperty('gravity');
    });

    test('is drawn where the native client has it', () => {
      // The first sample only turns sampling on; a second later nothing moves on between two frames.
      player.module.sample('interpolate');
      player.time.now += 1000;
      const { frame } = player.module.status();
      const sample = player.module.sample('interpolate');
      expect(sample?.frame).toBe(frame);
      expect(sample?.capacity).toBe(trace.told.capacity);
      const bodies = sample?.alive.reduce((sum, each) => sum + each, 0);
      expect(bodies).toBe(trace.told.bodies);
      const alive = (_: number, i: number) => sample?.alive[Math.floor(i / 3)] === 1;
      // To within the last bit or two of a float: a sample is computed in them.
      const told = trace.told.positions.filter(alive);
      const drawn = Array.from(sample?.positions ?? []).filter(alive);
      expect(drawn).toHaveLength(told.length);
      const beside = told.filter((value, i) => !(Math.abs((drawn[i] ?? NaN) - value) <= Math.abs(value) * 2 ** -22));
      expect(beside).toEqual([]);
      expect(sample?.corrected.reduce((sum, each) => sum + each, 0)).toBe(trace.told.frames.at(-1)?.[2]);
      if (name !== 'orientations') expect(sample?.orientations).toBeNull();
      else {
        for (let slot = 0; slot < trace.told.capacity; ++slot) {
          if (sample?.alive[slot] !== 1) continue;
          const q = sample.orientations?.subarray(4 * slot, 4 * slot + 4) ?? [];
          expect(Math.hypot(...q)).toBeCloseTo(1, 5);
        }
      }
    });
  });

  test('bytes cut short or flipped do not end it: it counts them and joins again', async () => {
    const { messages } = recorded['field'] as Trace;
    const player = await new Player().start(variant);
    let random = 12345;
    const below = (n: number) => (random = (Math.imul(random, 1103515245) + 12345) >>> 0) % n;
    for (const { atMs, bytes } of messages) {
      const broken = bytes.slice(0, below(4) === 0 ? below(bytes.length) : bytes.length);
      for (let i = below(4); i > 0 && broken.length > 0; --i) broken[below(broken.length)] = below(256);
      if (below(3) === 0) player.play({ atMs, bytes: broken });
      player.play({ atMs, bytes });
    }
    const status = player.module.status();
    expect(status.refusedMessages).toBeGreaterThan(0);
    expect(['joining', 'playing', 'refused']).toContain(status.phase);
  });

  test('a session of another protocol version is refused with the reason', async () => {
    const { messages } = recorded['field'] as Trace;
    const session = (messages[0] as Trace['messages'][number]).bytes.slice();
    // Behind kind, header and epoch.
    new DataView(session.buffer).setUint32(1 + 4 + 8, 3, true);
    const player = await new Player().start(variant);
    player.play({ atMs: 1, bytes: session });
    expect(player.module.status()).toMatchObject({ phase: 'refused' });
    expect(player.module.status().reason).toContain('version');
  });

  test('a stream of a codec that only comparisons need is refused by name', async () => {
    const { messages } = recorded['other_codec'] as Trace;
    const player = await new Player().start(variant);
    player.play(messages[0] as Trace['messages'][number]);
    expect(player.module.status()).toMatchObject({ phase: 'refused' });
    expect(player.module.status().reason).toContain("unknown codec 'quantized'");
  });

  test('the world of a session is told', async () => {
    const { messages } = recorded['field'] as Trace;
    const player = await new Player().start(variant);
    expect(player.module.status().dtS).toBeUndefined();
    player.play(messages[0] as Trace['messages'][number]);
    expect(player.module.status()).toMatchObject({ upAxis: 1, continuesEpoch: 0, continuesFrame: 0 });
    expect(player.module.status().dtS).toBeCloseTo(1 / 30, 4);
  });

  test('a server that starts again is another epoch, played from its snapshot', async () => {
    const player = await new Player().start(variant);
    const first = recorded['field'] as Trace;
    const second = recorded['restarted'] as Trace;
    for (const message of first.messages.slice(0, 200)) player.play(message);
    const before = player.applied.length;
    expect(before).toBeGreaterThan(100);
    player.play({ atMs: 0, bytes: Uint8Array.of(Kind.absent) });
    expect(player.module.status()).toMatchObject({ serverAlive: false });
    player.sent.length = 0;
    const later = player.time.now;
    for (const { atMs, bytes } of second.messages) player.play({ atMs: later + atMs, bytes });
    expect(player.applied.slice(before).map((each) => [each.frame, each.hash, each.corrected])).toEqual(second.told.frames);
    expect(player.module.status()).toMatchObject({ phase: 'playing', epoch: second.told.epoch, resyncs: 0, hashMismatches: 0 });
  });

  test('over another connection it goes on with what it holds', async () => {
    const { messages, told } = recorded['field'] as Trace;
    const player = await new Player().start(variant);
    for (const message of messages.slice(0, 200)) player.play(message);
    const before = player.applied.length;
    expect(before).toBeGreaterThan(100);
    player.module.disconnected();
    player.poll();
    expect(player.module.status()).toMatchObject({ phase: 'playing', serverAlive: false });
    player.module.connected();
    for (const message of messages) player.play(message);
    expect(player.applied.map((each) => [each.frame, each.hash, each.corrected])).toEqual(told.frames);
    expect(player.module.status()).toMatchObject({ resyncs: 0, hashMismatches: 0 });
  });

  test('a connection that begins anew is a join of its own', async () => {
    const { messages, told } = recorded['field'] as Trace;
    const player = await new Player().start(variant);
    for (const message of messages.slice(0, 200)) player.play(message);
    player.module.disconnected();
    player.poll();
    expect(player.module.status()).toMatchObject({ phase: 'playing', serverAlive: false });
    player.sent.length = player.applied.length = 0;
    player.module.connected(true);
    player.poll();
    expect(player.sent).toEqual([]);
    for (const message of messages) player.play(message);
    expect(player.applied.map((each) => [each.frame, each.hash, each.corrected])).toEqual(told.frames);
  });
});
