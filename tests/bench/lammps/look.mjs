// Two pages look at a gateway, one as large as on a desk and one as on a phone; both stay until the end, and each leaves a picture.
//
//   node look.mjs URL --packages FOLDER --pictures FOLDER [--chromium PATH] [--frames 20]

import { parseArgs } from 'node:util';
import { Stage, playing } from '../../web/stage.mjs';

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    packages: { type: 'string' },
    pictures: { type: 'string' },
    chromium: { type: 'string', default: '/usr/bin/chromium' },
    frames: { type: 'string', default: '20' },
  },
});
const windows = {
  desk: { viewport: { width: 1280, height: 800 } },
  phone: { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true },
};
const stage = new Stage(values);
try {
  for (const [name, window] of Object.entries(windows)) {
    const page = await stage.page(window);
    await page.goto(positionals[0]);
    const { frame, framesApplied } = await playing(page, Number(values.frames));
    await stage.picture(page, name);
    console.log(`${name}: plays frame ${frame}, ${framesApplied} frames applied`);
  }
} finally {
  await stage.close(false);
}
