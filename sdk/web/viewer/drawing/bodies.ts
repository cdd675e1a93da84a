// Draws a sample: spheres as sprites or discs, other shapes as instances, in colours that the caller has chosen.

import { Group } from 'three';
import type { BodyType, Sample } from '../../tandem';
import { Discs } from './discs';
import { Solids, surfaceOf } from './solids';
import { Spheres } from './spheres';

export class Bodies {
  readonly group = new Group();
  /** Packed colours of every slot; to be filled before update(). */
  readonly tints: Uint32Array;
  /** Of the last update. */
  hasSpheres = false;
  private readonly spheres: Spheres;
  private readonly discs: Discs;
  private readonly solids: (Solids | null)[];
  private readonly radii: number[];

  constructor(
    readonly capacity: number,
    types: BodyType[],
  ) {
    this.tints = new Uint32Array(capacity);
    this.spheres = new Spheres(capacity, this.tints);
    this.discs = new Discs(this.spheres.radii, this.tints);
    this.group.add(this.spheres.points, this.discs.mesh);
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

  /** Takes over the sample's positions until the next call. `discs`: spheres are flat discs. */
  update(sample: Sample, discs: boolean): void {
    const { alive, types, positions, orientations } = sample;
    const { radii } = this.spheres;
    let radiiChanged = false;
    this.hasSpheres = false;
    for (const solids of this.solids) solids?.clear();
    for (let slot = 0; slot < this.capacity; ++slot) {
      const radius = alive[slot] ? (this.radii[types[slot]] ?? 0) : 0;
      if (radius > 0) this.hasSpheres = true;
      if (radii[slot] !== radius) {
        radii[slot] = radius;
        radiiChanged = true;
      }
      if (alive[slot]) this.solids[types[slot]]?.add(slot, positions, orientations, this.tints);
    }
    for (const solids of this.solids) solids?.finish();
    this.spheres.points.visible = !discs;
    this.discs.mesh.visible = discs && this.hasSpheres;
    if (radiiChanged) this.spheres.radiiChanged();
    if (discs) return this.discs.setPositions(positions);
    this.spheres.setPositions(positions);
    this.spheres.tintsChanged();
  }

  dispose(): void {
    this.spheres.dispose();
    this.discs.dispose();
    for (const solids of this.solids) solids?.dispose();
  }
}
