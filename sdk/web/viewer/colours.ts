// Chooses the colours of bodies.

import type { BodyType, Sample } from '../tandem';
import { Changes } from './changes';

export const colourModes = ['type', 'speed', 'corrected', 'age'] as const;
export type ColourMode = (typeof colourModes)[number];

type Rgb = [number, number, number];

/** As the graphics card takes it: red in the lowest byte. */
export function packed([red, green, blue]: Rgb): number {
  return (0xff000000 | (blue << 16) | (green << 8) | red) >>> 0;
}

export function css([red, green, blue]: Rgb): string {
  return `rgb(${red} ${green} ${blue})`;
}

const quiet: Rgb = [58, 70, 82];
const alarm: Rgb = [255, 176, 59];

/** Viridis at seven places (Smith and van der Walt, 2015), its dark end lifted to be seen on the background. */
const ramp: Rgb[] = [
  [72, 50, 124],
  [62, 74, 137],
  [49, 104, 142],
  [33, 145, 140],
  [53, 183, 121],
  [143, 215, 68],
  [253, 231, 37],
];

/** `share` in 0 to 1, clamped. */
export function rampColour(share: number): Rgb {
  const place = Math.min(Math.max(share, 0), 1) * (ramp.length - 1);
  const i = Math.min(Math.floor(place), ramp.length - 2);
  return ramp[i].map((low, c) => Math.round(low + (ramp[i + 1][c] - low) * (place - i))) as Rgb;
}

const steps = 256;
const packedRamp = Uint32Array.from({ length: steps }, (_, i) => packed(rampColour(i / (steps - 1))));

/** The colour of "#rrggbb" or "#rrggbbaa"; grey for other text. */
export function parseColour(text: string): Rgb {
  const hex = /^#([0-9a-f]{6})/i.exec(text);
  const rgb = hex ? parseInt(hex[1], 16) : 0x9aa7b3;
  return [rgb >> 16, (rgb >> 8) & 255, rgb & 255];
}

/** Frames after which a body's last correction is long ago. */
const longAgo = 90;

/** Follows a session's bodies sample by sample and colours them. */
export class Colours {
  mode: ColourMode = 'type';
  private readonly typeColours: Uint32Array;
  private readonly lastPositions: Float32Array;
  private readonly speeds: Float32Array;
  private lastFrame = -Infinity;
  private readonly changes = new Changes();
  private topSpeed = 1;  // m/s, at the top of the ramp; follows what the bodies do

  constructor(
    capacity: number,
    types: BodyType[],
    private readonly frameSeconds: number,
  ) {
    this.typeColours = Uint32Array.from(types, (type) => packed(parseColour(type.colour)));
    this.lastPositions = new Float32Array(3 * capacity);
    this.speeds = new Float32Array(capacity);
  }

  /** To be called with a sample that follow() does not get. */
  note(sample: Sample): void {
    this.changes.note(sample);
  }

  follow(sample: Sample): void {
    this.note(sample);
    const frames = sample.frame - this.lastFrame;
    if (frames >= 1 || frames < 0) this.measureSpeeds(sample, frames * this.frameSeconds);
  }

  private measureSpeeds(sample: Sample, seconds: number): void {
    const { alive, positions, capacity, frame } = sample;
    const changes = this.changes.take();
    const scale = seconds > 0 && seconds < 0.5 ? 1 / seconds : 0;
    let sum = 0;
    let count = 0;
    for (let slot = 0, at = 0; slot < capacity; ++slot, at += 3) {
      if (!alive[slot]) continue;
      const dx = positions[at] - this.lastPositions[at];
      const dy = positions[at + 1] - this.lastPositions[at + 1];
      const dz = positions[at + 2] - this.lastPositions[at + 2];
      this.speeds[slot] = changes[slot] ? 0 : scale * Math.sqrt(dx * dx + dy * dy + dz * dz);
      sum += this.speeds[slot];
      ++count;
    }
    const wanted = Math.max((2.5 * sum) / Math.max(count, 1), 0.5);
    this.topSpeed += (wanted - this.topSpeed) * 0.05;
    this.lastPositions.set(positions);
    this.lastFrame = frame;
  }

  /** Writes the packed colour of every slot. `applied` is the frame of the last delta. */
  fill(sample: Sample, applied: number, tints: Uint32Array): void {
    const { capacity, types, corrected, correctedIn } = sample;
    switch (this.mode) {
      case 'type':
        for (let slot = 0; slot < capacity; ++slot) tints[slot] = this.typeColours[types[slot]];
        break;
      case 'speed':
        for (let slot = 0; slot < capacity; ++slot) tints[slot] = shareColour(this.speeds[slot] / this.topSpeed);
        break;
      case 'corrected': {
        const [now, otherwise] = [packed(alarm), packed(quiet)];
        for (let slot = 0; slot < capacity; ++slot) tints[slot] = corrected[slot] ? now : otherwise;
        break;
      }
      case 'age':
        for (let slot = 0; slot < capacity; ++slot) {
          const frames = (applied - correctedIn[slot]) >>> 0;  // both modulo 2^32
          tints[slot] = shareColour(correctedIn[slot] === 0 ? 0 : 1 - frames / longAgo);
        }
    }
  }

  /** The meaning of the colours: names with their colours, or the ends of the ramp. */
  legend(types: BodyType[]): { names: [string, Rgb][] } | { ends: [string, string] } {
    switch (this.mode) {
      case 'type':
        return { names: types.map((type) => [type.name, parseColour(type.colour)]) };
      case 'speed':
        return { ends: ['0', `${this.topSpeed.toFixed(1)} m/s`] };
      case 'corrected':
        return { names: [['corrected by the last delta', alarm], ['as predicted', quiet]] };
      case 'age':
        return { ends: [`not corrected for ${longAgo} frames`, 'just now'] };
    }
  }
}

function shareColour(share: number): number {
  return packedRamp[share > 0 ? Math.min(Math.floor(share * steps), steps - 1) : 0];
}
