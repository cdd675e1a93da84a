// A parser of protobuf text, and what the viewer reads of a scene (idl/scene.proto) with it. The text comes from the
// network, so sizes and depths are bounded. Unknown fields are kept and ignored.

export type Scalar = string | number | boolean;
export type Message = Map<string, (Scalar | Message)[]>;
export type Vec3 = [number, number, number];

const maxCharacters = 1 << 20;
const maxDepth = 16;
const maxFields = 100_000;

/** A text that is not protobuf text or breaks a bound; the message names the line. */
export class SceneTextError extends Error {}

class Reader {
  private at = 0;
  private fields = 0;

  constructor(private readonly text: string) {
    if (text.length > maxCharacters) throw new SceneTextError(`more than ${maxCharacters} characters`);
  }

  /** Fields up to `end`, which is taken; '' is the end of the text. */
  message(end: string, depth: number): Message {
    if (depth > maxDepth) this.fail(`more than ${maxDepth} levels`);
    const message: Message = new Map();
    for (;;) {
      this.skipSpace();
      if (this.at === this.text.length) {
        if (end !== '') this.fail(`'${end}' is missing`);
        return message;
      }
      if (end !== '' && this.take(end)) return message;
      this.field(message, depth);
    }
  }

  private field(message: Message, depth: number): void {
    if (++this.fields > maxFields) this.fail(`more than ${maxFields} fields`);
    const name = this.match(/[A-Za-z_][A-Za-z0-9_]*/y) ?? this.fail('a field name is missing');
    let values = message.get(name);
    if (!values) message.set(name, (values = []));
    const colon = this.take(':');
    if (this.take('[')) {
      while (!this.take(']')) {
        if (++this.fields > maxFields) this.fail(`more than ${maxFields} fields`);
        values.push(this.value(true, depth));
        this.take(',');
      }
    } else {
      values.push(this.value(colon, depth));
    }
    if (!this.take(',')) this.take(';');
  }

  private value(scalar: boolean, depth: number): Scalar | Message {
    if (this.take('{')) return this.message('}', depth + 1);
    if (this.take('<')) return this.message('>', depth + 1);
    if (!scalar) this.fail("':' or '{' is missing");
    const quoted = this.string();
    if (quoted !== null) return quoted;
    const number = this.match(/[-+]?(?:0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)[fF]?/y);
    if (number !== null) return Number(/^[-+]?0[xX]/.test(number) ? number : number.replace(/[fF]$/, ''));
    const word = this.match(/-?[A-Za-z_][A-Za-z0-9_]*/y) ?? this.fail('a value is missing');
    if (word === 'true' || word === 'false') return word === 'true';
    if (/^-?(inf|infinity|nan)$/i.test(word)) this.fail('a number must be finite');
    return word;
  }

  /** Joins adjacent strings, as protobuf does; null if there is none. */
  private string(): string | null {
    let whole: string | null = null;
    for (;;) {
      const part = this.match(/"(?:[^"\\\n]|\\[^\n])*"|'(?:[^'\\\n]|\\[^\n])*'/y);
      if (part === null) return whole;
      whole = (whole ?? '') + part.slice(1, -1).replace(/\\(.)/g, (_, c: string) => (c === 'n' ? '\n' : c));
    }
  }

  private skipSpace(): void {
    const space = /(?:\s+|#[^\n]*)*/y;
    space.lastIndex = this.at;
    space.test(this.text);
    this.at = space.lastIndex;
  }

  private take(character: string): boolean {
    this.skipSpace();
    if (this.text[this.at] !== character) return false;
    ++this.at;
    return true;
  }

  private match(pattern: RegExp): string | null {
    this.skipSpace();
    pattern.lastIndex = this.at;
    const found = pattern.exec(this.text);
    if (!found) return null;
    this.at = pattern.lastIndex;
    return found[0];
  }

  private fail(what: string): never {
    const line = this.text.slice(0, this.at).split('\n').length;
    throw new SceneTextError(`line ${line}: ${what}`);
  }
}

/** Every field of a protobuf text, in order, as lists by name. Throws SceneTextError. */
export function parseText(text: string): Message {
  return new Reader(text).message('', 0);
}

/** Bodies stay on the side of `through` that the unit normal points to. */
export interface Plane {
  through: Vec3;
  normal: Vec3;
}

export interface Box {
  centre: Vec3;
  size: Vec3;
  /** A rotation about an axis, 0 to 2, by an angle in radians; in their order. */
  turns: { axis: number; angle: number }[];
}

export interface Sphere {
  centre: Vec3;
  radius: number;
}

/** Where a replayed session is in its recording: `fromFrame` is `from` seconds after the first message. */
export interface Recording {
  /** The time of the first message, ms since 1970. */
  started: number;
  /** Seconds. */
  length: number;
  from: number;
  fromFrame: number;
  /** Frames a second of the recorded session. */
  rate: number;
  /** What happened, by time. */
  events: RecordedEvent[];
}

/** `at` seconds after the first message. */
export interface RecordedEvent {
  at: number;
  text: string;
}

/** The parts of a scene that are drawn, and the scales of inputs. Metres, seconds. */
export interface Scene {
  description: string;
  dt: number;
  gravity: Vec3;
  /** Gravities above are refused by the server, m/s^2. */
  maxGravity: number;
  /** Pushes above are refused by the server, m/s; 0 where the scene leaves it to the bodies' size. */
  maxPush: number;
  bounds: { low: Vec3; high: Vec3 } | null;
  planes: Plane[];
  boxes: Box[];
  spheres: Sphere[];
  /** Null: the session is no replay. */
  recording: Recording | null;
}

export const emptyScene: Scene = {
  description: '',
  dt: 1 / 30,
  gravity: [0, -9.81, 0],
  maxGravity: 98.1,
  maxPush: 0,
  bounds: null,
  planes: [],
  boxes: [],
  spheres: [],
  recording: null,
};

const maxSolids = 4096;
const maxEvents = 500;

/** Reads the parts of a scene's text that the viewer needs. Ignores fields of a wrong type. Throws SceneTextError. */
export function readScene(text: string): Scene {
  const scene = parseText(text);
  const gravity = vec3(child(scene, 'gravity'));
  const bounds = child(scene, 'bounds');
  return {
    description: string(scene, 'description'),
    dt: number(scene, 'dt_s') || emptyScene.dt,
    gravity,
    maxGravity: number(scene, 'max_gravity') || 10 * Math.hypot(...gravity) || emptyScene.maxGravity,
    maxPush: number(scene, 'max_push'),
    bounds: bounds && { low: vec3(child(bounds, 'low')), high: vec3(child(bounds, 'high')) },
    planes: children(scene, 'planes').flatMap((plane) => {
      const normal = vec3(child(plane, 'normal'));
      const length = Math.hypot(...normal);
      if (!(length > 0)) return [];
      return [{ through: vec3(child(plane, 'through')), normal: normal.map((x) => x / length) as Vec3 }];
    }),
    boxes: children(scene, 'boxes').map((box) => ({
      centre: vec3(child(box, 'centre')),
      size: vec3(child(box, 'size')),
      turns: children(box, 'turns').map((turn) => ({
        axis: Math.max(0, ['x', 'y', 'z'].indexOf(string(turn, 'axis'))),
        angle: Math.atan2(number(turn, 'rise'), number(turn, 'run')),
      })),
    })),
    spheres: children(scene, 'spheres').map((sphere) => ({
      centre: vec3(child(sphere, 'centre')),
      radius: number(sphere, 'radius_m'),
    })),
    recording: readRecording(child(scene, 'recording')),
  };
}

function readRecording(message: Message | null): Recording | null {
  if (!message) return null;
  const recording = {
    started: number(message, 'started_unix_ms'),
    length: number(message, 'length_s'),
    from: number(message, 'from_s'),
    fromFrame: number(message, 'from_frame'),
    rate: number(message, 'frame_rate_hz'),
    events: children(message, 'events')
      .slice(0, maxEvents)
      .map((event) => ({ at: number(event, 'at_s'), text: string(event, 'text') })),
  };
  return recording.length > 0 && recording.rate > 0 ? recording : null;
}

function children(message: Message, name: string): Message[] {
  const found = (message.get(name) ?? []).filter((value) => value instanceof Map);
  if (found.length > maxSolids) throw new SceneTextError(`more than ${maxSolids} ${name}`);
  return found;
}

function child(message: Message, name: string): Message | null {
  return children(message, name).at(-1) ?? null;
}

function number(message: Message | null, name: string): number {
  const value = message?.get(name)?.at(-1);
  return typeof value === 'number' && Number.isFinite(value) ? value : 0;
}

function string(message: Message, name: string): string {
  const value = message.get(name)?.at(-1);
  return typeof value === 'string' ? value : '';
}

function vec3(message: Message | null): Vec3 {
  return [number(message, 'x'), number(message, 'y'), number(message, 'z')];
}
