// Plain images for software renderers: without shadows, gloss and transmission they take a tenth of the time.
import * as THREE from 'three';
import { closeGaps } from './gaps.js';

/** Returns true for software renderers. */
export function isDrawnByProgram() {
  const gl = new OffscreenCanvas(1, 1).getContext('webgl2');
  const info = gl?.getExtension('WEBGL_debug_renderer_info');
  const name = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : '';
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

function plainOf(material) {
  const { map, color, vertexColors, alphaTest, depthWrite, side, emissive, emissiveMap, emissiveIntensity } = material;
  const through = material.transmission ?? 0;  // fraction of light; half of it is used, by eye
  const plain = new THREE.MeshLambertMaterial({
    map, color, vertexColors, alphaTest, depthWrite, side, emissive, emissiveMap, emissiveIntensity,
    transparent: material.transparent || through > 0, opacity: material.opacity * (1 - through / 2),
  });
  if (material.userData.hasClosedGaps) closeGaps(plain);
  return plain;
}

/** Switches a model between plain and original materials. Shared materials stay shared. */
export class PlainModel {
  #parts = [];
  #plain = new Map();

  constructor(model) {
    model.traverse((object) => {
      if (!object.isMesh) return;
      const { material } = object;
      if (!this.#plain.has(material)) this.#plain.set(material, plainOf(material));
      this.#parts.push({ object, material, plain: this.#plain.get(material) });
    });
  }

  show(isPlain) {
    for (const { object, material, plain } of this.#parts) object.material = isPlain ? plain : material;
  }

  dispose() {
    this.show(false);
    for (const plain of this.#plain.values()) plain.dispose();
  }
}

/** Compiles the shaders for plain images of Quoin's GLB files in advance. */
export function prepare(renderer, stage, camera) {
  const geometry = new THREE.BufferGeometry();
  const attribute = (Kind, size, normalized) => new THREE.BufferAttribute(new Kind(3 * size), size, normalized);
  geometry.setAttribute('position', attribute(Float32Array, 3));
  geometry.setAttribute('normal', attribute(Float32Array, 3));
  geometry.setAttribute('uv', attribute(Float32Array, 2));
  geometry.setAttribute('color', attribute(Uint8Array, 4, true));
  const map = new THREE.DataTexture(new Uint8Array(4), 1, 1);
  map.colorSpace = THREE.SRGBColorSpace;
  map.needsUpdate = true;
  const kinds = [{}, { transparent: true }, { emissive: 0xffffff, emissiveMap: map }];
  const materials = kinds.map((kind) => new THREE.MeshLambertMaterial({ map, vertexColors: true, ...kind }));
  materials.forEach(closeGaps);
  const triangles = materials.map((material) => new THREE.Mesh(geometry, material));
  for (const triangle of triangles) triangle.frustumCulled = false;
  stage.add(...triangles);
  renderer.render(stage, camera);
  stage.remove(...triangles);
  geometry.dispose();
  map.dispose();
  // The materials are kept: disposing them would discard their programs.
}
