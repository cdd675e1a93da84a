import { PerspectiveCamera } from 'three';
import { describe, expect, it } from 'vitest';
import { DetailChoice, detailsOf } from '../drawing/detail';
import { Canvas } from '../drawing/discs';

describe('the detail', () => {
  const frames = (choice: DetailChoice, ms: number, count: number) => Array.from({ length: count }, () => choice.note(ms)).filter(Boolean).length;

  it('has fewer pixels where a graphics card is slow, and discs besides where the processor draws', () => {
    expect(detailsOf(2, false)).toEqual([2, 1.5, 1.125, 1].map((pixelRatio) => ({ pixelRatio, discs: false })));
    expect(detailsOf(1, true).map(({ pixelRatio, discs }) => `${pixelRatio}${discs ? ' discs' : ''}`)).toEqual(['1', '1 discs', '0.75 discs', '0.5 discs']);
  });

  it('falls while pictures are slow, says what it leaves out, and rises again where they are quick', () => {
    const choice = new DetailChoice(1, true);
    choice.begin(10_000);
    expect(choice.leftOut(true)).toBe('Less detail, to keep up: spheres as flat discs'); // sooner there
    expect(choice.leftOut(false)).toBe('');
    expect(frames(choice, 17, 120)).toBe(1);
    expect(choice.leftOut(true)).toBe('');
    expect(frames(choice, 50, 12)).toBe(0);
    expect(frames(choice, 17, 10)).toBe(0); // for a moment alone
    expect(frames(choice, 50, 30)).toBe(1);
    expect(frames(choice, 17, 200)).toBe(0); // it has been too much
    expect(frames(choice, 50, 100)).toBe(2);
    expect(choice.leftOut(true)).toBe('Less detail, to keep up: spheres as flat discs, 25 % of the pixels');
    expect(choice.leftOut(false)).toBe('Less detail, to keep up: 25 % of the pixels');
    expect(frames(choice, 17, 900)).toBe(0);
    expect(frames(choice, 17, 2000)).toBe(3);
    expect(choice.leftOut(true)).toBe('');
  });

  it('falls where every other picture misses the screen by one period, but not for one long pause', () => {
    const choice = new DetailChoice(1, true);
    choice.begin(100_000);
    expect(frames(choice, 33, 100)).toBe(0);
    expect(frames(choice, 2000, 1)).toBe(0);
    expect(frames(choice, 33, 100)).toBe(0);
    expect(Array.from({ length: 40 }, (_, i) => choice.note(i % 2 ? 33 : 50)).filter(Boolean).length).toBe(1);
  });

  it('of very many bodies is never finer than discs, without a graphics card', () => {
    const software = new DetailChoice(1, true);
    software.begin(100_000);
    expect(software.now.discs).toBe(true);
    expect(frames(software, 17, 10_000)).toBe(0);
    const card = new DetailChoice(1, false);
    card.begin(100_000);
    expect(card.now.discs).toBe(false);
  });
});

describe('a picture of discs', () => {
  const camera = new PerspectiveCamera(40, 4 / 3, 0.1, 100);
  camera.position.set(0, 0, 10);
  camera.updateMatrixWorld();
  const matrix = camera.projectionMatrix.clone().multiply(camera.matrixWorldInverse).elements;
  const painted = (positions: number[], radii: number[], tints: number[]) => {
    const canvas = new Canvas(80, 60);
    const scale = 30 * camera.projectionMatrix.elements[5];
    canvas.paint(Float32Array.from(positions), Float32Array.from(radii), Uint32Array.from(tints), matrix, scale, 50, 100);
    return canvas;
  };
  const seen = (canvas: Canvas) => canvas.depths.reduce((count, depth) => count + Number(depth < 1), 0);

  it('has each where its body is, as large as it is', () => {
    const canvas = painted([0, 0, 0], [1], [0xff0000c8]);
    const radius = (30 / Math.tan((20 * Math.PI) / 180)) / 10;
    expect(seen(canvas) / (Math.PI * radius * radius)).toBeCloseTo(1, 1);
    expect(canvas.depths[30 * 80 + 40]).toBeLessThan(1);
    expect(canvas.colours[30 * 80 + 40] & 255).toBeGreaterThan(120);
    expect(canvas.colours[30 * 80 + 40] >> 8).toBe(0);
    expect(canvas.colours[36 * 80 + 40]).toBeGreaterThan(canvas.colours[24 * 80 + 40]); // lighter above
  });

  it('hides what is behind, whatever the order', () => {
    const near = 0xff00ff00;
    const far = 0xff0000ff;
    for (const canvas of [painted([0, 0, 2, 0, 0, -2], [1, 1], [near, far]), painted([0, 0, -2, 0, 0, 2], [1, 1], [far, near])]) {
      expect(canvas.colours[30 * 80 + 40] & 255).toBe(0);
    }
  });

  it('shows even the smallest, and leaves out what is dead, behind the camera, outside or not a number', () => {
    expect(seen(painted([0, 0, -80], [0.001], [~0]))).toBeGreaterThan(0);
    expect(seen(painted([0, 0, 0, 0, 0, 11, 99, 0, 0, NaN, 0, 0, 0, 0, -1e9], [0, 1, 1, 1, 1], [~0, ~0, ~0, ~0, ~0]))).toBe(0);
    expect(seen(painted([0, 0, 9.5], [1], [~0]))).toBe(80 * 60); // all of it, from within
  });
});
