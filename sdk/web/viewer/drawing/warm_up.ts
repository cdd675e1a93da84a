// Draws what no session has yet, so that the programs of the first picture are made while its bodies are still on their way.

import type { BodyType, Sample } from '../../tandem';
import type { Extent } from '../room';
import { emptyScene, type Plane, type Scene } from '../scene';
import { Bodies } from './bodies';
import { Scenery } from './scenery';
import type { Stage } from './stage';

const floor: Plane = { through: [0, 0, 0], normal: [0, 1, 0] };
const scene: Scene = { ...emptyScene, planes: [floor] };

const sphere: BodyType = { name: '', shape: 'sphere', radius: 0.1, shapeValues: [], colour: '' };
const none = new Uint8Array(1);
const sample: Sample = {
  frame: 0,
  capacity: 1,
  positions: new Float32Array(3),
  orientations: null,
  alive: new Uint8Array([1]),
  generation: none,
  types: new Uint16Array(1),
  changes: none,
  corrected: none,
  correctedIn: new Uint32Array(1),
};

/** Draws one of everything that most sessions have, and then nothing, which is what stays to be seen. */
export function warmUp(stage: Stage): void {
  const around: Extent = { low: [-1, -1, -1], high: [1, 1, 1] };
  const scenery = new Scenery(scene, around);
  const bodies = new Bodies(1, [sphere]);
  bodies.update(sample, stage.detail.discs);
  stage.frame(around);
  for (const { group } of [scenery, bodies]) stage.add(group);
  stage.render(0);
  for (const { group } of [scenery, bodies]) stage.remove(group);
  stage.render(0);
  scenery.dispose();
  bodies.dispose();
}
