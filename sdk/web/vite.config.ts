import { defineConfig } from 'vitest/config';

// The library, for web apps: dist/tandem.js. The WebAssembly modules are copied beside it by the CMake build.
export default defineConfig({
  build: {
    target: 'es2022',
    lib: { entry: 'tandem/index.ts', formats: ['es'], fileName: 'tandem' },
  },
  test: { include: ['tandem/test/**/*.test.ts', 'viewer/test/**/*.test.ts'], testTimeout: 60_000 },
});
