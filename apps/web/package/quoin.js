// JavaScript binding of Quoin's WebAssembly module. See docs/web.md and quoin.d.ts.

const codes = ['ok', 'invalid_argument', 'cannot_read', 'cannot_write', 'bad_format', 'unsupported', 'limit_exceeded',
               'cancelled', 'device_lost', 'bad_handle', 'out_of_memory', 'internal'];

export class QuoinError extends Error {
  constructor(code, message) {
    super(message);
    this.name = 'QuoinError';
    this.code = code;
  }
}

// Struct numbers of quoin_web_struct. In the field offsets below, pointers and size_t have 4 bytes.
const structs = { array: 0, gridInfo: 1, type: 2, meshData: 3, meshOptions: 4, renderOptions: 5, hits: 6,
                  loadOptions: 7 };
const scalars = [Uint8Array, Int8Array, Uint16Array, Int16Array, Uint32Array, Int32Array, BigUint64Array, BigInt64Array,
                 Float32Array, Float64Array];

/** An instance of the module. If a call ends it, the call throws a QuoinError and later calls are refused. */
class Instance {
  constructor(module) {
    this.dead = false;
    this.exports = new WebAssembly.Instance(module, this.imports(module)).exports;
    this.isSmall = this.exports.quoin_web_reads !== undefined;
    this.run('__wasm_call_ctors');
  }

  imports(module) {
    const imports = {};
    // WASI without files: all calls return ENOSYS (52).
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
      report: (fraction) => this.report(fraction),
    };
    return imports;
  }

  /** Calls an export. An exception leaves the instance in an undefined state and ends it. */
  run(name, ...values) {
    if (this.dead) throw new QuoinError('bad_handle', 'the WebAssembly instance of this object has ended');
    if (this.isTelling) throw new QuoinError('invalid_argument', 'the progress callback must not call the package');
    if (this.exports[name] === undefined)
      throw new QuoinError('unsupported', 'the small module does not support this: load without { small: true }');
    try {
      return this.exports[name](...values);
    } catch (error) {
      this.dead = true;
      if (error instanceof QuoinError) throw error;
      throw new QuoinError('trap', `the module stopped: ${error.message}`);
    }
  }

  /** Calls the progress listener. Its exception is kept and rethrown after the module has returned. */
  report(fraction) {
    const { listener } = this;
    if (listener.threw !== undefined) return 0;
    this.isTelling = true;
    try {
      return listener.tell(fraction) === false ? 0 : 1;
    } catch (error) {
      listener.threw = { error };
      return 0;
    } finally {
      this.isTelling = false;
    }
  }

  /** Runs work that reports its progress to `tell`, if given. */
  listened(tell, work) {
    if (tell === undefined) return work();
    if (typeof tell !== 'function') throw new QuoinError('invalid_argument', 'progress must be a function');
    const listener = { tell };
    this.run('quoin_web_listen', 1);
    this.listener = listener;
    try {
      return work();
    } catch (error) {
      throw listener.threw === undefined ? error : listener.threw.error;
    } finally {
      this.listener = undefined;
      if (!this.dead) this.run('quoin_web_listen', 0);
    }
  }

  /** Calls a function of quoin.h. */
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

  /** Copies `count` numbers; returns null for a null address. */
  numbers(Kind, at, count) {
    return at === 0 ? null : new Kind(this.exports.memory.buffer, at, count).slice();
  }

  /** Calls use(address) with `bytes` of memory, and frees it. */
  with(bytes, use) {
    // malloc takes a size modulo 2^32, and never returns half of the address space or more.
    const at = bytes < 2 ** 31 ? this.run('malloc', Math.max(bytes, 1)) >>> 0 : 0;
    if (at === 0) throw new QuoinError('out_of_memory', `no memory for ${bytes} bytes`);
    try {
      return use(at);
    } finally {
      if (!this.dead) this.run('free', at);
    }
  }

  /** Copies an ArrayBuffer or a typed array to an address. */
  put(array, at) {
    const { buffer = array, byteOffset = 0, byteLength } = array;
    const bytes = new Uint8Array(buffer, byteOffset, byteLength);
    new Uint8Array(this.exports.memory.buffer, at, bytes.length).set(bytes);
  }

  withBytes(bytes, use) {
    return this.with(bytes.byteLength, (at) => {
      this.put(bytes, at);
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

  /** Calls `use` with a function that reads the fields of quoin_mesh_data by number, and frees the mesh. */
  withMesh(mesh, use) {
    try {
      return this.withStruct('meshData', (at) => {
        this.call('quoin_mesh_view', mesh, at);
        return use((index) => this.view().getUint32(at + 4 * index, true));
      });
    } finally {
      if (!this.dead) this.run('quoin_free', mesh);
    }
  }

  takeMesh(mesh) {
    return this.withMesh(mesh, (field) => {
      const vertices = field(1);
      return {
        positions: this.numbers(Float32Array, field(4), 3 * vertices) ?? new Float32Array(),
        normals: this.numbers(Float32Array, field(5), 3 * vertices) ?? new Float32Array(),
        colours: this.numbers(Uint8Array, field(6), 4 * vertices),
        occlusion: this.numbers(Float32Array, field(7), vertices),
        indices: this.numbers(Uint32Array, field(8), field(2)) ?? new Uint32Array(),
      };
    });
  }

  /** `label`: converts a 64-bit label to the caller's type. */
  takeLabels(mesh, label) {
    return this.withMesh(mesh, (field) => {
      const numbers = this.numbers(BigInt64Array, field(9), 4 * field(3)) ?? [];
      return {
        positions: this.numbers(Float32Array, field(4), 3 * field(1)) ?? new Float32Array(),
        indices: this.numbers(Uint32Array, field(8), field(2)) ?? new Uint32Array(),
        interfaces: Array.from({ length: numbers.length / 4 }, (_, i) => {
          const [back, front, firstIndex, indexCount] = numbers.slice(4 * i, 4 * i + 4);
          return { back: label(back), front: label(front), firstIndex: Number(firstIndex),
                   indexCount: Number(indexCount) };
        }),
      };
    });
  }
}

const isBytes = (given) => given instanceof ArrayBuffer || ArrayBuffer.isView(given);

/** Compiles a WebAssembly.Module from its bytes or address. Errors: QuoinError. */
async function compile(given) {
  try {
    return await compiled(given);
  } catch (error) {
    if (error instanceof QuoinError) throw error;
    // Invalid modules are format errors. All other errors mean that the module is not available.
    const code = error instanceof WebAssembly.CompileError ? 'bad_format' : 'cannot_read';
    const name = isBytes(given) ? '' : ` ${given}`;
    throw new QuoinError(code, `cannot compile the WebAssembly module${name}: ${error.message}`);
  }
}

async function compiled(given) {
  if (isBytes(given)) return WebAssembly.compile(given);
  if (String(given).startsWith('file:')) {
    // Written so that bundlers for browsers do not resolve the module.
    const name = ['node:fs', 'promises'].join('/');
    const { readFile } = await import(/* webpackIgnore: true */ /* @vite-ignore */ name);
    return WebAssembly.compile(await readFile(new URL(given)));
  }
  const response = await fetch(given);
  if (!response.ok) throw new QuoinError('cannot_read', `${given}: ${response.status} ${response.statusText}`);
  // Compiles while downloading if the server sends the MIME type.
  if (response.headers.get('Content-Type') === 'application/wasm') return WebAssembly.compileStreaming(response);
  return WebAssembly.compile(await response.arrayBuffer());
}

/** One of the two modules and its live instance. */
class Engine {
  #usual;     // returns the default address
  #compiled;  // a promise of the WebAssembly.Module
  #instance;  // a promise of the live Instance, or undefined

  constructor(usual) {
    this.#usual = usual;
  }

  async start(given) {
    if (given !== undefined || this.#compiled === undefined) {
      const compiled = compile(given ?? this.#usual());
      compiled.catch(() => { if (this.#compiled === compiled) this.#compiled = undefined; });
      this.#compiled = compiled;
      this.#instance = undefined;
    }
    return this.alive();
  }

  /** Returns the instance for new work, a fresh one if the last one has ended. Concurrent callers share it. */
  async alive() {
    if (this.#compiled === undefined) return this.start();
    const promise = (this.#instance ??= this.#fresh());
    const instance = await promise;
    if (!instance.dead) return instance;
    if (this.#instance === promise) this.#instance = undefined;
    return this.alive();
  }

  #fresh() {
    const fresh = this.#compiled.then((module) => new Instance(module));
    fresh.catch(() => { if (this.#instance === fresh) this.#instance = undefined; });
    return fresh;
  }
}

// Bundlers recognise these expressions.
const whole = new Engine(() => new URL('./quoin.wasm', import.meta.url));
const small = new Engine(() => new URL('./quoin-small.wasm', import.meta.url));

export async function start(module, options = {}) {
  known(options, ['small']);
  await (options.small ? small : whole).start(module);
}

const registry = new FinalizationRegistry(({ instance: of, free, handle }) => {
  if (!of.dead) of.run(free, handle);
});

export class Scene {
  #instance;
  #handle;

  constructor(of, handle) {
    this.#instance = of;
    this.#handle = handle;
    registry.register(this, { instance: of, free: 'quoin_free', handle }, this);
    this.isSmall = of.isSmall;
    this.warnings = Object.freeze(this.#texts());
    this.grids = Object.freeze(this.#grids());
    this.types = Object.freeze(this.#types());
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

  /** Calls `use` with the address of a quoin_mesh_options. */
  #withMeshOptions(options, use) {
    const { smooth, watertight } = known(options, ['smooth', 'watertight', 'progress']);
    const of = this.#instance;
    return of.withStruct('meshOptions', (at) => {
      const view = of.view();
      view.setInt32(at + 4, (smooth ?? this.grids.some((grid) => grid.hasField)) ? 1 : 0, true);
      view.setInt32(at + 20, watertight ? 1 : 0, true);
      return use(at);
    });
  }

  glb(options) {
    return this.file('.glb', options);
  }

  file(extension, options = {}) {
    const of = this.#instance;
    const { progress } = known(options, ['smooth', 'watertight', 'progress']);
    const kinds = ['.glb', '.ply', '.stl', '.3mf', '.vox'];
    if (!kinds.some((kind) => typeof extension === 'string' && extension.toLowerCase().endsWith(kind)))
      throw new QuoinError('unsupported',
                           `cannot write ${String(extension)}: the extension must be one of ${kinds.join(', ')}`);
    const write = (wanted, name, out) => {
      of.call('quoin_web_write', this.#handle, name, wanted, out, out + 4);
      const at = of.view().getUint32(out, true);
      const bytes = of.numbers(Uint8Array, at, of.view().getUint32(out + 4, true));
      of.run('quoin_web_release');
      return bytes;
    };
    return of.listened(progress, () => this.#withMeshOptions(options, (wanted) =>
      of.withText(extension, (name) => of.with(8, (out) => write(wanted, name, out)))));
  }

  mesh(grid, options = {}) {
    const of = this.#instance;
    const { progress } = known(options, ['smooth', 'watertight', 'progress']);
    return of.listened(progress, () => this.#withMeshOptions(options, (wanted) =>
      of.takeMesh(of.handle('quoin_grid_mesh', this.#handle, index(grid), wanted))));
  }

  read(grid, min, shape) {
    const of = this.#instance;
    const numbers = [...three(min, 'min'), ...three(shape, 'shape')].map((value) => int32(value, 'min or shape'));
    const count = numbers[3] * numbers[4] * numbers[5];
    if (!(count >= 0 && count <= 2 ** 30)) throw new QuoinError('invalid_argument', 'the box is out of range');
    return of.withBytes(Int32Array.from(numbers), (box) => of.with(2 * count, (out) => {
      of.call('quoin_grid_read', this.#handle, index(grid), box, box + 12, out, count);
      return of.numbers(Uint16Array, out, count);
    }));
  }

  render(options = {}) {
    const of = this.#instance;
    const { width = 1280, height = 720, progress } = known(options, renderNames);
    const pixels = pixelsOf(width, height);
    return of.listened(progress, () => of.withStruct('renderOptions', (wanted) => of.with(3 * pixels, (out) => {
      putRenderOptions(of.view(), wanted, { ...options, width, height });
      of.call('quoin_scene_render', this.#handle, wanted, out, 3 * pixels);
      const rgb = new Uint8Array(of.exports.memory.buffer, out, 3 * pixels);
      const rgba = new Uint8ClampedArray(4 * pixels).fill(255);
      for (let i = 0; i < pixels; ++i) {
        rgba[4 * i] = rgb[3 * i];
        rgba[4 * i + 1] = rgb[3 * i + 1];
        rgba[4 * i + 2] = rgb[3 * i + 2];
      }
      return { width, height, rgba };
    })));
  }

  rays(origins, directions, options = {}) {
    const { maxT = Infinity } = known(options, ['maxT']);
    const [from, along] = [origins, directions].map(doubles);
    const count = from.length / 3;
    if (typeof maxT !== 'number' || Number.isNaN(maxT))
      throw new QuoinError('invalid_argument', 'maxT must be a number');
    if (!Number.isInteger(count) || along.length !== from.length)
      throw new QuoinError('invalid_argument', 'origins and directions need three numbers per ray, ' +
                           `not ${from.length} and ${along.length} numbers`);
    const of = this.#instance;
    // Per ray: origin, direction, t and normal are doubles; then the voxel's integers and the type.
    const at = [0, 24, 48, 56, 80, 92].map((bytes) => bytes * count);
    return of.withStruct('hits', (hits) => of.with(94 * count, (memory) => {
      of.put(from, memory);
      of.put(along, memory + at[1]);
      [2, 4, 5, 3].forEach((part, i) => of.view().setUint32(hits + 4 + 4 * i, memory + at[part], true));
      of.call('quoin_scene_rays', this.#handle, count, memory, memory + at[1], maxT, hits);
      return { t: of.numbers(Float64Array, memory + at[2], count),
               normal: of.numbers(Float64Array, memory + at[3], 3 * count),
               voxel: of.numbers(Int32Array, memory + at[4], 3 * count),
               type: of.numbers(Uint16Array, memory + at[5], count) };
    }));
  }

  forShaders() {
    return new ShaderScene(this.#instance, this.#handle);
  }

  free() {
    if (!this.#instance.dead) this.#instance.run('quoin_free', this.#handle);
    registry.unregister(this);
  }
}

const renderNames = ['width', 'height', 'samples', 'camera', 'sun', 'progress'];

function pixelsOf(width, height) {
  if (!(Number.isInteger(width) && Number.isInteger(height) && width > 0 && height > 0 && width * height <= 2 ** 28))
    throw new QuoinError('invalid_argument', 'width and height must be integers with at most 2^28 pixels in total');
  return width * height;
}

/** Writes a quoin_render_options. */
function putRenderOptions(view, at, { width, height, samples = 4, camera, sun }) {
  [width, height, whole32(samples, 'samples', 1)].forEach((value, i) => view.setInt32(at + 4 + 4 * i, value, true));
  const put = (flag, from, numbers) => {
    view.setInt32(at + flag, 1, true);
    numbers.forEach((value, i) => view.setFloat64(at + from + 8 * i, value, true));
  };
  if (camera !== undefined) {
    const { fovDegrees = 45 } = known(camera, ['position', 'lookAt', 'fovDegrees'], 'camera');
    if (typeof fovDegrees !== 'number') throw new QuoinError('invalid_argument', 'camera.fovDegrees must be a number');
    put(24, 32, [...three(camera.position, 'camera.position'), ...three(camera.lookAt, 'camera.lookAt'), fovDegrees]);
  }
  if (sun !== undefined) put(88, 96, three(sun, 'sun'));
}

/** A scene's data for ray-marching shaders. */
export class ShaderScene {
  #instance;
  #march;

  constructor(of, scene) {
    this.#instance = of;
    this.#march = of.with(4, (out) => {
      of.call('quoin_web_march_begin', scene, out);
      return of.view().getUint32(out, true);
    });
    registry.register(this, { instance: of, free: 'quoin_web_march_free', handle: this.#march }, this);
    try {
      [this.bytes, this.has] = of.with(12, (out) => {
        of.call('quoin_web_march_data', this.#march, out, out + 4, out + 8);
        return [this.#taken(out), of.view().getInt32(out + 8, true)];
      });
    } catch (error) {
      this.free();
      throw error;
    }
  }

  #taken(out) {
    const view = this.#instance.view();
    return this.#instance.numbers(Uint8Array, view.getUint32(out, true), view.getUint32(out + 4, true));
  }

  frame(options = {}) {
    const of = this.#instance;
    const { width = 1280, height = 720 } = known(options, renderNames);
    pixelsOf(width, height);
    return of.withStruct('renderOptions', (wanted) => of.with(8, (out) => {
      putRenderOptions(of.view(), wanted, { ...options, width, height });
      of.call('quoin_web_march_frame', this.#march, wanted, out, out + 4);
      return this.#taken(out);
    }));
  }

  sample(number) {
    const of = this.#instance;
    const bytes = 104;  // of a ShaderPush
    return of.with(bytes, (out) => {
      of.call('quoin_web_march_sample', index(number), out, bytes);
      return of.numbers(Uint8Array, out, bytes);
    });
  }

  free() {
    if (!this.#instance.dead) this.#instance.run('quoin_web_march_free', this.#march);
    registry.unregister(this);
    this.#march = 0;
  }
}

/** Returns `options`; throws for names not in `names`, since a misspelt option would have no effect. */
function known(options, names, what = 'options') {
  if (typeof options !== 'object' || options === null)
    throw new QuoinError('invalid_argument', `${what} must be an object with the properties ${names.join(', ')}`);
  const other = Object.keys(options).find((name) => !names.includes(name));
  if (other !== undefined)
    throw new QuoinError('invalid_argument', `${what}: unknown option ${other}; known: ${names.join(', ')}`);
  return options;
}

/** Returns the index of a grid or sample; -1, which is never valid, for other values. */
function index(number) {
  return Number.isInteger(number) && number >= 0 && number < 2 ** 31 ? number : -1;
}

/** Returns `value`; throws unless it is a 32-bit integer. */
function int32(value, what) {
  if (!Number.isInteger(value) || (value | 0) !== value)
    throw new QuoinError('invalid_argument', `${what} must be a 32-bit integer`);
  return value;
}

/** Returns a list of three numbers. The functions of quoin.h check that they are finite. */
function three(list, what) {
  const numbers = list?.length === 3 ? Array.from(list) : [];
  if (numbers.length !== 3 || numbers.some((value) => typeof value !== 'number'))
    throw new QuoinError('invalid_argument', `${what} must be a list of three numbers`);
  return numbers;
}

function doubles(list) {
  if (typeof list?.length !== 'number') throw new QuoinError('invalid_argument', 'rays must be lists of numbers');
  if (list.length >= 2 ** 28) throw new QuoinError('out_of_memory', `no memory for ${list.length} numbers of rays`);
  return Float64Array.from(list, (number) => {
    if (typeof number !== 'number') throw new QuoinError('invalid_argument', 'rays must be lists of numbers');
    return number;
  });
}

/** Throws unless `given` is bytes. The message says how to get bytes from common other objects. */
function checkBytes(given) {
  if (!isBytes(given)) {
    const kind = given === null || given === undefined ? String(given) : given.constructor?.name ?? typeof given;
    const how = typeof given?.arrayBuffer === 'function' ? ': await its arrayBuffer()' :
      typeof given?.then === 'function' ? ': await it' : '';
    throw new QuoinError('invalid_argument', `bytes must be an ArrayBuffer or a typed array, not ${kind}${how}`);
  }
  try {
    new Uint8Array(given.buffer ?? given, 0, 0);
  } catch {
    throw new QuoinError('invalid_argument', 'the ArrayBuffer of these bytes was transferred');
  }
}

const loadNames = ['showHidden', 'frame', 'radius', 'iso', 'meshVoxels', 'voxelSize', 'raw', 'heights', 'packs',
                   'small', 'progress'];

export async function load(bytes, options = {}) {
  checkBytes(bytes);
  known(options, loadNames);
  checkPacks(options.packs ?? []);
  // The small module does not support raw values and height maps.
  if (options.small && options.raw === undefined && options.heights === undefined) {
    const scene = loaded(await small.alive(), bytes, options);
    if (scene !== undefined) return scene;
  }
  const scene = loaded(await whole.alive(), bytes, options);
  if (scene === undefined)
    throw new QuoinError('unsupported', 'the small module, which reads only .vox, was started without { small: true }');
  return scene;
}

/** Loads a scene; returns undefined if the module cannot read such files. */
function loaded(of, bytes, { progress, ...options }) {
  return of.withBytes(bytes, (at) => {
    if (of.isSmall && of.run('quoin_web_reads', at, bytes.byteLength) === 0) return undefined;
    const handle = of.listened(progress, () => of.withStruct('loadOptions', (wanted) => {
      putLoadOptions(of.view(), wanted, options);
      // The small module reads no files with blocks of Minecraft.
      return withPacks(of, wanted, of.isSmall ? [] : options.packs ?? [],
                       () => of.handle('quoin_scene_load_bytes_with', at, bytes.byteLength, wanted));
    }));
    return new Scene(of, handle);
  });
}

const ownPack = 'builtin';

function checkPacks(packs) {
  if (!Array.isArray(packs))
    throw new QuoinError('invalid_argument', 'packs must be a list of ArrayBuffers, typed arrays or "builtin"');
  for (const pack of packs) {
    if (pack !== ownPack) checkBytes(pack);
  }
}

/** Copies packs to memory, and sets them in the quoin_load_options at an address, for the time of use(). */
function withPacks(of, wanted, packs, use) {
  const zips = packs.filter((pack) => pack !== ownPack);
  const putFrom = (i, addresses) => {
    if (i < zips.length) return of.withBytes(zips[i], (zip) => putFrom(i + 1, [...addresses, zip]));
    const lists = Uint32Array.of(...addresses, ...zips.map(({ byteLength }) => byteLength));
    const put = (zipLists, paths) => {
      const view = of.view();
      [paths, zips.length < packs.length ? 1 : 0, zipLists, zipLists + 4 * zips.length, zips.length].forEach(
        (value, i) => view.setUint32(wanted + 112 + 4 * i, value, true));
      return use();
    };
    return of.withBytes(lists, (zipLists) => of.withText(ownPack, (own) =>
      of.withBytes(Uint32Array.of(own), (paths) => put(zipLists, paths))));
  };
  return packs.length === 0 ? use() : putFrom(0, []);
}

const scalarNames = ['uint8', 'int8', 'uint16', 'int16', 'uint32', 'int32', 'uint64', 'int64', 'float32', 'float64'];
const heightEncodings = ['none', 'grey', 'mapbox', 'terrarium'];

/** Returns the index of a name in `names`, without the first `skipped`. */
function numberOf(name, names, what, skipped = 0) {
  const found = names.indexOf(name);
  if (found < skipped)
    throw new QuoinError('invalid_argument', `${what} must be one of ${names.slice(skipped).join(', ')}`);
  return found;
}

/** Returns `value`; 0, the default, if it is not given. */
function amount(value, what) {
  if (value === undefined) return 0;
  if (typeof value !== 'number' || !(value > 0 && value < Infinity))
    throw new QuoinError('invalid_argument', `${what} must be a positive number`);
  return value;
}

function whole32(value, what, least) {
  if (value === undefined) return 0;
  if (int32(value, what) < least) throw new QuoinError('invalid_argument', `${what} must be at least ${least}`);
  return value;
}

/** Writes a quoin_load_options. */
function putLoadOptions(view, at, { showHidden, frame, radius, iso, meshVoxels, voxelSize, raw, heights }) {
  const ints = (from, ...values) => values.forEach((value, i) => view.setInt32(at + from + 4 * i, value, true));
  const doubles = (from, ...values) => values.forEach((value, i) => view.setFloat64(at + from + 8 * i, value, true));
  if (iso !== undefined && (typeof iso !== 'number' || !Number.isFinite(iso)))
    throw new QuoinError('invalid_argument', 'iso must be a finite number');
  ints(8, showHidden ? 1 : 0, whole32(frame, 'frame', 0), whole32(radius, 'radius', 1), iso === undefined ? 0 : 1);
  view.setFloat32(at + 24, iso ?? 0, true);
  ints(28, whole32(meshVoxels, 'meshVoxels', 1));
  doubles(32, amount(voxelSize, 'voxelSize'));
  if (raw !== undefined) {
    known(raw, ['shape', 'type', 'bigEndian'], 'raw');
    const shape = three(raw.shape, 'raw.shape').map((length) => whole32(length, 'raw.shape', 1));
    ints(40, ...shape, numberOf(raw.type ?? 'uint8', scalarNames, 'raw.type'), raw.bigEndian ? 1 : 0);
  }
  if (heights !== undefined) {
    const { encoding, metresPerLevel, metresPerPixel, metresPerVoxel, exaggeration, groundDepth, smooth } =
      known(heights, ['encoding', 'metresPerLevel', 'metresPerPixel', 'metresPerVoxel', 'exaggeration', 'groundDepth',
                      'smooth'], 'heights');
    ints(60, numberOf(encoding, heightEncodings, 'heights.encoding', 1));
    doubles(64, amount(metresPerLevel, 'heights.metresPerLevel'), amount(metresPerPixel, 'heights.metresPerPixel'),
            amount(metresPerVoxel, 'heights.metresPerVoxel'), amount(exaggeration, 'heights.exaggeration'));
    ints(96, whole32(groundDepth, 'heights.groundDepth', 1), smooth ? 1 : 0);
  }
}

/** Calls `use` with the instance and the address of a quoin_array. */
async function withArray(array, shape, { spacing = [1, 1, 1], origin = [0, 0, 0], progress }, use) {
  const scalar = scalars.findIndex((Kind) => Kind !== null && array instanceof Kind);
  if (scalar < 0) throw new QuoinError('invalid_argument', 'the array must be a typed array of numbers');
  const [nx, ny, nz] = three(shape, 'shape');
  if ([nx, ny, nz].some((n) => !Number.isSafeInteger(n) || n < 0) || nx * ny * nz !== array.length)
    throw new QuoinError('invalid_argument', `the shape ${[nx, ny, nz]} does not match ${array.length} samples`);
  const placed = [...three(spacing, 'spacing'), ...three(origin, 'origin')];
  const of = await whole.alive();
  return of.listened(progress, () => of.withBytes(array, (data) => of.withStruct('array', (at) => {
    const view = of.view();
    const size = array.BYTES_PER_ELEMENT;
    view.setUint32(at + 4, data, true);
    view.setInt32(at + 8, scalar, true);
    const strides = [size * ny * nz, size * nz, size];
    [nx, ny, nz, ...strides].forEach((value, i) => view.setBigInt64(at + 16 + 8 * i, BigInt(value), true));
    placed.forEach((value, i) => view.setFloat64(at + 64 + 8 * i, value, true));
    return use(of, at);
  })));
}

export async function surfaceNets(array, shape, iso, options = {}) {
  known(options, ['spacing', 'origin', 'solidBelow', 'progress']);
  if (typeof iso !== 'number') throw new QuoinError('invalid_argument', 'iso must be a number');
  return withArray(array, shape, options, (of, at) =>
    of.takeMesh(of.handle('quoin_surface_nets', at, iso, options.solidBelow ? 1 : 0, 0)));
}

export async function meshLabels(array, shape, options = {}) {
  const { background = 0, relaxationSteps = 4 } =
    known(options, ['spacing', 'origin', 'background', 'relaxationSteps', 'progress']);
  const isUnsigned = array instanceof BigUint64Array;
  const bits = isUnsigned ? BigInt.asUintN : BigInt.asIntN;
  const isWhole = typeof background === 'bigint' || Number.isSafeInteger(background);
  if (!isWhole || bits(64, BigInt(background)) !== BigInt(background))
    throw new QuoinError('invalid_argument', `background must be an integer label, not ${background}`);
  int32(relaxationSteps, 'relaxationSteps');
  const label = isUnsigned || array instanceof BigInt64Array ? (number) => bits(64, number) : Number;
  return withArray(array, shape, options, (of, at) =>
    of.takeLabels(of.handle('quoin_mesh_labels', at, BigInt(background), relaxationSteps, 0), label));
}

export async function toThree(scene, GLTFLoader, options = {}) {
  if (!(scene instanceof Scene)) throw new QuoinError('invalid_argument', 'scene must be a Scene from load()');
  if (typeof GLTFLoader?.prototype?.parseAsync !== 'function')
    throw new QuoinError('invalid_argument', 'GLTFLoader must be the class of three/addons/loaders/GLTFLoader.js');
  return (await new GLTFLoader().parseAsync(scene.glb(options).buffer, '')).scene;
}

export async function version() {
  const of = await whole.alive();
  return of.text(of.run('quoin_version'));
}
