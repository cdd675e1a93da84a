import { PerspectiveCamera, Vector3 } from 'three';
import { describe, expect, it } from 'vitest';
import { SERVER_GONE, type Sample } from '../../tandem';
import { adviceOf } from '../advice';
import { Colours, packed, parseColour, rampColour } from '../colours';
import { driftLine } from '../corrections';
import { niceTop } from '../history';
import { loginRefusal, noticeOf } from '../notices';
import { hashIsGood } from '../panel';
import { threeDigits } from '../elements';
import { framingDistance } from '../drawing/stage';

it('figures have three digits', () => {
  expect([0, 0.0771, 0.3, 5.4321, 54.93, 549.3, 5493].map(threeDigits)).toEqual(['0', '0.077', '0.300', '5.43', '54.9', '549', '5493']);
  expect(threeDigits(NaN)).toBe('–');
});

it('scales of plots are 1, 2 or 5 times a power of ten', () => {
  expect([0, 0.03, 1, 1.1, 6].map(niceTop)).toEqual([1, 0.05, 1, 2, 10]);
});

it('what is seen without corrections is said in seconds and metres', () => {
  const uncorrected = { frames: 90, bodies: 10, meanDrift: 0.4567, mostDrift: 12.34 };
  const line = driftLine({ uncorrected, frameRateHz: 30, phase: 'playing' });
  for (const figure of ['3.00 s', '0.457 m', '12.3 m']) expect(line).toContain(figure);
  expect(driftLine({ uncorrected: null, frameRateHz: 30, phase: 'playing' })).toBe('');
});

it('a device that does not keep up is told what to do', () => {
  const well = { phase: 'playing', predictor: 'field', frameMs: { p50: 9, p99: 20 }, frameRateHz: 30, lagMs: 80, roundTripMs: 20 } as const;
  expect(adviceOf(well)).toBe('');
  expect(adviceOf({ ...well, frameMs: { p50: 24, p99: 30 } })).toMatch(/72 %.*ballistic/);
  expect(adviceOf({ ...well, lagMs: 900 })).toMatch(/0.9 s late.*ballistic/);
  expect(adviceOf({ ...well, lagMs: 900, roundTripMs: 800 })).toBe('');
  expect(adviceOf({ ...well, predictor: 'ballistic', lagMs: 900 })).toMatch(/fewer bodies/);
  expect(adviceOf({ ...well, phase: 'lost', lagMs: 900 })).toBe('');
});

it('a state is equal to the server’s only while there is a server to compare with', () => {
  const well = { phase: 'playing', framesApplied: 9, hashMismatches: 0 } as const;
  expect(hashIsGood(well)).toBe(true);
  expect(hashIsGood({ ...well, framesApplied: 0 })).toBe(null);
  expect(hashIsGood({ ...well, hashMismatches: 1 })).toBe(false);
  for (const phase of ['connecting', 'searching', 'refused', 'joining', 'lost', 'closed'] as const) {
    expect(hashIsGood({ ...well, phase })).toBe(null);
    expect(hashIsGood({ ...well, phase, hashMismatches: 1 })).toBe(false);
  }
});

it('every phase but playing says something', () => {
  const phases = ['connecting', 'searching', 'refused', 'joining', 'lost', 'closed'] as const;
  for (const phase of phases) expect(noticeOf({ phase, reason: '' })?.title).toBeTruthy();
  expect(noticeOf({ phase: 'playing', reason: '' })).toBeNull();
  expect(noticeOf({ phase: 'lost', reason: 'the connection was lost' })?.title).toBe('Connection lost');
  expect(noticeOf({ phase: 'lost', reason: SERVER_GONE })?.title).toBe('The server is gone');
  expect(noticeOf({ phase: 'refused', reason: 'token missing or wrong' })?.text).toContain('token');
});

// A page of a proxy may be in HTML, and is for people who look at the proxy.
it('a login is refused in the words of the gateway or of this page', () => {
  const own = 'Bearer realm="tandem"';
  expect(loginRefusal(401, own, 'token missing or wrong\n')).toBe('token missing or wrong');
  for (const [status, challenge] of [
    [401, 'Basic realm="site"'],
    [401, null],
    [403, null],
  ] as const) {
    const said = loginRefusal(status, challenge, '<html><h1>Authorization Required</h1></html>');
    expect(said).toContain(`HTTP ${status}`);
    expect(said).not.toContain('<');
  }
  for (const status of [200, 429, 502]) expect(loginRefusal(status, own, 'later')).toBeNull();
});

describe('colours', () => {
  const type = { name: 'red', radius: 0.5, colour: '#102030ff', shape: 'sphere' as const, shapeValues: [] };
  const sample = (frame: number, x: number, corrected: number): Sample => ({
    frame,
    capacity: 2,
    positions: Float32Array.of(x, 0, 0, 0, 0, 0),
    orientations: null,
    alive: Uint8Array.of(1, 1),
    generation: new Uint8Array(2),
    types: new Uint16Array(2),
    changes: new Uint8Array(2),
    corrected: Uint8Array.of(corrected, 0),
    correctedIn: Uint32Array.of(1, 0),
  });

  it('are parsed, and packed with red lowest', () => {
    expect(parseColour('#102030ff')).toEqual([16, 32, 48]);
    expect(packed([16, 32, 48])).toBe(0xff302010);
    expect(parseColour('blue')).toEqual(parseColour(''));
  });

  it('a body that jumped between two whole frames is not fast', () => {
    const colours = new Colours(2, [type], 1 / 30);
    colours.mode = 'speed';
    colours.follow(sample(1, 0, 0));
    colours.follow({ ...sample(1.5, 9, 0), changes: Uint8Array.of(3, 0) });
    colours.follow(sample(2, 9, 0));
    const tints = new Uint32Array(2);
    colours.fill(sample(2, 9, 0), 2, tints);
    expect(tints[0]).toBe(packed(rampColour(0)));
  });

  it('tell type, speed, corrections and their age', () => {
    const colours = new Colours(2, [type], 1 / 30);
    const tints = new Uint32Array(2);
    const after = (mode: typeof colours.mode, applied: number, last: Sample) => {
      colours.mode = mode;
      colours.fill(last, applied, tints);
      return [...tints];
    };
    colours.follow(sample(1, 0, 1));
    colours.follow(sample(2, 1, 0));
    const last = sample(2, 1, 0);
    expect(after('type', 2, last)).toEqual([0xff302010, 0xff302010]);
    expect(after('speed', 2, last)).toEqual([packed(rampColour(1)), packed(rampColour(0))]);
    const [first, second] = after('corrected', 1, sample(1, 0, 1));
    expect(first).not.toBe(second);
    const ages = after('age', 2, last);
    expect(ages[1]).toBe(packed(rampColour(0)));
    expect(ages[0]).not.toBe(ages[1]);
  });
});

it('the camera is framed so that all corners are seen, and barely', () => {
  const extent = { low: [-30, 0, -15], high: [30, 50, 15] } as const;
  const camera = new PerspectiveCamera(40, 0.5);
  const back = new Vector3(0.5, 0.42, 1).normalize();
  camera.position.copy(back);
  camera.lookAt(0, 0, 0);
  const [right, up, towards] = [new Vector3(), new Vector3(), new Vector3()];
  camera.updateMatrixWorld();
  camera.matrixWorld.extractBasis(right, up, towards);
  const tan = Math.tan((20 * Math.PI) / 180);
  const box = { low: [...extent.low], high: [...extent.high] } as { low: [number, number, number]; high: [number, number, number] };
  const distance = framingDistance(box, towards, right, up, tan * 0.5, tan);
  camera.position.set(0, 25, 0).addScaledVector(towards, distance);
  camera.updateMatrixWorld();
  let most = 0;
  for (const x of [-30, 30]) {
    for (const y of [0, 50]) {
      for (const z of [-15, 15]) {
        const at = new Vector3(x, y, z).project(camera);
        most = Math.max(most, Math.abs(at.x), Math.abs(at.y));
      }
    }
  }
  expect(most).toBeCloseTo(1);
});
