import { describe, expect, it } from 'vitest';
import { readScene, SceneError } from '../scene';
import { clock, marksOf, secondsOf } from '../time_line';

describe('a scene', () => {
  it('has unit normals, turns as angles, and limits by default', () => {
    const scene = readScene(`{"description": "a \\u0022b\\ud83d\\ude00", "gravity": {"y": -2}, "bounds": {"high": {"x": 3}},
      "planes": [{"normal": {"x": 3, "y": 4}}, {"normal": {}}], "spheres": [{"centre": {"z": 1}, "radiusM": 2.5}],
      "boxes": [{"size": {"x": 1, "y": 2, "z": 3}, "turns": [{"axis": "z", "rise": 1, "run": 1}]}]}`);
    expect(scene.description).toBe('a "b\u{1f600}');
    expect(scene.bounds).toEqual({ low: [0, 0, 0], high: [3, 0, 0] });
    expect(scene.planes).toEqual([{ through: [0, 0, 0], normal: [0.6, 0.8, 0] }]);
    expect(scene.boxes).toEqual([{ centre: [0, 0, 0], size: [1, 2, 3], turns: [{ axis: 2, angle: Math.PI / 4 }] }]);
    expect(scene.spheres).toEqual([{ centre: [0, 0, 1], radius: 2.5 }]);
    expect(scene.maxGravity).toBe(20);
    expect(scene.maxPush).toBe(0);
  });

  it('is empty without a text', () => {
    expect(readScene('')).toEqual(readScene('{}'));
    expect(readScene('').bounds).toBeNull();
  });

  it('ignores values of a wrong type, unknown members, and numbers that are not finite', () => {
    const scene = readScene(`{"planes": 3, "boxes": [1, null, [], {"turns": {}, "size": [1, 2]}], "spheres": {"radiusM": 1},
      "gravity": "down", "dtS": {}, "maxPush": "7", "maxGravity": 1e999, "description": 5, "bounds": [],
      "later": {"x": [1]}, "__proto__": {"maxPush": 9}, "constructor": 1, "recording": [1]}`);
    expect(scene).toEqual({ ...readScene(''), boxes: [{ centre: [0, 0, 0], size: [0, 0, 0], turns: [] }] });
    for (const other of ['null', '3', '[]', '"x"']) expect(readScene(other)).toEqual(readScene(''));
  });

  it.each([
    ['gravity { y: 1 }', 'JSON'],
    ['{"a": 1', 'JSON'],
    ['{"maxPush": NaN}', 'JSON'],
    [' '.repeat(2 ** 20 + 1), 'more than 1048576 characters'],
    [`{"spheres": [${'{},'.repeat(4096)}{}]}`, 'more than 4096 spheres'],
    [`{"boxes": [{"turns": [${'{},'.repeat(4096)}{}]}]}`, 'more than 4096 turns'],
  ])('is refused where it is none: %#', (text, why) => {
    expect(() => readScene(text)).toThrow(SceneError);
    expect(() => readScene(text)).toThrow(why);
  });

  it('that is deep is read or refused, soon', () => {
    for (const text of ['['.repeat(2 ** 20), `{"later": ${'['.repeat(2 ** 19 - 20)}${']'.repeat(2 ** 19 - 20)}}`]) {
      try {
        expect(readScene(text)).toEqual(readScene(''));
      } catch (error) {
        expect(error).toBeInstanceOf(SceneError);
      }
    }
  });

  it('of random bytes is read or refused, soon', () => {
    let seed = 1;
    const random = (below: number) => (seed = (seed * 48271) % 2147483647) % below;
    const pieces = ['"planes":', '{', '}', ':', ' ', '1', '"', '[', ']', '"recording":', '\n', '"normal":', '-', '\\', ',', 'null'];
    for (let run = 0; run < 2000; ++run) {
      const text = '{"planes":[' + Array.from({ length: random(9) }, () => pieces[random(pieces.length)]).join('') + ']}';
      try {
        readScene(text);
      } catch (error) {
        expect(error).toBeInstanceOf(SceneError);
      }
    }
  });
});

describe('the recording of a replay', () => {
  const told = { startedUnixMs: '1700000000000', lengthS: 130.5, fromS: 62, fromFrame: '1900', frameRateHz: 30 };
  const read = (recording: object) => readScene(JSON.stringify({ dtS: 0.02, recording })).recording;

  it('is read from the scene', () => {
    expect(read(told)).toEqual({
      started: 1700000000000,
      length: 130.5,
      from: 62,
      fromFrame: 1900,
      rate: 30,
      events: [],
    });
  });

  it('has whole numbers as strings, and nothing else in them', () => {
    expect(read({ ...told, fromFrame: 7, startedUnixMs: '1e3' })).toMatchObject({ fromFrame: 7, started: 0 });
    expect(read({ ...told, fromFrame: '-1', startedUnixMs: ' 5' })).toMatchObject({ fromFrame: 0, started: 0 });
  });

  it('is not there in a live session, nor without a length', () => {
    expect(readScene('{"dtS": 0.02}').recording).toBeNull();
    expect(read({ fromS: 1, frameRateHz: 30 })).toBeNull();
    expect(read({ lengthS: 1, frameRateHz: 0 })).toBeNull();
  });

  it('has events, which are marks on the time line', () => {
    const events = [
      { atS: 13.05, text: 'server: crashes' },
      { atS: 13.2, text: 'again' },
      { atS: 500, text: '<b>' },
    ];
    const recording = read({ ...told, events })!;
    expect(recording.events[0]).toEqual({ at: 13.05, text: 'server: crashes' });
    expect(marksOf(recording)).toEqual([
      { place: 0.1, at: 13.05, title: '0:13 server: crashes\n0:13 again' },
      { place: 1, at: 130.5, title: '2:10 <b>' },
    ]);
  });

  it('keeps a mark short, and the number of events bounded', () => {
    const events = Array.from({ length: 600 }, (_, i) => ({ atS: 1, text: `e${i}` }));
    const recording = read({ ...told, events })!;
    expect(recording.events.length).toBe(500);
    const [mark, ...others] = marksOf(recording);
    expect(others).toEqual([]);
    expect(mark!.title.split('\n').length).toBe(13);
    expect(mark!.title).toContain('… and 488 more');
  });

  it('tells the second of a frame', () => {
    const recording = read(told)!;
    expect(secondsOf(recording, 0)).toBe(62);
    expect(secondsOf(recording, 1915)).toBe(62.5);
    expect(secondsOf(recording, 99999)).toBe(130.5);
    expect([0, 61.9, 3725].map(clock)).toEqual(['0:00', '1:01', '1:02:05']);
  });
});
