// A server, a gateway and browsers for one test or measurement; all are ended whatever happens.

import { spawn } from 'node:child_process';
import { createRequire } from 'node:module';
import { mkdirSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { setTimeout as sleep } from 'node:timers/promises';

const limitMs = 60_000; // of any one wait; a busy machine is slow
const chromiumFlags = ['--no-sandbox', '--enable-unsafe-swiftshader']; // as on a machine without a graphics card

export class Failed extends Error {}

export function check(truth, what) {
  if (!truth) throw new Failed(what);
}

/** Waits until `ready()` gives something true, and returns it. */
export async function until(ready, what) {
  for (const deadline = Date.now() + limitMs; Date.now() < deadline; await sleep(50)) {
    const value = await ready();
    if (value) return value;
  }
  throw new Failed(`waited ${limitMs / 1000} s for ${what}`);
}

export class Stage {
  #processes = new Map();
  #browser = null;

  /** Paths of `tandemd`, `gateway`, `tandem`, `site` (the built viewer), `packages` (with node_modules), `chromium`, `pictures`; `flags` for Chromium. */
  constructor(options) {
    this.options = options;
    this.violations = [];
    this.errors = [];
    this.domain = 20 + (process.pid % 70);
    // The tag keeps sessions of tests that run at the same time apart, whatever their domain.
    const loopback =
      '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>' +
      `</General><Discovery><Tag>viewer-test-${process.pid}</Tag></Discovery></Domain></CycloneDDS>`;
    this.environment = { ...process.env, CYCLONEDDS_URI: loopback };
    mkdirSync(options.pictures, { recursive: true });
  }

  #start(name, program, ...args) {
    const child = spawn(program, [...args, '--domain', String(this.domain)].map(String), {
      env: this.environment,
      stdio: ['ignore', 'pipe', 'pipe'],
    });
    const started = { child, log: '', ended: new Promise((resolve) => child.once('exit', resolve)) };
    for (const stream of [child.stdout, child.stderr]) stream.on('data', (bytes) => (started.log += bytes));
    this.#processes.set(name, started);
    return started;
  }

  server(scene, bodies, ...more) {
    this.#start('server', this.options.tandemd, '--scene', scene, '--bodies', bodies, ...more);
  }

  /** The program `tandem`; `{child, log, ended}`. */
  tool(name, command, ...more) {
    return this.#start(name, this.options.tandem, command, ...more);
  }

  /** Its address, once it listens. */
  async gateway(port = 0, ...more) {
    const { site, gateway } = this.options;
    const started = this.#start('gateway', gateway, '--port', port, '--viewer', site, ...more);
    const found = await until(() => {
      check(started.child.exitCode === null, `the gateway ended:\n${started.log}`);
      return /(https?:\/\/[^/\s]+\/)/.exec(started.log);
    }, 'the gateway to listen');
    return found[1];
  }

  async end(name, signal = 'SIGTERM') {
    const started = this.#processes.get(name);
    started.child.kill(signal);
    await started.ended;
    this.#processes.delete(name);
  }

  /** A page in a window of its own; `window` as playwright's newContext() takes it. */
  async page(window = { viewport: { width: 800, height: 600 } }) {
    const { chromium } = createRequire(join(resolve(this.options.packages), 'package.json'))('playwright-core');
    this.#browser ??= await chromium.launch({ executablePath: this.options.chromium, args: [...chromiumFlags, ...(this.options.flags ?? [])] });
    const context = await this.#browser.newContext({ ...window, ignoreHTTPSErrors: true });
    const page = await context.newPage();
    // What the gateway's Content-Security-Policy forbids is told on the console only.
    page.on('console', (message) => {
      if (message.text().includes('Content Security Policy')) this.violations.push(message.text());
    });
    page.on('pageerror', (error) => {
      console.error(`page: ${error.stack}`);
      this.errors.push(error.stack);
    });
    page.setDefaultTimeout(limitMs);
    return page;
  }

  /** From now on each of the module's next calls makes its memory grow, as any call may. */
  async growMemory(page) {
    await page.addInitScript(() => {
      const instantiate = WebAssembly.instantiate.bind(WebAssembly);
      let calls = 4000; // of 64 KiB
      WebAssembly.instantiate = async (...given) => {
        const { exports } = await instantiate(...given);
        const growing = (call) => (...values) => {
          if (calls-- > 0) exports.memory.grow(1);
          return call(...values);
        };
        const wrapped = Object.entries(exports).map(([name, it]) => [name, typeof it === 'function' ? growing(it) : it]);
        return { exports: Object.fromEntries(wrapped) };
      };
    });
  }

  picture(page, name) {
    return page.screenshot({ path: join(this.options.pictures, `${name}.png`) });
  }

  async close(failed) {
    await this.#browser?.close();
    for (const [name, { child, log }] of this.#processes) {
      child.kill('SIGKILL');
      if (failed) console.error(`--- ${name}\n${log.slice(-3000)}`);
    }
  }
}

export const status = (page) => page.evaluate(() => globalThis.tandem?.status() ?? null);

export function playing(page, frames = 1) {
  return until(async () => {
    const now = await status(page);
    return now?.phase === 'playing' && now.framesApplied >= frames && now;
  }, `${frames} frames played`);
}

/** Milliseconds from opening the page to its first picture of bodies. */
export function firstPictureMs(page) {
  const drawn = () => page.evaluate(() => performance.getEntriesByName('tandem-first-picture')[0]?.startTime);
  return until(drawn, 'the first picture');
}

export function notice(page, title) {
  return until(
    () => page.evaluate((wanted) => {
      const state = document.getElementById('state');
      return !state.hidden && state.innerText.includes(wanted) && state.innerText;
    }, title),
    `the page to say "${title}"`,
  );
}

/**
 * Bodies of one radius that nothing hides: slot, place on the page, type, distance, and the colour drawn there, in the same picture.
 */
export function visibleBodies(page, most = 200, radius = 0.5) {
  return page.evaluate(async ({ limit, radius }) => {
    const { tandem } = globalThis;
    await new Promise((resolve) => requestAnimationFrame(resolve));
    // This runs after the page has drawn, before the browser takes the picture; reading pixels may take its time.
    const sample = tandem.sample('extrapolate');
    const canvas = document.getElementById('world');
    const gl = canvas.getContext('webgl2');
    const pixels = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
    gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    const scale = gl.drawingBufferWidth / canvas.clientWidth;
    const bodies = [];
    for (let slot = 0; slot < sample.capacity; ++slot) {
      if (!sample.alive[slot]) continue;
      const centre = Array.from(sample.positions.subarray(3 * slot, 3 * slot + 3));
      bodies.push({ slot, type: sample.types[slot], centre, ...tandem.project(centre) });
    }
    bodies.sort((a, b) => a.distance - b.distance);
    // Nearer ones hide a disc of the page about each of them.
    const hidden = new Set();
    const cell = 1;
    const found = [];
    for (const body of bodies) {
      const [cx, cy] = [Math.round(body.x / cell), Math.round(body.y / cell)];
      const inside = body.x > 0 && body.y > 0 && body.x < innerWidth && body.y < innerHeight;
      if (inside && !hidden.has(`${cx} ${cy}`) && document.elementFromPoint(body.x, body.y) === canvas) {
        const at = 4 * (Math.floor((canvas.clientHeight - body.y) * scale) * gl.drawingBufferWidth + Math.floor(body.x * scale));
        found.push({ ...body, colour: Array.from(pixels.subarray(at, at + 3)) });
        if (found.length === limit) break;
      }
      const reach = Math.ceil((body.scale * radius) / cell);
      for (let dx = -reach; dx <= reach; ++dx) for (let dy = -reach; dy <= reach; ++dy) hidden.add(`${cx + dx} ${cy + dy}`);
    }
    return found;
  }, { limit: most, radius });
}
