// Ray-marches a scene by WebGPU with Quoin's lighting: the shaders in march/ read the tables of the package's
// ShaderScene.
import data from './march/data.wgsl';
import walk from './march/walk.wgsl';
import field from './march/field.wgsl';
import instances from './march/instances.wgsl';
import cameraRays from './march/camera.wgsl';
import primary from './march/primary.wgsl';
import lit from './march/lit.wgsl';
import fieldBlend from './march/field_blend.wgsl';
import glassOfFields from './march/glass_field.wgsl';
import glass from './march/glass.wgsl';
import light from './march/light.wgsl';
import resolve from './march/resolve.wgsl';
import show from './march/show.wgsl';

const frameBytes = 608;  // a Frame, followed by the image's tables
const flagsAt = 536;
// Supported flags: perspective, lighting, shadows, occlusion rays in fixed directions; optionally lamps and glass.
const neededFlags = 1 | 2 | 4 | 8 | 64;
const knownFlags = neededFlags | 2048 | 4096;
const tileEdge = 128;
const patience = 50;  // milliseconds of work that cannot be cancelled
const pushBytes = 256;  // alignment of dynamic offsets; a Push has 104
const pointBytes = 48;

/** Returns a device of the best adapter. Rejects if WebGPU or an adapter is missing. */
export async function openDevice() {
  if (navigator.gpu === undefined) throw new Error('this browser has no WebGPU');
  const adapter = await navigator.gpu.requestAdapter({ powerPreference: 'high-performance' });
  if (adapter === null) throw new Error('WebGPU has no adapter here');
  const { maxStorageBufferBindingSize, maxBufferSize } = adapter.limits;
  const device = await adapter.requestDevice({ requiredLimits: { maxStorageBufferBindingSize, maxBufferSize } });
  const { vendor, architecture } = adapter.info ?? {};
  return { device, name: [vendor, architecture].filter(Boolean).join(' ') };
}

const sizeOf = (bytes) => (bytes < 2 ** 20 ? `${Math.ceil(bytes / 1024)} KiB` : `${Math.ceil(bytes / 2 ** 20)} MiB`);

/** A scene on a device, and its image, which is rendered sample by sample. */
export class Marcher {
  #device;
  #layouts;
  #pipelines;
  #scene;    // a GPUBuffer
  #samples;  // push constants of each sample
  #size = [0, 0];
  #image;    // buffers of the current size
  #tables;
  #uniform;
  #pushes;
  #groups;
  #shown;
  #atOnce = 1;  // tiles
  /** Samples of the image so far. */
  samples = 0;

  /** `scene`: { bytes, has, samples } from a worker. Rejects if the scene exceeds the device's limits. */
  static async open(device, scene) {
    const marcher = new Marcher();
    marcher.#device = device;
    marcher.#samples = scene.samples;
    marcher.#checkSize('the scene', scene.bytes.byteLength);
    try {
      await marcher.#put(scene);
    } catch (error) {
      marcher.close();
      throw error;
    }
    return marcher;
  }

  #checkSize(what, bytes) {
    const most = this.#device.limits.maxStorageBufferBindingSize;
    if (bytes > most) throw new Error(`${what} needs ${sizeOf(bytes)}, but the adapter binds at most ${sizeOf(most)}`);
  }

  async #put(scene) {
    const device = this.#device;
    device.pushErrorScope('validation');
    device.pushErrorScope('out-of-memory');
    this.#scene = this.#buffer(scene.bytes.byteLength, GPUBufferUsage.STORAGE, scene.bytes);
    this.#uniform = this.#buffer(frameBytes, GPUBufferUsage.UNIFORM);
    const errors = [device.popErrorScope(), device.popErrorScope()];
    for (const error of await Promise.all(errors)) {
      if (error !== null) throw new Error(error.message);
    }
    await this.#compile(scene.has);
  }

  /** Frees its device memory. */
  close() {
    for (const buffer of [this.#scene, this.#uniform, this.#tables, this.#pushes, this.#shown,
                          ...Object.values(this.#image ?? {})]) buffer?.destroy();
  }

  #buffer(size, usage, bytes) {
    const buffer = this.#device.createBuffer({ size: Math.max(Math.ceil(size / 32) * 32, 32),
                                               usage: usage | GPUBufferUsage.COPY_DST });
    if (bytes !== undefined) this.#device.queue.writeBuffer(buffer, 0, bytes);
    return buffer;
  }

  async #compile(has) {
    const device = this.#device;
    const compute = GPUShaderStage.COMPUTE;
    const storage = (binding, type) => ({ binding, visibility: compute, buffer: { type } });
    const common = device.createBindGroupLayout({ entries: [
      storage(0, 'uniform'), storage(1, 'read-only-storage'), storage(2, 'read-only-storage'),
      storage(3, 'read-only-storage'), storage(4, 'storage'), storage(5, 'storage'), storage(6, 'storage')] });
    const pushed = device.createBindGroupLayout({ entries: [
      { binding: 0, visibility: compute, buffer: { type: 'uniform', hasDynamicOffset: true, minBindingSize: 96 } }] });
    this.#layouts = { common, pushed };
    const layout = device.createPipelineLayout({ bindGroupLayouts: [common, pushed] });
    const constants = { kHasGlass: has & 1, kHasFields: (has >> 1) & 1, kHasFieldGlass: (has >> 2) & 1 };
    constants.kHasGlass ||= constants.kHasFieldGlass;
    const rays = [data, walk, field, instances, cameraRays].join('\n');
    const make = (code, entryPoint, used) => device.createComputePipelineAsync({ layout, compute: {
      module: device.createShaderModule({ code }), entryPoint,
      constants: Object.fromEntries(used.map((name) => [name, constants[name]])) } });
    const all = ['kHasGlass', 'kHasFields', 'kHasFieldGlass'];
    const format = navigator.gpu.getPreferredCanvasFormat();
    const screen = device.createShaderModule({ code: show });
    const [points, lights, resolves, shows] = await Promise.all([
      make([rays, primary].join('\n'), 'find_points', ['kHasFields']),
      make([rays, lit, fieldBlend, glassOfFields, glass, light].join('\n'), 'light_points', all),
      make([data, resolve].join('\n'), 'resolve', []),
      device.createRenderPipelineAsync({ layout: 'auto', vertex: { module: screen, entryPoint: 'corner' },
                                         fragment: { module: screen, entryPoint: 'pixel_of', targets: [{ format }] } }),
    ]);
    this.#pipelines = { points, lights, resolves, shows };
  }

  /** Begins an image: `frame` is the package's Frame for this size. */
  begin(frame, width, height) {
    const words = new DataView(frame.buffer, frame.byteOffset, frame.byteLength);
    const flags = words.getUint32(flagsAt, true);
    if ((flags & neededFlags) !== neededFlags || (flags & ~knownFlags) !== 0)
      throw new Error(`cannot render with the lighting flags ${flags}`);
    this.#resize(width, height);
    if (this.#tables === undefined || this.#tables.size < frame.byteLength) {
      this.#checkSize('the image data', frame.byteLength);
      this.#tables?.destroy();
      const most = Math.floor(this.#device.limits.maxStorageBufferBindingSize / 32) * 32;
      this.#tables = this.#buffer(Math.min(frame.byteLength * 1.25, most), GPUBufferUsage.STORAGE);
      this.#groups = undefined;
    }
    this.#device.queue.writeBuffer(this.#uniform, 0, frame, 0, frameBytes);
    this.#device.queue.writeBuffer(this.#tables, 0, frame);
    this.#groups ??= this.#bound();
    this.samples = 0;
  }

  #resize(width, height) {
    if (this.#size[0] === width && this.#size[1] === height) return;
    this.#checkSize('the image', width * height * 16);
    for (const buffer of Object.values(this.#image ?? {})) buffer.destroy();
    this.#size = [width, height];
    const { STORAGE, COPY_SRC } = GPUBufferUsage;
    const ofTile = Math.min(tileEdge, width) * Math.min(tileEdge, height);
    this.#image = { points: this.#buffer(ofTile * pointBytes, STORAGE),
                    sums: this.#buffer(width * height * 16, STORAGE),
                    colours: this.#buffer(width * height * 4, STORAGE | COPY_SRC) };
    this.#pushes?.destroy();
    this.#pushes = this.#buffer(this.#tiles().length * pushBytes, GPUBufferUsage.UNIFORM);
    this.#groups = undefined;
  }

  #tiles() {
    const [width, height] = this.#size;
    const tiles = [];
    for (let y = 0; y < height; y += tileEdge) {
      for (let x = 0; x < width; x += tileEdge)
        tiles.push([x, y, Math.min(tileEdge, width - x), Math.min(tileEdge, height - y)]);
    }
    return tiles;
  }

  #bound() {
    const { points, sums, colours } = this.#image;
    const buffers = [this.#uniform, this.#scene, this.#scene, this.#tables, points, sums, colours];
    return [
      this.#device.createBindGroup({ layout: this.#layouts.common,
                                     entries: buffers.map((buffer, binding) => ({ binding, resource: { buffer } })) }),
      this.#device.createBindGroup({ layout: this.#layouts.pushed,
                                     entries: [{ binding: 0, resource: { buffer: this.#pushes, size: 96 } }] }),
    ];
  }

  /** Adds a sample to every pixel. Resolves when the device has finished; with false if `isWanted()` became false, and
   *  the image is incomplete. */
  async addSample(isWanted = () => true) {
    const tiles = this.#tiles();
    const pushes = new Uint8Array(tiles.length * pushBytes);
    tiles.forEach(([x, y, columns, rows], i) => {
      pushes.set(this.#samples[this.samples], i * pushBytes);
      const view = new DataView(pushes.buffer, i * pushBytes);
      [x, y, columns, rows].forEach((value, k) => view.setInt32(8 + 4 * k, value, true));
      const [sample, place, pitch] = [this.samples, y * this.#size[0] + x, this.#size[0]];
      [sample, place, pitch].forEach((value, k) => view.setUint32(68 + 4 * k, value, true));
    });
    this.#device.queue.writeBuffer(this.#pushes, 0, pushes);
    // Submits enough tiles at a time to keep the device busy, but few enough to avoid timeouts and to cancel quickly.
    for (let next = 0; next < tiles.length;) {
      const began = performance.now();
      const end = Math.min(next + this.#atOnce, tiles.length);
      this.#addTiles(tiles, next, end);
      await this.#device.queue.onSubmittedWorkDone();
      if (!isWanted()) return false;
      const took = performance.now() - began;
      if (took < patience / 3 && end - next === this.#atOnce) this.#atOnce *= 2;
      if (took > patience) this.#atOnce = Math.max(Math.floor(this.#atOnce / 2), 1);
      next = end;
    }
    this.samples += 1;
    return true;
  }

  #addTiles(tiles, begin, end) {
    const commands = this.#device.createCommandEncoder();
    const pass = commands.beginComputePass();
    pass.setBindGroup(0, this.#groups[0]);
    for (let i = begin; i < end; ++i) {
      pass.setBindGroup(1, this.#groups[1], [i * pushBytes]);
      for (const pipeline of [this.#pipelines.points, this.#pipelines.lights, this.#pipelines.resolves]) {
        pass.setPipeline(pipeline);
        pass.dispatchWorkgroups(Math.ceil(tiles[i][2] / 8), Math.ceil(tiles[i][3] / 8));
      }
    }
    pass.end();
    this.#device.queue.submit([commands.finish()]);
  }

  /** True if there are more samples. */
  get isFinished() {
    return this.samples >= this.#samples.length;
  }

  /** Draws the image to a canvas with a context of the device. */
  show(context) {
    const texture = context.getCurrentTexture();
    this.#shown ??= this.#buffer(16, GPUBufferUsage.UNIFORM);
    this.#device.queue.writeBuffer(this.#shown, 0, new Uint32Array([...this.#size, texture.width, texture.height]));
    const entries = [this.#image.colours, this.#shown].map((buffer, binding) => ({ binding, resource: { buffer } }));
    const group = this.#device.createBindGroup({ layout: this.#pipelines.shows.getBindGroupLayout(0), entries });
    const commands = this.#device.createCommandEncoder();
    const pass = commands.beginRenderPass({ colorAttachments: [
      { view: texture.createView(), loadOp: 'clear', storeOp: 'store' }] });
    pass.setPipeline(this.#pipelines.shows);
    pass.setBindGroup(0, group);
    pass.draw(3);
    pass.end();
    this.#device.queue.submit([commands.finish()]);
  }

  /** Returns the pixels in the layout of ImageData. */
  async read() {
    const { colours } = this.#image;
    const [width, height] = this.#size;
    const bytes = width * height * 4;
    const landing = this.#device.createBuffer({ size: colours.size,
                                                usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST });
    const commands = this.#device.createCommandEncoder();
    commands.copyBufferToBuffer(colours, 0, landing, 0, colours.size);
    this.#device.queue.submit([commands.finish()]);
    await landing.mapAsync(GPUMapMode.READ);
    const rgba = new Uint8ClampedArray(landing.getMappedRange().slice(0, bytes));
    landing.destroy();
    return { width, height, rgba };
  }
}
