// Reads files and draws pictures beside the page, which goes on meanwhile.
import { load } from '../package/quoin.js';

let scene;

const work = {
  async load({ bytes, smooth }) {
    scene?.free();
    scene = undefined;
    const began = performance.now();
    scene = await load(bytes);
    const loaded = performance.now();
    const glb = scene.glb(smooth === undefined ? {} : { smooth });
    return { glb, warnings: scene.warnings, grids: scene.grids, types: scene.types.length - 1,
             milliseconds: { load: loaded - began, mesh: performance.now() - loaded } };
  },
  async glb({ smooth }) {
    return { glb: scene.glb({ smooth }) };
  },
  async march(options) {
    return scene.render(options);
  },
};

onmessage = async ({ data: { id, name, options } }) => {
  try {
    const answer = await work[name](options);
    postMessage({ id, answer }, [(answer.glb ?? answer.rgba).buffer]);
  } catch (error) {
    postMessage({ id, error: { message: error.message, code: error.code } });
  }
};
