// Reads files and draws pictures beside the page, which goes on meanwhile.
import { load, start } from '../package/quoin.js';

// Compiled before there is a file.
start(undefined, { small: true }).catch(() => {});  // `load` says why

let file;   // its bytes
let scene;
let isWhole;

/** The scene in the module that does everything. */
async function wholeScene() {
  if (!isWhole) {
    const last = scene;
    scene = await load(file);
    isWhole = true;
    last.free();
  }
  return scene;
}

const work = {
  async load({ bytes, smooth }) {
    scene?.free();
    scene = undefined;
    isWhole = false;
    file = bytes;
    const began = performance.now();
    scene = await load(bytes, { small: true });
    const loaded = performance.now();
    const glb = scene.glb(smooth === undefined ? {} : { smooth });
    return { glb, warnings: scene.warnings, grids: scene.grids, types: scene.types.length - 1,
             milliseconds: { load: loaded - began, mesh: performance.now() - loaded } };
  },
  async glb({ smooth }) {
    return { glb: scene.glb({ smooth }) };
  },
  async march(options) {
    return (await wholeScene()).render(options);
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
