// Takes an object of messages apart, and reads what the player has to know of them (idl/PROTOCOL.md, "WebSocket", "Fields").

import { Broken, type Run, type Segment } from './manifest';

export const Kind = { session: 1, delta: 2, scheduledInput: 3, snapshot: 4, absent: 7, ack: 16 } as const;

/** The server is gone. */
export const ABSENT = new Uint8Array([Kind.absent]);

/** Behind the kind and the encapsulation header, from which values are aligned. */
const BODY = 5;

/** A message, and when it is due on the time line. */
export interface Timed {
  atMs: number;
  /** Of the delta at or behind which it stands. */
  frame: number;
  /** The server's wall clock at that delta, ms since 1970. */
  serverMs: number;
  message: Uint8Array;
}

/** Messages behind their sizes (u32). */
export function messagesOf(object: Uint8Array): Uint8Array[] {
  const view = new DataView(object.buffer, object.byteOffset, object.byteLength);
  const messages: Uint8Array[] = [];
  for (let at = 0; at < object.length; ) {
    if (at + 4 > object.length) throw new Broken('a message is cut short');
    const size = view.getUint32(at, true);
    at += 4;
    if (size === 0 || at + size > object.length) throw new Broken('a message is cut short');
    messages.push(object.subarray(at, at + size));
    at += size;
  }
  return messages;
}

/** The messages of a segment with their times. Throws Broken where they are not what the manifest says. */
export function readSegment(object: Uint8Array, segment: Segment, run: Run): Timed[] {
  const timed: Timed[] = [];
  let frame = segment.frame;
  let waiting = 0; // inputs in front of the next delta
  for (const message of messagesOf(object)) {
    const body = bodyOf(message);
    if (message[0] === Kind.scheduledInput) {
      if (epochOf(body) !== run.epoch) throw new Broken('an input of another epoch');
      timed.push({ atMs: 0, frame, serverMs: 0, message });
      ++waiting;
      continue;
    }
    if (message[0] !== Kind.delta || body.byteLength < 56) throw new Broken('something else than deltas and inputs');
    const [stream, generation] = [body.getUint16(40, true), body.getUint16(42, true)];
    if (epochOf(body) !== run.epoch || stream !== run.stream || generation !== run.generation) throw new Broken('a delta of another stream');
    if (Number(body.getBigUint64(8, true)) !== frame) throw new Broken('frames are missing');
    timed.push({ atMs: 0, frame, serverMs: Number(body.getBigInt64(24, true) / 1_000_000n), message });
    for (const input of timed.slice(-1 - waiting)) input.serverMs = timed.at(-1)!.serverMs;
    waiting = 0;
    ++frame;
  }
  if (waiting > 0 || frame !== segment.frame + segment.frames) throw new Broken('frames are missing');
  setTimes(timed, segment);
  return timed;
}

const LONGEST_FRAME_MS = 1000;

// As the writer counts: each frame is as long as the time from the one before, at most a second. That of the first is what is left.
function setTimes(timed: Timed[], segment: Segment): void {
  let sinceFirst = 0;
  for (const [i, each] of timed.entries()) {
    const before = timed[i - 1];
    if (before) sinceFirst += Math.min(Math.max(each.serverMs - before.serverMs, 0), LONGEST_FRAME_MS);
    each.atMs = sinceFirst;
  }
  const first = segment.fromMs + Math.max(0, segment.ms - sinceFirst);
  for (const each of timed) each.atMs = Math.min(first + each.atMs, segment.fromMs + segment.ms);
}

/** The messages of a session's or a snapshot's object. */
export function readWhole(object: Uint8Array, kind: number, run: Run): Uint8Array[] {
  const messages = messagesOf(object);
  if (messages.length === 0) throw new Broken('it is empty');
  for (const message of messages) {
    if (message[0] !== kind || epochOf(bodyOf(message)) !== run.epoch) throw new Broken('another message than the manifest says');
  }
  return messages;
}

/** The request of a TandemAck for a snapshot, by its number; nothing where it asks for none. */
export function joinAttemptOf(message: Uint8Array): number | undefined {
  if (message[0] !== Kind.ack) return undefined;
  const body = bodyOf(message);
  return body.getUint32(28, true) === 0 ? body.getUint32(52, true) : undefined;
}

function bodyOf(message: Uint8Array): DataView {
  if (message.length < BODY + 8 || message[1] !== 0 || message[2] !== 1) throw new Broken('a message of another encoding');
  return new DataView(message.buffer, message.byteOffset + BODY, message.length - BODY);
}

const epochOf = (body: DataView): number => Number(body.getBigUint64(0, true));
