// The first picture of a session from files, from a cold cache on a link of 10 Mbit/s and 50 ms, and how late a live session is shown.
//
//   node first_picture.mjs URL --packages FOLDER_WITH_node_modules [--runs N] [--live SECONDS]
//
// URL: of the viewer, with ?from=. The link is that of Chromium (Network.emulateNetworkConditions: 50 ms to the first byte of each answer).
// Prints one line of JSON: milliseconds from opening the page; and the delay by this machine's clock, which the server must share.

import { createRequire } from 'node:module';
import { join } from 'node:path';
import { setTimeout as sleep } from 'node:timers/promises';
import { parseArgs } from 'node:util';

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    packages: { type: 'string' },
    runs: { type: 'string', default: '5' },
    live: { type: 'string', default: '0' },
    chromium: { type: 'string', default: '/usr/bin/chromium' },
  },
});
const { chromium } = createRequire(join(values.packages, 'package.json'))('playwright-core');
const median = (list) => [...list].sort((a, b) => a - b)[list.length >> 1];
const browser = await chromium.launch({
  executablePath: values.chromium,
  args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});

async function open(slow) {
  const page = await (await browser.newContext({ viewport: { width: 800, height: 600 } })).newPage();
  const link = await page.context().newCDPSession(page);
  await link.send('Network.enable');
  if (slow) await link.send('Network.emulateNetworkConditions', { offline: false, latency: 50, downloadThroughput: 10e6 / 8, uploadThroughput: 10e6 / 8 });
  await page.goto(positionals[0]);
  return page;
}

const firstMs = [];
for (let run = 0; run < Number(values.runs); ++run) {
  const page = await open(true);
  const drawn = () => page.evaluate(() => performance.getEntriesByName('tandem-first-picture')[0]?.startTime);
  let at;
  while ((at = await drawn()) === undefined) await sleep(20);
  firstMs.push(Math.round(at));
  await page.context().close();
}
const lateMs = [];
if (Number(values.live) > 0) {
  const page = await open(false);
  await sleep(10_000);
  for (const end = Date.now() + 1000 * Number(values.live); Date.now() < end; await sleep(250)) {
    const { timeLine } = await page.evaluate(() => globalThis.tandem.status());
    if (timeLine?.behindMs != null) lateMs.push(Math.round(timeLine.behindMs));
  }
}
console.log(JSON.stringify({ first_picture_ms: { median: median(firstMs), all: firstMs }, late_ms: lateMs.length ? { median: median(lateMs), most: Math.max(...lateMs) } : null }));
await browser.close();
