// The faces of the room that a scene's planes enclose: each plane's part that lies on the inner side of all others.

import type { Plane, Vec3 } from './scene';

export interface Face {
  normal: Vec3;
  corners: Vec3[];
}

export interface Extent {
  low: Vec3;
  high: Vec3;
}

const axes = [0, 1, 2] as const;

export function dot(a: Vec3, b: Vec3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

export function cross(a: Vec3, b: Vec3): Vec3 {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

export function add(a: Vec3, b: Vec3, scale = 1): Vec3 {
  return [a[0] + b[0] * scale, a[1] + b[1] * scale, a[2] + b[2] * scale];
}

/** Two unit vectors that span the plane of a unit normal. */
export function tangents(normal: Vec3): [Vec3, Vec3] {
  const least = axes.reduce((a, b) => (Math.abs(normal[b]) < Math.abs(normal[a]) ? b : a));
  const u = cross(normal, [Number(least === 0), Number(least === 1), Number(least === 2)]);
  const length = Math.hypot(...u);
  const unit: Vec3 = [u[0] / length, u[1] / length, u[2] / length];
  return [unit, cross(normal, unit)];
}

/** The side of a polygon or line that a plane's normal points to; possibly nothing. Sutherland and Hodgman, 1974. */
export function clip(corners: Vec3[], plane: Plane, closed = true): Vec3[] {
  const height = corners.map((corner) => dot(plane.normal, add(corner, plane.through, -1)));
  const inside: Vec3[] = [];
  corners.forEach((corner, i) => {
    if (height[i] >= -1e-9) inside.push(corner);
    const next = (i + 1) % corners.length;
    if ((next !== 0 || closed) && height[i] < -1e-9 !== height[next] < -1e-9) {
      const share = height[i] / (height[i] - height[next]);
      inside.push(add(corner, add(corners[next], corner, -1), share));
    }
  });
  return inside;
}

function walls(extent: Extent): Plane[] {
  return axes.flatMap((axis) => {
    const unit: Vec3 = [0, 0, 0];
    unit[axis] = 1;
    return [
      { through: extent.low, normal: unit },
      { through: extent.high, normal: [-unit[0], -unit[1], -unit[2]] as Vec3 },
    ];
  });
}

/** Faces of the planes within the extent, which itself has none. */
export function roomFaces(planes: Plane[], extent: Extent): Face[] {
  const size = 2 * Math.hypot(...add(extent.high, extent.low, -1));
  const centre = add(extent.low, extent.high).map((x) => x / 2) as Vec3;
  return planes.flatMap((plane) => {
    const middle = add(centre, plane.normal, dot(plane.normal, add(plane.through, centre, -1)));
    const [u, v] = tangents(plane.normal);
    let corners = ([[-1, -1], [1, -1], [1, 1], [-1, 1]] as const).map(([a, b]) => add(add(middle, u, a * size), v, b * size));
    for (const other of [...planes, ...walls(extent)]) {
      if (other !== plane) corners = clip(corners, other);
    }
    return corners.length < 3 ? [] : [{ normal: plane.normal, corners }];
  });
}

/** Lines of a square grid on a face, as pairs of ends. */
export function gridLines(face: Face, pitch: number): [Vec3, Vec3][] {
  const [u, v] = tangents(face.normal);
  const centre = face.corners.reduce((sum, corner) => add(sum, corner, 1 / face.corners.length), [0, 0, 0] as Vec3);
  const edges: Plane[] = face.corners.map((corner, i) => {
    const inward = cross(face.normal, add(face.corners[(i + 1) % face.corners.length], corner, -1));
    const towards = dot(inward, add(centre, corner, -1)) >= 0 ? 1 : -1;
    return { through: corner, normal: inward.map((x) => x * towards) as Vec3 };
  });
  const origin = add([0, 0, 0], face.normal, dot(face.normal, centre));
  const lines: [Vec3, Vec3][] = [];
  for (const [along, across] of [[u, v], [v, u]]) {
    const places = face.corners.map((corner) => dot(across, corner));
    const reach = Math.max(...face.corners.map((corner) => Math.abs(dot(along, corner))));
    for (let n = Math.ceil(Math.min(...places) / pitch); n * pitch <= Math.max(...places) && lines.length < 2000; ++n) {
      const middle = add(origin, across, n * pitch);
      let line = [add(middle, along, -reach), add(middle, along, reach)];
      for (const edge of edges) line = clip(line, edge, false);
      if (line.length === 2) lines.push([line[0], line[1]]);
    }
  }
  return lines;
}

/** The least extent that holds both. */
export function join(a: Extent, b: Extent): Extent {
  return {
    low: axes.map((axis) => Math.min(a.low[axis], b.low[axis])) as Vec3,
    high: axes.map((axis) => Math.max(a.high[axis], b.high[axis])) as Vec3,
  };
}

/** The intersection of two boxes that overlap. */
export function meet(a: Extent, b: Extent): Extent {
  return {
    low: axes.map((axis) => Math.max(a.low[axis], b.low[axis])) as Vec3,
    high: axes.map((axis) => Math.min(a.high[axis], b.high[axis])) as Vec3,
  };
}

/** Null if there are no points. */
export function extentOf(points: Iterable<Vec3>): Extent | null {
  let extent: Extent | null = null;
  for (const point of points) {
    const here = { low: point, high: point };
    extent = extent ? join(extent, here) : here;
  }
  return extent;
}

/** Larger by a share of its longest edge on all sides. */
export function grown(extent: Extent, share: number): Extent {
  const by = share * Math.max(...add(extent.high, extent.low, -1));
  return { low: extent.low.map((x) => x - by) as Vec3, high: extent.high.map((x) => x + by) as Vec3 };
}
