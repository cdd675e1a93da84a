export { Client } from './client';
export type { DataValues } from './data';
export * from './figures';
export * from './types';
