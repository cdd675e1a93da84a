// Makes the pictures of the README, sdk/web/viewer/pictures, from the viewer in headless Chromium: the page as it is, the
// paper's five scenes at 10,000 bodies, and an animation (animate.py: Debian's python3-pil).
//
//   node pictures.mjs [NAME...] --tandemd PATH --gateway PATH --site FOLDER --packages FOLDER --chromium PATH --pictures FOLDER

import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';
import { Stage, status, until } from './stage.mjs';

const bodies = 10_000;
/** Scene, frame, colours; where `page` is set, with all that the page shows. */
const pictures = {
  viewer: { scene: 'half_pipe', frame: 330, colour: 'type', page: true },
  half_pipe: { scene: 'half_pipe', frame: 110, colour: 'type' },
  cube: { scene: 'cube', frame: 170, colour: 'speed' },
  four_cubes: { scene: 'four_cubes', frame: 150, colour: 'type' },
  half_pipe_2: { scene: 'half_pipe_2', frame: 240, colour: 'age' },
  half_pipe_3: { scene: 'half_pipe_3', frame: 240, colour: 'corrected' },
  // A picture every third frame of a server that takes its time, so that none is missed, shown as fast as it would be.
  animation: { scene: 'half_pipe', frame: 60, colour: 'type', until: 300, every: 3, rate: 3 },
};
const large = { viewport: { width: 1120, height: 640 } };
const small = { viewport: { width: 480, height: 400 } };
const mostAnimationBytes = 600_000;
const sceneHz = 30;

const paths = ['tandemd', 'gateway', 'site', 'packages', 'chromium', 'pictures'];
const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: Object.fromEntries(paths.map((path) => [path, { type: 'string' }])),
});

const reached = (page, frame) => until(async () => (await status(page)).frame >= frame, `frame ${frame}`);

async function takeMany(page, { frame, until: last, every }, folder) {
  for (let at = frame; at <= last; at += every) {
    await reached(page, at);
    const { frame: shown } = await status(page); // not `at` where the machine is slow
    await page.screenshot({ path: join(folder, `${shown}.png`) });
    at = Math.max(at, shown);
  }
}

function animate(name, folder) {
  const script = fileURLToPath(new URL('animate.py', import.meta.url));
  const out = join(values.pictures, `${name}.webp`);
  execFileSync(script, [folder, out, sceneHz, mostAnimationBytes], { stdio: 'inherit' });
}

for (const name of positionals.length > 0 ? positionals : Object.keys(pictures)) {
  const picture = pictures[name];
  const { scene, frame, colour, page: whole, rate } = picture;
  const stage = new Stage(values);
  const folder = mkdtempSync(join(tmpdir(), 'tandem-pictures-'));
  let failed = true;
  try {
    stage.server(scene, bodies, '--scripted', ...(rate ? ['--rate', rate] : []));
    const page = await stage.page(whole ? large : small);
    await page.goto(`${await stage.gateway()}${whole ? '' : '?bare'}`);
    await until(() => page.evaluate(() => Boolean(globalThis.tandem)), 'the page to start');
    await page.evaluate((value) => document.querySelector(`#colours input[value="${value}"]`).click(), colour);
    await reached(page, frame);
    if (picture.every) await takeMany(page, picture, folder);
    else await page.screenshot({ path: join(values.pictures, `${name}.jpg`), type: 'jpeg', quality: whole ? 82 : 76 });
    failed = false;
  } catch (error) {
    console.error(`${name}: ${error.message}`);
    process.exitCode = 1;
  } finally {
    await stage.close(failed);
    if (picture.every && !failed) animate(name, folder);
    rmSync(folder, { recursive: true });
  }
}
