// Load and mesh options: the tool with the same options writes the same. Invalid values give errors.
//   node options.mjs PACKAGE TOOL CORPUS THREE FILE.vox
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { check, found, refusing } from './checks.mjs';
import { oneVoxel, stonePack } from './packs.mjs';

const [packageFolder, tool, corpus, three, castle] = process.argv.slice(2);
const { load, toThree, QuoinError } = await import(pathToFileURL(join(packageFolder, 'quoin.js')));
const refuses = async (what, work, code = 'invalid_argument') => refusing(QuoinError)(what, work, code);
const scratch = mkdtempSync(join(tmpdir(), 'quoin-options-'));
const out = join(scratch, 'out.glb');

function native(file, ...args) {
  rmSync(out, { force: true });
  execFileSync(tool, ['convert', file, out, ...args], { stdio: ['ignore', 'ignore', 'pipe'] });
  return readFileSync(out);
}

// Bytes lack the file's name, which the tool gives to volumes, height maps and voxelised triangles.
const jsonOf = (glb) => JSON.parse(glb.toString('utf8', 20, 20 + glb.readUInt32LE(12)));
const arraysOf = (glb) => glb.subarray(20 + glb.readUInt32LE(12));
const areSame = (one, other) => arraysOf(one).equals(arraysOf(other)) && jsonOf(one).nodes.length > 0;

async function glbOf(bytes, options, meshing) {
  const scene = await load(bytes, options);
  const glb = Buffer.from(scene.glb(meshing));
  scene.free();
  return glb;
}

/** Checks that a file is read the same as by the tool with the same options, and differently without them. */
async function compare(what, file, options, args, without = {}) {
  const bytes = readFileSync(file);
  const glb = await glbOf(bytes, options);
  check(areSame(glb, native(file, ...args)), `${what}: another file than the tool's with ${args.join(' ')}`);
  if (without === null) return;
  check(!areSame(glb, await glbOf(bytes, without)), `${what}: the same without ${JSON.stringify(options)}`);
}

// ---- Raw values: a ball of big-endian 16-bit numbers.
{
  const [nx, ny, nz] = [24, 20, 16];
  const values = new DataView(new ArrayBuffer(2 * nx * ny * nz));
  for (let i = 0; i < nx * ny * nz; ++i) {
    const [x, y, z] = [i % nx, Math.floor(i / nx) % ny, Math.floor(i / nx / ny)];
    values.setInt16(2 * i, Math.round(1000 - 100 * Math.hypot(x - 11, y - 9, z - 7)), false);
  }
  const file = join(scratch, 'ball.raw');
  const bytes = new Uint8Array(values.buffer);
  writeFileSync(file, bytes);
  const raw = { shape: [nx, ny, nz], type: 'int16', bigEndian: true };
  const args = ['--raw-size', `${nx}x${ny}x${nz}`, '--raw-type', 'int16', '--raw-order', 'big'];
  await compare('a raw volume', file, { raw, iso: 400 }, [...args, '--iso', '400'], { raw, iso: 300 });
  await compare('a raw volume for the small module', file, { raw, small: true }, args, null);
  await refuses('a raw volume that is not said to be one', () => load(bytes), 'bad_format');
  await refuses('a raw volume of another size', () => load(bytes, { raw: { ...raw, shape: [nx, ny, nz + 1] } }),
                'bad_format');
  const wrong = { 'no shape': {}, 'null': null, 'two lengths': { shape: [2, 2] }, 'a length of 0': { shape: [0, 2, 2] },
                  'half a voxel': { shape: [0.5, 2, 2] }, 'text as a length': { shape: ['2', 2, 2] },
                  'a length beyond 32 bits': { shape: [2 ** 32 + 2, 2, 2] },
                  'a type that is none': { ...raw, type: 'int12' } };
  for (const [what, given] of Object.entries(wrong)) await refuses(`raw: ${what}`, () => load(bytes, { raw: given }));
  for (const iso of [NaN, Infinity, '400']) await refuses(`iso ${iso}`, () => load(bytes, { raw, iso }));
  await refuses('values alone that are heights', () => load(bytes, { raw, heights: { encoding: 'grey' } }));
}

// ---- Heights.
{
  const grey = join(corpus, 'heights/grey_16_bits.png');
  const encoding = 'grey';
  const heights = { encoding, metresPerLevel: 0.002, metresPerPixel: 2, metresPerVoxel: 1, exaggeration: 1.5,
                    groundDepth: 3 };
  const args = ['--heights', 'grey', '--metres-per-level', '0.002', '--metres-per-pixel', '2', '--metres-per-voxel',
                '1', '--exaggeration', '1.5', '--ground-depth', '3'];
  for (const name of ['metresPerLevel', 'metresPerPixel', 'metresPerVoxel', 'exaggeration', 'groundDepth'])
    await compare(`heights: ${name}`, grey, { heights }, args, { heights: { ...heights, [name]: 2 * heights[name] } });
  await compare('heights that are smooth', grey, { heights: { ...heights, smooth: true } },
                [...args, '--smooth-ground'], { heights });
  const rgb = join(corpus, 'heights/rgb.png');
  for (const other of ['mapbox', 'terrarium']) {
    const coarse = { metresPerPixel: 4000, exaggeration: 0.5 };
    await compare(other, rgb, { small: true, heights: { encoding: other, ...coarse } },
                  ['--heights', other, '--metres-per-pixel', '4000', '--exaggeration', '0.5'], null);
  }
  const bytes = readFileSync(grey);
  await refuses('an image loaded without a height encoding', () => load(bytes), 'bad_format');
  await refuses('heights that are not an image', () => load(new Uint8Array(64), { heights }), 'bad_format');
  for (const [name, value] of [['encoding', 'red'], ['encoding', 'none'], ['encoding', undefined],
                               ['metresPerLevel', 0], ['metresPerPixel', -1], ['metresPerVoxel', NaN],
                               ['exaggeration', '2'], ['exaggeration', 1e9], ['groundDepth', 0], ['groundDepth', 5000],
                               ['groundDepth', 1.5]])
    await refuses(`heights.${name}: ${value}`, () => load(bytes, { heights: { ...heights, [name]: value } }));
  await refuses('heights that are null', () => load(bytes, { heights: null }));
}

// ---- Resource packs: a stone of half the height, and one of a quarter.
{
  const scene = join(scratch, 'scene.json');
  const house = join(scratch, 'house.schem');
  const stone = { name: 'minecraft:stone', colour: [120, 120, 120, 255] };
  const vox = join(scratch, 'one.vox');
  writeFileSync(vox, oneVoxel());
  execFileSync(tool, ['convert', vox, scene, '-q']);
  const json = JSON.parse(readFileSync(scene));
  writeFileSync(scene, JSON.stringify({ ...json, types: json.types.map(() => stone) }));
  execFileSync(tool, ['convert', scene, house, '-q']);
  const [half, quarter] = [8, 4].map(stonePack);
  const [halfFile, quarterFile] = [half, quarter].map((pack, i) => {
    const file = join(scratch, `pack-${i}.zip`);
    writeFileSync(file, pack);
    return file;
  });
  await compare('a pack', house, { packs: [half] }, ['--pack', halfFile]);
  await compare('the last of two packs', house, { packs: [half, quarter] }, ['--pack', quarterFile], { packs: [half] });
  const buffer = half.buffer.slice(half.byteOffset, half.byteOffset + half.byteLength);
  await compare('packs from an ArrayBuffer and a view', house, { packs: [buffer, quarter], small: true },
                ['--pack', halfFile, '--pack', quarterFile]);
  await compare("Quoin's own pack", house, { packs: ['builtin'] }, ['--pack', 'builtin']);
  await compare('a pack above the own one', house, { packs: ['builtin', half] },
                ['--pack', halfFile, '--pack', 'builtin'], { packs: ['builtin'] });
  const bytes = readFileSync(house);
  await refuses('a pack that is no zip file', () => load(bytes, { packs: [new Uint8Array(40)] }), 'bad_format');
  await refuses('a pack that is cut off', () => load(bytes, { packs: [half.subarray(0, half.length - 30)] }),
                'bad_format');
  for (const wrong of ['builtin', half, [half, null], ['other'], [3]])
    await refuses('packs that are no list of bytes', () => load(bytes, { packs: wrong }));
}

// ---- Triangles.
{
  const [name] = readdirSync(join(corpus, 'triangles')).filter((one) => one === 'obj');
  const obj = join(corpus, 'triangles', name);
  await compare('voxels along the longest side', obj, { meshVoxels: 20 }, ['--size', '20']);
  await compare('voxels of a size', obj, { voxelSize: 0.125 }, ['--voxel', '0.125']);
  const bytes = readFileSync(obj);
  for (const [option, value] of [['meshVoxels', 0], ['meshVoxels', -4], ['meshVoxels', 1.5],
                                 ['meshVoxels', '20'], ['voxelSize', 0], ['voxelSize', NaN], ['voxelSize', -1],
                                 ['voxelSize', 'small']])
    await refuses(`${option}: ${value}`, () => load(bytes, { [option]: value }));
  await refuses('both meshVoxels and voxelSize', () => load(bytes, { meshVoxels: 20, voxelSize: 1 }));
  // glTF with arrays compressed by meshoptimizer.
  const packed = join(scratch, 'packed.glb');
  execFileSync(tool, ['convert', castle, packed, '--compress', '-q']);
  const coded = readFileSync(packed);
  check(jsonOf(coded).extensionsRequired.includes('EXT_meshopt_compression'), 'the tool compresses');
  await compare('compressed glTF', packed, { meshVoxels: 60 }, ['--size', '60'], null);
  const damaged = Buffer.from(coded);
  damaged.fill(0x5a, coded.length - 4000);
  await refuses('compressed glTF that is damaged', () => load(damaged), 'bad_format');
}

// ---- Animations and hidden objects, in both modules.
{
  const chunk = (name, content) => {
    const head = Buffer.alloc(12);
    head.write(name, 0, 'latin1');
    head.writeUInt32LE(content.length, 4);
    return Buffer.concat([head, content]);
  };
  const ints = (...values) => Buffer.from(Int32Array.from(values).buffer);
  const dict = (entries) => Buffer.concat([ints(Object.keys(entries).length), ...Object.entries(entries).flatMap(
    ([key, value]) => [ints(key.length), Buffer.from(key), ints(value.length), Buffer.from(value)])]);
  const model = (...xs) => [chunk('SIZE', ints(8, 1, 1)), chunk('XYZI', Buffer.concat([ints(xs.length), ...xs.map(
    (x) => Buffer.from([x, 0, 0, 1]))]))];
  // A model in its first frame, another from frame 5 on; and a hidden one.
  const nodes = [
    chunk('nTRN', Buffer.concat([ints(0), dict({}), ints(1, -1, -1, 1), dict({})])),
    chunk('nGRP', Buffer.concat([ints(1), dict({}), ints(2, 2, 4)])),
    chunk('nTRN', Buffer.concat([ints(2), dict({}), ints(3, -1, 0, 1), dict({})])),
    chunk('nSHP', Buffer.concat([ints(3), dict({}), ints(2, 0), dict({ _f: '0' }), ints(1), dict({ _f: '5' })])),
    chunk('nTRN', Buffer.concat([ints(4), dict({ _hidden: '1' }), ints(5, -1, 0, 1), dict({ _t: '0 4 0' })])),
    chunk('nSHP', Buffer.concat([ints(5), dict({}), ints(1, 2), dict({})]))];
  const content = Buffer.concat([...model(0, 1), ...model(3, 5, 7), ...model(2), ...nodes]);
  const main = chunk('MAIN', Buffer.alloc(0));
  main.writeUInt32LE(content.length, 8);
  const bytes = Buffer.concat([Buffer.from('VOX '), ints(200), main, content]);
  const file = join(scratch, 'animated.vox');
  writeFileSync(file, bytes);
  for (const small of [false, true]) {
    await compare('a frame', file, { small, frame: 5 }, ['--frame', '5'], { small });
    await compare('what is hidden', file, { small, showHidden: true }, ['--hidden'], { small });
    for (const frame of [-1, 0.5, NaN, '5', 2 ** 31])
      await refuses(`frame ${frame}`, () => load(bytes, { small, frame }));
    for (const radius of [-1, 0, 1.5, 5000]) await refuses(`radius ${radius}`, () => load(bytes, { small, radius }));
  }
}

// ---- Watertight meshes.
{
  globalThis.self = globalThis;
  globalThis.createImageBitmap = async () => ({ width: 1, height: 1, close() {} });
  const { GLTFLoader } = await import(pathToFileURL(resolve(three, 'examples/jsm/loaders/GLTFLoader.js')));
  const scene = await load(readFileSync(castle), { small: true });
  const glb = Buffer.from(scene.glb({ watertight: true }));
  check(glb.equals(native(castle, '--watertight')), 'a watertight GLB is the tool\'s');
  const count = (group) => {
    let triangles = 0;
    group.traverse((object) => { triangles += object.isMesh ? object.geometry.index.count / 3 : 0; });
    return triangles;
  };
  const [plain, tight] = [await toThree(scene, GLTFLoader), await toThree(scene, GLTFLoader, { watertight: true })];
  check(count(tight) > count(plain), `${count(tight)} triangles that are watertight, ${count(plain)} that are not`);
  /** Counts corners inside axis-parallel edges. All corners have integer coordinates. */
  const cornersInEdges = ({ positions, indices }) => {
    const place = (i) => positions.subarray(3 * i, 3 * i + 3);
    const corners = new Set(Array.from({ length: positions.length / 3 }, (_, i) => place(i).join()));
    let inside = 0;
    for (let i = 0; i < indices.length; ++i) {
      const from = place(indices[i]);
      const by = place(indices[i % 3 === 2 ? i - 2 : i + 1]).map((value, axis) => value - from[axis]);
      const length = Math.max(...by.map(Math.abs));
      if (by.filter((value) => value !== 0).length !== 1) continue;
      for (let step = 1; step < length; ++step)
        inside += corners.has(from.map((value, axis) => value + step / length * by[axis]).join()) ? 1 : 0;
    }
    return inside;
  };
  let inside = 0;
  scene.grids.forEach((grid, number) => {
    inside += cornersInEdges(scene.mesh(number));
    const left = cornersInEdges(scene.mesh(number, { watertight: true }));
    check(left === 0, `grid ${number}, watertight, has ${left} corners in edges`);
  });
  check(inside > 0, 'without, there are corners in edges');
  scene.free();
}

rmSync(scratch, { recursive: true });
console.log(`options of reading and meshing: ${found.checked} checks, ${found.failed} failed`);
if (found.failed > 0 || found.checked === 0) process.exit(1);
