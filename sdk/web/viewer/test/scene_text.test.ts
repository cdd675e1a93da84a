import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { describe, expect, it } from 'vitest';
import { parseText, readScene, SceneTextError } from '../scene_text';
import { clock, marksOf, secondsOf } from '../time_line';

const scenes = process.env.TANDEM_SCENES ?? fileURLToPath(new URL('../../../../services/engines/scenes', import.meta.url));

describe('protobuf text', () => {
  it('has scalars, messages, lists, comments and repeated fields', () => {
    const message = parseText(`
      # a comment
      name: "a \\"b\\"" 'c'  # two strings are one
      number: -1.5e2, hex: 0x1F; float: 2f
      yes: true  word: RED
      list: [1, 2, 3]
      child { x: 1 } child: < x: 2 >
      empty {}`);
    expect(message.get('name')).toEqual(['a "b"c']);
    expect(message.get('number')).toEqual([-150]);
    expect(message.get('hex')).toEqual([31]);
    expect(message.get('float')).toEqual([2]);
    expect(message.get('yes')).toEqual([true]);
    expect(message.get('word')).toEqual(['RED']);
    expect(message.get('list')).toEqual([1, 2, 3]);
    expect(message.get('child')).toEqual([new Map([['x', [1]]]), new Map([['x', [2]]])]);
    expect(message.get('empty')).toEqual([new Map()]);
  });

  it.each([
    ['a { b: 1', "line 1: '}' is missing"],
    ['a: 1\n}', 'line 2: a field name is missing'],
    ['a 1', "line 1: ':' or '{' is missing"],
    ['a: inf', 'line 1: a number must be finite'],
    ['a: "b', 'line 1: a value is missing'],
    ['a: [1', 'line 1: a value is missing'],
    ['a{'.repeat(20), 'more than 16 levels'],
    ['a:1 '.repeat(100_001), 'more than 100000 fields'],
    ['#'.repeat(2 ** 20 + 1), 'more than 1048576 characters'],
  ])('is refused where it is none: %#', (text, why) => {
    expect(() => parseText(text)).toThrow(SceneTextError);
    expect(() => parseText(text)).toThrow(why);
  });

  it('of random bytes is read or refused, soon', () => {
    let seed = 1;
    const random = (below: number) => (seed = (seed * 48271) % 2147483647) % below;
    const pieces = ['planes', '{', '}', ':', ' ', '1', '"', '[', ']', '<', '>', '#', '\n', 'normal', '-', '\\', ','];
    for (let run = 0; run < 2000; ++run) {
      const text = Array.from({ length: random(60) }, () => pieces[random(pieces.length)]).join('');
      try {
        readScene(text);
      } catch (error) {
        expect(error).toBeInstanceOf(SceneTextError);
      }
    }
  });
});

describe('a scene', () => {
  it('is read from every file of services/engines/scenes', () => {
    const files = readdirSync(scenes).filter((name) => name.endsWith('.textproto') && !name.includes('trained'));
    expect(files.length).toBeGreaterThan(5);
    for (const file of files) {
      const scene = readScene(readFileSync(join(scenes, file), 'utf8'));
      expect(scene.description, file).not.toBe('');
      expect(scene.planes.length + scene.boxes.length, file).toBeGreaterThan(0);
      expect(Math.hypot(...scene.gravity), file).toBeGreaterThan(0);
    }
  });

  it('has unit normals, turns as angles, and limits by default', () => {
    const scene = readScene(`gravity { y: -2 } planes { normal { x: 3 y: 4 } } planes { normal { } }
      boxes { size { x: 1 y: 2 z: 3 } turns { axis: "z" rise: 1 run: 1 } }`);
    expect(scene.planes).toEqual([{ through: [0, 0, 0], normal: [0.6, 0.8, 0] }]);
    expect(scene.boxes).toEqual([{ centre: [0, 0, 0], size: [1, 2, 3], turns: [{ axis: 2, angle: Math.PI / 4 }] }]);
    expect(scene.maxGravity).toBe(20);
    expect(scene.maxPush).toBe(0);
  });

  it('ignores fields of a wrong type', () => {
    expect(readScene('planes: 3 gravity: "down" dt_s { }').planes).toEqual([]);
  });
});

describe('the recording of a replay', () => {
  const told = 'recording { started_unix_ms: 1700000000000 length_s: 130.5 from_s: 62 from_frame: 1900 frame_rate_hz: 30 }';

  it('is read from the scene', () => {
    expect(readScene(`dt_s: 0.02 ${told}`).recording).toEqual({
      started: 1700000000000,
      length: 130.5,
      from: 62,
      fromFrame: 1900,
      rate: 30,
      events: [],
    });
  });

  it('is not there in a live session, nor without a length', () => {
    expect(readScene('dt_s: 0.02').recording).toBeNull();
    expect(readScene('recording { from_s: 1 frame_rate_hz: 30 }').recording).toBeNull();
    expect(readScene('recording { length_s: 1 frame_rate_hz: 0 }').recording).toBeNull();
  });

  it('has events, which are marks on the time line', () => {
    const events = 'events { at_s: 13.05 text: "server: crashes" } events { at_s: 13.2 text: "again" } events { at_s: 500 text: "<b>" }';
    const recording = readScene(told.replace('}', `${events} }`)).recording!;
    expect(recording.events[0]).toEqual({ at: 13.05, text: 'server: crashes' });
    expect(marksOf(recording)).toEqual([
      { place: 0.1, at: 13.05, title: '0:13 server: crashes\n0:13 again' },
      { place: 1, at: 130.5, title: '2:10 <b>' },
    ]);
  });

  it('keeps a mark short, and the number of events bounded', () => {
    const many = Array.from({ length: 600 }, (_, i) => `events { at_s: 1 text: "e${i}" }`).join(' ');
    const recording = readScene(told.replace('}', `${many} }`)).recording!;
    expect(recording.events.length).toBe(500);
    const [mark, ...others] = marksOf(recording);
    expect(others).toEqual([]);
    expect(mark!.title.split('\n').length).toBe(13);
    expect(mark!.title).toContain('… and 488 more');
  });

  it('tells the second of a frame', () => {
    const recording = readScene(told).recording!;
    expect(secondsOf(recording, 0)).toBe(62);
    expect(secondsOf(recording, 1915)).toBe(62.5);
    expect(secondsOf(recording, 99999)).toBe(130.5);
    expect([0, 61.9, 3725].map(clock)).toEqual(['0:00', '1:01', '1:02:05']);
  });
});
