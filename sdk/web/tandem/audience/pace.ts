// Keeps a place on the time line: on with the clock, as far as there is something to play, and two seconds behind the present.

/** How far the time line should reach beyond the place when a segment has just come. A segment is there one second after its begin and
 * what its way takes; so this is two seconds behind the present. */
const AHEAD_MS = 1750;
/** Of it, where nothing says how old the newest frame is. */
const FIRST_AHEAD_MS = 1250;
/** A place that ran dry waits until it is so far behind. */
const ENOUGH_MS = AHEAD_MS - 250;
/** Farther off, it jumps. */
const JUMP_MS = 1000;
const DELAY_MS = 2000;
/** A change of pace that nobody sees. */
const MOST_CHANGE = 0.08;

export class Pace {
  /** The place, in milliseconds of the time line. */
  atMs = 0;
  /** True while it keeps behind the present. */
  live = false;
  /** True while it waits for something to play. */
  dry = true;
  #enoughMs = 0;
  #rate = 1;
  #clockMs = 0;
  #meanError = 0;

  goTo(ms: number, nowMs: number): void {
    this.atMs = ms;
    this.#clockMs = nowMs;
    this.#rate = 1;
    this.#meanError = 0;
    this.live = false;
    this.dry = true;
    this.#enoughMs = 0;
  }

  /** Where to begin behind an end at `toMs`, if its newest frame is so old; that counts if it is likely. */
  static first(toMs: number, ageMs: number): number {
    const likely = ageMs >= 0 && ageMs <= DELAY_MS;
    return toMs - (likely ? Math.min(Math.max(DELAY_MS - ageMs, 1000), AHEAD_MS) : FIRST_AHEAD_MS);
  }

  /** Goes on by the clock, up to `endMs`. */
  advance(nowMs: number, endMs: number): void {
    const passedMs = Math.max(0, nowMs - this.#clockMs);
    this.#clockMs = nowMs;
    if (this.dry) {
      this.dry = endMs <= this.atMs || (this.live && endMs - this.atMs < this.#enoughMs);
      return;
    }
    this.atMs += passedMs * (this.live ? this.#rate : 1);
    if (this.atMs < endMs) return;
    this.atMs = endMs;
    this.dry = true;
    this.#enoughMs = ENOUGH_MS;
  }

  /** The time line has just grown up to `toMs`. */
  grew(toMs: number): void {
    if (!this.live || this.dry) return;
    const error = toMs - this.atMs - AHEAD_MS;
    this.#meanError += (error - this.#meanError) / 4;
    if (Math.min(error, this.#meanError) > JUMP_MS) {
      this.atMs += error;
      this.#meanError = 0;
    }
    this.#rate = 1 + Math.min(Math.max(this.#meanError / 5000, -MOST_CHANGE), MOST_CHANGE);
  }
}
