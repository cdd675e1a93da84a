export { Client } from './client';
export * from './figures';
export * from './types';
