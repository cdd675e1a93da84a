// Draws bodies that are not spheres: an instanced mesh for each type, filled each frame with the bodies of that type.

import {
  BoxGeometry,
  BufferGeometry,
  CapsuleGeometry,
  CylinderGeometry,
  DynamicDrawUsage,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  Mesh,
  ShaderMaterial,
  Vector3,
} from 'three';
import { ConvexGeometry } from 'three/addons/geometries/ConvexGeometry.js';
import type { BodyType } from '../../tandem';
import { shadingGlsl, shadingUniforms } from './shading';

const vertexShader = /* glsl */ `
attribute vec3 place;
attribute vec4 turn;
attribute vec4 tint;
varying vec3 vTint;
varying vec3 vNormal;
varying float vDepth;

vec3 turned(vec3 v) {
  return v + 2.0 * cross(turn.xyz, cross(turn.xyz, v) + turn.w * v);
}

void main() {
  vec4 at = modelViewMatrix * vec4(turned(position) + place, 1.0);
  vTint = tint.rgb;
  vNormal = normalMatrix * turned(normal);
  vDepth = -at.z;
  gl_Position = projectionMatrix * at;
}
`;

const fragmentShader = /* glsl */ `
varying vec3 vTint;
varying vec3 vNormal;
varying float vDepth;
${shadingGlsl}

void main() {
  gl_FragColor = vec4(shade(vTint, normalize(vNormal), hazeAt(vDepth)), 1.0);
}
`;

const material = new ShaderMaterial({ vertexShader, fragmentShader, uniforms: shadingUniforms });

/** The surface of a type; null for spheres and types without a shape. */
export function surfaceOf(type: BodyType): BufferGeometry | null {
  const values = type.shapeValues;
  switch (type.shape) {
    case 'box':
      return new BoxGeometry(2 * values[0], 2 * values[1], 2 * values[2]);
    case 'capsule':
      return new CapsuleGeometry(values[0], 2 * values[1], 5, 12);
    case 'cylinder':
      return new CylinderGeometry(values[0], values[0], 2 * values[1], 20);
    case 'hull': {
      const points = [];
      for (let i = 0; i + 2 < values.length; i += 3) points.push(new Vector3(values[i], values[i + 1], values[i + 2]));
      return new ConvexGeometry(points);
    }
    default:
      return null;
  }
}

/** Up to `capacity` bodies of one surface. */
export class Solids {
  readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  private readonly places: InstancedBufferAttribute;
  private readonly turns: InstancedBufferAttribute;
  private readonly packedTints: Uint32Array;
  private readonly tints: InstancedBufferAttribute;
  private count = 0;

  constructor(surface: BufferGeometry, capacity: number) {
    const geometry = new InstancedBufferGeometry();
    geometry.index = surface.index;
    geometry.setAttribute('position', surface.getAttribute('position'));
    geometry.setAttribute('normal', surface.getAttribute('normal'));
    const attribute = (name: string, array: Float32Array | Uint8Array, size: number) => {
      const made = new InstancedBufferAttribute(array, size, array instanceof Uint8Array).setUsage(DynamicDrawUsage);
      geometry.setAttribute(name, made);
      return made;
    };
    this.places = attribute('place', new Float32Array(3 * capacity), 3);
    this.turns = attribute('turn', new Float32Array(4 * capacity), 4);
    this.packedTints = new Uint32Array(capacity);
    this.tints = attribute('tint', new Uint8Array(this.packedTints.buffer), 4);
    this.mesh = new Mesh(geometry, material);
    this.mesh.frustumCulled = false;
  }

  clear(): void {
    this.count = 0;
  }

  /** The body of a slot of the arrays; without orientations it is not turned. */
  add(slot: number, positions: Float32Array, orientations: Float32Array | null, tints: Uint32Array): void {
    const to = this.count++;
    for (let i = 0; i < 3; ++i) this.places.array[3 * to + i] = positions[3 * slot + i];
    this.packedTints[to] = tints[slot];
    for (let i = 0; i < 4; ++i) this.turns.array[4 * to + i] = orientations ? orientations[4 * slot + i] : Number(i === 3);
  }

  finish(): void {
    this.mesh.geometry.instanceCount = this.count;
    this.mesh.visible = this.count > 0;
    for (const attribute of [this.places, this.turns, this.tints]) {
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, attribute.itemSize * this.count);
      attribute.needsUpdate = true;
    }
  }

  dispose(): void {
    this.mesh.geometry.dispose();
  }
}
