// Replays in slow motion: keeps the last seconds of samples and plays them slowly until it is behind all of them, then
// continues from the newest.

import type { Sample } from '../tandem';
import { Changes } from './changes';

export const speeds = ['1', '1/2', '1/4'] as const;
export type Speed = (typeof speeds)[number];

const shares: Record<Speed, number> = { '1': 1, '1/2': 0.5, '1/4': 0.25 };
const mostKept = 120;
const mostKeptBytes = 96 << 20;

interface Kept {
  sample: Sample;
  applied: number;
}

export class SlowMotion {
  private kept: Kept[] = [];  // oldest first
  private cursor = 0;  // frame shown
  private playedMs = 0;
  private share = 1;
  private shown: Sample | null = null;
  private readonly changes = new Changes();

  constructor(private readonly frameSeconds: number) {}

  setSpeed(speed: Speed): void {
    this.share = shares[speed];
    this.kept = [];
    this.changes.take();
  }

  /** Call with each sample that play() does not get, because a sample reports a body's jump only once. */
  note(sample: Sample): void {
    if (this.share !== 1) this.changes.note(sample);
  }

  /** The sample to draw while `newest` is the newest one. */
  seen(newest: Sample): Sample {
    return this.share === 1 ? newest : (this.shown ?? newest);
  }

  /** Takes the newest sample, and returns what to draw now and the frame of its last delta. */
  play(sample: Sample, applied: number, nowMs: number): { sample: Sample; applied: number } {
    if (this.share === 1) return { sample, applied };
    this.note(sample);
    const last = this.kept.at(-1)?.sample;
    if (last && (last.capacity !== sample.capacity || sample.frame < last.frame)) this.kept = [];
    if (this.kept.length === 0 || !last || sample.frame >= last.frame + 1) this.keep(sample, applied);
    const frames = ((nowMs - this.playedMs) / 1000 / this.frameSeconds) * this.share;
    this.playedMs = nowMs;
    this.cursor += frames;
    const [from, to] = [this.kept[0].sample.frame, this.kept[this.kept.length - 1].sample.frame];
    if (this.cursor < from || this.cursor > to) this.cursor = to;
    const after = this.kept.findIndex((kept) => kept.sample.frame >= this.cursor);
    const b = this.kept[after];
    const a = this.kept[Math.max(after - 1, 0)];
    return { sample: this.between(a.sample, b.sample), applied: a.applied };
  }

  private keep(sample: Sample, applied: number): void {
    const bytes = sample.capacity * (sample.orientations ? 37 : 21);
    const most = Math.max(2, Math.min(mostKept, Math.floor(mostKeptBytes / bytes)));
    this.kept.push({ sample: copyOf({ ...sample, changes: this.changes.take() }), applied });
    if (this.kept.length > most) this.kept.shift();
  }

  private between(a: Sample, b: Sample): Sample {
    if (this.shown?.capacity !== b.capacity || !this.shown.orientations !== !b.orientations) this.shown = copyOf(b);
    const span = b.frame - a.frame;
    const share = span > 0 ? (this.cursor - a.frame) / span : 1;
    const out = { ...b, positions: this.shown.positions, orientations: this.shown.orientations, frame: this.cursor };
    this.shown = out;
    mix(a.positions, b.positions, 3, share, b.changes, out.positions);
    if (a.orientations && b.orientations && out.orientations) {
      mix(a.orientations, b.orientations, 4, share, b.changes, out.orientations);
    }
    return out;
  }
}

/** With arrays of its own. */
function copyOf(sample: Sample): Sample {
  return {
    frame: sample.frame,
    capacity: sample.capacity,
    positions: sample.positions.slice(),
    orientations: sample.orientations?.slice() ?? null,
    alive: sample.alive.slice(),
    generation: sample.generation.slice(),
    types: sample.types.slice(),
    changes: sample.changes.slice(),
    corrected: sample.corrected.slice(),
    correctedIn: sample.correctedIn.slice(),
  };
}

/** From a to b, but at b where a body has come or jumped. Quaternions go the shorter way and are made unit ones. */
function mix(a: Float32Array, b: Float32Array, size: number, share: number, changes: Uint8Array, out: Float32Array): void {
  for (let slot = 0; slot < changes.length; ++slot) {
    const at = slot * size;
    let dot = 1;
    if (size === 4) dot = a[at] * b[at] + a[at + 1] * b[at + 1] + a[at + 2] * b[at + 2] + a[at + 3] * b[at + 3];
    const [from, to] = changes[slot] ? [0, 1] : [dot < 0 ? share - 1 : 1 - share, share];
    let length = 0;
    for (let i = at; i < at + size; ++i) {
      out[i] = a[i] * from + b[i] * to;
      length += out[i] * out[i];
    }
    if (size === 4 && length > 0) for (let i = at; i < at + 4; ++i) out[i] /= Math.sqrt(length);
  }
}
