// In the browser, for march.mjs: renders a scene by WebGPU and by the module, and compares the images.
import { load } from '../package/quoin.js';
import { Marcher, openDevice } from '../page/march.js';

let opened;

/** Renders a scene's images: `render(options)` returns both. */
async function both(scene, samples) {
  opened ??= await openDevice();
  const shaders = scene.forShaders();
  const pushes = Array.from({ length: samples }, (_, i) => shaders.sample(i));
  const began = performance.now();
  const marcher = await Marcher.open(opened.device, { bytes: shaders.bytes, has: shaders.has, samples: pushes });
  const opening = performance.now() - began;
  return {
    has: shaders.has, bytes: shaders.bytes.length, opening,
    async render(options) {
      marcher.begin(shaders.frame(options), options.width, options.height);
      const first = performance.now();
      while (!marcher.isFinished) await marcher.addSample();
      const milliseconds = (performance.now() - first) / samples;
      const device = await marcher.read();
      const then = performance.now();
      const module = scene.render({ ...options, samples });
      return { device, module, milliseconds, byModule: (performance.now() - then) / samples };
    },
    free() {
      marcher.close();
      shaders.free();
    },
  };
}

function differences(a, b) {
  const pixels = a.length / 4;
  let equal = 0;
  let close = 0;
  let largest = 0;
  const seen = new Set();
  for (let i = 0; i < a.length; i += 4) {
    const off = Math.max(Math.abs(a[i] - b[i]), Math.abs(a[i + 1] - b[i + 1]), Math.abs(a[i + 2] - b[i + 2]));
    equal += off === 0;
    close += off <= 2;
    largest = Math.max(largest, off);
    seen.add((a[i] << 16) | (a[i + 1] << 8) | a[i + 2]);
  }
  return { pixels, equal, close, largest, colours: seen.size };
}

async function png({ width, height, rgba }) {
  const canvas = new OffscreenCanvas(width, height);
  canvas.getContext('2d').putImageData(new ImageData(rgba, width, height), 0, 0);
  return [...new Uint8Array(await (await canvas.convertToBlob({ type: 'image/png' })).arrayBuffer())];
}

/** Returns the differences between a file's images for a list of views. `keeps`: also returns the images as PNG. */
window.compare = async (address, views, { samples, keeps }) => {
  const scene = await load(await (await fetch(address)).arrayBuffer());
  const images = await both(scene, samples);
  const found = [];
  for (const view of views) {
    const { device, module, milliseconds, byModule } = await images.render(view);
    found.push({ ...differences(device.rgba, module.rgba), milliseconds, byModule,
                 images: keeps ? [await png(device), await png(module)] : [] });
  }
  images.free();
  scene.free();
  return { has: images.has, bytes: images.bytes, opening: images.opening, name: opened.name, found };
};

/** Returns the error codes of invalid calls to a scene's tables. */
window.misuse = async (address) => {
  const scene = await load(await (await fetch(address)).arrayBuffer());
  const shaders = scene.forShaders();
  const code = (work) => {
    try {
      return work() && 'none';
    } catch (error) {
      return error.code;
    }
  };
  const codes = [() => shaders.frame({ width: 0 }), () => shaders.frame({ width: 2 ** 20, height: 2 ** 20 }),
                 () => shaders.frame({ sun: [0, 0, 0] }), () => shaders.sample(-1)].map(code);
  shaders.free();
  codes.push(code(() => shaders.frame({})));
  scene.free();
  codes.push(code(() => scene.forShaders()));
  return codes;
};

/** Returns the error of a device whose binding limit is too small for a scene. */
window.openOnSmallDevice = async (address, most) => {
  const scene = await load(await (await fetch(address)).arrayBuffer());
  const shaders = scene.forShaders();
  const device = { limits: { maxStorageBufferBindingSize: most } };
  try {
    await Marcher.open(device, { bytes: shaders.bytes, has: shaders.has, samples: [] });
    return 'it was opened';
  } catch (error) {
    return error.message;
  } finally {
    shaders.free();
    scene.free();
  }
};
