// Draws all spheres of a session as flat discs, painted by the processor: colours and depths of a whole picture, which the graphics then take as
// two textures. Where the processor also does the graphics' work, that is several times as fast as a sprite for each body.

import {
  BufferGeometry,
  DataTexture,
  Float32BufferAttribute,
  FloatType,
  Mesh,
  RedFormat,
  ShaderMaterial,
  Vector2,
  type Camera,
} from 'three';
import { hazeShare, shadingUniforms } from './shading';

const drawingSize = new Vector2();
/** A disc that reaches less far from its middle, in pixels, is painted as a square: the difference is not seen, and it is sooner done. */
const smallReach = 1.5;

const material = new ShaderMaterial({
  uniforms: { colours: { value: null as DataTexture | null }, depths: { value: null as DataTexture | null } },
  vertexShader: /* glsl */ `
    varying vec2 at;
    void main() {
      at = 0.5 * position.xy + 0.5;
      gl_Position = vec4(position.xy, 0.0, 1.0);
    }`,
  fragmentShader: /* glsl */ `
    precision highp float;
    uniform sampler2D colours;
    uniform highp sampler2D depths;
    varying vec2 at;
    void main() {
      float depth = texture2D(depths, at).r;
      if (depth >= 1.0) discard;
      gl_FragDepth = depth;
      gl_FragColor = vec4(texture2D(colours, at).rgb, 1.0);
    }`,
});

/** A picture of discs: rows from the bottom, colours as in `colours.ts`, depths from 0 to 1, which is where nothing is. */
export class Canvas {
  readonly colours: Uint32Array;
  readonly depths: Float32Array;

  constructor(
    readonly width: number,
    readonly height: number,
  ) {
    this.colours = new Uint32Array(width * height);
    this.depths = new Float32Array(width * height);
  }

  /**
   * Paints a disc for every slot with a radius. `matrix`: from the world to the clip space, by columns; `scale`: half the height of the picture
   * over the tangent of half the opening angle; haze begins and is thickest at these distances.
   */
  paint(positions: Float32Array, radii: Float32Array, tints: Uint32Array, matrix: number[], scale: number, hazeFrom: number, hazeTo: number): void {
    const { width, height, colours, depths } = this;
    const [xx, xy, xz, xw, yx, yy, yz, yw, zx, zy, zz, zw, ox, oy, oz, ow] = matrix;
    const [halfWidth, halfHeight] = [width / 2, height / 2];
    depths.fill(1);
    for (let slot = 0, at = 0; slot < radii.length; ++slot, at += 3) {
      const radius = radii[slot];
      if (radius === 0) continue;
      const x = positions[at];
      const y = positions[at + 1];
      const z = positions[at + 2];
      const w = xw * x + yw * y + zw * z + ow;
      const nearness = 1 / w;
      const depth = 0.5 + 0.5 * (xz * x + yz * y + zz * z + oz) * nearness;
      if (w <= 0 || depth <= 0 || depth >= 1) continue;
      const reach = Math.max(scale * radius * nearness, 0.75);
      const column = halfWidth * (1 + (xx * x + yx * y + zx * z + ox) * nearness) - 0.5;
      const row = halfHeight * (1 + (xy * x + yy * y + zy * z + oy) * nearness) - 0.5;
      const small = reach < smallReach;
      if (!small && this.hides(column, row, 0.7 * reach, depth)) continue;
      const top = Math.min(Math.floor(row + reach), height - 1);
      const tint = tints[slot];
      const bright = 1 - hazeShare(w, hazeFrom, hazeTo);
      for (let line = Math.max(Math.ceil(row - reach), 0); line <= top; ++line) {
        const up = (line - row) / reach;
        const half = small ? reach : reach * Math.sqrt(1 - up * up);
        const light = bright * (0.7 + 0.3 * up);
        const red = (light * (tint & 255)) | 0;
        const green = (light * ((tint >> 8) & 255)) | 0;
        const blue = (light * ((tint >> 16) & 255)) | 0;
        const colour = red | (green << 8) | (blue << 16);
        const end = line * width + Math.min(Math.floor(column + half), width - 1);
        for (let pixel = line * width + Math.max(Math.ceil(column - half), 0); pixel <= end; ++pixel) {
          if (depth >= depths[pixel]) continue;
          depths[pixel] = depth;
          colours[pixel] = colour;
        }
      }
    }
  }

  /**
   * Whether a disc is behind what is painted, or outside, in its middle and at four places around it. In a pile nine of ten are, and need no
   * more than this; of a few others, a sliver is missed.
   */
  private hides(column: number, row: number, away: number, depth: number): boolean {
    return (
      this.hidesPlace(column, row, depth) &&
      this.hidesPlace(column - away, row, depth) &&
      this.hidesPlace(column + away, row, depth) &&
      this.hidesPlace(column, row - away, depth) &&
      this.hidesPlace(column, row + away, depth)
    );
  }

  private hidesPlace(column: number, row: number, depth: number): boolean {
    const x = (column + 0.5) | 0;
    const y = (row + 0.5) | 0;
    return column < 0 || row < 0 || x >= this.width || y >= this.height || this.depths[y * this.width + x] <= depth;
  }
}

export class Discs {
  readonly mesh: Mesh<BufferGeometry, ShaderMaterial>;
  private canvas: Canvas | null = null;
  private textures: DataTexture[] = [];
  private positions: Float32Array = new Float32Array(0);

  /** Radii and packed colours of every slot, kept by reference. */
  constructor(
    private readonly radii: Float32Array,
    private readonly tints: Uint32Array,
  ) {
    const wholePicture = new Float32BufferAttribute([-1, -1, 0, 3, -1, 0, -1, 3, 0], 3);
    this.mesh = new Mesh(new BufferGeometry().setAttribute('position', wholePicture), material);
    this.mesh.frustumCulled = false;
    this.mesh.visible = false;
    this.mesh.onBeforeRender = (renderer, _scene, camera) => {
      const { x, y } = renderer.getDrawingBufferSize(drawingSize);
      this.paint(x, y, camera);
    };
  }

  /** Takes over x, y, z of every slot; the array is read until the next call. */
  setPositions(positions: Float32Array): void {
    this.positions = positions;
  }

  private paint(width: number, height: number, camera: Camera): void {
    if (this.canvas?.width !== width || this.canvas.height !== height) {
      this.forget();
      this.canvas = new Canvas(width, height);
      this.textures = [
        new DataTexture(new Uint8Array(this.canvas.colours.buffer), width, height),
        new DataTexture(this.canvas.depths, width, height, RedFormat, FloatType),
      ];
    }
    const matrix = camera.projectionMatrix.clone().multiply(camera.matrixWorldInverse);
    const { hazeFrom, hazeTo } = shadingUniforms;
    const scale = 0.5 * height * camera.projectionMatrix.elements[5];
    this.canvas.paint(this.positions, this.radii, this.tints, matrix.elements, scale, hazeFrom.value, hazeTo.value);
    for (const texture of this.textures) texture.needsUpdate = true;
    [material.uniforms.colours.value, material.uniforms.depths.value] = this.textures;
    material.uniformsNeedUpdate = true;
  }

  private forget(): void {
    for (const texture of this.textures) texture.dispose();
  }

  dispose(): void {
    this.forget();
    this.mesh.geometry.dispose();
  }
}
