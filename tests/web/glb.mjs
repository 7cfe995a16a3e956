// Reads the parts of a GLB that the checks need, by the specification and without any client's loader (browser only).
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';

async function decodePng(bytes) {
  const bitmap = await createImageBitmap(new Blob([bytes], { type: 'image/png' }),
                                         { premultiplyAlpha: 'none', colorSpaceConversion: 'none' });
  const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
  context.drawImage(bitmap, 0, 0);
  return context.getImageData(0, 0, bitmap.width, bitmap.height);
}

const arrayTypes = {
  5120: Int8Array, 5121: Uint8Array, 5122: Int16Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array,
};
/** What integers that are normalized are divided by. */
const largest = { 5120: 127, 5121: 255, 5122: 32767, 5123: 65535 };
const widths = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };

/** {meshes: [{primitives: [{positions, normals, indices, textured, texelOf(vertex), lightOf(vertex)}]}]}; the texel is
 *  white where there is no texture, the light (of COLOR_0, from 0 to 1 a channel) where there are no colours. */
export async function parseGlb(buffer) {
  const header = new DataView(buffer);
  const jsonBytes = header.getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 20, jsonBytes)));
  const start = 20 + jsonBytes + 8;
  const view = (index) => json.bufferViews[index];
  await MeshoptDecoder.ready;
  const bytesOf = ({ byteOffset, byteLength, extensions }) => {
    const packed = extensions?.EXT_meshopt_compression;
    if (!packed) return new Uint8Array(buffer, start + byteOffset, byteLength);
    const decoded = new Uint8Array(packed.count * packed.byteStride);
    const source = new Uint8Array(buffer, start + packed.byteOffset, packed.byteLength);
    MeshoptDecoder.decodeGltfBuffer(decoded, packed.count, packed.byteStride, source, packed.mode, packed.filter);
    return decoded;
  };
  /** Returns tightly packed elements; floats if the file has floats or normalized integers. */
  const accessor = (index) => {
    if (index === undefined) return undefined;
    const { bufferView, componentType, count, type, normalized } = json.accessors[index];
    const [bytes, Type, width] = [bytesOf(view(bufferView)), arrayTypes[componentType], widths[type]];
    const stride = view(bufferView).byteStride ?? Type.BYTES_PER_ELEMENT * width;
    const elements = new (normalized ? Float32Array : Type)(count * width);
    for (let i = 0; i < count; ++i) {
      const element = new Type(bytes.slice(i * stride, i * stride + Type.BYTES_PER_ELEMENT * width).buffer);
      elements.set(normalized ? [...element].map((value) => Math.max(value / largest[componentType], -1)) : element,
                   i * width);
    }
    return elements;
  };
  const images = [];
  for (const { bufferView } of json.images ?? []) {
    const { byteOffset, byteLength } = view(bufferView);
    images.push(await decodePng(new Uint8Array(buffer, start + byteOffset, byteLength)));
  }
  const read = ({ attributes, indices, material }) => {
    const texture = json.materials[material].pbrMetallicRoughness.baseColorTexture?.index;
    const image = images[json.textures?.[texture]?.source];
    const coordinates = accessor(attributes.TEXCOORD_0);
    const colours = accessor(attributes.COLOR_0);
    const texelOf = (vertex) => {
      if (!image) return [255, 255, 255, 255];
      const x = Math.floor(coordinates[vertex * 2] * image.width);
      const y = Math.floor(coordinates[vertex * 2 + 1] * image.height);
      return [...image.data.slice((y * image.width + x) * 4, (y * image.width + x) * 4 + 4)];
    };
    const lightOf = (vertex) => [0, 1, 2].map((channel) => (colours ? colours[vertex * 4 + channel] : 1));
    return { positions: accessor(attributes.POSITION), normals: accessor(attributes.NORMAL),
             indices: accessor(indices), textured: image !== undefined, texelOf, lightOf };
  };
  return { meshes: (json.meshes ?? []).map(({ primitives }) => ({ primitives: primitives.map(read) })) };
}
