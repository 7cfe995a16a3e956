// Reads files and draws pictures beside the page, which goes on meanwhile.
import { load, start } from '../package/quoin.js';

/** A .vox file of a block of two colours. */
function block() {
  const [width, height] = [32, 16];
  const voxels = Uint32Array.from({ length: width * width * height }, (_, i) =>
    i % width | (Math.floor(i / width) % width) << 8 | Math.floor(i / width / width) << 16 | (1 + i % 2) << 24);
  const id = (name) => new DataView(new TextEncoder().encode(name).buffer).getUint32(0, true);
  return Uint32Array.of(id('VOX '), 150, id('MAIN'), 0, 40 + voxels.byteLength, id('SIZE'), 12, 0, width, width, height,
                        id('XYZI'), 4 + voxels.byteLength, 0, voxels.length, ...voxels);
}

/** Compiles the small module before there is a file, and what a first file takes of it: functions are compiled when
 *  they are first called. */
async function prepare() {
  await start(undefined, { small: true });
  const small = await load(block(), { small: true });
  small.glb();
  small.free();
}
prepare().catch(() => {});  // `load` says why

let file;   // its bytes
let scene;
let whole;  // a promise of the same in the module that does everything

async function wholeScene() {
  if (!scene.isSmall) return scene;
  whole ??= load(file).then((made) => {
    scene.free();
    scene = made;
  }).finally(() => { whole = undefined; });
  await whole;
  return scene;
}

let shaders;  // of it; what WebGPU marches it by

const samplesOfAPixel = 16;

const work = {
  async load({ bytes, smooth }, tell) {
    shaders?.free();
    scene?.free();
    shaders = scene = undefined;
    file = bytes;
    const began = performance.now();
    scene = await load(bytes, { small: true, progress: (fraction) => tell(fraction / 2) });
    const loaded = performance.now();
    const progress = (fraction) => tell(0.5 + fraction / 2);
    const glb = scene.glb(smooth === undefined ? { progress } : { smooth, progress });
    return { glb, warnings: scene.warnings, grids: scene.grids, types: scene.types.length - 1,
             milliseconds: { load: loaded - began, mesh: performance.now() - loaded } };
  },
  async glb({ smooth }, tell) {
    return { glb: scene.glb({ smooth, progress: tell }) };
  },
  async march(options, tell) {
    return (await wholeScene()).render({ ...options, progress: tell });
  },
  async shaders() {
    shaders?.free();
    shaders = (await wholeScene()).forShaders();
    const { bytes, has } = shaders;
    return { bytes, has, samples: Array.from({ length: samplesOfAPixel }, (_, i) => shaders.sample(i)) };
  },
  async frame(options) {
    return { frame: shaders.frame(options) };
  },
};

onmessage = async ({ data: { id, name, options } }) => {
  let told = performance.now();
  const tell = (fraction) => {
    if (performance.now() - told < 100) return;
    told = performance.now();
    postMessage({ id, fraction });
  };
  try {
    const answer = await work[name](options, tell);
    postMessage({ id, answer }, [(answer.glb ?? answer.rgba ?? answer.bytes ?? answer.frame).buffer]);
  } catch (error) {
    postMessage({ id, error: { message: error.message, code: error.code } });
  }
};
