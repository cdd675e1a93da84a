import { readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';
import { defineConfig, type Plugin } from 'vite';

const here = (path: string) => fileURLToPath(new URL(path, import.meta.url));

/** Has the browser fetch with the page what the page's first script would ask for only when it runs. */
function preloads(): Plugin {
  return {
    name: 'preloads',
    apply: 'build',
    transformIndexHtml: {
      order: 'post',
      handler: (_html, { bundle }) => {
        const late = Object.values(bundle ?? {}).filter((file) => file.type === 'chunk' && !file.isEntry);
        return [
          // Nearly every browser has SIMD; the others fetch the other module besides.
          { tag: 'link', injectTo: 'head' as const, attrs: { rel: 'preload', as: 'fetch', crossorigin: true, href: './tandem-simd.wasm' } },
          ...late.map(({ fileName }) => ({ tag: 'link', injectTo: 'head' as const, attrs: { rel: 'modulepreload', crossorigin: true, href: `./${fileName}` } })),
        ];
      },
    },
  };
}

/** Packs what is text or code, once, for web servers that send such files (nginx: gzip_static). */
function packed(): Plugin {
  let folder = '';
  return {
    name: 'packed',
    apply: 'build',
    configResolved: ({ root, build }) => void (folder = resolve(root, build.outDir)),
    closeBundle() {
      for (const name of readdirSync(folder, { recursive: true }) as string[]) {
        if (!/\.(html|js|css|wasm)$/.test(name)) continue;
        writeFileSync(join(folder, `${name}.gz`), gzipSync(readFileSync(join(folder, name)), { level: 9 }));
      }
    },
  };
}

// The page, with the WebAssembly modules beside it. TANDEM_WASM says where the CMake build has put them; `vite dev`
// takes its session from a gateway at TANDEM_GATEWAY.
export default defineConfig({
  root: here('.'),
  base: './',
  publicDir: process.env.TANDEM_WASM ?? here('../../../build/release/sdk/web/wasm'),
  build: {
    target: 'es2022',
    outDir: here('../dist/viewer'),
    emptyOutDir: true,
    chunkSizeWarningLimit: 1000,
    modulePreload: { polyfill: false, resolveDependencies: () => [] },
  },
  plugins: [preloads(), packed()],
  server: { proxy: { '/login': process.env.TANDEM_GATEWAY ?? 'http://127.0.0.1:8080', '/tandem': { target: process.env.TANDEM_GATEWAY ?? 'http://127.0.0.1:8080', ws: true, changeOrigin: true } } },
});
