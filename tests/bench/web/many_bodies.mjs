// How fast the viewer draws very many bodies in headless Chromium that draws in software, from files, so that no server runs beside it.
//
//   node many_bodies.mjs --site FOLDER --tandemd PATH --tandem PATH --packages FOLDER_WITH_node_modules [--scene NAME] [--bodies N] [--record SECONDS]
//        [--seconds S] [--predictor NAME] [--pictures FOLDER] [--chromium PATH] [--nginx PATH] [--domain N]
//
// Records a scene (half_pipe) for a while and has nginx serve that (deploy/http). Prints one line of JSON: pictures a second; milliseconds that the page
// needs to draw one (the fastest tenth, which others on the machine hardly interrupt, and the median); the processor's time for a picture in the page's process, which decodes too, and in the one of its graphics, which
// does not depend on what else the machine does; frames of the session a second; what the page says that it leaves out. A picture of the page
// stays in --pictures.

import { readdirSync, readFileSync } from 'node:fs';
import { setTimeout as sleep } from 'node:timers/promises';
import { parseArgs } from 'node:util';
import { fileURLToPath } from 'node:url';
import { firstPictureMs, playing, Stage, status } from '../../web/stage.mjs';
import { Web } from '../../web/web.mjs';

const { values } = parseArgs({
  options: {
    site: { type: 'string' },
    tandemd: { type: 'string' },
    tandem: { type: 'string' },
    packages: { type: 'string' },
    scene: { type: 'string', default: 'half_pipe' },
    bodies: { type: 'string', default: '100000' },
    record: { type: 'string', default: '30' },
    seconds: { type: 'string', default: '15' },
    predictor: { type: 'string', default: 'ballistic' },
    pictures: { type: 'string', default: '/tmp/many_bodies' },
    chromium: { type: 'string', default: '/usr/bin/chromium' },
    nginx: { type: 'string', default: '/usr/sbin/nginx' },
    domain: { type: 'string' },
  },
});

/** Milliseconds of processor time of Chromium's processes of a kind that `stage` started. */
function processorMs(kind) {
  let ticks = 0;
  for (const id of readdirSync('/proc').filter((name) => /^\d+$/.test(name))) {
    try {
      if (!readFileSync(`/proc/${id}/cmdline`, 'utf8').includes(`--type=${kind}`)) continue;
      const fields = readFileSync(`/proc/${id}/stat`, 'utf8').replace(/.*\)/, '').split(' ');
      ticks += Number(fields[12]) + Number(fields[13]);
    } catch {
      // it has just ended
    }
  }
  return 10 * ticks;
}

const stage = new Stage(values);
if (values.domain) stage.domain = Number(values.domain);
const web = new Web({ nginx: values.nginx, configuration: fileURLToPath(new URL('../../../deploy/http', import.meta.url)), sites: { viewer: values.site } });
let failed = true;
try {
  stage.server(values.scene, values.bodies, '--predictor', values.predictor);
  const recorder = stage.tool('recorder', 'record', '--to', 'http', web.folder('world'), '--seconds', values.record);
  await recorder.ended;
  await stage.end('server');
  const page = await stage.page();
  await page.addInitScript(() => {
    globalThis.drawMs = [];
    const next = globalThis.requestAnimationFrame;
    globalThis.requestAnimationFrame = (draw) =>
      next((now) => {
        const began = performance.now();
        draw(now);
        globalThis.drawMs.push(performance.now() - began);
      });
  });
  await page.goto(`${await web.origin()}viewer/?from=../world`);
  const first = await firstPictureMs(page);
  await playing(page, 30);
  await sleep(4000); // until the detail is found
  const look = async () => ({ at: performance.now(), now: await status(page), page: processorMs('renderer'), graphics: processorMs('gpu-process') });
  const from = await look();
  await page.evaluate(() => void globalThis.drawMs.splice(0));
  await sleep(1000 * Number(values.seconds));
  const draws = await page.evaluate(() => globalThis.drawMs);
  const to = await look();
  await stage.picture(page, `bodies-${values.bodies}`);
  const seconds = (to.at - from.at) / 1000;
  const pictures = draws.length;
  draws.sort((a, b) => a - b);
  const one = (value) => Number(value.toFixed(1));
  console.log(
    JSON.stringify({
      bodies: to.now.bodies,
      seconds: one(seconds),
      picturesPerS: one(pictures / seconds),
      drawMs: { p10: one(draws[Math.floor(draws.length / 10)]), p50: one(draws[draws.length >> 1]) },
      pageMsAPicture: one((to.page - from.page) / pictures),
      graphicsMsAPicture: one((to.graphics - from.graphics) / pictures),
      framesPerS: one((to.now.framesApplied - from.now.framesApplied) / seconds),
      clientMsAFrameP50: to.now.frameMs.p50,
      mismatches: to.now.hashMismatches,
      firstPictureMs: Math.round(first),
      leftOut: to.now.drawing.leftOut,
    }),
  );
  failed = false;
} catch (error) {
  console.error(error.message);
  process.exitCode = 1;
} finally {
  await stage.close(failed);
  web.close();
}
