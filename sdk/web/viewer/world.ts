// One session as it is drawn: its bodies, its scenery, its colours.

import type { BodyType, Sample } from '../tandem';
import { Bodies } from './drawing/bodies';
import { Colours } from './colours';
import { add, extentOf, grown, join, meet, roomFaces, type Extent } from './room';
import { Scenery } from './drawing/scenery';
import { emptyScene, readScene, type Scene, type Vec3 } from './scene';
import { SlowMotion } from './slow_motion';
import type { Stage } from './drawing/stage';

export class World {
  readonly bodies: Bodies;
  readonly colours: Colours;
  readonly slowMotion: SlowMotion;
  readonly scene: Scene;
  /** Why nothing of the scene's geometry is drawn; empty when it is. */
  readonly sceneError: string = '';
  /** The part of the world that the camera shows at first. */
  readonly extent: Extent;
  private readonly scenery: Scenery;

  /** From the first sample of a session. `up`: the axis that points up. */
  constructor(
    private readonly stage: Stage,
    readonly types: BodyType[],
    sceneJson: string,
    sample: Sample,
    up: number,
  ) {
    try {
      this.scene = readScene(sceneJson);
    } catch (error) {
      this.scene = emptyScene;
      this.sceneError = error instanceof Error ? error.message : String(error);
    }
    const { shown, walls } = extentsOf(this.scene, bodiesExtent(sample, types), up);
    this.extent = shown;
    this.scenery = new Scenery(this.scene, walls);
    this.bodies = new Bodies(sample.capacity, types);
    this.colours = new Colours(sample.capacity, types, this.scene.dt);
    this.slowMotion = new SlowMotion(this.scene.dt);
    stage.add(this.scenery.group);
    stage.add(this.bodies.group);
  }

  /** `applied` is the frame of the last delta; `discs`: spheres are flat discs. */
  update(sample: Sample, applied: number, discs: boolean): void {
    this.colours.follow(sample);
    this.colours.fill(sample, applied, this.bodies.tints);
    this.bodies.update(sample, discs);
  }

  /** To be called with a sample that update() does not get. */
  note(sample: Sample): void {
    this.colours.note(sample);
    this.slowMotion.note(sample);
  }

  beforeRender(): void {
    this.scenery.update(this.stage.camera);
  }

  dispose(): void {
    this.stage.remove(this.scenery.group);
    this.stage.remove(this.bodies.group);
    this.scenery.dispose();
    this.bodies.dispose();
  }
}

/** The bounds of nearly all bodies, without the few that have flown far away. */
export function bodiesExtent(sample: Sample, types: BodyType[]): Extent | null {
  const slots = Array.from({ length: sample.capacity }, (_, slot) => slot).filter((slot) => sample.alive[slot]);
  if (slots.length === 0) return null;
  const extent: Extent = { low: [0, 0, 0], high: [0, 0, 0] };
  const left = Math.floor(slots.length / 50);
  const radius = Math.max(...types.map((type) => type.radius), 0);
  for (let axis = 0; axis < 3; ++axis) {
    const sorted = Float32Array.from(slots, (slot) => sample.positions[3 * slot + axis]).sort();
    extent.low[axis] = sorted[left] - radius;
    extent.high[axis] = sorted[sorted.length - 1 - left] + radius;
  }
  return extent;
}

/** Everything within these walls is drawn; `shown` is the part that the camera shows at first. */
export function extentsOf(scene: Scene, bodies: Extent | null, up = 1): { shown: Extent; walls: Extent } {
  const bounds = scene.bounds ?? grown(bodies ?? { low: [-1, -1, -1], high: [1, 1, 1] }, 4);
  const corners = roomFaces(scene.planes, bounds).flatMap((face) => face.corners);
  const inner = grown(bounds, -1e-6);
  const closed = corners.every((corner) => corner.every((x, i) => x > inner.low[i] && x < inner.high[i]));
  const solids = extentOf([
    ...scene.boxes.flatMap(({ centre, size }) => around(centre, Math.hypot(...size) / 2)),
    ...scene.spheres.flatMap(({ centre, radius }) => around(centre, radius)),
  ]);
  const core = bodies && solids ? join(bodies, solids) : (bodies ?? solids ?? bounds);
  const room = extentOf(corners);
  if (!room || !closed) return { shown: core, walls: meet(bounds, grown(core, 0.6)) };
  // Rooms may be far higher than anything in them will jump.
  const near = grown(core, 1.5);
  near.low[up] = room.low[up];
  near.high[up] = core.high[up] + 0.5 * Math.max(...add(core.high, core.low, -1));
  return { shown: meet(room, near), walls: bounds };
}

function around(centre: Vec3, radius: number): Vec3[] {
  return [add(centre, [radius, radius, radius], -1), add(centre, [radius, radius, radius])];
}
