// The types of the public interface. Units: scene units, milliseconds, Mbit of 2^20 bits.

import type { ClientFigures, ServerFigures } from './figures';

export type Role = 'observer' | 'participant';

/**
 * `connecting`: no connection was ever open. `searching`: there is no server behind the gateway yet. `refused`: the
 * gateway refused this client, or the client cannot play the session; see `reason`. `joining`: the client waits for a
 * snapshot. `playing`: the client holds the agreed state and follows it. `lost`: the connection or the session's server
 * is gone; the client tries again until it is back.
 * `closed`: after close().
 */
export type Phase = 'connecting' | 'searching' | 'refused' | 'joining' | 'playing' | 'lost' | 'closed';

/** The source of a WebAssembly module. */
export type WasmSource = URL | string | BufferSource | WebAssembly.Module;

/** The part of WebSocket that the client needs. */
export interface SocketLike {
  binaryType: string;
  readonly protocol: string;
  readonly readyState: number;
  onopen: ((event: never) => void) | null;
  onmessage: ((event: never) => void) | null;
  onclose: ((event: never) => void) | null;
  onerror: ((event: never) => void) | null;
  send(data: Uint8Array): void;
  close(code?: number, reason?: string): void;
}

/** Both in milliseconds; `steady` never goes back, `wall` counts from 1970. */
export interface Clock {
  steady(): number;
  wall(): number;
}

export interface ConnectOptions {
  /** The gateway's address: `ws://HOST:PORT/tandem`, with `?token=TOKEN` if the gateway needs one. */
  url?: string;
  /**
   * Instead of a gateway: the folder of a session's files (`tandem record --to http`), on any web server. The client is an observer of
   * it, some two seconds behind the present where there is one, and can seek.
   */
  from?: string | URL;
  /** Participants may send input. Default: participant. */
  role?: Role;
  /** Frames to simulate beyond the last delta, 0 or 1; the session may allow less. Default: 1. */
  lead?: number;
  /**
   * Seconds, 0..1, rounded down to a multiple of 0.05: how long the gateway may hold back a frame until the next ones come, so that
   * they share a message, which costs far fewer bytes. What is drawn is that much later. A frame on which an input of this client
   * acted waits for nothing. Default: 0 for a participant, 0.2 for an observer.
   */
  maxDelay?: number;
  /**
   * What this client may take on the network, with all headers, in both directions: kbit/s (1,000 bit), 16..10,000,000; 0: no cap. The
   * gateway ends the connection where that is exceeded, and its text has both numbers. Snapshots come at the pace that it leaves. Not
   * with `from`. Default: 0.
   */
  maxKbitS?: number;
  /** `auto` uses SIMD if the browser has it. */
  simd?: 'auto' | 'on' | 'off';
  /** Default: `tandem.wasm` and `tandem-simd.wasm` next to this script. */
  wasm?: { plain: WasmSource; simd: WasmSource };
  /** Replaces the browser's WebSocket in other environments. */
  webSocket?: (url: string, protocol: string) => SocketLike;
  /** Replaces the browser's fetch, for `from`. */
  fetch?: (url: URL, options: RequestInit) => Promise<Response>;
  /** Replaces performance.now() and Date.now() in tests. */
  clock?: Clock;
  /** Receives one line for a human. Default: warnings and errors go to the console. */
  log?: (level: LogLevel, text: string) => void;
}

export type LogLevel = 'info' | 'warning' | 'error';

/** The server's status, which the gateway passes on once a second. */
export interface ServerStatus extends ServerFigures {
  session: string;
  epoch: number;
  frame: number;
  codec: string;
  predictor: string;
}

/** The module's own status: WebClient::status(). */
export interface ModuleStatus extends ClientFigures {
  phase: 'searching' | 'refused' | 'joining' | 'playing';
  serverAlive: boolean;
  /** The reason why phase or role differ from the wanted ones; empty if they do not. */
  reason: string;
  /** The role that the server granted. */
  role: Role;
  /** 16 hex digits. */
  clientId: string;
  scene: string;
  epoch: number;
  /** The last frame agreed with the server. */
  frame: number;
  /** The state hash of that frame, 16 hex digits; empty while not playing. */
  stateHash: string;
  frameRateHz: number;
  /** Seconds that one frame simulates; absent before a session is known, as are the next three. */
  dtS?: number;
  /** The axis of the scene that points up: 0 x, 1 y, 2 z. */
  upAxis?: number;
  /** The epoch that this one continues, and from which of its frames; 0: none. */
  continuesEpoch?: number;
  continuesFrame?: number;
  lead: number;
  predictor: string;
  codec: string;
  capacity: number;
  bodies: number;
  atRest: number;
  /** Bodies that the last delta corrected. */
  corrected: number;
  /** Time from publishing a delta to applying it, by the estimated clock of the server. */
  lagMs: number;
  /** Parts of clientMsP50 and clientMsP99. */
  frameMs: { p50: number; p99: number };
  /** The gravity in force, scene units / s^2; zero before a snapshot. */
  gravity: [number, number, number];
  /** Null unless showUncorrected() is on and a state is held. */
  uncorrected: Uncorrected | null;
  server: ServerStatus | null;
}

/** Distances of the bodies shown without corrections from their agreed places; scene units. */
export interface Uncorrected {
  /** Since the last correction. */
  frames: number;
  /** Alive in both states. */
  bodies: number;
  meanDrift: number;
  mostDrift: number;
}

/** A session that comes from files. In seconds since it began to be written. */
export interface TimeLine {
  fromS: number;
  toS: number;
  atS: number;
  /** The present is played. */
  live: boolean;
  /** Nothing will be added. */
  ended: boolean;
  /** The age of what is shown, by this device's clock and the server's; null where they do not fit each other, or for the past. */
  behindMs: number | null;
  /** Bytes that were fetched. */
  receivedBytes: number;
  /** Answers that were none, cut short, altered, old or of another recording. Each was asked for again, or left out. */
  refusedFiles: number;
}

export interface Status extends Omit<ModuleStatus, 'phase' | 'serverAlive'> {
  phase: Phase;
  /** The rate of the deltas' payload over the last second. */
  mbitPerS: number;
  /** The rate of all messages received over the last second. */
  receivedMbitPerS: number;
  /** The rate of positions and velocities without compression: 24 bytes per body and frame; once a sample had orientations,
   * with those and angular velocities: 52. */
  rawMbitPerS: number;
  /** Where the client is in a session that comes from files; null with a gateway, and before the manifest is there. */
  timeLine: TimeLine | null;
  /** True if the module with SIMD runs. */
  simd: boolean;
  /** How often the module failed and was started anew. */
  restarts: number;
}

export interface BodyType {
  name: string;
  /** The radius of the sphere around the body. */
  radius: number;
  /** `#rrggbbaa` */
  colour: string;
  shape: 'none' | 'sphere' | 'box' | 'capsule' | 'cylinder' | 'hull';
  /** box: half sizes x, y, z; capsule: radius, half of the length between the caps' centres, along y; cylinder: radius,
   * half of the height, along y; hull: points x, y, z. */
  shapeValues: number[];
}

/** Values of `Sample.changes`, against the sample before. */
export const Change = { none: 0, new: 1, gone: 2, jumped: 3 } as const;

export type SampleMode = 'extrapolate' | 'interpolate';

/**
 * The bodies at one moment. The arrays are views into the module's memory, valid until the next call of any method of
 * the client or the next turn of the event loop. Values of slots with alive = 0 are unspecified, except their change.
 */
export interface Sample {
  /** The moment, in frames. */
  frame: number;
  capacity: number;
  /** x, y, z of slot 0, of slot 1, ... */
  positions: Float32Array;
  /** Quaternions x, y, z, w from the body's frame to the world's; null if bodies do not turn. */
  orientations: Float32Array | null;
  alive: Uint8Array;
  /** Counts the bodies that the slot has held, modulo 256. */
  generation: Uint8Array;
  /** Index into types(). */
  types: Uint16Array;
  changes: Uint8Array;
  /** 1 if the last applied delta corrected the body. */
  corrected: Uint8Array;
  /** The frame, modulo 2^32, of the last delta that corrected the body; 0 if none of this epoch did. */
  correctedIn: Uint32Array;
}

export interface SessionEvent {
  type: 'session';
  epoch: number;
}
export interface AppliedEvent {
  type: 'applied';
  epoch: number;
  frame: number;
  /** 16 hex digits. */
  hash: string;
  /** The size of the delta's payload. */
  bytes: number;
  corrected: number;
}
export interface OutcomeEvent {
  type: 'outcome';
  /** The number that send...() returned. */
  number: number;
  kind: 'acted' | 'refused' | 'unknown';
  /** The frame that it acted on. */
  frame: number;
  /** The simulation's own words where it refused the input and gave some. */
  reason: string;
  /** Time from sending the input to applying that frame. */
  latencyMs: number;
}
/** A field of the data that the server gives each body; `rgba`: bytes of red, green, blue and opacity. */
export interface DataField {
  name: string;
  kind: 'u8' | 'i8' | 'u16' | 'i16' | 'u32' | 'i32' | 'f32' | 'rgba';
}
/** The server broadcast something: each client that plays hears of it once. */
export interface HappenedEvent {
  type: 'happened';
  epoch: number;
  /** It is in a picture whose `frame` is at least this. */
  frame: number;
  /** From 1 on, over epochs that continue each other. */
  number: number;
  /** What it means is the server's. */
  kind: number;
  /** The body that it is about. `reuse`: as Sample.generation; the slot may hold another body now. */
  body: { slot: number; reuse: number } | null;
  data: Uint8Array;
}
/** So many events up to `frame` are lost for this client, or (`takenBack`) of frames beyond it did not happen. */
export interface MissedEvent {
  type: 'lost' | 'takenBack';
  epoch: number;
  frame: number;
  count: number;
}
/** A key of the session has another value, or none: it is gone. */
export interface KeyEvent {
  type: 'key';
  epoch: number;
  frame: number;
  key: string;
  value: Uint8Array | null;
}
export type ModuleEvent = SessionEvent | AppliedEvent | OutcomeEvent | HappenedEvent | MissedEvent | KeyEvent;

export interface Handlers {
  phase: (phase: Phase) => void;
  session: (event: SessionEvent) => void;
  outcome: (event: OutcomeEvent) => void;
  applied: (event: AppliedEvent) => void;
  happened: (event: HappenedEvent) => void;
  lost: (event: MissedEvent) => void;
  takenBack: (event: MissedEvent) => void;
  key: (event: KeyEvent) => void;
}

/** `reason` of a status of phase `lost` whose gateway is there, and says that its server is not. */
export const SERVER_GONE = 'the server is gone';

/** An input that could not be sent, or a module that could not be loaded. */
export class TandemError extends Error {
  override name = 'TandemError';
}
