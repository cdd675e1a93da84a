import { fileURLToPath } from 'node:url';
import { defineConfig } from 'vite';

const here = (path: string) => fileURLToPath(new URL(path, import.meta.url));

// The page, with the WebAssembly modules beside it. TANDEM_WASM says where the CMake build has put them; `vite dev`
// takes its session from a gateway at TANDEM_GATEWAY.
export default defineConfig({
  root: here('.'),
  base: './',
  publicDir: process.env.TANDEM_WASM ?? here('../../../build/release/sdk/web/wasm'),
  build: { target: 'es2022', outDir: here('../dist/viewer'), emptyOutDir: true, chunkSizeWarningLimit: 1000 },
  server: { proxy: { '/login': process.env.TANDEM_GATEWAY ?? 'http://127.0.0.1:8080', '/tandem': { target: process.env.TANDEM_GATEWAY ?? 'http://127.0.0.1:8080', ws: true, changeOrigin: true } } },
});
