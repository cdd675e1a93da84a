// Draws a sample: spheres as sprites, other shapes as instances, in colours that the caller has chosen.

import { Group } from 'three';
import type { BodyType, Sample } from '../tandem';
import { Solids, surfaceOf } from './solids';
import { Spheres } from './spheres';

export class Bodies {
  readonly group = new Group();
  /** Packed colours of every slot; to be filled before update(). */
  readonly tints: Uint32Array;
  private readonly spheres: Spheres;
  private readonly solids: (Solids | null)[];
  private readonly radii: number[];

  constructor(
    readonly capacity: number,
    types: BodyType[],
  ) {
    this.tints = new Uint32Array(capacity);
    this.spheres = new Spheres(capacity, this.tints);
    this.group.add(this.spheres.points);
    this.radii = [];
    this.solids = types.map((type, i) => {
      const surface = surfaceOf(type);
      this.radii[i] = surface ? 0 : type.radius;
      if (!surface) return null;
      const solids = new Solids(surface, capacity);
      this.group.add(solids.mesh);
      return solids;
    });
  }

  /** Takes over the sample's positions until the next call. */
  update(sample: Sample): void {
    const { alive, types, positions, orientations } = sample;
    const { radii } = this.spheres;
    let radiiChanged = false;
    for (const solids of this.solids) solids?.clear();
    for (let slot = 0; slot < this.capacity; ++slot) {
      const radius = alive[slot] ? (this.radii[types[slot]] ?? 0) : 0;
      if (radii[slot] !== radius) {
        radii[slot] = radius;
        radiiChanged = true;
      }
      if (alive[slot]) this.solids[types[slot]]?.add(slot, positions, orientations, this.tints);
    }
    for (const solids of this.solids) solids?.finish();
    this.spheres.setPositions(positions);
    this.spheres.tintsChanged();
    if (radiiChanged) this.spheres.radiiChanged();
  }

  dispose(): void {
    this.spheres.dispose();
    for (const solids of this.solids) solids?.dispose();
  }
}
