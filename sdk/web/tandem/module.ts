// The WebAssembly module, typed. module/exports.cpp is the other side.

import type { Clock, DataField, LogLevel, ModuleEvent, ModuleStatus, Role, Sample, SampleMode, WasmSource } from './types';
import { TandemError } from './types';

interface Exports {
  memory: WebAssembly.Memory;
  _initialize(): void;
  tandem_create(id: bigint, role: number, lead: number, maxDelayMs: number, maxKbitS: number): number;
  tandem_input(self: number, size: number): number;
  tandem_output(self: number): number;
  tandem_connected(self: number, anew: number): void;
  tandem_disconnected(self: number): void;
  tandem_receive(self: number): number;
  tandem_poll(self: number, steady: number, wall: number): number;
  tandem_next_message(self: number): number;
  tandem_send(self: number, kind: number, steady: number, wall: number): bigint;
  tandem_take_events(self: number): number;
  tandem_status(self: number): number;
  tandem_types(self: number): number;
  tandem_data_fields(self: number): number;
  tandem_data(self: number): number;
  tandem_scene_json(self: number): number;
  tandem_show_uncorrected(self: number, on: number): void;
  tandem_sample(self: number, mode: number, steady: number, wall: number): number;
}

const bytesOf = (digits: string): Uint8Array =>
  Uint8Array.from({ length: digits.length / 2 }, (_, i) => parseInt(digits.slice(2 * i, 2 * i + 2), 16));

const LEVELS: readonly LogLevel[] = ['info', 'warning', 'error'];

export const InputKind = { gravity: 1, push: 2, seek: 3, application: 16 } as const;

/** i8x16.splat, the smallest module that needs SIMD. */
const NEEDS_SIMD = new Uint8Array([
  0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11,
]);

export const hasSimd = (): boolean => WebAssembly.validate(NEEDS_SIMD);

export async function compile(source: WasmSource): Promise<WebAssembly.Module> {
  if (source instanceof WebAssembly.Module) return source;
  if (typeof source !== 'string' && !(source instanceof URL)) return WebAssembly.compile(source);
  const response = await fetch(source);
  if (!response.ok) throw new TandemError(`${source}: ${response.status} ${response.statusText}`);
  // Servers that do not know the type of .wasm are common enough.
  if (response.headers.get('content-type')?.startsWith('application/wasm')) return WebAssembly.compileStreaming(response);
  return WebAssembly.compile(await response.arrayBuffer());
}

export interface ModuleOptions {
  id: bigint;
  role: Role;
  lead: number;
  maxDelayMs?: number;
  maxKbitS?: number;
  clock: Clock;
  log: (level: LogLevel, text: string) => void;
}

/** One client in one instance. Every method may throw what WebAssembly throws; the instance is lost then. */
export class Module {
  readonly #exports: Exports;
  readonly #self: number;
  readonly #clock: Clock;

  static async create(compiled: WebAssembly.Module, options: ModuleOptions): Promise<Module> {
    let memory: WebAssembly.Memory | undefined;
    const instance = await WebAssembly.instantiate(compiled, {
      tandem: {
        clock_ms: () => options.clock.steady(),
        log: (level: number, at: number, size: number) => {
          if (memory) options.log(LEVELS[level] ?? 'error', text(memory, at, size));
        },
      },
    });
    const exports = instance.exports as unknown as Exports;
    memory = exports.memory;
    exports._initialize();
    return new Module(exports, options);
  }

  private constructor(exports: Exports, options: ModuleOptions) {
    this.#exports = exports;
    this.#clock = options.clock;
    const role = options.role === 'participant' ? 1 : 0;
    this.#self = exports.tandem_create(options.id, role, options.lead, options.maxDelayMs ?? 0, options.maxKbitS ?? 0);
  }

  /** `anew`: the client joins, although it plays the epoch that is announced. */
  connected(anew = false): void {
    this.#exports.tandem_connected(this.#self, anew ? 1 : 0);
  }
  disconnected(): void {
    this.#exports.tandem_disconnected(this.#self);
  }
  /** Takes in one message; why it was refused, or an empty text. */
  receive(message: Uint8Array): string {
    if (!this.#put(message)) return 'a message above 128 MiB';
    return this.#text(this.#exports.tandem_receive(this.#self));
  }
  /** Does what is due. Returns the steady time at which it wants to be called again. */
  poll(): number {
    return this.#exports.tandem_poll(this.#self, this.#clock.steady(), this.#clock.wall());
  }
  /** A copy. */
  nextMessage(): Uint8Array | undefined {
    const size = this.#exports.tandem_next_message(this.#self);
    return size === 0 ? undefined : this.#output(size).slice();
  }
  /** Sends an input and returns its number. Throws TandemError if it is refused. */
  send(kind: number, content: Uint8Array): number {
    if (!this.#put(content)) throw new TandemError('an input holds at most 1,024 bytes');
    const number = this.#exports.tandem_send(this.#self, kind, this.#clock.steady(), this.#clock.wall());
    if (number === 0n) {
      const at = this.#exports.tandem_output(this.#self);
      const memory = new Uint8Array(this.#exports.memory.buffer, at);
      throw new TandemError(new TextDecoder().decode(memory.subarray(0, memory.indexOf(0)).slice()));
    }
    return Number(number);
  }
  events(): ModuleEvent[] {
    const json = this.#text(this.#exports.tandem_take_events(this.#self));
    // Bytes travel as hexadecimal digits.
    const revive = (name: string, value: unknown): unknown =>
      (name === 'data' || name === 'value') && typeof value === 'string' ? bytesOf(value) : value;
    return json === '' ? [] : (JSON.parse(json, revive) as ModuleEvent[]);
  }
  status(): ModuleStatus {
    return JSON.parse(this.#text(this.#exports.tandem_status(this.#self))) as ModuleStatus;
  }
  types(): string {
    return this.#text(this.#exports.tandem_types(this.#self));
  }
  dataFields(): DataField[] {
    return JSON.parse(this.#text(this.#exports.tandem_data_fields(this.#self))) as DataField[];
  }
  /** A copy. */
  data(): Uint8Array {
    return this.#output(this.#exports.tandem_data(this.#self)).slice();
  }
  sceneJson(): string {
    return this.#text(this.#exports.tandem_scene_json(this.#self));
  }

  showUncorrected(on: boolean): void {
    this.#exports.tandem_show_uncorrected(this.#self, on ? 1 : 0);
  }

  sample(mode: SampleMode): Sample | null {
    const at = this.#exports.tandem_sample(
      this.#self,
      mode === 'interpolate' ? 0 : 1,
      this.#clock.steady(),
      this.#clock.wall(),
    );
    if (at === 0) return null;
    // SampleView: f64, then words of 32 bits.
    const buffer = this.#exports.memory.buffer;
    const frame = new Float64Array(buffer, at, 1)[0] as number;
    const words = new Uint32Array(buffer, at + 8, 9);
    const [capacity, positions, orientations, alive, generation, types, changes, corrected, correctedIn] = words as unknown as [
      number, number, number, number, number, number, number, number, number,
    ];
    return {
      frame,
      capacity,
      positions: new Float32Array(buffer, positions, 3 * capacity),
      orientations: orientations === 0 ? null : new Float32Array(buffer, orientations, 4 * capacity),
      alive: new Uint8Array(buffer, alive, capacity),
      generation: new Uint8Array(buffer, generation, capacity),
      types: new Uint16Array(buffer, types, capacity),
      changes: new Uint8Array(buffer, changes, capacity),
      corrected: new Uint8Array(buffer, corrected, capacity),
      correctedIn: new Uint32Array(buffer, correctedIn, capacity),
    };
  }

  #put(bytes: Uint8Array): boolean {
    const at = this.#exports.tandem_input(this.#self, bytes.length);
    if (at === 0) return bytes.length === 0;
    new Uint8Array(this.#exports.memory.buffer, at, bytes.length).set(bytes);
    return true;
  }
  #output(size: number): Uint8Array {
    const at = this.#exports.tandem_output(this.#self); // any call may grow the memory, which ends its buffer
    return new Uint8Array(this.#exports.memory.buffer, at, size);
  }
  #text(size: number): string {
    return size === 0 ? '' : new TextDecoder().decode(this.#output(size));
  }
}

function text(memory: WebAssembly.Memory, at: number, size: number): string {
  return new TextDecoder().decode(new Uint8Array(memory.buffer, at, size));
}
