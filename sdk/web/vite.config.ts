import { copyFileSync } from 'node:fs';

import { defineConfig } from 'vitest/config';

/** The folder in which the CMake build puts the WebAssembly modules. */
const wasm = process.env['TANDEM_WASM'] ?? '../../build/ci/sdk/web/wasm';

// The library, for web apps: dist/tandem.js and, beside it, the modules.
export default defineConfig({
  build: {
    target: 'es2022',
    lib: { entry: 'tandem/index.ts', formats: ['es'], fileName: 'tandem' },
  },
  plugins: [
    {
      name: 'copy-wasm',
      apply: 'build',
      closeBundle() {
        for (const name of ['tandem.wasm', 'tandem-simd.wasm']) copyFileSync(`${wasm}/${name}`, `dist/${name}`);
      },
    },
  ],
  test: { include: ['tandem/test/**/*.test.ts', 'viewer/test/**/*.test.ts'], testTimeout: 60_000 },
});
