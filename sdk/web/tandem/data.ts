// Data of bodies: a column of the records that the server gives all bodies.

import type { DataField } from './types';

export type DataValues =
  | Uint8Array | Int8Array | Uint16Array | Int16Array | Uint32Array | Int32Array | Float32Array;

const COLUMNS = {
  u8: Uint8Array, i8: Int8Array, u16: Uint16Array, i16: Int16Array, u32: Uint32Array, i32: Int32Array, f32: Float32Array,
  rgba: Uint8Array,
} as const;

const bytesOf = (kind: DataField['kind']): number => (kind === 'rgba' ? 4 : COLUMNS[kind].BYTES_PER_ELEMENT);

/** The values of a field, by slot; null if there is no such field. */
export function valuesOf(records: Uint8Array, fields: readonly DataField[], name: string): DataValues | null {
  let record = 0;
  let at = -1;
  let field: DataField | undefined;
  for (const each of fields) {
    if (each.name === name) [at, field] = [record, each];
    record += bytesOf(each.kind);
  }
  if (field === undefined) return null;
  const size = bytesOf(field.kind);
  const slots = records.length / record;
  const column = new Uint8Array(slots * size);
  for (let slot = 0; slot < slots; ++slot) column.set(records.subarray(slot * record + at, slot * record + at + size), slot * size);
  return new COLUMNS[field.kind](column.buffer);
}
