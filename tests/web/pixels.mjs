// Loads GLB files in three.js in a headless Chromium, unlit, and checks that sampled pixels are the palette's colour
// times the vertices' (the occlusion of blocks; the whole colour of smooth surfaces, which have no palette):
// node pixels.mjs [--occluded] FILE.glb[=FILE.vox]...
//
// If a .vox file with a single plain model is named, the GLB is compared with colours and occlusion computed from
// those voxels, instead of with its own data.
// With --occluded it is a failure when no sampled pixel is darkened by occlusion.
// Exit status: 0 all right, 1 not, 77 when the browser or the packages are not installed.
import { parseArgs } from 'node:util';

import { closeBrowser, withViewer } from './browser.mjs';

const views = ['front', 'back', 'left', 'right', 'top', 'bottom', 'iso', 'iso2', 'iso3', 'iso4'];
const pixelsPerView = 60;

const { values: options, positionals: pairs } = parseArgs({ allowPositionals: true, options: {
  occluded: { type: 'boolean', default: false },
} });

let failed = false;
for (const pair of pairs) {
  const [file, vox] = pair.split(/=(.*)/s);
  const totals = await withViewer([file], [800, 800], (page) => page.evaluate(async ([list, count, truth]) => {
    window.viewer.unlit();
    const from_voxels = truth && (await window.viewer.compareWith(truth));
    const sums = { from_voxels, checked: 0, inside_out: 0, darkened: 0, wrong: [] };
    list.forEach((view, index) => {
      window.viewer.look(view, 1, 32);
      const result = window.viewer.checkPixels(count, 12345 + index);
      for (const key of ['checked', 'inside_out', 'darkened']) sums[key] += result[key];
      sums.wrong.push(...result.wrong.map((pixel) => ({ view, ...pixel })));
    });
    return sums;
  }, [views, pixelsPerView, vox && '/truth.vox']), vox);
  const good = totals.checked > 0 && totals.wrong.length === 0 && totals.inside_out === 0 &&
    (totals.darkened > 0 || !options.occluded);
  failed ||= !good;
  console.log(`${good ? 'ok' : 'FAILED'} ${file}: ${totals.checked} pixels (${totals.darkened} occluded), ` +
              `${totals.wrong.length} wrong, ${totals.inside_out} inside out${totals.from_voxels ? ', against the voxels' : ''}`);
  totals.wrong.slice(0, 5).forEach((pixel) => console.log(`  ${JSON.stringify(pixel)}`));
}
await closeBrowser();
if (pairs.length === 0) console.error('pixels.mjs: which files?');
process.exit(failed || pairs.length === 0 ? 1 : 0);
