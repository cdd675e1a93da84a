// A module that plays recorded messages.

import { Module } from '../module';
import type { AppliedEvent } from '../types';
import { Kind } from './trace';
import type { Trace } from './trace';
import { wasm } from './wasm';

const WALL_MS = 1_700_000_000_000;
const compiled = { plain: WebAssembly.compile(wasm.plain), simd: WebAssembly.compile(wasm.simd) };

export class Player {
  readonly time = { now: 0 };
  readonly applied: AppliedEvent[] = [];
  readonly sent: Uint8Array[] = [];
  module!: Module;

  async start(variant: 'plain' | 'simd'): Promise<this> {
    this.module = await Module.create(await compiled[variant], {
      id: 77n,
      role: 'participant',
      lead: 1,
      clock: { steady: () => this.time.now, wall: () => WALL_MS + this.time.now },
      log: () => undefined,
    });
    this.module.connected();
    return this;
  }

  poll(): void {
    this.module.poll();
    for (let message; (message = this.module.nextMessage()); ) this.sent.push(message);
    for (const event of this.module.events()) if (event.type === 'applied') this.applied.push(event);
  }

  /** Takes in one message; a snapshot not before it was asked for. */
  play(message: Trace['messages'][number]): string {
    this.time.now = Math.max(this.time.now, message.atMs);
    if (message.bytes[0] === Kind.snapshot) {
      for (let i = 0; i < 100 && !this.sent.some((each) => each[0] === Kind.ack); ++i) {
        this.time.now += 1;
        this.poll();
      }
    }
    const refused = this.module.receive(message.bytes);
    this.poll();
    return refused;
  }
}
