import { expect, it } from 'vitest';
import type { Sample } from '../../tandem';
import { SlowMotion } from '../slow_motion';

const sample = (frame: number, change = 0): Sample => ({
  frame,
  capacity: 1,
  positions: Float32Array.of(frame, 0, 0),
  orientations: Float32Array.of(0, 0, 0, frame % 2 ? 1 : -1), // the same orientation, told in both ways
  alive: Uint8Array.of(1),
  generation: Uint8Array.of(0),
  types: Uint16Array.of(0),
  changes: Uint8Array.of(change),
  corrected: Uint8Array.of(0),
  correctedIn: Uint32Array.of(0),
});
const second = 30;

it('at full speed the sample is handed on as it is', () => {
  const slow = new SlowMotion(1 / 30);
  const live = sample(1);
  expect(slow.play(live, 1, 0).sample).toBe(live);
});

it('at half speed a second takes two, without jumps and with unit quaternions', () => {
  const slow = new SlowMotion(1 / 30);
  slow.setSpeed('1/2');
  const shown: number[] = [];
  for (let frame = 1; frame <= 2 * second; ++frame) {
    const played = slow.play(sample(frame), frame, (frame * 1000) / 30).sample;
    shown.push(played.positions[0]);
    expect(Math.abs(played.orientations?.[3] ?? 0)).toBeCloseTo(1);
  }
  expect(shown[shown.length - 1] - shown[0]).toBeCloseTo(0.5 * (2 * second - 1), 3);
  for (let i = 1; i < shown.length; ++i) expect(shown[i] - shown[i - 1]).toBeCloseTo(0.5, 3);
});

it('what it keeps is bounded: it goes on from the newest in the end', () => {
  const slow = new SlowMotion(1 / 30);
  slow.setSpeed('1/4');
  let jumps = 0;
  let last = 0;
  for (let frame = 1; frame <= 20 * second; ++frame) {
    const at = slow.play(sample(frame), frame, (frame * 1000) / 30).sample.frame;
    if (at > last + 1) ++jumps;
    last = at;
  }
  expect(jumps).toBe(3);
});

it('a body that came or jumped is not drawn on its way', () => {
  const slow = new SlowMotion(1 / 30);
  slow.setSpeed('1/2');
  slow.play(sample(1), 1, 0);
  slow.play(sample(10, 3), 10, 100);
  const played = slow.play(sample(11), 11, 133).sample;
  expect([1, 10]).toContain(Math.round(played.positions[0]));
});

it('a jump is no way either where the sample that told of it is not kept', () => {
  const slow = new SlowMotion(1 / 30);
  slow.setSpeed('1/2');
  slow.play(sample(1), 1, 0);
  slow.play(sample(1.4, 3), 1, 13);
  slow.note(sample(1.6, 0));
  const played = slow.play(sample(10), 10, 46).sample;
  expect(played.frame).toBeCloseTo(1.5, 1);
  expect(played.positions[0]).toBe(10);
});

it('a new session starts anew', () => {
  const slow = new SlowMotion(1 / 30);
  slow.setSpeed('1/2');
  slow.play(sample(500), 500, 0);
  expect(slow.play(sample(3), 3, 33).sample.frame).toBe(3);
});
