// Renders GLB files with three.js, next to each other, for visual checks:
//   node shot.mjs -o OUT.png [--view iso|front|back|left|right|top|x,y,z] [--size 1280x720] [--zoom 1] [--unlit]
//     FILE.glb...
//
// A view is the direction from the model towards the camera. If it begins with a minus: --view=-1,0.5,1.
// --camera=X,Y,Z --look-at=X,Y,Z --fov DEGREES sets the camera instead, as for quoin render.
// Exit status: 0 on success, 77 if the browser is not installed.
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
