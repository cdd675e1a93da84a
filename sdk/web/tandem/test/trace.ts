// Reads the files that tests/web/record_session and record_worlds wrote.

import { readFileSync } from 'node:fs';

export const Kind = { session: 1, delta: 2, scheduledInput: 3, snapshot: 4, reply: 5, absent: 7, ack: 16, input: 17 } as const;

export interface Message {
  atMs: number;
  bytes: Uint8Array;
}

export interface Told {
  epoch: number;
  scene: string;
  capacity: number;
  /** Number, hash, bodies corrected. */
  frames: [number, string, number][];
  bodies: number;
  at_rest: number;
  positions: number[];
}

export interface Trace {
  messages: Message[];
  told: Told;
}

const folder = process.env['TANDEM_TRACES'];

export function readTrace(name: string): Trace {
  const path = `${folder}/${name}`;
  const file = readFileSync(`${path}.trace`);
  const messages: Message[] = [];
  for (let at = 0; at < file.length; ) {
    const size = file.readUInt32LE(at + 8);
    messages.push({ atMs: file.readDoubleLE(at), bytes: new Uint8Array(file.subarray(at + 12, at + 12 + size)) });
    at += 12 + size;
  }
  return { messages, told: JSON.parse(readFileSync(`${path}.json`, 'utf8')) as Told };
}

/** Of the sessions that the test program was told to record; see tests/web. */
export const traces = (): Record<string, Trace> =>
  Object.fromEntries(
    ['field', 'orientations', 'lifecycle', 'other_codec', 'restarted'].map((name) => [name, readTrace(name)]),
  );

/** Of tests/support/worlds. */
export const worldNames = () => JSON.parse(readFileSync(`${folder}/worlds.json`, 'utf8')) as string[];
