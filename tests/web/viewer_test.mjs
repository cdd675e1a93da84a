// The viewer in a browser, beside a real gateway and a real server.
//
//   node viewer_test.mjs SCENARIO... --tandemd PATH --gateway PATH --site FOLDER --packages FOLDER --chromium PATH
//        --pictures FOLDER
//
// Exit 0 passed, 1 failed.

import { parseArgs } from 'node:util';
import { check, Failed, firstPictureMs, notice, playing, Stage, status, until, visibleBodies } from './stage.mjs';

const phone = { viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2 };
/** Of half_pipe's types. */
const typeColours = [[0xd1, 0x49, 0x5b], [0x00, 0x79, 0x8c], [0xed, 0xae, 0x49]];

/** The type whose colour has about the proportions of this one. */
function nearestType(colour) {
  const unit = (rgb) => rgb.map((c) => c / Math.hypot(...rgb, 1e-9));
  const distance = (a, b) => Math.hypot(...unit(a).map((c, i) => c - unit(b)[i]));
  const distances = typeColours.map((known) => distance(colour, known));
  return distances.indexOf(Math.min(...distances));
}

/**
 * Where the state says that a body is, its colour is on the screen. Not all: they fall on between the sample and the picture, so a busy machine
 * may need another look. By chance it would be a third.
 */
async function checkPixels(page) {
  for (let look = 1; ; ++look) {
    const bodies = await visibleBodies(page);
    const right = bodies.filter(({ type, colour }) => nearestType(colour) === type);
    console.log(`${right.length} of ${bodies.length} visible bodies have their colour where they are`);
    check(bodies.length >= 50, `only ${bodies.length} bodies are visible`);
    if (right.length >= 0.85 * bodies.length) return;
    check(look < 5, 'bodies are not drawn where the state says');
  }
}

const meanOf = (page, axis) =>
  page.evaluate((a) => {
    const { positions, alive, capacity } = globalThis.tandem.sample();
    let sum = 0;
    let count = 0;
    for (let slot = 0; slot < capacity; ++slot) {
      if (!alive[slot]) continue;
      sum += positions[3 * slot + a];
      ++count;
    }
    return sum / count;
  }, axis);

const acted = (page, count) => until(async () => (await status(page)).inputsActed >= count, `${count} inputs to act`);

/** Drags the dial to its right rim; the bodies follow to the right of the screen, about along x. */
async function dragGravity(page) {
  const before = { x: await meanOf(page, 0), inputs: (await status(page)).inputsActed };
  const dial = await page.locator('#dial').boundingBox();
  await page.mouse.move(dial.x + dial.width / 2, dial.y + dial.height * 0.9);
  await page.mouse.down();
  await page.mouse.move(dial.x + dial.width * 0.9, dial.y + dial.height / 2, { steps: 4 });
  await page.mouse.up();
  await acted(page, before.inputs + 1);
  await until(async () => (await meanOf(page, 0)) > before.x + 1, 'the bodies to follow gravity');
}

/** Pushes a body that is seen, away from the viewer; it goes further than others. */
async function pushBody(page, tap) {
  const before = (await status(page)).inputsActed;
  for (let attempt = 0; ; ++attempt) {
    const [body] = (await visibleBodies(page)).slice(3 * attempt);
    check(body && attempt < 10, 'no push met a body');
    await tap(body.x, body.y);
    const said = await page.evaluate(() => document.getElementById('toast').textContent);
    if ((await status(page)).inputsSent > before || said.includes('push')) break;
  }
  await acted(page, before + 1);
  await until(
    () => page.evaluate(() => /^push of .* acted in frame/.test(document.getElementById('toast').textContent)),
    'the page to say that the push acted',
  );
}

/** Without corrections bodies are drawn elsewhere, while the agreed state goes on; with them they come back. */
async function switchCorrections(page, stage) {
  await page.locator('#corrections').click();
  const off = await until(async () => {
    const now = await status(page);
    return now.uncorrected?.frames > 30 && now.uncorrected.meanDrift > 0 && now;
  }, 'bodies to drift');
  console.log(`without corrections bodies drifted by ${off.uncorrected.meanDrift.toFixed(3)} m in ${off.uncorrected.frames} frames`);
  await until(() => page.evaluate(() => /on average/.test(document.getElementById('drift').innerText)), 'the page to say how far');
  await stage.picture(page, 'uncorrected');
  await page.locator('#corrections').click();
  const on = await status(page);
  check(on.uncorrected === null && on.hashMismatches === 0 && on.resyncs === off.resyncs, 'corrections are not back');
  await checkPixels(page);
}

async function checkHealth(page) {
  const now = await status(page);
  check(now.hashMismatches === 0, `${now.hashMismatches} hash mismatches`);
  check(now.frame > 0 && now.framesApplied > 0, 'no frames were applied');
  const drawn = await firstPictureMs(page);
  console.log(`first picture after ${Math.round(drawn)} ms, ${now.framesApplied} frames applied, ${now.drawing.framesPerSecond.toFixed(0)} fps`);
}

const scenarios = {
  async smoke(stage) {
    stage.server('half_pipe', 1000);
    const address = await stage.gateway();
    const page = await stage.page();
    await stage.growMemory(page);
    await page.goto(address);
    await playing(page, 30);
    await checkPixels(page);
    await pushBody(page, (x, y) => page.mouse.click(x, y));
    await dragGravity(page);
    await switchCorrections(page, stage);
    await checkHealth(page);
    await stage.picture(page, 'smoke');
  },

  async phone(stage) {
    stage.server('half_pipe', 1000);
    const page = await stage.page(phone);
    await page.goto(await stage.gateway());
    await playing(page, 30);
    const width = await page.evaluate(() => document.documentElement.scrollWidth);
    check(width <= phone.viewport.width, `the page is ${width} pixels wide`);
    const outside = await page.evaluate(() => {
      const long = `a_name_of_${'x'.repeat(54)} drawn with less detail than this device can show, as it has too little time`;
      document.getElementById('leftOut').hidden = false;
      for (const it of document.querySelectorAll('#leftOut, #legend span, #toast')) it.append(long);
      return [...document.querySelectorAll('body *')]
        .filter((it) => it.getBoundingClientRect().right > innerWidth + 0.5)
        .map((it) => `${it.tagName} ${it.id}`);
    });
    check(outside.length === 0, `beyond the edge of the screen: ${outside}`);
    await checkPixels(page);
    await pushBody(page, (x, y) => page.touchscreen.tap(x, y));
    await stage.picture(page, 'phone');
    await page.locator('#more').tap();
    check(await page.locator('#hashHex').isVisible(), 'the figures do not open');
    await stage.picture(page, 'phone-figures');
    await checkHealth(page);
  },

  async gatewayRestart(stage) {
    stage.server('half_pipe', 1000);
    const address = await stage.gateway();
    const page = await stage.page();
    await page.goto(address);
    const before = await playing(page, 30);
    await stage.end('gateway', 'SIGKILL');
    await notice(page, 'Connection lost');
    await stage.picture(page, 'gateway-lost');
    await stage.gateway(new URL(address).port);
    await until(async () => (await status(page)).frame > before.frame + 60, 'frames after the gateway came back');
    check((await status(page)).epoch === before.epoch, 'the epoch changed');
    await checkHealth(page);
  },

  async serverRestart(stage) {
    stage.server('half_pipe', 1000);
    const page = await stage.page();
    await page.goto(await stage.gateway());
    const before = await playing(page, 30);
    await stage.end('server', 'SIGKILL');
    await notice(page, 'The server is gone');
    await stage.picture(page, 'server-lost');
    stage.server('cube', 500);
    await until(async () => {
      const now = await status(page);
      return now.phase === 'playing' && now.epoch > before.epoch && now.frame > 30;
    }, 'frames of the new run');
    check((await status(page)).bodies === 500, 'the bodies are those of the old run');
    await until(() => page.evaluate(() => document.getElementById('scene').textContent === 'cube'), "the new scene's name");
    await stage.picture(page, 'server-restarted');
    await checkHealth(page);
  },

  async refusals(stage) {
    const { writeFileSync } = await import('node:fs');
    const tokenFile = `${stage.options.pictures}/token`;
    writeFileSync(tokenFile, 'a-token-of-this-test\n');
    const address = await stage.gateway(0, '--token-file', tokenFile);
    const page = await stage.page();
    await page.goto(address);
    const said = await notice(page, 'Refused');
    check(said.includes('token'), `a missing token is called "${said}"`);
    await stage.picture(page, 'refused');
    await page.goto(`${address}?observe#token=of-another-key`);
    await notice(page, 'token missing or wrong');
    await page.goto(`${address}#token=a-token-of-this-test`);
    await page.reload();
    check(!page.url().includes('token'), `the token stays in the address: ${page.url()}`);
    await notice(page, 'Waiting for the server');
    await stage.picture(page, 'searching');
    stage.server('mixed', 200);
    await playing(page, 30);
    check((await page.evaluate(() => document.cookie)) === '', 'a script reads the token');
    await stage.picture(page, 'mixed');
    await page.addInitScript(() => delete globalThis.WebAssembly);
    await page.reload();
    await notice(page, 'no WebAssembly');
    await stage.picture(page, 'no-webassembly');
  },
};

const paths = ['tandemd', 'gateway', 'site', 'packages', 'chromium', 'pictures'];
const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: Object.fromEntries(paths.map((path) => [path, { type: 'string' }])),
});
for (const name of positionals) {
  const stage = new Stage(values);
  let failed = true;
  const began = Date.now();
  try {
    await scenarios[name](stage);
    check(stage.violations.length === 0, `the page breaks the policy: ${stage.violations[0]}`);
    check(stage.errors.length === 0, `an error of the page: ${stage.errors[0]}`);
    failed = false;
    console.log(`${name}: passed after ${((Date.now() - began) / 1000).toFixed(1)} s`);
  } catch (error) {
    console.error(`${name}: FAILED: ${error instanceof Failed ? error.message : error.stack}`);
    process.exitCode = 1;
  } finally {
    await stage.close(failed);
  }
}
