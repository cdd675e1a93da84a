// Draws all spheres of a session in one call: each is a point sprite, whose fragments find their place on the sphere, so
// that a body costs one vertex, and positions go to the graphics card as the client hands them out.

import { BufferAttribute, BufferGeometry, Points, ShaderMaterial, Sphere, Vector2, Vector3 } from 'three';
import { shadingGlsl, shadingUniforms } from './shading';

const drawingSize = new Vector2();

const vertexShader = /* glsl */ `
attribute float radius;
attribute vec4 tint;
uniform float pixelsPerUnit;  // at distance 1
varying vec4 vTint;  // and how much haze hides
varying vec2 vDepth;  // view-space z of the centre, radius
${shadingGlsl}

void main() {
  vec4 centre = modelViewMatrix * vec4(position, 1.0);
  vTint = vec4(tint.rgb, hazeAt(-centre.z));
  vDepth = vec2(centre.z, radius);
  gl_Position = projectionMatrix * centre;
  // A sphere's outline is a little wider than its radius at the distance of its centre.
  float outline = radius / sqrt(max(dot(centre.xyz, centre.xyz) - radius * radius, 1e-6));
  gl_PointSize = radius > 0.0 ? max(2.0 * pixelsPerUnit * outline, 1.5) : 0.0;
  if (radius <= 0.0) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}
`;

const fragmentShader = /* glsl */ `
precision highp float;
varying vec4 vTint;
varying vec2 vDepth;
uniform mat4 projection;
${shadingGlsl}

void main() {
  vec2 at = vec2(2.0, -2.0) * gl_PointCoord + vec2(-1.0, 1.0);
  float inside = 1.0 - dot(at, at);
  if (inside < 0.0) discard;
  vec3 normal = vec3(at, sqrt(inside));
  float z = vDepth.x + vDepth.y * normal.z;
  // The depth that the projection gives a point at z.
  gl_FragDepth = 0.5 + 0.5 * (projection[2][2] * z + projection[3][2]) / -z;
  gl_FragColor = vec4(shade(vTint.rgb, normal, vTint.a), 1.0);
}
`;

/** One for all sessions, because a program is made for the first picture of a material, and forgotten with it. */
const material = new ShaderMaterial({
  vertexShader,
  fragmentShader,
  uniforms: { ...shadingUniforms, pixelsPerUnit: { value: 1 }, projection: { value: null } },
});

/** Spheres of up to `capacity` slots. Slots with radius 0 are not drawn. */
export class Spheres {
  readonly points: Points<BufferGeometry, ShaderMaterial>;
  readonly radii: Float32Array;
  private readonly positions: BufferAttribute;
  private readonly radiusAttribute: BufferAttribute;
  private readonly tints: BufferAttribute;

  /** `tints`: packed colours of every slot, kept by reference. */
  constructor(capacity: number, tints: Uint32Array) {
    this.radii = new Float32Array(capacity);
    this.positions = new BufferAttribute(new Float32Array(3 * capacity), 3);
    this.radiusAttribute = new BufferAttribute(this.radii, 1);
    this.tints = new BufferAttribute(new Uint8Array(tints.buffer), 4, true);
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', this.positions);
    geometry.setAttribute('radius', this.radiusAttribute);
    geometry.setAttribute('tint', this.tints);
    geometry.boundingSphere = new Sphere(new Vector3(), Infinity);
    this.points = new Points(geometry, material);
    this.points.frustumCulled = false;
    this.points.onBeforeRender = (renderer, _scene, camera) => {
      const height = renderer.getDrawingBufferSize(drawingSize).y;
      material.uniforms.pixelsPerUnit.value = 0.5 * height * camera.projectionMatrix.elements[5];
      material.uniforms.projection.value = camera.projectionMatrix;
      material.uniformsNeedUpdate = true;
    };
  }

  /** Takes over x, y, z of every slot; the array is read until the next call. */
  setPositions(positions: Float32Array): void {
    this.positions.array = positions;
    this.positions.needsUpdate = true;
  }

  tintsChanged(): void {
    this.tints.needsUpdate = true;
  }

  radiiChanged(): void {
    this.radiusAttribute.needsUpdate = true;
  }

  dispose(): void {
    this.points.geometry.dispose();
  }
}
