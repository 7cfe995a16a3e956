// Invalid and broken files give an error, and the next file can be loaded.
//   node bad.mjs PACKAGE GOOD_FILE
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { check, found, refusing } from './checks.mjs';

const [packageFolder, goodFile] = process.argv.slice(2);
const { load, meshLabels, start, surfaceNets, toThree, QuoinError, version } =
  await import(pathToFileURL(join(packageFolder, 'quoin.js')));
const good = new Uint8Array(readFileSync(goodFile));
const before = (await load(good)).glb();
const refuses = refusing(QuoinError);

/** Checks that loading ends with a scene or a QuoinError. */
async function survives(what, bytes) {
  try {
    (await load(bytes)).free();
    check(true);
  } catch (error) {
    check(error instanceof QuoinError, `${what}: ${error}`);
  }
}

let seed = 12345;
const random = () => (seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0) / 2 ** 32;

await refuses('a module that is none', () => start(new Uint8Array(8)), 'bad_format');
await refuses('a module that is nowhere', () => start('file:///nowhere/quoin.wasm'), 'cannot_read');
await refuses('a module of no address', () => start('quoin://nowhere'), 'cannot_read');
await refuses('nothing', () => load(new Uint8Array(0)));
await refuses('a string', () => load('castle.vox'), 'invalid_argument');
/** Checks that the error message contains helpful words. */
async function tells(what, work, words) {
  try {
    await work();
    check(false, `${what}: no error`);
  } catch (error) {
    check(error instanceof QuoinError && error.code === 'invalid_argument' && words.test(error.message),
          `${what}: ${error}`);
  }
}
await tells('a file of the browser', () => load(new Blob([good])), /not Blob: await its arrayBuffer\(\)/);
await tells('a response', () => load(new Response(good)), /not Response: await its arrayBuffer\(\)/);
await tells('a promise', () => load(Promise.resolve(good)), /not Promise: await it/);
await tells('nothing at all', () => load(), /not undefined/);
const gone = good.slice();
structuredClone(gone.buffer, { transfer: [gone.buffer] });
for (const bytes of [gone, gone.buffer]) await tells('bytes that are gone', () => load(bytes), /transferred/);
await refuses('noise', () => load(Uint8Array.from({ length: 4096 }, () => 256 * random())));
await refuses('no JSON', () => load(new TextEncoder().encode('{"quoin_scene": 1, "grids": [')));
for (const size of [4, 8, 20, 60, good.length >> 1, good.length - 1])
  await survives(`cut to ${size}`, good.subarray(0, size));
for (let i = 0; i < 60; ++i) {
  const bytes = good.slice(0, 20_000 + (i % 2) * (good.length - 20_000));
  for (let n = 0; n < 8; ++n) bytes[Math.floor(bytes.length * (n < 4 ? random() * 0.01 : random()))] = 256 * random();
  await survives(`damage ${i}`, bytes);
}
// Triangles: broken and damaged files.
const text = (string) => new TextEncoder().encode(string);
await refuses('a GLB without an end', () => load(text('glTF\x02\0\0\0\xff\xff\0\0')));
await refuses('a glTF whose meshes are a number', () => load(text('{"asset": {"version": "2.0"}, "meshes": 5}')));
await refuses('a glTF without triangles', () => load(text('{"asset": {"version": "2.0"}, "scenes": [{"nodes": []}]}')));
await refuses('a glTF that is cut off', () => load(text('{"asset": {"version": "2.0"}, "meshes": [')));
const triangles = { glb: new Uint8Array(before), obj: text('v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\nf 1 2 3\nf 1 2 -1\n') };
for (const [kind, whole] of Object.entries(triangles)) {
  for (let i = 0; i < 20; ++i) {
    const bytes = whole.slice(0, Math.min(whole.length, 6000 + Math.floor(6000 * random())));
    for (let n = 0; n < 4; ++n) bytes[Math.floor(bytes.length * random())] = 256 * random();
    await survives(`${kind}, damage ${i}`, bytes);
  }
}
// A volume whose header claims 2 GB, and one that claims more than the address space.
for (const size of ['1024 1024 512', '4096 4096 4096']) {
  const header = `NRRD0004\ntype: float\ndimension: 3\nsizes: ${size}\nencoding: raw\nendian: little\n\n`;
  await refuses(`a header of ${size}`, () => load(new TextEncoder().encode(header)));
}
// Samples that exhaust the memory end the instance but not the page.
const many = new Uint8Array(600 * 600 * 600);
for (let i = 0; i < many.length; ++i) many[i] = (i * 2654435761) >>> 31;
await refuses('more triangles than memory', () => surfaceNets(many, [600, 600, 600], 0.5),
              'out_of_memory', 'trap', 'limit_exceeded');
await refuses('a shape that does not fit', () => surfaceNets(new Float32Array(8), [2, 2, 3], 0), 'invalid_argument');
await refuses('strings', () => surfaceNets(['a'], [1, 1, 1], 0), 'invalid_argument');
await refuses('an iso that is none', () => surfaceNets(new Float32Array(8), [2, 2, 2], NaN), 'invalid_argument');
const scene = await load(good);
await refuses('no grid', () => scene.mesh(99_999), 'invalid_argument');
await refuses('a fraction of a grid', () => scene.mesh(0.5), 'invalid_argument');
await refuses('no extension', () => scene.file('.xyz'), 'unsupported');
await refuses('an image without a size', () => scene.render({ width: 0 }), 'invalid_argument');
await refuses('a camera nowhere', () => scene.render({ camera: { position: [NaN, 0, 0], lookAt: [0, 0, 0] } }));
for (const extension of [undefined, null, 3, '', 'glb', '.obj', '.json', '.quoin'])
  await refuses(`files of the kind ${extension}`, () => scene.file(extension), 'unsupported');
// Misspelt and missing options.
const eight = new Uint8Array(8);
const cube = [2, 2, 2];
const takesOptions = {
  load: (options) => load(good, options), start: (options) => start(undefined, options),
  raw: (raw) => load(eight, { raw: { shape: cube, ...raw } }),
  glb: (options) => scene.glb(options), file: (options) => scene.file('.ply', options),
  mesh: (options) => scene.mesh(0, options), render: (options) => scene.render(options),
  camera: (camera) => scene.render({ width: 8, height: 8, camera }), shaders: (options) => shaders.frame(options),
  heights: (heights) => load(good, { heights }), rays: (options) => scene.rays([0, 9, 0], [0, -1, 0], options),
  surfaceNets: (options) => surfaceNets(eight, cube, 0, options),
  meshLabels: (options) => meshLabels(eight, cube, options),
};
// Values written into the module must have the length and type that it expects.
const small = { width: 16, height: 8 };
const image = () => Buffer.from(scene.render(small).rgba);
const imageBefore = image();
const shaders = scene.forShaders();
const [here, there] = [[0, 9, 9], [0, 0, 0]];
for (const [what, call] of Object.entries(takesOptions)) {
  await tells(`${what}, misspelt`, async () => call({ watertigt: true }), /unknown option watertigt; known: \w+/);
  if (what === 'raw') continue;  // these values would be spread into an object
  for (const none of [null, 3, 'small'])
    await tells(`${what}: ${none}`, async () => call(none), /must be an object with the properties/);
}
await tells('no loader', () => toThree(scene), /GLTFLoader must be the class/);
await tells('a loader that is an object', () => toThree(scene, { parseAsync() {} }), /GLTFLoader must be the class/);
await tells('no scene', () => toThree(undefined, class { async parseAsync() {} }), /scene must be a Scene/);
for (const iso of [null, '0', 1n, undefined, {}])
  await tells(`an iso of ${iso}`, () => surfaceNets(eight, cube, iso), /iso must be a number/);
const noThree = { 'nothing': null, 'a number': 3, 'an object': { x: 1, y: 1, z: 1 }, 'one number': [1],
                  'two numbers': [1, 2], 'four numbers': [1, 1, 1, 1], '64 numbers': Array(64).fill(1),
                  'two million numbers': Array(2e6).fill(1), 'texts': ['a', 'b', 'c'], 'a text': 'abc',
                  'big integers': [1n, 1n, 1n] };
for (const [what, list] of Object.entries(noThree)) {
  for (const [where, options] of Object.entries({
    'the sun': { sun: list }, 'the position': { camera: { position: list, lookAt: there } },
    'the target': { camera: { position: here, lookAt: list } } })) {
    await refuses(`${what} for ${where}`, () => scene.render({ ...small, ...options }), 'invalid_argument');
    await refuses(`${what} for ${where} of shaders`, () => shaders.frame({ ...small, ...options }), 'invalid_argument');
  }
  await refuses(`${what} for spacing`, () => surfaceNets(new Float32Array(8), [2, 2, 2], 0, { spacing: list }),
                'invalid_argument');
  await refuses(`${what} for an origin`, () => surfaceNets(new Float32Array(8), [2, 2, 2], 0, { origin: list }),
                'invalid_argument');
  await refuses(`${what} for a shape`, () => surfaceNets(new Float32Array(8), list, 0), 'invalid_argument');
  await refuses(`${what} for a box's corner`, () => scene.read(0, list, [1, 1, 1]), 'invalid_argument');
  await refuses(`${what} for a box's shape`, () => scene.read(0, [0, 0, 0], list), 'invalid_argument');
}
for (const camera of [null, 3, {}, { position: here }, { lookAt: there },
                      { position: here, lookAt: there, fovDegrees: '45' }])
  await refuses(`a camera of ${JSON.stringify(camera)}`, () => scene.render({ ...small, camera }), 'invalid_argument');
for (const sun of [[NaN, 1, 1], [0, 0, 0]])
  await refuses(`a sun at ${sun}`, () => scene.render({ ...small, sun }), 'invalid_argument');
for (const samples of ['many', 0.5, 0, -1, NaN, 2 ** 31, 2 ** 32 + 1])
  await refuses(`${samples} samples`, () => scene.render({ ...small, samples }), 'invalid_argument');
await refuses('a width that is a big integer', () => scene.render({ width: 8n, height: 8 }), 'invalid_argument');
for (const number of [-1, 2 ** 31, 2 ** 32, '0']) {
  await refuses(`grid ${number}`, () => scene.mesh(number), 'invalid_argument');
  await refuses(`grid ${number} that is read`, () => scene.read(number, [0, 0, 0], [1, 1, 1]), 'invalid_argument');
  await refuses(`sample ${number}`, () => shaders.sample(number), 'invalid_argument');
}
await refuses('a corner beyond 32 bits', () => scene.read(0, [2 ** 32, 0, 0], [1, 1, 1]), 'invalid_argument');
await refuses('a shape beyond 32 bits', () => scene.read(0, [0, 0, 0], [2 ** 32, 1, 0]), 'invalid_argument');
await refuses('half a voxel', () => scene.read(0, [0, 0, 0], [0.5, 2, 1]), 'invalid_argument');
// More than the module can address; these bytes are never accessed.
for (const bytes of [2 ** 31, 2 ** 32 + 64])
  await refuses(`a file of ${bytes} bytes`, () => load(new ArrayBuffer(bytes)), 'out_of_memory');
for (const rays of ['abc', ['0', '0', '0'], [0, 0, undefined]])
  await refuses(`rays of ${rays}`, () => scene.rays(rays, [0, 0, 1]), 'invalid_argument');
await refuses('more rays than memory', () => scene.rays({ length: 3 * 2 ** 33 }, { length: 3 * 2 ** 33 }),
              'out_of_memory');
check(image().equals(imageBefore), 'refused calls do not change the image');
shaders.free();
await refuses('shaders that were freed', () => shaders.frame(small), 'invalid_argument');
scene.free();
await refuses('a scene that was freed', () => scene.glb(), 'bad_handle');

const after = (await load(good)).glb();
check(Buffer.from(before).equals(Buffer.from(after)), 'after all that the good file has another GLB');
check(/^\d+\.\d+\.\d+$/.test(await version()), 'the version');
const ball = Float32Array.from({ length: 20 ** 3 }, (_, i) =>
  8 - Math.hypot(Math.floor(i / 400) - 9.5, Math.floor(i / 20) % 20 - 9.5, i % 20 - 9.5));
const mesh = await surfaceNets(ball, [20, 20, 20], 0);
let furthest = 0;
for (let i = 0; i < mesh.positions.length; i += 3) {
  const at = [0, 1, 2].map((axis) => mesh.positions[i + axis] - 9.5);
  furthest = Math.max(furthest, Math.abs(Math.hypot(...at) - 8));
}
check(mesh.indices.length > 3000 && furthest < 0.1, `a ball's surface is off by ${furthest}`);
console.log(`${found.checked} checks, ${found.failed} failed`);
if (found.failed > 0) process.exit(1);
