// Loads GLB files in three.js in a headless Chromium, unlit, and checks that sampled pixels are the palette's colour
// times the occlusion: node pixels.mjs FILE.glb...
//
// Exit status: 0 all right, 1 not, 77 when the browser or the packages are not installed.
import { withViewer } from './browser.mjs';

const views = ['front', 'back', 'left', 'right', 'top', 'bottom', 'iso', 'iso2', 'iso3', 'iso4'];
const pixelsPerView = 60;

let failed = false;
for (const file of process.argv.slice(2)) {
  const totals = await withViewer([file], [800, 800], (page) => page.evaluate(([list, count]) => {
    window.viewer.unlit();
    const sums = { checked: 0, inside_out: 0, darkened: 0, wrong: [] };
    list.forEach((view, index) => {
      window.viewer.look(view);
      const result = window.viewer.checkPixels(count, 12345 + index);
      for (const key of ['checked', 'inside_out', 'darkened']) sums[key] += result[key];
      sums.wrong.push(...result.wrong.map((pixel) => ({ view, ...pixel })));
    });
    return sums;
  }, [views, pixelsPerView]));
  const good = totals.checked > 0 && totals.wrong.length === 0 && totals.inside_out === 0;
  failed ||= !good;
  console.log(`${good ? 'ok' : 'FAILED'} ${file}: ${totals.checked} pixels (${totals.darkened} occluded), ` +
              `${totals.wrong.length} wrong, ${totals.inside_out} inside out`);
  totals.wrong.slice(0, 5).forEach((pixel) => console.log(`  ${JSON.stringify(pixel)}`));
}
if (process.argv.length < 3) console.error('pixels.mjs: which files?');
process.exit(failed || process.argv.length < 3 ? 1 : 0);
