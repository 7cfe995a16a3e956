// Quoin's WebAssembly module as a module of JavaScript: docs/web.md, quoin.d.ts.

const codes = ['ok', 'invalid_argument', 'cannot_read', 'cannot_write', 'bad_format', 'unsupported', 'limit_exceeded',
               'cancelled', 'device_lost', 'bad_handle', 'out_of_memory', 'internal'];

export class QuoinError extends Error {
  constructor(code, message) {
    super(message);
    this.name = 'QuoinError';
    this.code = code;
  }
}

// What quoin_web_struct calls its structs, and where their fields are: pointers and size_t have 4 bytes.
const structs = { array: 0, gridInfo: 1, type: 2, meshData: 3, meshOptions: 4, renderOptions: 5 };
const scalars = [Uint8Array, Int8Array, Uint16Array, Int16Array, Uint32Array, Int32Array, null, null, Float32Array,
                 Float64Array];

let compiled;  // a promise of the WebAssembly.Module
let instance;  // a promise of the Instance that lives; undefined where there is none, or it died

/** One instance of the module. What ends it is thrown as a QuoinError, and it is never called again. */
class Instance {
  constructor(module) {
    this.dead = false;
    this.exports = new WebAssembly.Instance(module, this.imports(module)).exports;
    this.run('__wasm_call_ctors');
  }

  imports(module) {
    const imports = {};
    // A system without files: calls fail as they do where something is not supported.
    for (const { module: from, name } of WebAssembly.Module.imports(module)) (imports[from] ??= {})[name] = () => 52;
    const system = (imports.wasi_snapshot_preview1 ??= {});
    system.clock_time_get = (clock, precision, out) => {
      const milliseconds = clock === 0 ? Date.now() : performance.now();
      this.view().setBigUint64(out, BigInt(Math.round(milliseconds * 1e6)), true);
      return 0;
    };
    system.environ_sizes_get = (count, bytes) => {
      this.view().setUint32(count, 0, true);
      this.view().setUint32(bytes, 0, true);
      return 0;
    };
    system.environ_get = () => 0;
    system.random_get = (out, bytes) => {
      crypto.getRandomValues(new Uint8Array(this.exports.memory.buffer, out, bytes));
      return 0;
    };
    system.proc_exit = (code) => {
      throw new QuoinError('trap', `the module ended with ${code}`);
    };
    imports.quoin = {
      fail: (text) => {
        const what = this.text(text);
        throw new QuoinError(what === 'out of memory' ? 'out_of_memory' : 'internal', what);
      },
    };
    return imports;
  }

  /** Calls an export. What is thrown through it leaves it in no state to go on. */
  run(name, ...values) {
    if (this.dead) throw new QuoinError('bad_handle', 'the instance that this belongs to has ended');
    try {
      return this.exports[name](...values);
    } catch (error) {
      this.dead = true;
      if (error instanceof QuoinError) throw error;
      throw new QuoinError('trap', `the module stopped: ${error.message}`);
    }
  }

  /** Calls one of quoin.h's functions. */
  call(name, ...values) {
    const status = this.run(name, ...values);
    if (status !== 0) throw new QuoinError(codes[status] ?? 'internal', this.text(this.run('quoin_last_error')));
  }

  view() {
    return new DataView(this.exports.memory.buffer);
  }

  text(at) {
    const bytes = new Uint8Array(this.exports.memory.buffer, at >>> 0);
    const end = bytes.indexOf(0);
    return new TextDecoder().decode(bytes.slice(0, end));
  }

  /** A copy of count numbers; null where the address is. */
  numbers(Kind, at, count) {
    return at === 0 ? null : new Kind(this.exports.memory.buffer, at, count).slice();
  }

  /** Calls use(address, view of it) with `bytes` of memory. */
  with(bytes, use) {
    const at = this.run('malloc', Math.max(bytes, 1)) >>> 0;
    if (at === 0) throw new QuoinError('out_of_memory', `no memory for ${bytes} bytes`);
    try {
      return use(at);
    } finally {
      if (!this.dead) this.run('free', at);
    }
  }

  withBytes(bytes, use) {
    return this.with(bytes.byteLength, (at) => {
      new Uint8Array(this.exports.memory.buffer, at, bytes.byteLength).set(
        new Uint8Array(bytes.buffer, bytes.byteOffset, bytes.byteLength));
      return use(at);
    });
  }

  withText(text, use) {
    return this.withBytes(new TextEncoder().encode(`${text}\0`), use);
  }

  withStruct(kind, use) {
    const at = this.run('quoin_web_struct', structs[kind]) >>> 0;
    if (at === 0) throw new QuoinError('out_of_memory', 'no memory for a struct');
    try {
      return use(at);
    } finally {
      if (!this.dead) this.run('free', at);
    }
  }

  count(name, scene) {
    return this.with(4, (out) => {
      this.call(name, scene, out);
      return this.view().getUint32(out, true);
    });
  }

  handle(name, ...values) {
    return this.with(8, (out) => {
      this.call(name, ...values, out);
      return this.view().getBigUint64(out, true);
    });
  }

  /** Copies a mesh out, and frees it. */
  takeMesh(mesh) {
    try {
      return this.withStruct('meshData', (at) => {
        this.call('quoin_mesh_view', mesh, at);
        const field = (index) => this.view().getUint32(at + 4 * index, true);
        const vertices = field(1);
        return {
          positions: this.numbers(Float32Array, field(4), 3 * vertices) ?? new Float32Array(),
          normals: this.numbers(Float32Array, field(5), 3 * vertices) ?? new Float32Array(),
          colours: this.numbers(Uint8Array, field(6), 4 * vertices),
          occlusion: this.numbers(Float32Array, field(7), vertices),
          indices: this.numbers(Uint32Array, field(8), field(2)) ?? new Uint32Array(),
        };
      });
    } finally {
      if (!this.dead) this.run('quoin_free', mesh);
    }
  }
}

async function bytesOf(module) {
  if (module instanceof ArrayBuffer || ArrayBuffer.isView(module)) return module;
  const url = module ?? new URL('./quoin.wasm', import.meta.url);
  if (String(url).startsWith('file:')) {
    const { readFile } = await import('node:fs/promises');
    return readFile(new URL(url));
  }
  const response = await fetch(url);
  if (!response.ok) throw new QuoinError('cannot_read', `${url}: ${response.status} ${response.statusText}`);
  return response.arrayBuffer();
}

async function compile(module) {
  const given = module instanceof ArrayBuffer || ArrayBuffer.isView(module);
  const url = String(given ? '' : module ?? new URL('./quoin.wasm', import.meta.url));
  // Compiled while it arrives, where the server says that it is WebAssembly.
  if (!given && !url.startsWith('file:')) {
    const response = await fetch(url);
    if (response.ok && response.headers.get('Content-Type') === 'application/wasm')
      return WebAssembly.compileStreaming(response);
  }
  return WebAssembly.compile(await bytesOf(module));
}

export async function start(module) {
  if (module !== undefined || compiled === undefined) {
    compiled = compile(module);
    compiled.catch(() => { compiled = undefined; });
    instance = undefined;
  }
  await alive();
}

/** The instance for new work: where the last one ended, a fresh one. */
async function alive() {
  if (compiled === undefined) await start();
  const last = await instance;
  if (last === undefined || last.dead) instance = compiled.then((module) => new Instance(module));
  return instance;
}

const registry = new FinalizationRegistry(({ instance: of, handle }) => {
  if (!of.dead) of.run('quoin_free', handle);
});

export class Scene {
  #instance;
  #handle;

  constructor(of, handle) {
    this.#instance = of;
    this.#handle = handle;
    this.warnings = Object.freeze(this.#texts());
    this.grids = Object.freeze(this.#grids());
    this.types = Object.freeze(this.#types());
    registry.register(this, { instance: of, handle }, this);
  }

  #texts() {
    const of = this.#instance;
    const texts = [];
    const count = of.count('quoin_scene_warning_count', this.#handle);
    for (let i = 0; i < count; ++i) {
      texts.push(of.with(1024, (at) => {
        of.call('quoin_scene_warning', this.#handle, i, at, 1024);
        return of.text(at);
      }));
    }
    return texts;
  }

  #grids() {
    const of = this.#instance;
    const count = of.count('quoin_grid_count', this.#handle);
    return Array.from({ length: count }, (_, i) => of.withStruct('gridInfo', (at) => {
      of.call('quoin_grid_get_info', this.#handle, i, at);
      const view = of.view();
      const triple = (from) => [0, 4, 8].map((step) => view.getInt32(at + from + step, true));
      return { name: of.text(at + 4), voxels: Number(view.getBigInt64(at + 136, true)), min: triple(144),
               extent: triple(156), hasField: view.getInt32(at + 168, true) !== 0 };
    }));
  }

  #types() {
    const of = this.#instance;
    const count = of.count('quoin_type_count', this.#handle);
    return Array.from({ length: count }, (_, i) => of.withStruct('type', (at) => {
      of.call('quoin_type_get', this.#handle, i, at);
      const view = of.view();
      return { name: of.text(at + 20), rgba: [4, 5, 6, 7].map((step) => view.getUint8(at + step)),
               emission: view.getFloat32(at + 8, true), metalness: view.getFloat32(at + 12, true),
               roughness: view.getFloat32(at + 16, true) };
    }));
  }

  #isSmooth({ smooth } = {}) {
    return (smooth ?? this.grids.some((grid) => grid.hasField)) ? 1 : 0;
  }

  glb(options) {
    return this.file('.glb', options);
  }

  file(extension, options) {
    const of = this.#instance;
    return of.withStruct('meshOptions', (wanted) => of.withText(extension, (name) => of.with(8, (out) => {
      of.view().setInt32(wanted + 4, this.#isSmooth(options), true);
      of.call('quoin_web_write', this.#handle, name, wanted, out, out + 4);
      const at = of.view().getUint32(out, true);
      const bytes = of.numbers(Uint8Array, at, of.view().getUint32(out + 4, true));
      of.run('free', at);
      return bytes;
    })));
  }

  mesh(grid, options) {
    const of = this.#instance;
    return of.withStruct('meshOptions', (wanted) => {
      of.view().setInt32(wanted + 4, this.#isSmooth(options), true);
      return of.takeMesh(of.handle('quoin_grid_mesh', this.#handle, index(grid), wanted));
    });
  }

  read(grid, min, shape) {
    const of = this.#instance;
    const count = shape[0] * shape[1] * shape[2];
    if (!(count >= 0 && count <= 2 ** 30)) throw new QuoinError('invalid_argument', 'a box that cannot be');
    return of.withBytes(Int32Array.from([...min, ...shape]), (box) => of.with(2 * count, (out) => {
      of.call('quoin_grid_read', this.#handle, index(grid), box, box + 12, out, count);
      return of.numbers(Uint16Array, out, count);
    }));
  }

  render({ width = 1280, height = 720, ...options } = {}) {
    const of = this.#instance;
    const pixels = pixelsOf(width, height);
    return of.withStruct('renderOptions', (wanted) => of.with(3 * pixels, (out) => {
      putRenderOptions(of.view(), wanted, { width, height, ...options });
      of.call('quoin_scene_render', this.#handle, wanted, out, 3 * pixels);
      const rgb = new Uint8Array(of.exports.memory.buffer, out, 3 * pixels);
      const rgba = new Uint8ClampedArray(4 * pixels).fill(255);
      for (let i = 0; i < pixels; ++i) {
        rgba[4 * i] = rgb[3 * i];
        rgba[4 * i + 1] = rgb[3 * i + 1];
        rgba[4 * i + 2] = rgb[3 * i + 2];
      }
      return { width, height, rgba };
    }));
  }

  forShaders() {
    return new ShaderScene(this.#instance, this.#handle);
  }

  free() {
    registry.unregister(this);
    if (!this.#instance.dead) this.#instance.run('quoin_free', this.#handle);
  }
}

function pixelsOf(width, height) {
  const pixels = width * height;
  if (!(Number.isInteger(width) && Number.isInteger(height) && width > 0 && height > 0 && pixels <= 2 ** 28))
    throw new QuoinError('invalid_argument', 'a size of a picture is two whole numbers, at most 2^28 pixels');
  return pixels;
}

/** Writes a quoin_render_options. */
function putRenderOptions(view, at, { width, height, samples = 4, camera, sun }) {
  [width, height, samples].forEach((value, i) => view.setInt32(at + 4 + 4 * i, value, true));
  const put = (flag, from, numbers) => {
    view.setInt32(at + flag, 1, true);
    numbers.forEach((value, i) => view.setFloat64(at + from + 8 * i, value, true));
  };
  if (camera !== undefined) put(24, 32, [...camera.position, ...camera.lookAt, camera.fovDegrees ?? 45]);
  if (sun !== undefined) put(88, 96, sun);
}

/** What shaders march a scene by. */
export class ShaderScene {
  #instance;
  #march;

  constructor(of, scene) {
    this.#instance = of;
    this.#march = of.with(4, (out) => {
      of.call('quoin_web_march_begin', scene, out);
      return of.view().getUint32(out, true);
    });
    [this.bytes, this.has] = of.with(12, (out) => {
      of.call('quoin_web_march_data', this.#march, out, out + 4, out + 8);
      return [this.#taken(out), of.view().getInt32(out + 8, true)];
    });
  }

  #taken(out) {
    const view = this.#instance.view();
    return this.#instance.numbers(Uint8Array, view.getUint32(out, true), view.getUint32(out + 4, true));
  }

  frame({ width = 1280, height = 720, ...options } = {}) {
    const of = this.#instance;
    pixelsOf(width, height);
    return of.withStruct('renderOptions', (wanted) => of.with(8, (out) => {
      putRenderOptions(of.view(), wanted, { width, height, ...options });
      of.call('quoin_web_march_frame', this.#march, wanted, out, out + 4);
      return this.#taken(out);
    }));
  }

  sample(number) {
    const of = this.#instance;
    const bytes = 96;
    return of.with(bytes, (out) => {
      of.call('quoin_web_march_sample', index(number), out, bytes);
      return of.numbers(Uint8Array, out, bytes);
    });
  }

  free() {
    if (!this.#instance.dead) this.#instance.run('quoin_web_march_free', this.#march);
    this.#march = 0;
  }
}

/** A number of a grid; -1, which none has, for what is no number of one. */
function index(grid) {
  return Number.isInteger(grid) && grid >= 0 ? grid : -1;
}

function asBytes(given) {
  if (given instanceof ArrayBuffer) return new Uint8Array(given);
  if (ArrayBuffer.isView(given)) return given;
  throw new QuoinError('invalid_argument', 'bytes are an ArrayBuffer or a typed array');
}

export async function load(given) {
  const bytes = asBytes(given);
  const of = await alive();
  const handle = of.withBytes(bytes, (at) => of.handle('quoin_scene_load_bytes', at, bytes.byteLength));
  return new Scene(of, handle);
}

export async function surfaceNets(array, shape, iso, { spacing = [1, 1, 1], origin = [0, 0, 0], solidBelow } = {}) {
  const scalar = scalars.findIndex((Kind) => Kind !== null && array instanceof Kind);
  if (scalar < 0) throw new QuoinError('invalid_argument', 'the array is none of the typed arrays that are read');
  if (shape.length !== 3 || shape.some((n) => !Number.isInteger(n) || n < 0) ||
      shape[0] * shape[1] * shape[2] !== array.length)
    throw new QuoinError('invalid_argument', `a shape of ${shape} does not fit ${array.length} samples`);
  const of = await alive();
  return of.withBytes(array, (data) => of.withStruct('array', (at) => {
    const view = of.view();
    const size = array.BYTES_PER_ELEMENT;
    view.setUint32(at + 4, data, true);
    view.setInt32(at + 8, scalar, true);
    const strides = [size * shape[1] * shape[2], size * shape[2], size];
    [...shape, ...strides].forEach((value, i) => view.setBigInt64(at + 16 + 8 * i, BigInt(value), true));
    [...spacing, ...origin].forEach((value, i) => view.setFloat64(at + 64 + 8 * i, value, true));
    return of.takeMesh(of.handle('quoin_surface_nets', at, iso, solidBelow ? 1 : 0, 0));
  }));
}

export async function toThree(scene, GLTFLoader, options) {
  return (await new GLTFLoader().parseAsync(scene.glb(options).buffer, '')).scene;
}

export async function version() {
  const of = await alive();
  return of.text(of.run('quoin_version'));
}
