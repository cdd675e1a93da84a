import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import type { Sample } from '../../tandem';
import { Coalesced } from '../coalesced';
import { downOfDevice, fromDial, toDial, type ViewAxes } from '../gravity';
import { pick } from '../pick';
import type { Vec3 } from '../scene';

const front: ViewAxes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

function expectClose(got: readonly number[], wanted: readonly number[]): void {
  wanted.forEach((x, i) => expect(got[i]).toBeCloseTo(x));
}

describe('the gravity dial', () => {
  it('shows gravity as the camera sees it', () => {
    expectClose(Object.values(toDial([0, -3, 0], front)).slice(0, 2) as number[], [0, -1]);
    expect(toDial([0, 0, -3], front)).toMatchObject({ x: 0, y: 0, away: true });
    expect(toDial([0, 0, 3], front)).toMatchObject({ away: false });
  });

  it('keeps the strength, on the disc and beyond its rim', () => {
    expectClose(fromDial({ x: 0, y: 0, away: true }, 3, front), [0, 0, -3]);
    expectClose(fromDial({ x: 5, y: 0, away: true }, 3, front), [3, 0, 0]);
    expect(Math.hypot(...fromDial({ x: 0.3, y: -0.4, away: true }, 3, front))).toBeCloseTo(3);
  });

  it('gives back what it shows', () => {
    const side: ViewAxes = [[0, 0, -1], [0, 1, 0], [1, 0, 0]];
    for (const gravity of [[1, -2, 0.5], [-1, 0, 2]] as Vec3[]) {
      expectClose(fromDial(toDial(gravity, side), Math.hypot(...gravity), side), gravity);
    }
  });
});

describe('down of a device', () => {
  it('is into the screen when it lies, and along it when it stands', () => {
    expectClose(downOfDevice(0, 0, 0), [0, 0, -1]);
    expectClose(downOfDevice(90, 0, 0), [0, -1, 0]);
    expectClose(downOfDevice(0, 90, 0), [1, 0, 0]);
  });

  it('turns with the screen', () => {
    // On its left edge, its top to the left: landscape, and down is down on the page.
    expectClose(downOfDevice(0, -90, 90), [0, -1, 0]);
  });
});

describe('coalesced values', () => {
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  it('pass the first at once and the last always, at most one in an interval', () => {
    const passed: number[] = [];
    const values = new Coalesced<number>(100, (value) => passed.push(value));
    for (let i = 0; i < 10; ++i) values.put(i);
    expect(passed).toEqual([0]);
    vi.advanceTimersByTime(100);
    expect(passed).toEqual([0, 9]);
    vi.advanceTimersByTime(1000);
    values.put(10);
    expect(passed).toEqual([0, 9, 10]);
  });
});

describe('picking', () => {
  const sample = {
    capacity: 4,
    positions: Float32Array.of(0, 0, -10, 0, 0, -5, 3, 0, -5, 0, 0, 5),
    alive: Uint8Array.of(1, 1, 1, 1),
    types: Uint16Array.of(0, 0, 0, 0),
  } as Sample;
  const ahead: Vec3 = [0, 0, -1];

  it('takes the nearest body before the viewer', () => {
    expect(pick(sample, [1], [0, 0, 0], ahead, 0)).toBe(1);
  });

  it('passes by what is dead and what is missed', () => {
    expect(pick({ ...sample, alive: Uint8Array.of(1, 0, 1, 1) }, [1], [0, 0, 0], ahead, 0)).toBe(0);
    expect(pick(sample, [1], [1.5, 0, 0], ahead, 0)).toBe(-1);
  });

  it('forgives a finger that misses a little', () => {
    expect(pick(sample, [1], [1.4, 0, 0], ahead, 0.1)).toBe(1);
  });
});
