// The one light of the viewer, for spheres and solids alike: a key light fixed to the camera, a sky that is lighter
// above, and a haze that lets what is far recede.

import { Color, Vector3 } from 'three';

export const background = new Color(0x0b0f14);

/** Uniforms of `shade()`; colours are those of the screen, without a colour space conversion. */
export const shadingUniforms = {
  skyUp: { value: new Vector3(0, 1, 0) },  // world's up in view space
  haze: { value: new Vector3(0.043, 0.059, 0.078) },
  hazeFrom: { value: 100 },
  hazeTo: { value: 1000 },
};

const mostHaze = 0.75;

/** How much of a surface haze hides at a distance; from 0 to 1. */
export function hazeShare(distance: number, from: number, to: number): number {
  return mostHaze * Math.min(Math.max((distance - from) / (to - from), 0), 1);
}

/** GLSL: the colour of a surface with a unit normal, in view space, and how much of it haze hides at a distance. */
export const shadingGlsl = /* glsl */ `
uniform vec3 skyUp;
uniform vec3 haze;
uniform float hazeFrom;
uniform float hazeTo;

float hazeAt(float depth) {
  return ${mostHaze} * clamp((depth - hazeFrom) / (hazeTo - hazeFrom), 0.0, 1.0);
}

vec3 shade(vec3 tint, vec3 normal, float hidden) {
  float key = max(dot(normal, vec3(0.36, 0.58, 0.73)), 0.0);
  float sky = 0.29 + 0.13 * dot(normal, skyUp);
  float gloss = key * key;
  gloss *= gloss;
  gloss *= gloss;
  gloss *= gloss;
  return mix(tint * (sky + 0.66 * key) + 0.09 * gloss, haze, hidden);
}
`;
