// Other functions of the package: rays, labels, progress, three.js groups.
//   node functions.mjs PACKAGE THREE FILE.vox
import { readFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { setFlagsFromString } from 'node:v8';
import { runInNewContext } from 'node:vm';
import { check, found, refusing } from './checks.mjs';

const [packageFolder, three, file] = process.argv.slice(2);
const { load, meshLabels, start, surfaceNets, toThree, QuoinError } = await import(
  pathToFileURL(join(packageFolder, 'quoin.js')));
const THREE = await import(pathToFileURL(resolve(three, 'build/three.module.js')));
const { GLTFLoader } = await import(pathToFileURL(resolve(three, 'examples/jsm/loaders/GLTFLoader.js')));
// The browser features that three.js' loader needs: images of known size.
globalThis.self = globalThis;
globalThis.createImageBitmap = async (blob) => {
  const png = new DataView(await blob.arrayBuffer());
  return { width: png.getUint32(16), height: png.getUint32(20), close() {} };
};
const refuses = (what, work, code = 'invalid_argument') => refusing(QuoinError)(what, work, code);

let seed = 4711;
const random = () => (seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0) / 2 ** 32;

const bytes = readFileSync(file);
const scene = await load(bytes);

// ---- Rays hit the same surfaces as three.js' rays hit of the scene's triangles.
{
  const group = await toThree(scene, GLTFLoader);
  group.updateMatrixWorld(true);
  let triangles = 0;
  let meshes = 0;
  group.traverse((object) => {
    if (!object.isMesh) return;
    ++meshes;
    triangles += object.geometry.index.count / 3;
    const { material } = object;
    check(material.isMeshStandardMaterial && material.map.image.width > 0, `${object.name} has ${material.type}`);
  });
  const inGlb = JSON.parse(Buffer.from(scene.glb().buffer, 20, new DataView(scene.glb().buffer).getUint32(12, true)));
  check(triangles > 0 && meshes >= inGlb.meshes.length, `${meshes} meshes of three.js of ${inGlb.meshes.length}`);

  const box = new THREE.Box3().setFromObject(group);
  const middle = box.getCenter(new THREE.Vector3());
  const radius = box.getSize(new THREE.Vector3()).length() / 2;
  const count = 150;
  const origins = [];
  const directions = [];
  for (let i = 0; i < count; ++i) {
    const from = new THREE.Vector3(random() - 0.5, random() / 2 + 0.05, random() - 0.5);
    from.setLength(1.5 * radius).add(middle);
    const at = new THREE.Vector3(random() - 0.5, random() - 0.5, random() - 0.5);
    const along = at.multiply(box.getSize(new THREE.Vector3())).add(middle).sub(from).normalize();
    origins.push(...from);
    directions.push(...along);
  }
  const hits = scene.rays(origins, new Float64Array(directions));
  const caster = new THREE.Raycaster();
  let met = 0;
  let different = 0;
  for (let i = 0; i < count; ++i) {
    caster.set(new THREE.Vector3().fromArray(origins, 3 * i), new THREE.Vector3().fromArray(directions, 3 * i));
    const expected = caster.intersectObject(group, true)[0];
    const t = expected?.distance ?? Infinity;
    met += expected ? 1 : 0;
    const isSame = t === hits.t[i] || Math.abs(t - hits.t[i]) < 1e-3 * radius / 100;
    const normal = expected?.face.normal.clone().transformDirection(expected.object.matrixWorld);
    const isAlong = !normal || normal.distanceTo(new THREE.Vector3().fromArray(hits.normal, 3 * i)) < 1e-4;
    if (isSame && isAlong && (hits.type[i] > 0) === (expected !== undefined)) continue;
    ++different;
    console.log(`ray ${i}: ${t} by three.js, ${hits.t[i]} here`);
  }
  check(met > count / 2, `only ${met} rays of ${count} met something`);
  // At edges, corners and seams of merged faces the results may differ.
  check(different <= count / 50, `${different} rays of ${count} met something else`);
  const short = scene.rays(origins, directions, { maxT: 1e-3 });
  check(short.t.every((t) => t === Infinity) && short.type.every((type) => type === 0), 'short rays meet nothing');
  check(scene.rays([], []).t.length === 0, 'no rays');
  await refuses('half a ray', () => scene.rays([0, 0], [0, 0]));
  await refuses('fewer directions', () => scene.rays([0, 0, 0], []));
  await refuses('a length that is none', () => scene.rays([0, 0, 0], [0, 0, 1], { maxT: NaN }));
  await refuses('no rays at all', () => scene.rays(undefined, null));
  const nowhere = scene.rays([NaN, 0, 0], [0, 0, 1]);
  check(nowhere.t[0] === Infinity && nowhere.type[0] === 0, 'a ray from nowhere meets nothing');
}

// ---- Labels: each has a closed surface of the right size.
function labelsOf(Kind, one, two) {
  const labels = new Kind(20 * 12 * 12);
  for (let i = 0; i < labels.length; ++i) {
    const [x, y, z] = [Math.floor(i / 144), Math.floor(i / 12) % 12, i % 12];
    if (y >= 2 && y < 10 && z >= 2 && z < 10 && x >= 2 && x < 18) labels[i] = x < 10 ? one : two;
  }
  return labels;
}

function volumeOf({ positions, indices, interfaces }, label) {
  let volume = 0;
  const edges = new Map();
  for (const { back, front, firstIndex, indexCount } of interfaces) {
    if (back !== label && front !== label) continue;
    const side = back === label ? 1 : -1;
    for (let i = firstIndex; i < firstIndex + indexCount; i += 3) {
      const corners = [0, 1, 2].map((k) => indices[i + k]);
      const [a, b, c] = corners.map((at) => new THREE.Vector3().fromArray(positions, 3 * at));
      volume += side * a.dot(b.cross(c)) / 6;
      corners.forEach((from, k) => {
        const edge = [from, corners[(k + 1) % 3]].sort((p, q) => p - q).join();
        edges.set(edge, (edges.get(edge) ?? 0) + 1);
      });
    }
  }
  check(edges.size > 0 && [...edges.values()].every((count) => count % 2 === 0), `the surface of ${label} is open`);
  return volume;
}

for (const [Kind, one, two] of [[Uint8Array, 7, 9], [Int32Array, -3, 70_000], [BigInt64Array, -5n, 2n ** 60n],
                                [BigUint64Array, 1n, 2n ** 64n - 1n]]) {
  const shape = [20, 12, 12];
  const labels = labelsOf(Kind, one, two);
  const mesh = await meshLabels(labels, shape, { relaxationSteps: 0, spacing: [1, 1, 2] });
  const known = new Set(mesh.interfaces.flatMap(({ back, front }) => [back, front]));
  const zero = typeof one === 'bigint' ? 0n : 0;
  check(known.size === 3 && [zero, one, two].every((label) => known.has(label)),
        `${Kind.name}: interfaces of ${[...known].join()}`);
  check(mesh.interfaces.reduce((sum, { indexCount }) => sum + indexCount, 0) === mesh.indices.length,
        `${Kind.name}: the interfaces cover the indices`);
  for (const label of [one, two]) {
    const volume = volumeOf(mesh, label);
    check(Math.abs(volume - 2 * 8 ** 3) < 60, `${Kind.name}: the volume of ${label} is ${volume}`);
  }
  const relaxed = await meshLabels(labels, shape);
  check(relaxed.indices.length === mesh.indices.length && volumeOf(relaxed, one) < volumeOf(mesh, one) / 2,
        `${Kind.name}: relaxed`);
  const inside = await meshLabels(labels, shape, { background: one });
  check(inside.interfaces.every(({ back }) => back !== one), `${Kind.name}: another background`);
}
const few = new Uint8Array(8).fill(3);
await refuses('labels with fractions', () => meshLabels(new Float32Array(8), [2, 2, 2]));
await refuses('a background that the type cannot hold', () => meshLabels(few, [2, 2, 2], { background: 300 }));
await refuses('half a background', () => meshLabels(few, [2, 2, 2], { background: 0.5 }));
await refuses('a background that is none', () => meshLabels(few, [2, 2, 2], { background: 'air' }));
await refuses('a background beyond 64 bits', () => meshLabels(few, [2, 2, 2], { background: 2n ** 70n }));
await refuses('half a step', () => meshLabels(few, [2, 2, 2], { relaxationSteps: 0.5 }));
await refuses('too many steps', () => meshLabels(few, [2, 2, 2], { relaxationSteps: 1001 }));
await refuses('a shape that does not fit', () => meshLabels(few, [2, 2, 3]));

// ---- Progress: fractions are in order, it cancels a call, and its exceptions propagate.
const ball = Float32Array.from({ length: 64 ** 3 }, (_, i) =>
  20 - Math.hypot(Math.floor(i / 4096) - 31.5, Math.floor(i / 64) % 64 - 31.5, i % 64 - 31.5));
const segments = Uint8Array.from(ball, (value) => value > 0 ? 1 : 0);
const long = {
  load: async (options) => (await load(bytes, options)).free(),
  glb: (options) => scene.glb(options),
  file: (options) => scene.file('.vox', options),
  smooth: (options) => scene.glb({ smooth: true, ...options }),
  mesh: (options) => scene.mesh(0, options),
  render: (options) => scene.render({ width: 64, height: 48, ...options }),
  surfaceNets: (options) => surfaceNets(ball, [64, 64, 64], 0, options),
  meshLabels: (options) => meshLabels(segments, [64, 64, 64], options),
};
class Mine extends Error {}
for (const [name, work] of Object.entries(long)) {
  const reported = [];
  await work({ progress: (fraction) => { reported.push(fraction); } });
  check(reported.length > 0 && reported.every((f, i) => f >= (reported[i - 1] ?? 0) && f <= 1),
        `${name}: got ${reported.join()}`);
  await refuses(`${name} that is stopped`, () => work({ progress: () => false }), 'cancelled');
  await refuses(`${name} that calls`, () => work({ progress: () => scene.read(0, [0, 0, 0], [1, 1, 1]) }));
  await refuses(`${name} without a function`, () => work({ progress: 'loud' }));
  try {
    await work({ progress: () => { throw new Mine(); } });
    check(false, `${name}: what progress throws is lost`);
  } catch (error) {
    check(error instanceof Mine, `${name}: ${error}`);
  }
  const again = [];
  await work({});
  await work({ progress: (fraction) => { again.push(fraction); } });
  check(again.length === reported.length, `${name} reports again`);
}
const whole = scene.glb();
scene.free();
const other = await load(bytes);
check(Buffer.from(whole).equals(Buffer.from(other.glb())), 'after all that the GLB is the same');
await refuses('rays at a scene that was freed', () => scene.rays([0, 0, 0], [0, 0, 1]), 'bad_handle');

// The promise of an async function is not awaited.
check(Buffer.from(whole).equals(Buffer.from(other.glb({ progress: async () => false }))), 'an async progress');

// ---- Instances: counts started instances and their freed objects.
const RealInstance = WebAssembly.Instance;
const counts = { instances: 0, quoin_free: 0, quoin_web_march_free: 0 };
const fails = { start: false, copy: false };
WebAssembly.Instance = class {
  constructor(...given) {
    ++counts.instances;
    if (fails.start) throw new WebAssembly.LinkError('as where there is no memory');
    const { exports } = new RealInstance(...given);
    const counted = (name) => (handle) => { ++counts[name]; return exports[name](handle); };
    const internal = 11;
    this.exports = {
      ...exports, quoin_free: counted('quoin_free'), quoin_web_march_free: counted('quoin_web_march_free'),
      quoin_web_march_data: (...values) => fails.copy ? internal : exports.quoin_web_march_data(...values) };
  }
};
const moduleOf = (name) => readFileSync(join(packageFolder, `${name}.wasm`));
const wholeModule = moduleOf('quoin');
fails.start = true;
await start(wholeModule).then(() => check(false, 'an instance that fails is taken'), () => check(true));
fails.start = false;
counts.instances = 0;
const atOnce = await Promise.all([load(bytes), load(bytes), load(bytes)]);
check(counts.instances === 1, `three loads at once start ${counts.instances} instances`);
check(atOnce.every((one) => Buffer.from(whole).equals(Buffer.from(one.glb()))), 'scenes loaded concurrently are equal');

// A scene that progress tries to free survives. Unreferenced scenes and shader scenes are freed.
const [kept] = atOnce;
await refuses('freed in progress', () => atOnce[1].glb({ progress: () => kept.free() }));
check(Buffer.from(whole).equals(Buffer.from(kept.glb())), 'it lives on');
fails.copy = true;
await refuses('shaders that cannot be copied', () => kept.forShaders(), 'internal');
check(counts.quoin_web_march_free === 1, 'what could not be copied is freed');
fails.copy = false;
setFlagsFromString('--expose-gc');
const collect = runInNewContext('gc');
async function collected(name, wanted) {
  for (let i = 0; i < 100 && counts[name] < wanted; ++i) {
    collect();
    await new Promise((done) => setTimeout(done, 10));
  }
  check(counts[name] === wanted, `${counts[name]} calls of ${name} in place of ${wanted}`);
}
for (let i = 0; i < 3; ++i) kept.forShaders();
kept.forShaders().free();
await collected('quoin_web_march_free', 1 + 1 + 3);
atOnce.slice(1).forEach((one) => one.free());
counts.quoin_free = 0;
await (async () => {
  const lost = await load(bytes);
  await refuses('freed in progress', () => kept.glb({ progress: () => lost.free() }));
})();
await collected('quoin_free', 1);

// The small module in place of the whole one reads .vox and rejects other formats.
await start(moduleOf('quoin-small'));
check((await load(bytes)).isSmall, 'the small module in place of the whole one');
await refuses('a file that it does not read', () => load(new TextEncoder().encode('v 0 0 0\n')), 'unsupported');
await start(wholeModule);
WebAssembly.Instance = RealInstance;

console.log(`rays, labels, progress, toThree: ${found.checked} checks, ${found.failed} failed`);
if (found.failed > 0 || found.checked === 0) process.exit(1);
