// The parts of a session's scene that the viewer draws, read from JSON (idl/scene.proto). The JSON comes from the network, so
// every value is checked before it is used, and lists are bounded. Unknown members are ignored.

export type Vec3 = [number, number, number];

type Message = Record<string, unknown>;

const maxCharacters = 1 << 20;

/** A text that is no JSON or breaks a bound. */
export class SceneError extends Error {}

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

/** Reads the parts of a scene's JSON that the viewer needs; the empty text is an empty scene. Ignores values of a wrong type. Throws SceneError. */
export function readScene(json: string): Scene {
  const scene = parse(json);
  const gravity = vec3(scene.gravity);
  const bounds = isMessage(scene.bounds) ? scene.bounds : null;
  return {
    description: string(scene.description),
    dt: number(scene.dtS) || emptyScene.dt,
    gravity,
    maxGravity: number(scene.maxGravity) || 10 * Math.hypot(...gravity) || emptyScene.maxGravity,
    maxPush: number(scene.maxPush),
    bounds: bounds && { low: vec3(bounds.low), high: vec3(bounds.high) },
    planes: list(scene, 'planes').flatMap((plane) => {
      const normal = vec3(plane.normal);
      const length = Math.hypot(...normal);
      if (!(length > 0)) return [];
      return [{ through: vec3(plane.through), normal: normal.map((x) => x / length) as Vec3 }];
    }),
    boxes: list(scene, 'boxes').map((box) => ({
      centre: vec3(box.centre),
      size: vec3(box.size),
      turns: list(box, 'turns').map((turn) => ({
        axis: Math.max(0, ['x', 'y', 'z'].indexOf(string(turn.axis))),
        angle: Math.atan2(number(turn.rise), number(turn.run)),
      })),
    })),
    spheres: list(scene, 'spheres').map((sphere) => ({
      centre: vec3(sphere.centre),
      radius: number(sphere.radiusM),
    })),
    recording: isMessage(scene.recording) ? readRecording(scene.recording) : null,
  };
}

function parse(json: string): Message {
  if (json.length > maxCharacters) throw new SceneError(`more than ${maxCharacters} characters`);
  if (json === '') return {};
  try {
    const scene: unknown = JSON.parse(json);
    return isMessage(scene) ? scene : {};
  } catch (error) {
    throw new SceneError(error instanceof Error ? error.message : String(error));
  }
}

function readRecording(message: Message): Recording | null {
  const recording = {
    started: whole(message.startedUnixMs),
    length: number(message.lengthS),
    from: number(message.fromS),
    fromFrame: whole(message.fromFrame),
    rate: number(message.frameRateHz),
    events: messages(message.events)
      .slice(0, maxEvents)
      .map((event) => ({ at: number(event.atS), text: string(event.text) })),
  };
  return recording.length > 0 && recording.rate > 0 ? recording : null;
}

function isMessage(value: unknown): value is Message {
  return typeof value === 'object' && value !== null && !Array.isArray(value);
}

function messages(value: unknown): Message[] {
  return Array.isArray(value) ? value.filter(isMessage) : [];
}

function list(message: Message, name: string): Message[] {
  const found = messages(message[name]);
  if (found.length > maxSolids) throw new SceneError(`more than ${maxSolids} ${name}`);
  return found;
}

function number(value: unknown): number {
  return typeof value === 'number' && Number.isFinite(value) ? value : 0;
}

/** JSON of protobuf has whole numbers of 64 bits as strings. */
function whole(value: unknown): number {
  return typeof value === 'string' && /^[0-9]{1,20}$/.test(value) ? Number(value) : number(value);
}

function string(value: unknown): string {
  return typeof value === 'string' ? value : '';
}

function vec3(value: unknown): Vec3 {
  return isMessage(value) ? [number(value.x), number(value.y), number(value.z)] : [0, 0, 0];
}
