// Collects which bodies have come, gone or jumped since the last call, because a sample compares only with the one before.

import type { Sample } from '../tandem';

export class Changes {
  private noted = new Uint8Array(0);
  private taken = new Uint8Array(0);

  /** To be called with every sample of the client. */
  note({ capacity, changes }: Pick<Sample, 'capacity' | 'changes'>): void {
    if (this.noted.length !== capacity) [this.noted, this.taken] = [new Uint8Array(capacity), new Uint8Array(capacity)];
    for (let slot = 0; slot < capacity; ++slot) if (changes[slot]) this.noted[slot] = changes[slot];
  }

  /** The last change of every slot since the last call, 0 for none; valid until the next call. */
  take(): Uint8Array {
    [this.noted, this.taken] = [this.taken, this.noted];
    this.noted.fill(0);
    return this.taken;
  }
}
