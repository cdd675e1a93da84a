// Counts bytes per second over the last second.

const WINDOW_MS = 1000;
const BITS_PER_MBIT = 1048576;

export class Rate {
  readonly #added: { at: number; bytes: number }[] = [];
  #sum = 0;

  add(at: number, bytes: number): void {
    this.#added.push({ at, bytes });
    this.#sum += bytes;
    this.#forget(at);
  }

  /** Mbit of 2^20 bits. */
  mbitPerS(now: number): number {
    this.#forget(now);
    return (this.#sum * 8) / BITS_PER_MBIT / (WINDOW_MS / 1000);
  }

  #forget(now: number): void {
    let old = 0;
    for (const { at, bytes } of this.#added) {
      if (at > now - WINDOW_MS) break;
      this.#sum -= bytes;
      ++old;
    }
    this.#added.splice(0, old);
  }
}
