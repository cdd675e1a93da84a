import { expect, test } from 'vitest';

import { valuesOf } from '../data';
import type { DataField } from '../types';

const FIELDS: DataField[] = [
  { name: 'health', kind: 'u8' },
  { name: 'heat', kind: 'f32' },
  { name: 'colour', kind: 'rgba' },
  { name: 'score', kind: 'i16' },
];

function records(): Uint8Array {
  const bytes = new Uint8Array(22);
  const view = new DataView(bytes.buffer);
  bytes[0] = 9;
  view.setFloat32(12, -1.5, true);
  bytes.set([1, 2, 3, 255], 5);
  view.setInt16(20, -7, true);
  return bytes;
}

test('the values of a field are a column by slot', () => {
  expect(valuesOf(records(), FIELDS, 'health')).toEqual(Uint8Array.of(9, 0));
  expect(valuesOf(records(), FIELDS, 'heat')).toEqual(Float32Array.of(0, -1.5));
  expect(valuesOf(records(), FIELDS, 'colour')).toEqual(Uint8Array.of(1, 2, 3, 255, 0, 0, 0, 0));
  expect(valuesOf(records(), FIELDS, 'score')).toEqual(Int16Array.of(0, -7));
  expect(valuesOf(records(), FIELDS, 'speed')).toBeNull();
});
