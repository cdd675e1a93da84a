import type { Sample } from '../tandem';
import type { Vec3 } from './scene';

/**
 * The slot of the nearest body that the ray hits, -1 for none. `radii`: of the types. `slack`: by how much more than
 * its radius a body may be missed, per unit of distance, as fingers are broad.
 */
export function pick(sample: Sample, radii: number[], origin: Vec3, direction: Vec3, slack: number): number {
  let nearest = -1;
  let least = Infinity;
  for (let slot = 0, at = 0; slot < sample.capacity; ++slot, at += 3) {
    if (!sample.alive[slot]) continue;
    const x = sample.positions[at] - origin[0];
    const y = sample.positions[at + 1] - origin[1];
    const z = sample.positions[at + 2] - origin[2];
    const along = x * direction[0] + y * direction[1] + z * direction[2];
    const radius = radii[sample.types[slot]] ?? 0;
    if (along <= 0 || along - radius >= least) continue;
    const missed = Math.sqrt(Math.max(0, x * x + y * y + z * z - along * along));
    if (missed > radius + slack * along) continue;
    // Surface hit, or behind all that were really hit at about the same distance.
    const hit = missed < radius ? along - Math.sqrt(radius * radius - missed * missed) : along + (missed - radius);
    if (hit < least) {
      least = hit;
      nearest = slot;
    }
  }
  return nearest;
}
