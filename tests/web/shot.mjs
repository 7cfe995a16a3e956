// A picture of GLB files in three.js, side by side, for a person to look at:
// node shot.mjs -o OUT.png [--view iso|front|back|left|right|top|x,y,z] [--size 1280x720] [--zoom 1] [--unlit] FILE.glb...
//
// --camera=X,Y,Z --look-at=X,Y,Z --fov DEGREES stands in the scene instead, as quoin render does.
// A view is the direction from the model towards the camera (--view=-1,0.5,1 when it begins with a minus). Exit status: 0 done, 77 when the browser is not installed.
import { parseArgs } from 'node:util';

import { closeBrowser, withViewer } from './browser.mjs';

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    output: { type: 'string', short: 'o', default: 'shot.png' },
    view: { type: 'string', default: 'iso' },
    size: { type: 'string', default: '1280x720' },
    zoom: { type: 'string', default: '1' },
    unlit: { type: 'boolean', default: false },
    camera: { type: 'string' },
    'look-at': { type: 'string', default: '0,0,0' },
    fov: { type: 'string', default: '45' },
  },
});
const triple = (text) => text.split(',').map(Number);
const view = values.view.includes(',') ? values.view.split(',').map(Number) : values.view;
await withViewer(positionals, values.size.split('x').map(Number), async (page) => {
  await page.evaluate(([direction, zoom, flat]) => {
    if (flat) window.viewer.unlit();
    window.viewer.look(direction, zoom);
  }, [view, Number(values.zoom), values.unlit]);
  if (values.camera) {
    await page.evaluate(([from, to, fov]) => window.viewer.stand(from, to, fov),
                        [triple(values.camera), triple(values['look-at']), Number(values.fov)]);
  }
  await page.screenshot({ path: values.output });
});
await closeBrowser();
