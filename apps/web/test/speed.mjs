// Times reading and meshing: the module, the native tool on one thread, and three.js' VOXLoader, alternating.
//   node speed.mjs PACKAGE TOOL THREE FILE.vox [TURNS]
import { execFileSync } from 'node:child_process';
import { readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';

const [packageFolder, tool, three, file, turns = '5'] = process.argv.slice(2);
const { load } = await import(pathToFileURL(join(packageFolder, 'quoin.js')));
const { VOXLoader } = await import(pathToFileURL(resolve(three, 'examples/jsm/loaders/VOXLoader.js')));
const bytes = readFileSync(file);
const out = join(tmpdir(), `quoin-speed-${process.pid}.glb`);
const times = { 'module: load': [], 'module: meshes': [], 'module: glb': [], 'module: image': [],
                'three.js VOXLoader': [], 'tool: convert': [] };
const timed = async (name, work) => {
  const began = performance.now();
  const result = await work();
  times[name].push(performance.now() - began);
  return result;
};
for (let turn = 0; turn < Number(turns); ++turn) {
  const scene = await timed('module: load', () => load(bytes, { small: true }));
  await timed('module: meshes', () => scene.grids.map((_, grid) => scene.mesh(grid)));
  await timed('module: glb', () => scene.glb());
  scene.free();
  const whole = await load(bytes);
  await timed('module: image', () => whole.render({ width: 640, height: 360, samples: 4 }));
  whole.free();
  await timed('three.js VOXLoader', () => {
    const copy = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
    const { chunks = [], scene: made } = new VOXLoader().parse(copy);
    return [chunks, made];
  });
  await timed('tool: convert', () => execFileSync(tool, ['convert', file, out, '--threads', '1', '-q']));
}
const ratios = times['three.js VOXLoader'].map(
  (time, i) => time / (times['module: load'][i] + times['module: meshes'][i]));
ratios.sort((a, b) => a - b);
console.log(`VOXLoader takes ${ratios[ratios.length >> 1].toFixed(1)} times load and meshes (median by turns), ${
  ratios[0].toFixed(1)} to ${ratios.at(-1).toFixed(1)}`);
for (const [name, all] of Object.entries(times)) {
  all.sort((a, b) => a - b);
  const [median, least] = [all[all.length >> 1], all[0]].map((time) => time.toFixed(1));
  console.log(`${name.padEnd(20)} ${median} ms (median of ${all.length}), ${least} least`);
}
rmSync(out, { force: true });
