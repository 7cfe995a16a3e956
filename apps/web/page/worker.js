// Reads files and draws pictures beside the page, which goes on meanwhile.
import { load } from '../package/quoin.js';

let scene;
let shaders;  // of it; what WebGPU marches it by

const samplesOfAPixel = 16;

const work = {
  async load({ bytes, smooth }) {
    shaders?.free();
    scene?.free();
    shaders = scene = undefined;
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
  async shaders() {
    shaders?.free();
    shaders = scene.forShaders();
    const { bytes, has } = shaders;
    return { bytes, has, samples: Array.from({ length: samplesOfAPixel }, (_, i) => shaders.sample(i)) };
  },
  async frame(options) {
    return { frame: shaders.frame(options) };
  },
};

onmessage = async ({ data: { id, name, options } }) => {
  try {
    const answer = await work[name](options);
    postMessage({ id, answer }, [(answer.glb ?? answer.rgba ?? answer.bytes ?? answer.frame).buffer]);
  } catch (error) {
    postMessage({ id, error: { message: error.message, code: error.code } });
  }
};
