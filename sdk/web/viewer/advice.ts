// Advises users whose device does not keep up.

import type { Status } from '../tandem';

/** The share of a frame's time that the client's work may take; drawing needs the rest. */
const mostShare = 0.5;
/** More lag than any network explains: frames wait here. */
const lateMs = 400;

/** Empty where all is well. */
export function adviceOf({ phase, predictor, frameMs, frameRateHz, lagMs, roundTripMs }: Pick<Status, 'phase' | 'predictor' | 'frameMs' | 'frameRateHz' | 'lagMs' | 'roundTripMs'>): string {
  if (phase !== 'playing' || frameRateHz <= 0) return '';
  const share = (frameMs.p50 * frameRateHz) / 1000;
  const late = lagMs - roundTripMs > lateMs;
  if (share <= mostShare && !late) return '';
  const what = late ? `frames are ${(lagMs / 1000).toFixed(1)} s late here` : `a frame takes ${(100 * share).toFixed(0)} % of its time here`;
  if (predictor !== 'ballistic') return `${what}: a session with --predictor ballistic is less work`;
  return `${what}: a session of fewer bodies is less work`;
}
