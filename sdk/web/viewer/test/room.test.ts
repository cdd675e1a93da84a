import { describe, expect, it } from 'vitest';
import { clip, extentOf, gridLines, roomFaces, tangents, type Extent } from '../room';
import type { Sample } from '../../tandem';
import type { Plane, Vec3 } from '../scene';
import { bodiesExtent, extentsOf } from '../world';
import { emptyScene } from '../scene';

const bounds: Extent = { low: [-10, -10, -10], high: [10, 10, 10] };
const unitRoom: Plane[] = [0, 1, 2].flatMap((axis) =>
  [-1, 1].map((side) => ({
    through: [0, 1, 2].map((a) => (a === axis ? side : 0)) as Vec3,
    normal: [0, 1, 2].map((a) => (a === axis ? -side : 0)) as Vec3,
  })),
);

describe('faces of a room', () => {
  it('of six planes are those of a cube', () => {
    const faces = roomFaces(unitRoom, bounds);
    expect(faces.length).toBe(6);
    for (const face of faces) expect(face.corners.length).toBe(4);
    expect(extentOf(faces.flatMap((face) => face.corners))).toEqual({ low: [-1, -1, -1], high: [1, 1, 1] });
  });

  it('of one plane end at the extent', () => {
    const [face] = roomFaces([{ through: [0, 2, 0], normal: [0, 1, 0] }], bounds);
    const extent = extentOf(face.corners);
    [-10, 2, -10].forEach((x, i) => expect(extent?.low[i]).toBeCloseTo(x));
    [10, 2, 10].forEach((x, i) => expect(extent?.high[i]).toBeCloseTo(x));
  });

  it('that others hide are left out', () => {
    const floors: Plane[] = [0, 1].map((y) => ({ through: [0, y, 0], normal: [0, 1, 0] }));
    const faces = roomFaces(floors, bounds);
    expect(faces.length).toBe(1);
    expect(faces[0].corners[0][1]).toBeCloseTo(1);
  });
});

describe('a line', () => {
  it('is clipped at one end, and gone behind the plane', () => {
    const plane: Plane = { through: [1, 0, 0], normal: [1, 0, 0] };
    expect(clip([[0, 0, 0], [2, 0, 0]], plane, false)).toEqual([[1, 0, 0], [2, 0, 0]]);
    expect(clip([[2, 0, 0], [0, 0, 0]], plane, false)).toEqual([[2, 0, 0], [1, 0, 0]]);
    expect(clip([[0, 0, 0], [0, 1, 0]], plane, false)).toEqual([]);
  });

  it('of a grid stays on its face', () => {
    const [face] = roomFaces(unitRoom, bounds);
    const lines = gridLines(face, 0.5);
    expect(lines.length).toBeGreaterThanOrEqual(6);
    for (const end of lines.flat()) for (const x of end) expect(Math.abs(x)).toBeLessThan(1 + 1e-6);
  });
});

it('tangents are at right angles to each other and the normal', () => {
  for (const normal of [[0, 1, 0], [0.6, 0.8, 0], [0.36, 0.48, 0.8]] as Vec3[]) {
    const [u, v] = tangents(normal);
    const dots = [[u, v], [u, normal], [v, normal]].map(([a, b]) => a.reduce((sum, x, i) => sum + x * b[i], 0));
    for (const dot of dots) expect(dot).toBeCloseTo(0);
    expect(Math.hypot(...u)).toBeCloseTo(1);
  }
});

describe('what the camera shows', () => {
  it('is a closed room', () => {
    const { shown } = extentsOf({ ...emptyScene, planes: unitRoom, bounds }, { low: [-1, -1, -1], high: [0, 0, 0] });
    expect(shown.low).toEqual([-1, -1, -1]);
    expect(shown.high[0]).toBeCloseTo(1);
  });

  it('leaves out the few bodies that have flown away', () => {
    const positions = new Float32Array(300);
    for (let slot = 0; slot < 99; ++slot) positions[3 * slot] = slot / 98;
    positions[297] = 1000;
    const alive = new Uint8Array(100).fill(1);
    const type = { name: '', radius: 0.5, colour: '', shape: 'sphere' as const, shapeValues: [] };
    const extent = bodiesExtent({ capacity: 100, positions, alive } as unknown as Sample, [type]);
    expect(extent?.high[0]).toBeLessThan(1.6);
    expect(extent?.low[1]).toBe(-0.5);
  });

  it('is the bodies where there is only ground', () => {
    const ground: Plane = { through: [0, 0, 0], normal: [0, 1, 0] };
    const bodies: Extent = { low: [-1, 0, -1], high: [1, 1, 1] };
    const { shown, walls } = extentsOf({ ...emptyScene, planes: [ground], bounds }, bodies);
    expect(shown).toEqual(bodies);
    expect(walls.high[0]).toBeCloseTo(2.2);
  });

  it('is something even of an empty scene without bodies', () => {
    const { shown } = extentsOf(emptyScene, null);
    expect(shown.high[0]).toBeGreaterThan(shown.low[0]);
  });
});
