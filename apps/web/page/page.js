// The page: opens dropped files, shows, rotates and measures them, and saves GLB files and images.
import * as THREE from 'three';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { closeGapsOf, setImageHeight } from './gaps.js';
import { isDrawnByProgram, PlainModel, prepare } from './plain.js';

const $ = (id) => document.getElementById(id);
const degrees = Math.PI / 180;
const canvas = $('view');
const isSlow = isDrawnByProgram();
const renderer = new THREE.WebGLRenderer({ canvas, antialias: !isSlow, alpha: true, preserveDrawingBuffer: true });
renderer.debug.checkShaderErrors = false;  // checking waits for the compiler
renderer.shadowMap.enabled = true;
renderer.toneMapping = THREE.NoToneMapping;
const stage = new THREE.Scene();
const camera = new THREE.PerspectiveCamera(45, 1, 0.1, 1000);
const controls = new OrbitControls(camera, canvas);
const sky = new THREE.HemisphereLight(0xdfeaff, 0x8a8478, 1.4);
const sun = new THREE.DirectionalLight(0xfff1dc, 2.4);
sun.castShadow = !isSlow;
sun.shadow.mapSize.set(2048, 2048);
sun.shadow.normalBias = 0.4;
const tape = new THREE.Line(new THREE.BufferGeometry(),
                            new THREE.LineBasicMaterial({ color: 0xff3b7a, depthTest: false, transparent: true }));
tape.renderOrder = 1;
tape.visible = false;
stage.add(sky, sun, sun.target, tape);

let file;      // { name, bytes, heights }
let packs = [];  // resource packs for blocks of Minecraft: { name, bytes }, the lowest first
let model;     // the displayed model
let plain;     // the same with plain materials, for software renderers
let glb;       // its bytes
let radius = 1;
let centre = new THREE.Vector3();
let measured;  // clicked points
let frame = 0;

function say(text, isError = false) {
  $('status').textContent = text;
  $('status').classList.toggle('error', isError);
}

const percent = (fraction) => `${Math.round(100 * fraction)} %`;

// ---- The worker. A worker that is busy with an abandoned task is replaced.
let worker;
let jobs = new Map();
let lastJob = 0;

function newWorker() {
  worker?.terminate();
  for (const { reject } of jobs.values()) reject(new Error('it was stopped'));
  jobs = new Map();
  // start.js starts the first worker.
  worker = globalThis.quoinWorker ?? new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
  globalThis.quoinWorker = undefined;
  worker.onmessage = ({ data: { id, fraction, answer, error } }) => {
    const job = jobs.get(id);
    if (fraction !== undefined) return job?.tell?.(fraction);
    jobs.delete(id);
    if (error === undefined) job?.resolve(answer);
    else job?.reject(new Error(error.message));
  };
  worker.onerror = (event) => {
    const text = event.message ?? 'the worker could not be started';
    event.target.hasFailed = true;
    for (const { reject } of jobs.values()) reject(new Error(text));
    jobs = new Map();
  };
  // `load` reports the error.
  if (file) ask('keep', { bytes: file.bytes, heights: file.heights, packs: packsOf(packs) }).catch(() => {});
}

/** `tell`: progress callback of long tasks. */
function ask(name, options, tell) {
  const id = ++lastJob;
  return new Promise((resolve, reject) => {
    jobs.set(id, { resolve, reject, tell });
    worker.postMessage({ id, name, options });
  });
}

// ---- Rendering, only after changes.
let rest;  // the timer for the full-quality image

function draw() {
  forgetFrame();
  clearTimeout(rest);
  rest = undefined;
  plain?.show(false);
  sun.castShadow = true;
  // The marched canvas lies below.
  renderer.render(marched?.isShown ? tape : stage, camera);
}

/** Cancels the scheduled frame, which is no longer needed. */
function forgetFrame() {
  cancelAnimationFrame(frame);
  frame = 0;
}

/** Renders now; software renderers use plain materials until the view has rested. */
function drawSoon() {
  if (!isSlow || marched?.isShown) return draw();
  forgetFrame();
  plain?.show(true);
  sun.castShadow = false;
  renderer.render(stage, camera);
  if (plain) drawWellLater();
}

/** Renders at full quality if the view rests for a while after the plain image is finished. */
async function drawWellLater() {
  clearTimeout(rest);
  const wanted = rest = setTimeout(() => {}, 0);
  await imageIsThere();
  if (rest === wanted) rest = setTimeout(draw, 600);
}

function redraw() {
  frame ||= requestAnimationFrame(drawSoon);
}

/** Resolves when rendering has finished. */
function imageIsThere() {
  const gl = renderer.getContext();
  const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl.flush();
  return new Promise((resolve) => {
    const look = () => {
      if (gl.clientWaitSync(fence, 0, 0) === gl.TIMEOUT_EXPIRED) return setTimeout(look, 4);
      gl.deleteSync(fence);
      resolve();
    };
    look();
  });
}

const toSun = () => {
  const around = $('around').valueAsNumber * degrees;
  const height = $('height').valueAsNumber * degrees;
  return new THREE.Vector3(Math.cos(height) * Math.sin(around), Math.sin(height), Math.cos(height) * Math.cos(around));
};

/** Returns the worker's render options for the view. */
const viewOf = (width, height) => ({
  width, height, sun: toSun().toArray(),
  camera: { position: camera.position.toArray(), lookAt: controls.target.toArray(), fovDegrees: camera.fov },
});

let marched;  // the ray-marching mode; loaded on first use

async function marchedView() {
  if (marched) return marched;
  const { MarchedView } = await import(new URL('./marching.js', import.meta.url));
  marched ??= new MarchedView({
    ask, below: canvas,
    view: () => {
      const ratio = Math.min(devicePixelRatio, 2);
      return viewOf(Math.floor(canvas.clientWidth * ratio), Math.floor(canvas.clientHeight * ratio));
    },
    shown: (facts) => {
      const { by, width, height, milliseconds, samples } = facts;
      const pace = `${milliseconds.toFixed(0)} ms per sample, ${samples} per pixel`;
      $('marching').textContent = `${by}: ${width} x ${height}, ${pace}`;
      window.quoinMarched = facts;
      redraw();
    },
    said: (text) => say(text, true),
  });
  return marched;
}

function changed() {
  marched?.change();
  redraw();
}

function resize() {
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  renderer.setSize(canvas.clientWidth, canvas.clientHeight, false);
  setImageHeight(renderer, canvas.height);
  camera.aspect = canvas.clientWidth / canvas.clientHeight;
  camera.updateProjectionMatrix();
  changed();
}

function placeSun() {
  sun.position.copy(centre).addScaledVector(toSun(), 2 * radius);
  sun.target.position.copy(centre);
  Object.assign(sun.shadow.camera, { left: -radius, right: radius, top: radius, bottom: -radius, near: radius / 10,
                                     far: 4 * radius });
  sun.shadow.camera.updateProjectionMatrix();
  changed();
}

function home() {
  const distance = radius / Math.sin(camera.fov * degrees / 2) / Math.min(1, camera.aspect) * 0.85;
  camera.position.copy(centre).add(new THREE.Vector3(1, 0.8, 1).normalize().multiplyScalar(distance));
  controls.target.copy(centre);
  controls.update();
  changed();
}

// ---- Links contain the view: #camera=...&at=...&sun=...
const rounded = (...numbers) => numbers.map((n) => Number(n.toPrecision(6))).join(',');
const spaced = (...numbers) => rounded(...numbers).replaceAll(',', ', ');

function viewAsText() {
  const at = controls.target;
  return `camera=${rounded(...camera.position)}&at=${rounded(...at)}&sun=${rounded($('around').valueAsNumber,
    $('height').valueAsNumber)}`;
}

function viewFromText(text) {
  const given = new URLSearchParams(text.replace(/^#/, ''));
  const numbers = (name, count) => {
    const all = (given.get(name) ?? '').split(',').map(Number);
    return all.length === count && given.get(name) !== '' && all.every(Number.isFinite) ? all : null;
  };
  const turned = numbers('sun', 2);
  if (turned) [$('around').value, $('height').value] = turned;
  const position = numbers('camera', 3);
  const at = numbers('at', 3);
  if (position && at) {
    camera.position.fromArray(position);
    controls.target.fromArray(at);
    controls.update();
  }
  placeSun();
}

// ---- Files.
let openings = 0;  // number of files chosen so far: only the last one is shown

/** Returns a function that returns true if no other file was chosen since. */
function untilTheNext() {
  const now = openings;
  return () => now === openings;
}

/** Loads embedded images for GLTFLoader, which would otherwise fetch them. */
function imagesFromMemory(parser) {
  const decoded = async ({ bufferView, mimeType }) => {
    const blob = new Blob([await parser.getDependency('bufferView', bufferView)], { type: mimeType });
    const texture = new THREE.Texture(await createImageBitmap(blob, { premultiplyAlpha: 'none' }));
    texture.needsUpdate = true;
    return texture;
  };
  return {
    name: 'images from memory',
    async beforeRoot() {
      (parser.json.images ?? []).forEach((image, i) => { parser.sourceCache[i] = decoded(image); });
    },
  };
}

/** Returns false and does nothing if another file was chosen meanwhile. */
async function show(bytes, isCurrent) {
  const { scene } = await new GLTFLoader().register(imagesFromMemory).parseAsync(bytes.buffer, '');
  if (!isCurrent()) return false;
  plain?.dispose();
  model?.removeFromParent();
  model?.traverse((object) => {
    object.geometry?.dispose();
    object.material?.map?.dispose();
    object.material?.dispose();
  });
  model = scene;
  model.traverse((object) => {
    if (!object.isMesh) return;
    object.castShadow = !object.material.transparent;
    object.receiveShadow = true;
  });
  closeGapsOf(model);
  stage.add(model);
  if (isSlow) plain = new PlainModel(model);
  const box = new THREE.Box3().setFromObject(model);
  if (box.isEmpty()) box.set(new THREE.Vector3(-1, -1, -1), new THREE.Vector3(1, 1, 1));
  centre = box.getCenter(new THREE.Vector3());
  radius = box.getSize(new THREE.Vector3()).length() / 2;
  Object.assign(camera, { near: radius / 500, far: radius * 50 });
  camera.updateProjectionMatrix();
  measured = undefined;
  tape.visible = false;
  return true;
}

const isPng = (bytes) => bytes.byteLength >= 8 && new DataView(bytes).getUint32(0) === 0x89504e47;

/** Asks for the height encoding of an image; undefined if the user cancels. */
async function heightsOf(name) {
  const dialog = $('heights');
  dialog.querySelector('h2').textContent = name;
  dialog.returnValue = '';
  if (!dialog.open) dialog.showModal();
  await new Promise((done) => dialog.addEventListener('close', done, { once: true }));
  if (dialog.returnValue !== 'read') return undefined;
  return { encoding: $('encoding').value, metresPerPixel: $('metres').valueAsNumber };
}

/** Returns the packs for `load`: those of a list, with Quoin's own pack below. */
const packsOf = (list) => ['builtin', ...list.map(({ bytes }) => bytes)];

/** Uses packs from now on, and names them in the panel. */
function setPacks(list) {
  packs = list;
  $('packs').hidden = packs.length === 0;
  $('packs').querySelector('span').textContent = packs.map(({ name }) => name).join(', ');
}

/** Returns true if the file was opened and is shown. */
async function open(name, bytes, isCurrent) {
  const heights = isPng(bytes) ? await heightsOf(name) : $('heights').close('');
  if (!isCurrent()) return false;
  if (isPng(bytes) && heights === undefined) {
    say('');
    return false;
  }
  return read({ name, bytes, heights }, isCurrent);
}

/** Reads a file and shows it. `keepsView`: it is shown already, and is read again. `used`: the packs for its blocks,
 *  which are set once the file is shown. */
async function read({ name, bytes, heights }, isCurrent, { keepsView = false, used = packs } = {}) {
  const began = performance.now();
  say(`Reading ${name} ...`);
  marched?.stop();
  if (jobs.size > 0 || worker.hasFailed) newWorker();
  try {
    const tell = (fraction) => say(`Reading ${name}: ${percent(fraction)} ...`);
    const answer = await ask('load', { bytes, heights, packs: packsOf(used) }, tell);
    if (!await show(answer.glb.slice(), isCurrent)) return false;
    glb = answer.glb;
    file = { name, bytes, heights };
    setPacks(used);
    describe(name, answer);
    resize();
    if (keepsView) {
      placeSun();
    } else {
      home();
      viewFromText(location.hash);
    }
    drawSoon();
    await imageIsThere();
    if (!isCurrent()) return false;
    const total = performance.now() - began;
    if (isPressed('rays')) march();
    const { load, mesh } = answer.milliseconds;
    say(isEmpty(answer) ? `${name}: read, but nothing in it is solid.` :
      `${name}: read in ${load.toFixed(0)} ms, meshed in ${mesh.toFixed(0)} ms, on the screen in ${
        total.toFixed(0)} ms.`);
    window.quoinPage = { ...answer.milliseconds, total };
    return true;
  } catch (error) {
    if (!isCurrent()) return false;
    $('rays').setAttribute('aria-pressed', 'false');
    $('marching').textContent = '';
    redraw();
    say(`${name}: ${error.message}`, true);
    return false;
  }
}

// ---- Resource packs.
const isPackName = (name) => /\.(zip|jar)$/i.test(name);

/** Returns true if the packs can be read. */
async function checkPacks(list, isCurrent) {
  try {
    await ask('check', { packs: packsOf(list) });
    return isCurrent();
  } catch (error) {
    if (isCurrent()) say(`${list.at(-1)?.name ?? 'Packs'}: ${error.message}`, true);
    return false;
  }
}

/** Uses other packs, and reads the current file again. The packs stay as they were if that fails, or if another file is
 *  chosen meanwhile. */
async function usePacks(wanted, isCurrent) {
  if (!await checkPacks(wanted, isCurrent)) return false;
  const hasBlocks = file !== undefined && file.heights === undefined;
  if (hasBlocks) return read(file, isCurrent, { keepsView: true, used: wanted });
  setPacks(wanted);
  return true;
}

/** Adds a pack above the others; a pack of the same name replaces the earlier one. */
async function addPack(name, bytes, isCurrent) {
  const isNew = (pack) => pack.name !== name;
  if (await usePacks([...packs.filter(isNew), { name, bytes }], isCurrent) && isCurrent())
    say(file === undefined ? `${name} gives blocks of Minecraft their shapes and textures. Now drop a file.` :
      `${name} gives blocks of Minecraft their shapes and textures.`);
}

const isEmpty = ({ grids }) => grids.every((grid) => grid.voxels === 0 && !grid.hasField);
const counted = (count, one, many) => `${count.toLocaleString()} ${count === 1 ? one : many}`;

function describe(name, { grids, types, warnings }) {
  document.body.classList.add('full');
  $('welcome').hidden = true;
  $('panel').hidden = false;
  $('name').textContent = name;
  const voxels = grids.reduce((sum, grid) => sum + grid.voxels, 0);
  const fields = grids.filter((grid) => grid.hasField).length;
  $('facts').textContent = [
    ...(voxels > 0 || fields === 0 ? [counted(voxels, 'voxel', 'voxels')] : []),
    ...(fields > 0 ? [counted(fields, 'surface', 'surfaces')] : []),
    counted(grids.length, 'grid', 'grids'), counted(types, 'colour', 'colours')].join(', ');
  $('smooth').checked = fields > 0;
  $('warnings').hidden = warnings.length === 0;
  $('warnings').open = isEmpty({ grids });  // they explain why
  $('warnings').querySelector('summary').textContent = counted(warnings.length, 'note', 'notes');
  $('warnings').querySelector('ul').replaceChildren(...warnings.map((text) => {
    const line = document.createElement('li');
    line.textContent = text;
    return line;
  }));
}

// Neither the module nor browsers can allocate more at once.
const tooManyBytes = 2 ** 31;

async function openFile(chosen) {
  if (chosen === undefined || chosen === null) return;
  if (chosen.size >= tooManyBytes) {
    const gigabytes = (chosen.size / 1e9).toFixed(1);
    return say(`${chosen.name}: a file of ${gigabytes} GB; the page reads less than 2.1 GB.`, true);
  }
  ++openings;
  const isCurrent = untilTheNext();
  try {
    const bytes = await chosen.arrayBuffer();
    if (isCurrent()) await (isPackName(chosen.name) ? addPack : open)(chosen.name, bytes, isCurrent);
  } catch (error) {
    say(`${chosen.name}: ${error.message}`, true);
  }
}

async function openAddress(address) {
  const url = new URL(address, location.href);
  if (url.origin !== location.origin)
    return say('The link names a file on another site; such files are not loaded.', true);
  ++openings;
  const isCurrent = untilTheNext();
  try {
    const response = await fetch(url);
    if (!response.ok) throw new Error(`${response.status} ${response.statusText}`);
    const bytes = await response.arrayBuffer();
    if (isCurrent()) await open(decodeURIComponent(url.pathname.split('/').pop()), bytes, isCurrent);
  } catch (error) {
    say(`${address}: ${error.message}`, true);
  }
}

function give(blob, extension) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = file.name.replace(/\.[^.]*$/, '') + extension;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

async function giveImage({ width, height, rgba }) {
  const image = new OffscreenCanvas(width, height);
  image.getContext('2d').putImageData(new ImageData(rgba, width, height), 0, 0);
  give(await image.convertToBlob({ type: 'image/png' }), '.png');
}

// ---- Measuring between two surface points.
function measure(x, y) {
  const pointer = new THREE.Vector2(2 * x / canvas.clientWidth - 1, 1 - 2 * y / canvas.clientHeight);
  const ray = new THREE.Raycaster();
  ray.setFromCamera(pointer, camera);
  const hit = ray.intersectObject(model, true)[0];
  if (hit === undefined) return say('No surface to measure here.');
  measured = measured?.length === 1 ? [measured[0], hit.point] : [hit.point];
  tape.visible = measured.length === 2;
  if (measured.length === 1) {
    say(`From ${spaced(...hit.point.toArray())}; click the other end.`);
  } else {
    tape.geometry.setFromPoints(measured);
    tape.frustumCulled = false;
    const by = measured[1].clone().sub(measured[0]);
    say(`${rounded(by.length())} units: ${spaced(...by.toArray().map(Math.abs))} along x, y and z.`);
  }
  redraw();
}

const isPressed = (id) => $(id).getAttribute('aria-pressed') === 'true';
const isMeasuring = () => isPressed('measure');
let pressed;
canvas.addEventListener('pointerdown', (event) => { pressed = [event.clientX, event.clientY]; });
canvas.addEventListener('pointerup', (event) => {
  const moved = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]);
  if (model && isMeasuring() && moved < 5) measure(event.clientX, event.clientY);
});

// ---- Event handlers.
function turn(around, up) {
  const offset = new THREE.Spherical().setFromVector3(camera.position.clone().sub(controls.target));
  offset.theta += around;
  offset.phi = Math.min(Math.max(offset.phi + up, 0.01), Math.PI - 0.01);
  camera.position.copy(controls.target).add(new THREE.Vector3().setFromSpherical(offset));
  controls.update();
}

function zoom(factor) {
  camera.position.sub(controls.target).multiplyScalar(factor).add(controls.target);
  controls.update();
}

function slide(id, by) {
  $(id).valueAsNumber += by;
  placeSun();
}

const keys = {
  ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, -0.1),
  ArrowDown: () => turn(0, 0.1), '+': () => zoom(0.9), '=': () => zoom(0.9), '-': () => zoom(1 / 0.9),
  a: () => slide('around', -5), d: () => slide('around', 5), w: () => slide('height', 5), s: () => slide('height', -5),
  r: () => $('rays').click(), m: () => $('measure').click(), h: home, o: () => $('other').click(),
};
addEventListener('keydown', (event) => {
  if ($('heights').open || event.ctrlKey || event.metaKey || event.altKey) return;
  // Sliders handle arrow keys themselves; no input takes letters.
  if (event.target.tagName === 'INPUT' && event.key.startsWith('Arrow')) return;
  const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!act || !model) return;
  event.preventDefault();
  if (!event.repeat || !'rmho'.includes(event.key.toLowerCase())) act();
});
controls.addEventListener('change', changed);
addEventListener('resize', resize);
$('around').addEventListener('input', placeSun);
$('height').addEventListener('input', placeSun);
for (const id of ['file', 'other']) {
  $(id).addEventListener('change', () => {
    openFile($(id).files[0]);
    $(id).value = '';
  });
}
addEventListener('dragover', (event) => {
  event.preventDefault();
  document.body.classList.add('over');
});
addEventListener('dragleave', () => document.body.classList.remove('over'));
addEventListener('drop', (event) => {
  event.preventDefault();
  document.body.classList.remove('over');
  const { files, items } = event.dataTransfer;
  if (files.length !== 1) return say(`Drop one file; here are ${files.length || 'none'}.`, true);
  if (items[0]?.webkitGetAsEntry?.()?.isDirectory)
    return say(`${files[0].name} is a folder. The page cannot read world folders; drop one file.`, true);
  openFile(files[0]);
});
$('measure').addEventListener('click', () => {
  $('measure').setAttribute('aria-pressed', String(!isMeasuring()));
  measured = undefined;
  tape.visible = false;
  say(isMeasuring() ? 'Click two points.' : '');
  redraw();
});
/** Turns the ray-marching mode on or off, according to the button. */
async function march() {
  $('marching').textContent = '';
  window.quoinMarched = undefined;
  if (!isPressed('rays')) {
    marched?.stop();
    say('');
    redraw();
    return;
  }
  $('marching').textContent = 'Preparing the shaders ...';
  try {
    const mode = await marchedView();
    if (isPressed('rays')) await mode.start();
  } catch (error) {
    $('rays').setAttribute('aria-pressed', 'false');
    $('marching').textContent = '';
    say(error.message, true);
  }
}
$('rays').addEventListener('click', () => {
  $('rays').setAttribute('aria-pressed', String(!isPressed('rays')));
  march();
});
$('home').addEventListener('click', home);
$('no-packs').addEventListener('click', () => {
  ++openings;
  usePacks([], untilTheNext());
});
$('smooth').addEventListener('change', async () => {
  say('Meshing ...');
  const isCurrent = untilTheNext();
  try {
    const tell = (fraction) => say(`Meshing: ${percent(fraction)} ...`);
    const answer = await ask('glb', { smooth: $('smooth').checked }, tell);
    if (!await show(answer.glb.slice(), isCurrent)) return;
    glb = answer.glb;
    placeSun();
    say('');
  } catch (error) {
    if (isCurrent()) say(error.message, true);
  }
});
$('glb').addEventListener('click', () => give(new Blob([glb], { type: 'model/gltf-binary' }), '.glb'));
$('image').addEventListener('click', async () => {
  if (marched?.isOn) {
    try {
      const image = await marched.read();
      if (image) await giveImage(image);
    } catch (error) {
      say(error.message, true);
    }
    return;
  }
  draw();
  canvas.toBlob((blob) => give(blob, '.png'), 'image/png');
});
$('march').addEventListener('click', async () => {
  say('Rendering by rays, on one thread ...');
  const began = performance.now();
  try {
    const tell = (fraction) => say(`Rendering by rays, on one thread: ${percent(fraction)} ...`);
    await giveImage(await ask('march', { ...viewOf(canvas.clientWidth, canvas.clientHeight), samples: 4 }, tell));
    say(`Rendered in ${((performance.now() - began) / 1000).toFixed(1)} s.`);
  } catch (error) {
    say(error.message, true);
  }
});
$('share').addEventListener('click', async () => {
  history.replaceState(null, '', `#${viewAsText()}`);
  try {
    await navigator.clipboard.writeText(location.href);
    say('Link copied. It opens this view of the same file.');
  } catch {
    say('The link is in the address bar.');
  }
});
addEventListener('hashchange', () => model && viewFromText(location.hash));

newWorker();
resize();
const asked = new URLSearchParams(location.search).get('file');
if (location.hash.includes('camera='))
  $('invitation').textContent = 'This link shows a view of a file: drop the same file here. It stays on this machine.';
if (asked) openAddress(asked);
if (isSlow) prepare(renderer, stage, camera);
