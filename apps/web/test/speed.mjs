// How long reading and meshing takes: the module, the native tool on one thread, three.js' VOXLoader. By turns.
//   node speed.mjs PACKAGE TOOL THREE FILE.vox [TURNS]
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';

const [packageFolder, tool, three, file, turns = '5'] = process.argv.slice(2);
const { load } = await import(pathToFileURL(join(packageFolder, 'quoin.js')));
const { VOXLoader } = await import(pathToFileURL(resolve(three, 'examples/jsm/loaders/VOXLoader.js')));
const bytes = readFileSync(file);
const times = { 'module: load': [], 'module: glb': [], 'module: picture': [], 'three.js VOXLoader': [], 'tool: convert': [] };
const timed = async (name, work) => {
  const began = performance.now();
  const result = await work();
  times[name].push(performance.now() - began);
  return result;
};
for (let turn = 0; turn < Number(turns); ++turn) {
  const scene = await timed('module: load', () => load(bytes));
  await timed('module: glb', () => scene.glb());
  await timed('module: picture', () => scene.render({ width: 640, height: 360, samples: 4 }));
  scene.free();
  await timed('three.js VOXLoader', () => {
    const { chunks = [], scene: made } = new VOXLoader().parse(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
    return [chunks, made];
  });
  await timed('tool: convert', () => execFileSync(tool, ['convert', file, '/tmp/quoin-speed.glb', '--threads', '1', '-q']));
}
for (const [name, all] of Object.entries(times)) {
  all.sort((a, b) => a - b);
  console.log(`${name.padEnd(20)} ${all[all.length >> 1].toFixed(1)} ms (median of ${all.length}), ${all[0].toFixed(1)} least`);
}
