// How the viewer does at 10,000 bodies, 800 x 600, in headless Chromium that draws in software.
//
//   node measure.mjs [--seconds S] [--bodies N] --tandemd PATH --gateway PATH --site FOLDER --packages FOLDER
//        --chromium PATH --pictures FOLDER
//
// Prints one JSON object a row: as it is, and with Chromium's CPU throttled by four, with both predictors. serverFramesPerS is
// what the server made meanwhile. Exit 0 if every frame was applied, each with the server's hash; 1 otherwise.

import { setTimeout as sleep } from 'node:timers/promises';
import { parseArgs } from 'node:util';
import { firstPictureMs, playing, Stage, status } from './stage.mjs';

const texts = ['tandemd', 'gateway', 'site', 'packages', 'chromium', 'pictures'];
const { values } = parseArgs({
  options: {
    ...Object.fromEntries(texts.map((name) => [name, { type: 'string' }])),
    seconds: { type: 'string', default: '60' },
    bodies: { type: 'string', default: '10000' },
  },
});

async function opened(stage, address) {
  const page = await stage.page();
  await page.goto(address);
  const drawn = await firstPictureMs(page);
  await page.context().close();
  return Math.round(drawn);
}

async function row(stage, address, predictor, throttle) {
  const page = await stage.page();
  if (throttle > 1) {
    const session = await page.context().newCDPSession(page);
    await session.send('Emulation.setCPUThrottlingRate', { rate: throttle });
  }
  await page.goto(address);
  await playing(page, 30);
  await page.evaluate(() => {
    globalThis.pictures = 0;
    const count = () => {
      ++globalThis.pictures;
      requestAnimationFrame(count);
    };
    requestAnimationFrame(count);
  });
  const pictures = () => page.evaluate(() => globalThis.pictures);
  const serverFrame = async () => (await (await fetch(`${address}healthz`)).json()).frame;
  const [from, fromPictures, fromServer, began] = [await status(page), await pictures(), await serverFrame(), performance.now()];
  await sleep(1000 * values.seconds);
  const [to, toPictures, toServer, ended] = [await status(page), await pictures(), await serverFrame(), performance.now()];
  const seconds = (ended - began) / 1000;
  await stage.picture(page, `measured-${predictor}-${throttle}`);
  await page.context().close();
  return {
    predictor,
    throttle,
    seconds: Number(seconds.toFixed(1)),
    fps: Number(((toPictures - fromPictures) / seconds).toFixed(1)),
    updatesPerS: Number(((to.framesApplied - from.framesApplied) / seconds).toFixed(1)),
    serverFramesPerS: Number(((toServer - fromServer) / seconds).toFixed(1)),
    lagMs: [from.lagMs, to.lagMs].map(Math.round),
    missed: to.frame - from.frame - (to.framesApplied - from.framesApplied),
    rejoins: to.resyncs - from.resyncs,
    mismatches: to.hashMismatches,
    clientMsP50: to.frameMs.p50,
    mbitPerS: Number(to.server.mbitPerS.toFixed(3)),
  };
}

const stage = new Stage(values);
let failed = false;
try {
  for (const predictor of ['field', 'ballistic']) {
    stage.server('half_pipe', values.bodies, '--predictor', predictor, '--scripted');
    const address = await stage.gateway();
    const first = [];
    for (let i = 0; i < 3; ++i) first.push(await opened(stage, address));
    console.log(JSON.stringify({ predictor, firstPictureMs: first }));
    for (const throttle of [1, 4]) {
      const measured = await row(stage, address, predictor, throttle);
      console.log(JSON.stringify(measured));
      failed ||= measured.mismatches > 0 || (throttle === 1 && measured.missed > 0);
    }
    await stage.end('gateway');
    await stage.end('server');
  }
} catch (error) {
  console.error(error.message);
  failed = true;
} finally {
  await stage.close(failed);
}
process.exitCode = failed ? 1 : 0;
