// The solid parts of a scene: the room that its planes enclose, boxes and balls. Dark, so that the bodies stand out.

import {
  BoxGeometry,
  BufferGeometry,
  Color,
  EdgesGeometry,
  Float32BufferAttribute,
  Group,
  LinearSRGBColorSpace,
  LineSegments,
  Matrix4,
  Mesh,
  ShaderMaterial,
  SphereGeometry,
  Vector3,
  type Camera,
} from 'three';
import { dot, gridLines, roomFaces, type Extent, type Face } from '../room';
import type { Box, Scene, Vec3 } from '../scene';
import { shadingGlsl, shadingUniforms } from './shading';

const wallColour = 0x10161d;
const gridColour = 0x1c2631;
const edgeColour = 0x33424f;

const solidMaterial = new ShaderMaterial({
  uniforms: shadingUniforms,
  vertexShader: /* glsl */ `
    varying vec3 vNormal;
    varying float vDepth;
    void main() {
      vec4 at = modelViewMatrix * vec4(position, 1.0);
      vNormal = normalMatrix * normal;
      vDepth = -at.z;
      gl_Position = projectionMatrix * at;
    }`,
  fragmentShader: /* glsl */ `
    varying vec3 vNormal;
    varying float vDepth;
    ${shadingGlsl}
    void main() {
      gl_FragColor = vec4(shade(vec3(0.23, 0.28, 0.33), normalize(vNormal), hazeAt(vDepth)), 1.0);
    }`,
});
/** One colour, whatever the light: three.js has materials for that, whose programs take many times as long to make. */
function plain(colour: number): ShaderMaterial {
  return new ShaderMaterial({
    uniforms: { colour: { value: new Color().setHex(colour, LinearSRGBColorSpace) } },
    vertexShader: 'void main() { gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }',
    fragmentShader: 'uniform vec3 colour; void main() { gl_FragColor = vec4(colour, 1.0); }',
  });
}
const wallMaterial = plain(wallColour);
// Draws surfaces behind lines and resting bodies in the same place.
Object.assign(wallMaterial, { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
const gridMaterial = plain(gridColour);
const edgeMaterial = plain(edgeColour);

export class Scenery {
  readonly group = new Group();
  readonly faces: { face: Face; group: Group }[] = [];

  /** Planes are drawn within the extent. */
  constructor(scene: Scene, extent: Extent) {
    const pitch = gridPitch(extent);
    for (const face of roomFaces(scene.planes, extent)) {
      const group = new Group();
      group.add(new Mesh(polygon(face), wallMaterial));
      group.add(lines(gridLines(face, pitch), gridMaterial));
      group.add(lines(face.corners.map((corner, i) => [corner, face.corners[(i + 1) % face.corners.length]]), edgeMaterial));
      this.group.add(group);
      this.faces.push({ face, group });
    }
    for (const box of scene.boxes) {
      const mesh = new Mesh(new BoxGeometry(...box.size), solidMaterial);
      mesh.applyMatrix4(placeOf(box));
      mesh.add(new LineSegments(new EdgesGeometry(mesh.geometry), edgeMaterial));
      this.group.add(mesh);
    }
    for (const sphere of scene.spheres) {
      const mesh = new Mesh(new SphereGeometry(sphere.radius, 48, 32), solidMaterial);
      mesh.position.set(...sphere.centre);
      this.group.add(mesh);
    }
  }

  /** Hides the walls whose back the camera sees. */
  update(camera: Camera): void {
    const eye = camera.position.toArray();
    for (const { face, group } of this.faces) {
      group.visible = dot(face.normal, eye) > dot(face.normal, face.corners[0]);
    }
  }

  dispose(): void {
    this.group.traverse((object) => {
      if (object instanceof Mesh || object instanceof LineSegments) object.geometry.dispose();
    });
  }
}

/** 1, 2 or 5 times a power of ten, so that there are some twenty lines. */
function gridPitch(extent: Extent): number {
  const about = Math.max(...extent.high.map((x, i) => x - extent.low[i])) / 20;
  const power = 10 ** Math.floor(Math.log10(about));
  return power * (about / power >= 5 ? 5 : about / power >= 2 ? 2 : 1);
}

function polygon(face: Face): BufferGeometry {
  const points: Vec3[] = [];
  for (let i = 1; i + 1 < face.corners.length; ++i) points.push(face.corners[0], face.corners[i], face.corners[i + 1]);
  return new BufferGeometry().setAttribute('position', new Float32BufferAttribute(points.flat(), 3));
}

function lines(pairs: [Vec3, Vec3][], material: ShaderMaterial): LineSegments {
  const geometry = new BufferGeometry().setAttribute('position', new Float32BufferAttribute(pairs.flat(2), 3));
  return new LineSegments(geometry, material);
}

function placeOf(box: Box): Matrix4 {
  const place = new Matrix4();
  for (const turn of box.turns) {
    const axis = new Vector3().setComponent(turn.axis, 1);
    place.premultiply(new Matrix4().makeRotationAxis(axis, turn.angle));
  }
  return place.setPosition(...box.centre);
}
