// Runs in the browser: shows models and answers questions about pixels.
import * as THREE from 'three';
import { RoomEnvironment } from 'three/addons/environments/RoomEnvironment.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

import { parseGlb } from './glb.mjs';
import { readVox, truthAt } from './vox_truth.mjs';

const background = [30, 34, 42];
const directions = {
  front: [0, 0, 1], back: [0, 0, -1], left: [-1, 0, 0], right: [1, 0, 0], top: [0, 1, 0], bottom: [0, -1, 0],
  iso: [1, 0.8, 1], iso2: [-1, 0.8, 1], iso3: [-1, -0.6, -1], iso4: [1, 0.7, -1],
};

const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
renderer.setSize(window.innerWidth, window.innerHeight);
document.body.append(renderer.domElement);
const scene = new THREE.Scene();
scene.background = new THREE.Color(`rgb(${background.join(',')})`);
const models = new THREE.Group();
scene.add(models);
const lights = new THREE.Group();
scene.add(lights);
let parsed = [];
let camera;
let truth = null;
let isLit = true;

function addLights() {
  // Metals are black without something to reflect.
  scene.environment = new THREE.PMREMGenerator(renderer).fromScene(new RoomEnvironment()).texture;
  scene.environmentIntensity = 0.35;
  lights.add(new THREE.HemisphereLight(0xddeeff, 0x998877, 0.9));
  const sun = new THREE.DirectionalLight(0xfff2dd, 1.5);
  sun.position.set(3, 5, 4);
  lights.add(sun);
}

/** Models stand in a row along x, a quarter of their width apart. */
async function load(urls) {
  let x = 0;
  for (const url of urls) {
    const bytes = await (await fetch(url)).arrayBuffer();
    const gltf = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).parseAsync(bytes.slice(0), '/');
    const own = parsed.push(await parseGlb(bytes)) - 1;
    gltf.scene.traverse((object) => {
      if (object.isMesh) object.userData.source = { model: own, ...gltf.parser.associations.get(object) };
    });
    const box = new THREE.Box3().setFromObject(gltf.scene);
    if (urls.length > 1 && !box.isEmpty()) {
      gltf.scene.position.set(x - box.min.x, -box.min.y, -(box.min.z + box.max.z) / 2);
      x += (box.max.x - box.min.x) * 1.25 + 1;
    }
    models.add(gltf.scene);
  }
  scene.updateMatrixWorld(true);
}

/** From now on pixels are compared with the voxels of this file; false when it has more than one plain model. */
async function compareWith(url) {
  truth = readVox(await (await fetch(url)).arrayBuffer());
  return truth !== null;
}

/** The palette times the vertex colours and nothing else; blended surfaces are left out. */
function unlit() {
  isLit = false;
  lights.visible = false;
  models.traverse((object) => {
    if (!object.isMesh) return;
    object.visible = !object.material.transparent;
    object.material = new THREE.MeshBasicMaterial({
      map: object.material.map, vertexColors: object.geometry.hasAttribute('color'), side: object.material.side,
    });
  });
}

/** Lights are made only for images that show them: a software driver takes seconds for the environment. */
function render() {
  if (isLit && lights.children.length === 0) addLights();
  renderer.render(scene, camera);
}

/** `unit`: minimum pixels per voxel; parts that do not fit then lie outside the image. */
function look(view, zoom = 1, unit = 0) {
  const direction = new THREE.Vector3(...(directions[view] ?? view)).normalize();
  const box = new THREE.Box3().setFromObject(models);
  const centre = box.getCenter(new THREE.Vector3());
  const radius = Math.max(box.getSize(new THREE.Vector3()).length() / 2, 1e-3);
  const aspect = window.innerWidth / window.innerHeight;
  camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 4 * radius);
  camera.position.copy(centre).addScaledVector(direction, 2 * radius);
  camera.up.set(0, Math.abs(direction.y) > 0.99 ? 0 : 1, Math.abs(direction.y) > 0.99 ? -Math.sign(direction.y) : 0);
  camera.lookAt(centre);
  camera.updateMatrixWorld(true);
  let [halfWidth, halfHeight] = [1e-3, 1e-3];
  for (let corner = 0; corner < 8; ++corner) {
    const point = new THREE.Vector3(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                                    corner & 4 ? box.max.z : box.min.z).applyMatrix4(camera.matrixWorldInverse);
    halfWidth = Math.max(halfWidth, Math.abs(point.x));
    halfHeight = Math.max(halfHeight, Math.abs(point.y));
  }
  const whole = Math.max(halfHeight, halfWidth / aspect) * 1.05 / zoom;
  const half = unit > 0 ? Math.min(whole, window.innerHeight / (2 * unit)) : whole;
  [camera.left, camera.right, camera.top, camera.bottom] = [-half * aspect, half * aspect, half, -half];
  camera.updateProjectionMatrix();
  render();
}

/** In the scene, in metres; `fov` is vertical, in degrees. */
function stand(from, to, fov) {
  camera = new THREE.PerspectiveCamera(fov, window.innerWidth / window.innerHeight, 0.1, 1e4);
  camera.position.set(...from);
  camera.lookAt(...to);
  camera.updateMatrixWorld(true);
  render();
}

const linear = (byte) => (byte / 255 <= 0.04045 ? byte / 255 / 12.92 : ((byte / 255 + 0.055) / 1.055) ** 2.4);
const encoded = (value) => Math.round(255 * (value <= 0.0031308 ? value * 12.92 : 1.055 * value ** (1 / 2.4) - 0.055));

const tileSize = 8;  // pixels

/** Sorts the triangles of visible meshes into tiles of the window, as a camera without perspective sees them. Returns
 *  meshesAt(x, y): meshes of the triangles that a ray through this point, at most a tile outside the window, can hit.
 *  Rays that try every triangle take a minute for 90,000 triangles. */
function sortIntoTiles() {
  const [columns, rows] = [window.innerWidth, window.innerHeight].map((size) => Math.ceil(size / tileSize) + 2);
  const tiles = Array.from({ length: columns * rows }, () => new Map());
  const clipFromWorld = new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
  const tileOf = (at) => Math.floor(at / tileSize) + 1;  // the first ones are outside the window
  models.traverse((object) => {
    if (!object.isMesh || !object.visible) return;
    object.geometry.computeBoundingSphere();
    const { index, attributes: { position } } = object.geometry;
    const clipFromObject = clipFromWorld.clone().multiply(object.matrixWorld);
    const [x, y] = [new Float64Array(position.count), new Float64Array(position.count)];
    const point = new THREE.Vector3();
    for (let i = 0; i < position.count; ++i) {
      point.fromBufferAttribute(position, i).applyMatrix4(clipFromObject);
      [x[i], y[i]] = [(1 + point.x) / 2 * window.innerWidth, (1 - point.y) / 2 * window.innerHeight];
    }
    const count = (index ?? position).count;
    for (let at = 0; at < count; at += 3) {
      const [a, b, c] = index ? [index.getX(at), index.getX(at + 1), index.getX(at + 2)] : [at, at + 1, at + 2];
      // A pixel more, because of rounding.
      const left = Math.max(0, tileOf(Math.min(x[a], x[b], x[c]) - 1));
      const right = Math.min(columns - 1, tileOf(Math.max(x[a], x[b], x[c]) + 1));
      const top = Math.max(0, tileOf(Math.min(y[a], y[b], y[c]) - 1));
      const bottom = Math.min(rows - 1, tileOf(Math.max(y[a], y[b], y[c]) + 1));
      for (let row = top; row <= bottom; ++row) {
        for (let column = left; column <= right; ++column) {
          const tile = tiles[row * columns + column];
          if (!tile.has(object)) tile.set(object, { triangles: [], corners: [] });
          tile.get(object).triangles.push(at / 3);
          tile.get(object).corners.push(a, b, c);
        }
      }
    }
  });
  const meshes = new Map();
  return (x, y) => {
    const tile = tiles[tileOf(y) * columns + tileOf(x)];
    if (!meshes.has(tile)) {
      meshes.set(tile, [...tile].map(([object, { triangles, corners }]) => {
        const geometry = new THREE.BufferGeometry();
        Object.assign(geometry, { attributes: object.geometry.attributes, boundingSphere: object.geometry.boundingSphere });
        const mesh = new THREE.Mesh(geometry.setIndex(corners), object.material);
        mesh.matrixAutoUpdate = false;
        mesh.matrix.copy(object.matrixWorld);
        mesh.updateMatrixWorld(true);
        mesh.userData = { source: object.userData.source, triangles };
        return mesh;
      }));
    }
    return meshes.get(tile);
  };
}

/** Returns the file's texel and brightness at the point where a ray through a pixel hits. */
function hitAt(raycaster, meshesAt, x, y) {
  const ndc = new THREE.Vector2((x / window.innerWidth) * 2 - 1, 1 - (y / window.innerHeight) * 2);
  raycaster.setFromCamera(ndc, camera);
  const [hit] = raycaster.intersectObjects(meshesAt(x, y), false);
  if (!hit) return null;
  const { source, triangles } = hit.object.userData;
  const primitive = parsed[source.model].meshes[source.meshes].primitives[source.primitives ?? 0];
  const corners = [0, 1, 2].map((corner) => primitive.indices[triangles[hit.faceIndex] * 3 + corner]);
  const local = hit.object.worldToLocal(hit.point.clone());
  const points = corners.map((index) => new THREE.Vector3().fromArray(primitive.positions, index * 3));
  const weights = THREE.Triangle.getBarycoord(local, ...points, new THREE.Vector3());
  const lights = corners.map(primitive.lightOf);
  const light = [0, 1, 2].map((channel) => lights.reduce((sum, of, corner) => sum + weights.getComponent(corner) * of[channel], 0));
  const normal = new THREE.Vector3();
  for (const index of corners) normal.add(new THREE.Vector3().fromArray(primitive.normals, index * 3));
  normal.transformDirection(hit.object.matrixWorld);
  // Smooth normals may lean away from a viewer who sees the triangle edge-on.
  const inside_out = normal.dot(raycaster.ray.direction) > (primitive.textured ? 0 : 0.5);
  return { texel: primitive.texelOf(corners[0]), light, point: hit.point, normal, inside_out };
}

/** Compares up to `count` pixels with palette times occlusion; pixels near an edge of colours are passed over. */
function checkPixels(count, seed) {
  const gl = renderer.getContext();
  const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const pixels = new Uint8Array(width * height * 4);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  const raycaster = new THREE.Raycaster();
  const meshesAt = sortIntoTiles();
  const result = { checked: 0, inside_out: 0, darkened: 0, wrong: [] };
  let state = seed;
  const random = (limit) => ((state = (state * 1664525 + 1013904223) >>> 0) / 2 ** 32) * limit;
  for (let attempt = 0; attempt < count * 4 && result.checked < count; ++attempt) {
    const [x, y] = [Math.floor(random(width)), Math.floor(random(height))];
    const hit = hitAt(raycaster, meshesAt, x + 0.5, y + 0.5);
    if (!hit) continue;
    // The pixel's own corners, lest a small voxel of another colour lies in it, and points a pixel away.
    const offsets = [[0, 0], [1, 0], [0, 1], [1, 1], [-1, -1], [2, -1], [-1, 2], [2, 2]];
    const around = offsets.map(([dx, dy]) => hitAt(raycaster, meshesAt, x + dx, y + dy));
    const alike = (other) => other && String(other.texel) === String(hit.texel) && other.normal.dot(hit.normal) > 0.99 &&
      other.light.every((value, channel) => Math.abs(value - hit.light[channel]) < 0.03);
    if (!around.every(alike)) continue;
    const at = ((height - 1 - y) * width + x) * 4;
    const known = truth ? truthAt(truth, hit.point.toArray(), hit.normal.toArray()) : { colour: hit.texel.slice(0, 3) };
    const lightOf = (channel) => known.brightness ?? hit.light[channel];
    const expected = known ? known.colour.map((byte, channel) => encoded(linear(byte) * lightOf(channel))) : ['air', 'air', 'air'];
    const actual = [...pixels.slice(at, at + 3)];
    ++result.checked;
    if (hit.inside_out) ++result.inside_out;
    if (Math.min(...hit.light) < 0.95) ++result.darkened;
    if (expected.some((value, channel) => !(Math.abs(value - actual[channel]) <= 4))) result.wrong.push({ x, y, expected, actual });
  }
  return result;
}

window.viewer = { load, compareWith, unlit, look, stand, checkPixels };
