// The first picture of a live session from files, from a cold cache on a link of 10 Mbit/s and 50 ms, and how late it is shown.
//
//   node first_picture.mjs --site FOLDER [--site FOLDER ...] --tandemd PATH --tandem PATH --packages FOLDER_WITH_node_modules [--bodies N]
//        [--runs N] [--live SECONDS] [--waterfall] [--chromium PATH] [--nginx PATH]
//
// Starts a server of half_pipe, its recorder and nginx as origin and cache (deploy/http), on ports and a domain of their own. --site: a viewer
// that was built (deploy/build-viewer); of several, each is opened in turns. The link is that of Chromium (Network.emulateNetworkConditions:
// 50 ms to the first byte of each answer). Prints a line of JSON for each site: milliseconds from opening the page to its first picture of
// bodies, drawn; with --waterfall the steps of the median run; with --live the delay by this machine's clock.

import { fileURLToPath } from 'node:url';
import { setTimeout as sleep } from 'node:timers/promises';
import { parseArgs } from 'node:util';
import { firstPictureMs, Stage, until } from '../../web/stage.mjs';
import { Web } from '../../web/web.mjs';

const { values } = parseArgs({
  options: {
    site: { type: 'string', multiple: true },
    tandemd: { type: 'string' },
    tandem: { type: 'string' },
    packages: { type: 'string' },
    bodies: { type: 'string', default: '10000' },
    runs: { type: 'string', default: '7' },
    live: { type: 'string', default: '0' },
    waterfall: { type: 'boolean', default: false },
    chromium: { type: 'string', default: '/usr/bin/chromium' },
    nginx: { type: 'string', default: '/usr/sbin/nginx' },
    pictures: { type: 'string', default: '/tmp/first_picture' },
    domain: { type: 'string' },
  },
});
const sites = Object.fromEntries(values.site.map((path, i) => [`viewer${i}`, path]));
const middle = (list, of = (each) => each) => [...list].sort((a, b) => of(a) - of(b))[list.length >> 1];

/** What the page did until its first picture, in milliseconds. */
function stepsOf(page) {
  return page.evaluate(() => {
    const ms = Math.round;
    const files = [...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')];
    const name = ({ name }) => new URL(name).pathname.split('/').slice(-2).join('/').replace(/([0-9a-f]{8})[0-9a-f]{56}/, '$1');
    return {
      files: files.map((file) => `${name(file)} ${ms(file.startTime)}-${ms(file.responseStart)}-${ms(file.responseEnd)} ${file.encodedBodySize}`),
      marks: performance.getEntriesByType('mark').map((mark) => `${mark.name.replace('tandem-', '')} ${ms(mark.startTime)}`),
    };
  });
}

async function open(stage, address, slow) {
  const page = await stage.page();
  if (slow) {
    const link = await page.context().newCDPSession(page);
    await link.send('Network.enable');
    await link.send('Network.emulateNetworkConditions', { offline: false, latency: 50, downloadThroughput: 10e6 / 8, uploadThroughput: 10e6 / 8 });
  }
  await page.goto(address);
  return page;
}

/** Milliseconds by which a page is behind the server, seen four times a second. */
async function lateness(stage, address, seconds) {
  const page = await open(stage, address, false);
  const seen = [];
  await sleep(10_000);
  for (const end = Date.now() + 1000 * seconds; Date.now() < end; await sleep(250)) {
    const { timeLine } = await page.evaluate(() => globalThis.tandem.status());
    if (timeLine?.behindMs != null) seen.push(Math.round(timeLine.behindMs));
  }
  await page.context().close();
  return { median: middle(seen), most: Math.max(...seen) };
}

const stage = new Stage(values);
if (values.domain) stage.domain = Number(values.domain);
const web = new Web({ nginx: values.nginx, configuration: fileURLToPath(new URL('../../../deploy/http', import.meta.url)), sites });
let failed = true;
try {
  stage.server('half_pipe', values.bodies);
  await web.origin();
  const cache = await web.cache();
  stage.tool('recorder', 'record', '--to', 'http', web.folder('live'), '--keep', 120);
  await until(async () => (await fetch(`${cache}live/manifest.json`)).ok, 'the manifest');
  await sleep(12_000); // a second snapshot
  const runs = Object.fromEntries(Object.keys(sites).map((name) => [name, []]));
  for (let run = 0; run < Number(values.runs); ++run) {
    for (const name of Object.keys(sites)) {
      const page = await open(stage, `${cache}${name}/?from=../live/`, true);
      runs[name].push({ ms: Math.round(await firstPictureMs(page)), steps: await stepsOf(page) });
      await page.context().close();
    }
  }
  for (const [name, all] of Object.entries(runs)) {
    const median = middle(all, ({ ms }) => ms);
    const told = { site: sites[name], first_picture_ms: { median: median.ms, all: all.map(({ ms }) => ms) } };
    if (values.waterfall) told.steps = median.steps;
    if (Number(values.live) > 0) told.late_ms = await lateness(stage, `${cache}${name}/?from=../live/`, Number(values.live));
    console.log(JSON.stringify(told, null, values.waterfall ? 1 : 0));
  }
  failed = false;
} catch (error) {
  console.error(error.message);
  process.exitCode = 1;
} finally {
  await stage.close(failed);
  web.close();
}
