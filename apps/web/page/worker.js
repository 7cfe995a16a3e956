// Loads files and renders images in the background, so that the page stays responsive.
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

/** Compiles the small module and the functions for a first file in advance: functions are compiled on their first
 *  call. */
async function prepare() {
  await start(undefined, { small: true });
  const small = await load(block(), { small: true });
  small.glb();
  small.free();
}
prepare().catch(() => {});  // `load` reports the error

let file;     // the bytes of the current file
let heights;  // its height encoding, if it is an image
let packs;    // the resource packs for its blocks
let scene;    // its scene; undefined if its instance has ended or a later file could not be read
let shaders;  // its ShaderScene for WebGPU, from the whole module

async function current() {
  if (file === undefined) throw new Error('no file is loaded');
  scene ??= await load(file, { small: true, heights, packs });
  return scene;
}

/** Returns the scene in the whole module. */
async function wholeScene() {
  const now = await current();
  if (!now.isSmall) return now;
  const whole = await load(file, { heights, packs });
  now.free();
  scene = whole;
  return whole;
}

function forget() {
  shaders?.free();
  scene?.free();
  shaders = scene = undefined;
}

const samplesOfAPixel = 16;

const work = {
  /** Receives the current file, if this worker replaces another. */
  async keep(kept) {
    ({ bytes: file, heights, packs } = kept);
    return {};
  },
  /** Fails if the packs cannot be read. */
  async check({ packs: given }) {
    (await load(block(), { packs: given })).free();
    return {};
  },
  async load({ bytes, smooth, heights: asHeights, packs: withPacks }, tell) {
    forget();
    const began = performance.now();
    const made = await load(bytes, { small: true, heights: asHeights, packs: withPacks,
                                     progress: (fraction) => tell(fraction / 2) });
    const loaded = performance.now();
    const progress = (fraction) => tell(0.5 + fraction / 2);
    let glb;
    try {
      glb = made.glb(smooth === undefined ? { progress } : { smooth, progress });
    } catch (error) {
      made.free();
      throw error;
    }
    file = bytes;
    heights = asHeights;
    packs = withPacks;
    scene = made;
    return { glb, warnings: scene.warnings, grids: scene.grids, types: scene.types.length - 1,
             milliseconds: { load: loaded - began, mesh: performance.now() - loaded } };
  },
  async glb({ smooth }, tell) {
    return { glb: (await current()).glb({ smooth, progress: tell }) };
  },
  async march(options, tell) {
    return (await wholeScene()).render({ ...options, progress: tell });
  },
  async shaders() {
    const whole = await wholeScene();
    shaders?.free();
    shaders = undefined;
    shaders = whole.forShaders();
    const { bytes, has } = shaders;
    return { bytes, has, samples: Array.from({ length: samplesOfAPixel }, (_, i) => shaders.sample(i)) };
  },
  async frame(options) {
    if (shaders === undefined) throw new Error('the marched scene has been freed');
    return { frame: shaders.frame(options) };
  },
};

const endings = ['trap', 'out_of_memory', 'internal'];  // these errors end the instance and all its scenes

async function answerTo({ id, name, options }) {
  let reported = performance.now();
  const tell = (fraction) => {
    if (performance.now() - reported < 100) return;
    reported = performance.now();
    postMessage({ id, fraction });
  };
  try {
    const answer = await work[name](options, tell);
    const large = answer.glb ?? answer.rgba ?? answer.bytes ?? answer.frame;
    postMessage({ id, answer }, large === undefined ? [] : [large.buffer]);
  } catch (error) {
    if (endings.includes(error.code)) shaders = scene = undefined;
    postMessage({ id, error: { message: error.message, code: error.code } });
  }
}

// Runs tasks one after another, so that none changes the state during another's await.
let last = Promise.resolve();
onmessage = ({ data }) => { last = last.then(() => answerTo(data)); };
