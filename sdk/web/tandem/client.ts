// A client over a WebSocket: loads the module, keeps a connection, and starts anew what fails.

import { Player } from './audience/player';
import { type DataValues, valuesOf } from './data';
import { compile, hasSimd, InputKind, Module } from './module';
import { Rate } from './rate';
import type {
  BodyType,
  ConnectOptions,
  DataField,
  Handlers,
  KeyEvent,
  LogLevel,
  ModuleStatus,
  Phase,
  Sample,
  SampleMode,
  SocketLike,
  Status,
} from './types';
import { SERVER_GONE, TandemError } from './types';

const PROTOCOL = 'tandem.4';
const FIRST_RETRY_MS = 250;
const LAST_RETRY_MS = 5000;
/** As long as a gateway can give what was missed: STATES.md, "The gateway". */
const HOPE_MS = 30_000;
const LAST_RETRY_IN_HOPE_MS = 1000;
/** A connection that is silent for so long, although there is a server, counts as dead. */
const SILENCE_MS = 10_000;
/** Maximum time of a timer. */
const LONGEST_WAIT_MS = 1000;
const RAW_BYTES_PER_BODY = { still: 24, turning: 52 };
const BITS_PER_MBIT = 1048576;
const OPEN = 1;
/** Nobody waits for an observer. */
const OBSERVER_DELAY_S = 0.2;

/** Close codes with which a gateway refuses this viewer for good: a violated policy, and its own codes. */
const isRefusal = (code: number): boolean => code === 1002 || code === 1003 || code === 1008 || (code >= 4000 && code < 5000);

type HandlerSets = { [Name in keyof Handlers]: Set<Handlers[Name]> };

interface Settings extends ConnectOptions {
  role: 'observer' | 'participant';
  lead: number;
  maxDelayMs: number;
  maxKbitS: number;
}

/**
 * Follows one session through a gateway: holds its bodies bit-identically with the server, sends input, and hands out
 * the bodies to draw. Connects again by itself until close().
 */
export class Client {
  readonly #settings: Settings;
  #compiled: WebAssembly.Module | null = null;
  readonly #simd: boolean;
  readonly #id = randomId();
  readonly #clock;
  readonly #handlers: HandlerSets = {
    phase: new Set(), session: new Set(), outcome: new Set(), applied: new Set(),
    happened: new Set(), lost: new Set(), takenBack: new Set(), key: new Set(),
  };
  readonly #keys = new Map<string, Uint8Array>();
  #module: Module | null = null;
  #socket: SocketLike | null = null;
  /** The socket, where the session comes from files. */
  #player: Player | null = null;
  #phase: Phase = 'connecting';
  #wasConnected = false;
  #closed = false;
  /** Why the gateway closed, or the module failed; empty while there is a connection. */
  #reason = '';
  #isRefused = false;
  #restarts = 0;
  #retryMs = FIRST_RETRY_MS;
  #playedMs = -Infinity; // when it did so last
  #retryTimer: ReturnType<typeof setTimeout> | undefined;
  #pollTimer: ReturnType<typeof setTimeout> | undefined;
  #heardMs = 0;
  #payload = new Rate();
  #received = new Rate();
  #lastStatus: ModuleStatus | null = null;
  #showsUncorrected = false;
  #turns = false;
  #isReady: () => void = () => undefined;
  readonly #ready = new Promise<void>((resolve) => (this.#isReady = resolve));
  #types: { json: string; types: BodyType[] } = { json: '', types: [] };

  /** Resolves when the module is loaded, whether a gateway is there or not. Throws where it cannot be loaded. */
  static async connect(options: ConnectOptions): Promise<Client> {
    if (typeof WebAssembly === 'undefined') throw new TandemError('there is no WebAssembly here');
    if ((options.url === undefined) === (options.from === undefined)) throw new TandemError('expected either url or from');
    const simd = options.simd === 'on' || (options.simd !== 'off' && hasSimd());
    const wasm = options.wasm ?? {
      plain: new URL(/* @vite-ignore */ './tandem.wasm', import.meta.url),
      simd: new URL(/* @vite-ignore */ './tandem-simd.wasm', import.meta.url),
    };
    const client = new Client(options, simd);
    // Files are fetched while the module is, because they need no client until they are there.
    if (options.from !== undefined) client.#player = client.#play(options.from);
    client.#compiled = await compile(simd ? wasm.simd : wasm.plain).catch((error: unknown) => {
      client.#player?.close();
      throw new TandemError(`the WebAssembly module cannot be loaded: ${text(error)}`);
    });
    await client.#start().catch((error: unknown) => {
      throw new TandemError(text(error));
    });
    return client;
  }

  private constructor(options: ConnectOptions, simd: boolean) {
    const role = options.from === undefined ? (options.role ?? 'participant') : 'observer';
    const maxDelay = options.maxDelay ?? (role === 'observer' ? OBSERVER_DELAY_S : 0);
    if (!(maxDelay >= 0 && maxDelay <= 1)) throw new TandemError('maxDelay must be 0 to 1');
    // Files are not collected for anybody.
    const maxDelayMs = options.from === undefined ? Math.round(maxDelay * 1000) : 0;
    const maxKbitS = options.maxKbitS ?? 0;
    const isCap = Number.isInteger(maxKbitS) && maxKbitS >= 16 && maxKbitS <= 10_000_000;
    if (maxKbitS !== 0 && !isCap) throw new TandemError('maxKbitS must be 0, for no cap, or 16 to 10,000,000');
    this.#settings = { ...options, role, lead: options.lead ?? 1, maxDelayMs, maxKbitS };
    this.#simd = simd;
    this.#clock = options.clock ?? { steady: () => performance.now(), wall: () => Date.now() };
  }

  status(): Status {
    const status = this.#guard((module) => module.status()) ?? this.#lastStatus;
    if (status === null) throw new TandemError('the module failed before it said anything');
    this.#lastStatus = status;
    const { serverAlive: _, ...figures } = status;
    const now = this.#clock.steady();
    return {
      ...figures,
      phase: this.#phase,
      timeLine: this.#player?.timeLine() ?? null,
      reason: this.#reason || this.#reasonOf(status),
      mbitPerS: this.#payload.mbitPerS(now),
      receivedMbitPerS: this.#received.mbitPerS(now),
      rawMbitPerS: (status.bodies * RAW_BYTES_PER_BODY[this.#turns ? 'turning' : 'still'] * 8 * status.frameRateHz) / BITS_PER_MBIT,
      simd: this.#simd,
      restarts: this.#restarts,
    };
  }

  /** The bodies as they should be drawn now; null before the first snapshot. Call it once a picture. */
  sample(mode: SampleMode = 'extrapolate'): Sample | null {
    const sample = this.#guard((module) => module.sample(mode)) ?? null;
    if (sample !== null) this.#turns = sample.orientations !== null;
    return sample;
  }

  /**
   * While on, sample() gives the bodies as they were when it was switched on, or at a later join, moved on by prediction and
   * scheduled inputs alone: what the session would look like without corrections. Costs a step of all bodies a frame.
   * What is agreed with the server stays what it is. status().uncorrected says how far the bodies have drifted.
   */
  showUncorrected(on: boolean): void {
    this.#showsUncorrected = on;
    this.#guard((module) => module.showUncorrected(on));
  }

  /** Body types of the session; empty before one is known. */
  types(): BodyType[] {
    const json = this.#guard((module) => module.types()) ?? this.#types.json;
    if (json !== this.#types.json) this.#types = { json, types: JSON.parse(json) as BodyType[] };
    return this.#types.types;
  }

  /** The fields of the data that the server gives each body, in the order of a record; empty if there are none. */
  dataFields(): DataField[] {
    return this.#guard((module) => module.dataFields()) ?? [];
  }

  /**
   * The values of a field at the last frame applied, by slot (of `rgba` four bytes each); zeros for slots without a body.
   * Null if there is no such field, or the client does not play a stream with data.
   */
  data(field: string): DataValues | null {
    const records = this.#guard((module) => module.data());
    return records === undefined || records.length === 0 ? null : valuesOf(records, this.dataFields(), field);
  }

  /** The scene as JSON (idl/scene.proto in protobuf's JSON mapping); empty before a session is known, and where it has none. */
  sceneJson(): string {
    return this.#guard((module) => module.sceneJson()) ?? '';
  }

  /** Sets gravity; returns the number of the input. Like the other inputs it throws TandemError unless playing. */
  sendGravity(gravity: readonly [number, number, number]): number {
    return this.#send(InputKind.gravity, values(gravity));
  }
  /** Adds `velocity` to the bodies within `radius` of `centre`. */
  sendPush(
    centre: readonly [number, number, number],
    radius: number,
    velocity: readonly [number, number, number],
  ): number {
    return this.#send(InputKind.push, values([...centre, radius, ...velocity]));
  }
  /** Makes the replay of a recording continue at `seconds` after its first message. A new session follows. */
  sendSeek(seconds: number): number {
    return this.#send(InputKind.seek, values([seconds]));
  }
  /** Of a session that comes from files: goes to a time of its time line; what is beyond its end is the present. */
  seek(seconds: number): void {
    this.#player?.seek(seconds);
  }
  /** Likewise: goes to the present, or to the end of what is ended. */
  goLive(): void {
    this.#player?.goLive();
  }
  /** Sends up to 1,024 bytes to the engine. */
  sendBytes(bytes: Uint8Array): number {
    return this.#send(InputKind.application, bytes);
  }

  /** Calls `handler` from now on; returns what ends that. */
  on<Name extends keyof Handlers>(name: Name, handler: Handlers[Name]): () => void {
    const handlers = this.#handlers[name] as Set<Handlers[Name]>;
    handlers.add(handler);
    return () => handlers.delete(handler);
  }

  /** Ends the connection; status() stays as it was. */
  close(): void {
    if (this.#closed) return;
    this.#closed = true;
    clearTimeout(this.#retryTimer);
    clearTimeout(this.#pollTimer);
    this.#drop(1000, 'closed by the viewer');
    this.#setPhase('closed');
  }

  // --- module

  async #start(): Promise<void> {
    this.#module = await Module.create(this.#compiled as WebAssembly.Module, {
      id: this.#id,
      role: this.#settings.role,
      lead: this.#settings.lead,
      maxDelayMs: this.#settings.maxDelayMs,
      maxKbitS: this.#settings.maxKbitS,
      clock: this.#clock,
      log: (level, text) => this.#log(level, text),
    });
    this.#module.showUncorrected(this.#showsUncorrected);
    if (!this.#closed) this.#open();
  }

  /** Calls the module. Undefined if there is none, or if it fails and is started anew. */
  #guard<T>(call: (module: Module) => T): T | undefined {
    if (this.#module === null) return undefined;
    try {
      return call(this.#module);
    } catch (error) {
      if (error instanceof TandemError) throw error;
      this.#fail(error);
      return undefined;
    }
  }

  // Nothing of an instance that trapped is of use, its memory least of all.
  #fail(error: unknown): void {
    this.#module = null;
    ++this.#restarts;
    this.#reason = `the module failed and is started anew: ${text(error)}`;
    this.#log('error', this.#reason);
    clearTimeout(this.#pollTimer);
    this.#drop(1011, 'the module failed');
    this.#setPhase('lost');
    this.#later(() => {
      this.#start().catch((again: unknown) => this.#fail(again));
    });
  }

  #send(kind: number, content: Uint8Array): number {
    if (this.#phase !== 'playing') throw new TandemError('a client can send input only while it plays');
    const number = this.#guard((module) => module.send(kind, content));
    if (number === undefined) throw new TandemError('the module failed');
    this.#pump();
    return number;
  }

  // --- connection

  #open(): void {
    const socket = this.#connection();
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => this.#onOpen(socket);
    socket.onmessage = (event: MessageEvent) => this.#onMessage(event.data);
    socket.onclose = (event: CloseEvent) => this.#onClose(event.code, event.reason);
    this.#socket = socket;
    setTimeout(() => this.#isReady(), 0); // once the application has set its own
    this.#pump();
  }

  #connection(): SocketLike {
    const { from, url = '', webSocket } = this.#settings;
    if (from === undefined) return webSocket?.(url, PROTOCOL) ?? new WebSocket(url, PROTOCOL);
    this.#player ??= this.#play(from);
    return this.#player;
  }

  #play(from: string | URL): Player {
    const { fetch } = this.#settings;
    return new Player(folderOf(from), {
      clock: this.#clock,
      fetch: fetch ?? ((file, options) => globalThis.fetch(file, options)),
      log: (line) => this.#log('warning', line),
      ready: this.#ready,
      reconnected: () => {
        this.#guard((module) => module.disconnected());
        this.#guard((module) => module.connected(true));
      },
    });
  }

  #onOpen(socket: SocketLike): void {
    if (socket.protocol !== PROTOCOL) {
      this.#drop(1002, 'another protocol');
      this.#onClose(1002, `the server does not speak ${PROTOCOL}`);
      return;
    }
    this.#wasConnected = true;
    this.#isRefused = false;
    this.#reason = '';
    this.#heardMs = this.#clock.steady();
    this.#guard((module) => module.connected(this.#player !== null));
    this.#pump();
  }

  #onMessage(data: unknown): void {
    this.#heardMs = this.#clock.steady();
    if (!(data instanceof ArrayBuffer)) {
      this.#log('warning', 'message refused: not binary');
      return;
    }
    this.#received.add(this.#heardMs, data.byteLength);
    const refused = this.#guard((module) => module.receive(new Uint8Array(data)));
    if (refused) this.#log('warning', `message refused: ${refused}`);
    this.#pump();
  }

  #onClose(code: number, reason: string): void {
    this.#socket = null;
    this.#isRefused = isRefusal(code);
    this.#reason = reason || (this.#wasConnected ? 'the connection was lost' : 'no gateway answers');
    this.#player = null;
    this.#guard((module) => module.disconnected());
    this.#pump();
    if (!this.#closed && this.#module !== null) this.#later(() => this.#open());
  }

  /** Ends the connection without waiting for the other side. */
  #drop(code: number, reason: string): void {
    const socket = this.#socket;
    if (socket === null) return;
    this.#socket = this.#player = null;
    socket.onopen = socket.onmessage = socket.onclose = null;
    // A browser allows 1000 and 3000 to 4999 only.
    socket.close(code === 1000 ? 1000 : 3000 + (code - 1000), reason);
  }

  // Half of the wait is random, so that the viewers of a gateway that comes back do not come at once.
  #later(action: () => void): void {
    const hopes = !this.#isRefused && this.#clock.steady() - this.#playedMs < HOPE_MS;
    const wait = Math.min(this.#retryMs, hopes ? LAST_RETRY_IN_HOPE_MS : LAST_RETRY_MS) * (0.5 + Math.random() / 2);
    this.#retryMs = Math.min(2 * this.#retryMs, LAST_RETRY_MS);
    clearTimeout(this.#retryTimer);
    this.#retryTimer = setTimeout(action, wait);
  }

  // --- work

  /** Lets the module do what is due, sends its messages, and calls the handlers. */
  #pump(): void {
    if (this.#closed) return;
    clearTimeout(this.#pollTimer);
    const due = this.#guard((module) => module.poll());
    if (due === undefined) return;
    this.#guard((module) => {
      for (let message; (message = module.nextMessage()) !== undefined; ) {
        if (this.#socket?.readyState === OPEN) this.#socket.send(message);
      }
    });
    const now = this.#clock.steady();
    for (const event of this.#guard((module) => module.events()) ?? []) {
      if (event.type === 'applied') this.#payload.add(now, event.bytes);
      if (event.type === 'key') this.#keep(event);
      this.#tell(event.type, event as never);
    }
    const status = this.#guard((module) => module.status());
    if (status === undefined || this.#closed) return;
    this.#lastStatus = status;
    this.#setPhase(this.#phaseOf(status));
    if (this.#phase === 'playing') this.#playedMs = now;
    if (this.#player === null && this.#socket?.readyState === OPEN && status.serverAlive && now - this.#heardMs > SILENCE_MS) {
      this.#drop(1001, 'silence');
      this.#onClose(1006, 'nothing was received for 10 s');
      return;
    }
    this.#pollTimer = setTimeout(() => this.#pump(), Math.min(Math.max(due - now, 0), LONGEST_WAIT_MS));
  }

  #keep({ key, value }: KeyEvent): void {
    if (value === null) this.#keys.delete(key);
    else this.#keys.set(key, value);
  }

  /** The keys of the session and their values at the last frame applied. */
  keys(): ReadonlyMap<string, Uint8Array> {
    return this.#keys;
  }

  #phaseOf(status: ModuleStatus): Phase {
    if (this.#socket?.readyState !== OPEN) {
      if (this.#isRefused) return 'refused';
      return this.#wasConnected ? 'lost' : 'connecting';
    }
    const hadServer = status.epoch !== 0;
    return hadServer && !status.serverAlive ? 'lost' : status.phase;
  }

  /** Of a client that has a connection. */
  #reasonOf(status: ModuleStatus): string {
    const ofFiles = this.#player?.reason ?? '';
    return this.#phase === 'lost' ? ofFiles || SERVER_GONE : status.reason || ofFiles;
  }

  #setPhase(phase: Phase): void {
    if (phase === this.#phase) return;
    this.#phase = phase;
    if (phase === 'playing') this.#retryMs = FIRST_RETRY_MS;
    this.#tell('phase', phase as never);
  }

  #tell<Name extends keyof Handlers>(name: Name, content: Parameters<Handlers[Name]>[0]): void {
    for (const handler of [...this.#handlers[name]]) {
      try {
        (handler as (content: unknown) => void)(content);
      } catch (error) {
        console.error(error);
      }
    }
  }

  #log(level: LogLevel, line: string): void {
    if (this.#settings.log) this.#settings.log(level, line);
    else if (level !== 'info') console.warn(`tandem: ${line}`);
  }
}

function text(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

/** The folder that an address names, with or without the manifest's name. */
function folderOf(from: string | URL): URL {
  const url = new URL(from, globalThis.document?.baseURI);
  url.search = url.hash = '';
  url.pathname = url.pathname.replace(/\/?(manifest\.json)?$/, '/');
  return url;
}

function values(numbers: readonly number[]): Uint8Array {
  return new Uint8Array(Float64Array.from(numbers).buffer);
}

/** 64 random bits, not 0. */
function randomId(): bigint {
  const words = crypto.getRandomValues(new BigUint64Array(1));
  return (words[0] as bigint) || 1n;
}
