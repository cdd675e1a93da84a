// Camera, controls and renderer.

import { PerspectiveCamera, Raycaster, Scene, Vector2, Vector3, WebGLRenderer, type Object3D } from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { add, type Extent } from '../room';
import type { Vec3 } from '../scene';
import { DetailChoice, type Detail } from './detail';
import { background, shadingUniforms } from './shading';
import type { Surface } from './surface';

/** Pixels at the edges that panels cover. */
export interface Insets {
  top: number;
  right: number;
  bottom: number;
  left: number;
}

/** Where the camera is at first, seen from what it looks at: a little above and to the side. `up`: 0 x, 1 y, 2 z. */
function viewFrom(up: number): Vector3 {
  const from = new Vector3();
  from.setComponent(up, 0.42).setComponent((up + 1) % 3, 1).setComponent((up + 2) % 3, 0.5);
  return from.normalize();
}

/**
 * How far from the extent's centre a camera that looks along -`back` must be for all of it to be seen: every corner
 * lies within both opening angles. `tanX`, `tanY`: tangents of the half angles.
 */
export function framingDistance(extent: Extent, back: Vector3, right: Vector3, up: Vector3, tanX: number, tanY: number): number {
  const half = add(extent.high, extent.low, -1).map((x) => x / 2);
  let distance = 0;
  for (let corner = 0; corner < 8; ++corner) {
    const at = new Vector3(...half.map((x, axis) => (corner & (1 << axis) ? x : -x)));
    const needed = Math.max(Math.abs(at.dot(right)) / tanX, Math.abs(at.dot(up)) / tanY) + at.dot(back);
    distance = Math.max(distance, needed);
  }
  return distance;
}

export class Stage {
  readonly canvas: HTMLCanvasElement;
  readonly camera = new PerspectiveCamera(40);
  private readonly renderer: WebGLRenderer;
  private readonly context: WebGL2RenderingContext;
  private readonly scene = new Scene();
  private controls: OrbitControls;
  private up = 1;
  private insets: Insets = { top: 0, right: 0, bottom: 0, left: 0 };
  private readonly choice: DetailChoice;
  private lastRender = 0;

  constructor(surface: Surface) {
    const { canvas, context } = surface;
    this.canvas = canvas;
    this.context = context;
    this.choice = new DetailChoice(window.devicePixelRatio, surface.software);
    this.renderer = new WebGLRenderer({ canvas, context });
    // Asking whether a program is right waits for it. The tests look at what is drawn.
    this.renderer.debug.checkShaderErrors = false;
    this.scene.background = background;
    this.controls = this.newControls();
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
  }

  add(object: Object3D): void {
    this.scene.add(object);
  }

  remove(object: Object3D): void {
    this.scene.remove(object);
  }

  /** In how much detail the next picture is. */
  get detail(): Detail {
    return this.choice.now;
  }
  /** What is left out of it, for people; empty where nothing is. */
  leftOut(hasSpheres: boolean): string {
    return this.choice.leftOut(hasSpheres);
  }
  /** Chooses the detail anew, for so many bodies. */
  begin(bodies: number): void {
    this.choice.begin(bodies);
    this.resize();
  }

  /** Puts the camera's target in the middle of the space that the panels leave free. */
  setInsets(insets: Insets): void {
    this.insets = insets;
    this.resize();
  }

  /** The axis of the world that points up: 0 x, 1 y, 2 z. To be called before frame(). */
  setUp(axis: number): void {
    if (axis === this.up) return;
    this.up = axis;
    this.camera.up.set(0, 0, 0).setComponent(axis, 1);
    this.controls.dispose();
    this.controls = this.newControls();
  }

  /** They take what is up from the camera, once. */
  private newControls(): OrbitControls {
    const controls = new OrbitControls(this.camera, this.canvas);
    controls.enableDamping = true;
    controls.dampingFactor = 0.12;
    return controls;
  }

  /** Looks at all of the extent. */
  frame(extent: Extent): void {
    const { camera, controls } = this;
    controls.target.set(...(add(extent.low, extent.high).map((x) => x / 2) as Vec3));
    const from = viewFrom(this.up);
    camera.position.copy(controls.target).add(from);
    camera.lookAt(controls.target);
    const [right, up, back] = this.axes();
    const tan = Math.tan((camera.fov * Math.PI) / 360);
    const { width, height, free } = this.sizes();
    const distance = 1.04 * framingDistance(extent, back, right, up, (tan * free.x) / height, (tan * free.y) / height);
    const size = Math.hypot(...add(extent.high, extent.low, -1));
    camera.position.copy(controls.target).addScaledVector(from, distance);
    camera.near = Math.max(size, distance) / 1000;
    camera.far = distance + 20 * size;
    controls.minDistance = 5 * camera.near;
    controls.maxDistance = distance + 8 * size;
    shadingUniforms.hazeFrom.value = distance;
    shadingUniforms.hazeTo.value = distance + 2.5 * size;
    if (width > 0) camera.updateProjectionMatrix();
    controls.update();
  }

  /** Unit vectors of the world that point right, up and towards the viewer on the screen. */
  axes(): [Vector3, Vector3, Vector3] {
    const [right, up, back] = [new Vector3(), new Vector3(), new Vector3()];
    this.camera.updateMatrixWorld();
    this.camera.matrixWorld.extractBasis(right, up, back);
    return [right, up, back];
  }

  /** The ray through a place of the page: origin, unit direction, and the size of a pixel at distance 1. */
  ray(clientX: number, clientY: number): { origin: Vec3; direction: Vec3; pixel: number } {
    const area = this.canvas.getBoundingClientRect();
    const at = new Vector2(((clientX - area.left) / area.width) * 2 - 1, 1 - ((clientY - area.top) / area.height) * 2);
    const caster = new Raycaster();
    caster.setFromCamera(at, this.camera);
    const pixel = 2 / (this.camera.projectionMatrix.elements[5] * area.height);
    return { origin: caster.ray.origin.toArray(), direction: caster.ray.direction.toArray(), pixel };
  }

  /** Where on the page a point of the world is drawn, how far it is from the camera, and pixels to the unit there. */
  project(point: Vec3): { x: number; y: number; distance: number; scale: number } {
    const area = this.canvas.getBoundingClientRect();
    const distance = this.camera.position.distanceTo(new Vector3(...point));
    const at = new Vector3(...point).project(this.camera);
    return {
      x: area.left + ((at.x + 1) / 2) * area.width,
      y: area.top + ((1 - at.y) / 2) * area.height,
      distance,
      scale: (this.camera.projectionMatrix.elements[5] * area.height) / 2 / distance,
    };
  }

  render(nowMs: number): void {
    this.controls.update();
    this.camera.updateMatrixWorld();
    shadingUniforms.skyUp.value.copy(this.camera.up).transformDirection(this.camera.matrixWorldInverse);
    this.renderer.render(this.scene, this.camera);
    if (this.choice.note(nowMs - this.lastRender)) this.resize();
    this.lastRender = nowMs;
  }

  /** Calls back when all that was asked of the graphics so far is drawn. */
  whenDrawn(done: () => void): void {
    const { context } = this;
    const fence = context.fenceSync(context.SYNC_GPU_COMMANDS_COMPLETE, 0);
    context.flush();
    const look = (): void => {
      const waits = fence && context.getSyncParameter(fence, context.SYNC_STATUS) === context.UNSIGNALED && !context.isContextLost();
      if (waits) return void setTimeout(look, 2);
      context.deleteSync(fence);
      done();
    };
    setTimeout(look, 0);
  }

  private sizes(): { width: number; height: number; free: Vector2 } {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const { top, right, bottom, left } = this.insets;
    return { width, height, free: new Vector2(Math.max(width - left - right, 80), Math.max(height - top - bottom, 80)) };
  }

  private resize(): void {
    const { width, height } = this.sizes();
    if (width === 0 || height === 0) return;
    const { top, right, bottom, left } = this.insets;
    this.renderer.setPixelRatio(this.detail.pixelRatio);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.setViewOffset(width, height, (right - left) / 2, (bottom - top) / 2, width, height);
  }
}
