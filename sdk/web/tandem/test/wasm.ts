// The modules under test: of the build that TANDEM_WASM names, or of preset ci.

import { readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';

const folder = process.env['TANDEM_WASM'] ?? fileURLToPath(new URL('../../../../build/ci/sdk/web/wasm', import.meta.url));

export const wasm = {
  plain: new Uint8Array(readFileSync(`${folder}/tandem.wasm`)),
  simd: new Uint8Array(readFileSync(`${folder}/tandem-simd.wasm`)),
};
export const VARIANTS = ['plain', 'simd'] as const;
