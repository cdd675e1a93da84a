// Makes the pictures of the README, sdk/web/viewer/pictures, from the viewer in headless Chromium: the page as it is, and
// the paper's five scenes at 10,000 bodies.
//
//   node pictures.mjs [NAME...] --tandemd PATH --gateway PATH --site FOLDER --packages FOLDER --chromium PATH --pictures FOLDER

import { join } from 'node:path';
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
};
const large = { viewport: { width: 1120, height: 640 } };
const small = { viewport: { width: 480, height: 400 } };

const paths = ['tandemd', 'gateway', 'site', 'packages', 'chromium', 'pictures'];
const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: Object.fromEntries(paths.map((path) => [path, { type: 'string' }])),
});

for (const name of positionals.length > 0 ? positionals : Object.keys(pictures)) {
  const { scene, frame, colour, page: whole } = pictures[name];
  const stage = new Stage(values);
  let failed = true;
  try {
    stage.server(scene, bodies, '--scripted');
    const page = await stage.page(whole ? large : small);
    await page.goto(`${await stage.gateway()}${whole ? '' : '?bare'}`);
    await until(() => page.evaluate(() => Boolean(globalThis.tandem)), 'the page to start');
    await page.evaluate((value) => document.querySelector(`#colours input[value="${value}"]`).click(), colour);
    await until(async () => (await status(page)).frame >= frame, `frame ${frame}`);
    await page.screenshot({ path: join(values.pictures, `${name}.jpg`), type: 'jpeg', quality: whole ? 82 : 76 });
    failed = false;
  } catch (error) {
    console.error(`${name}: ${error.message}`);
    process.exitCode = 1;
  } finally {
    await stage.close(failed);
  }
}
