// The viewer on the files of an audience, served by nginx as deploy/http configures it, in a browser.
//
//   node audience_test.mjs SCENARIO... --tandemd PATH --tandem PATH --gateway PATH --site FOLDER --packages FOLDER --chromium PATH
//        --pictures FOLDER --nginx PATH --configuration deploy/http
//
// Exit 0 passed, 1 failed.

import { readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { parseArgs } from 'node:util';

import { check, Failed, firstPictureMs, notice, playing, Stage, status, until, visibleBodies } from './stage.mjs';
import { Web } from './web.mjs';

const timeLine = async (page) => (await status(page)).timeLine;

/** Where the state says that bodies are, something is on the screen. */
async function checkDrawn(page) {
  const bodies = await visibleBodies(page);
  const drawn = bodies.filter(({ colour }) => Math.max(...colour) > 60);
  check(bodies.length >= 30 && drawn.length >= 0.85 * bodies.length, `${drawn.length} of ${bodies.length} bodies are drawn`);
}

function checkHashes(now) {
  check(now.hashMismatches === 0 && now.resyncs === 0, `${now.hashMismatches} mismatches, ${now.resyncs} rejoins`);
  check(now.role === 'observer', 'the page takes part');
}

const scenarios = {
  /** Live behind a cache; time line; the server is restarted; the recording that is left. */
  async live(stage, web) {
    stage.server('half_pipe', 500);
    await web.origin();
    const address = await web.cache();
    const recorder = stage.tool('recorder', 'record', '--to', 'http', web.folder('live'), '--keep', 600);
    await until(async () => (await fetch(`${address}live/manifest.json`)).ok, 'the manifest');
    const page = await stage.page();
    await page.goto(`${address}viewer/?from=../live/`);
    await playing(page, 60);
    const at = await until(async () => {
      const now = await timeLine(page);
      return now.behindMs !== null && now.toS > 6 && now;
    }, 'the page to know how late it is');
    check(at.live && !at.ended, 'it is not live');
    check(at.behindMs > 500 && at.behindMs < 10_000, `it is ${at.behindMs} ms late`);
    await checkDrawn(page);
    checkHashes(await status(page));
    await stage.picture(page, 'audience-live');

    const second = await stage.page();
    await second.goto(`${address}viewer/?from=${address}live/manifest.json`);
    await playing(second, 60);

    await page.locator('#time').fill('1');
    await until(async () => !(await timeLine(page)).live && (await timeLine(page)).atS < 5, 'the past');
    await playing(page, 1);
    await stage.picture(page, 'audience-past');
    await page.locator('#goLive').click();
    await until(async () => (await timeLine(page)).live && (await timeLine(page)).toS - (await timeLine(page)).atS < 4, 'the present');

    const { epoch } = await status(page);
    await stage.end('server', 'SIGKILL');
    stage.server('cube', 300);
    await until(async () => (await status(page)).epoch > epoch && (await status(page)).phase === 'playing', 'the new epoch');
    check((await status(page)).bodies === 300, 'the bodies are those of the old server');
    check((await status(second)).hashMismatches + (await status(page)).hashMismatches === 0, 'hashes differ');

    await stage.end('recorder', 'SIGINT');
    check(recorder.child.exitCode === 0, `the recorder: ${recorder.log}`);
    await until(async () => (await timeLine(page)).ended, 'the page to see the end');
    const left = readdirSync(join(web.folder('live'), 'objects'));
    check(left.length > 10 && left.every((name) => /^[0-9a-f]{64}\.(bin|json)$/.test(name)), `what is left: ${left.slice(0, 3)}`);

    // Each object was asked for once, whoever wanted it.
    const objects = web.asked().filter(([path]) => path.startsWith('/live/objects/'));
    const twice = objects.filter(([path], i) => objects.findIndex(([other]) => other === path) !== i);
    console.log(`${objects.length} objects were asked of the origin, ${twice.length} of them again`);
    check(objects.length > 10 && twice.length === 0, `asked again: ${twice.slice(0, 3)}`);
  },

  /** What a paper links to: a folder on a plain host, on a page without TLS and not of this machine's own name. */
  async recorded(stage, web) {
    stage.server('towers', 200);
    const recorder = stage.tool('recorder', 'record', '--to', 'http', web.folder('world'), '--seconds', 4);
    await recorder.ended;
    check(recorder.child.exitCode === 0, `the recorder: ${recorder.log}`);
    const address = (await web.origin()).replace('127.0.0.1', 'audience.test');
    const page = await stage.page();
    await page.goto(`${address}viewer/?from=../world`);
    check(!(await page.evaluate(() => isSecureContext)), 'this page has what a plain one has not');
    const now = await playing(page, 30);
    checkHashes(now);
    check(now.timeLine.ended && now.timeLine.toS > 3, `its time line: ${JSON.stringify(now.timeLine)}`);
    check(!(await page.locator('#goLive').isVisible()), 'there is no present to go to');
    console.log(`first picture after ${Math.round(await firstPictureMs(page))} ms`);
    await stage.picture(page, 'audience-recorded');

    // An altered object is left out and named.
    const objects = join(web.folder('world'), 'objects');
    const manifest = JSON.parse(readFileSync(join(web.folder('world'), 'manifest.json'), 'utf8'));
    const victim = manifest.passages[0].segments[1][0];
    writeFileSync(join(objects, `${victim}.bin`), 'altered');
    const other = await stage.page(); // one that holds no copy of it
    await other.goto(`${address}viewer/?from=../world`);
    await notice(other, `objects/${victim}.bin is not what its name says`);
    await stage.picture(other, 'audience-altered');
  },
};

const paths = ['tandemd', 'tandem', 'gateway', 'site', 'packages', 'chromium', 'pictures', 'nginx', 'configuration'];
const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: Object.fromEntries(paths.map((path) => [path, { type: 'string' }])),
});
for (const name of positionals) {
  const stage = new Stage({ ...values, flags: ['--host-resolver-rules=MAP audience.test 127.0.0.1'] });
  const web = new Web({ ...values, sites: { viewer: values.site } });
  let failed = true;
  const began = Date.now();
  try {
    await scenarios[name](stage, web);
    check(stage.errors.length === 0, `an error of the page: ${stage.errors[0]}`);
    failed = false;
    console.log(`${name}: passed after ${((Date.now() - began) / 1000).toFixed(1)} s`);
  } catch (error) {
    console.error(`${name}: FAILED: ${error instanceof Failed ? error.message : error.stack}`);
    process.exitCode = 1;
  } finally {
    await stage.close(failed);
    web.close();
  }
}
