// Computes the colour and occlusion of surface points of a one-model .vox file from its voxels: the reference that
// pixels.mjs compares with. Axes: MagicaVoxel's (x, y, z) is (x, z, -y) here; the model turns about floor(size / 2).

/** {type(voxel), colour(type)} in coordinates of the file's world; null when the file is not that simple. */
export function readVox(buffer) {
  const view = new DataView(buffer);
  const tag = (at) => String.fromCharCode(...new Uint8Array(buffer, at, 4));
  const chunks = {};
  const walk = (from, to) => {
    for (let at = from; at + 12 <= to; ) {
      const [content, children] = [view.getUint32(at + 4, true), view.getUint32(at + 8, true)];
      (chunks[tag(at)] ??= []).push(at + 12);
      walk(at + 12 + content, at + 12 + content + children);
      at += 12 + content + children;
    }
  };
  walk(8, buffer.byteLength);
  const simple = chunks.SIZE?.length === 1 && chunks.RGBA && !chunks.nTRN && !chunks.MATL && !chunks.MATT;
  if (!simple) return null;
  const size = [0, 4, 8].map((offset) => view.getUint32(chunks.SIZE[0] + offset, true));
  const centre = size.map((length) => Math.floor(length / 2));
  const voxels = new Map();
  const count = view.getUint32(chunks.XYZI[0], true);
  for (let i = 0; i < count; ++i) {
    const [x, y, z, colour] = new Uint8Array(buffer, chunks.XYZI[0] + 4 + i * 4, 4);
    voxels.set(`${x - centre[0]},${z},${centre[1] - y - 1}`, colour);
  }
  const palette = new Uint8Array(buffer, chunks.RGBA[0], 1024);
  return {
    type: (voxel) => voxels.get(voxel.join(',')) ?? 0,
    colour: (type) => [...palette.slice((type - 1) * 4, (type - 1) * 4 + 3)],
  };
}

/** Occlusion level of the corner of a face: 3 when both sides are filled, else how many of the three voxels are. */
function cornerLevel(truth, front, axes, signs) {
  const filled = (alongU, alongV) => {
    const voxel = [...front];
    voxel[axes[0]] += alongU;
    voxel[axes[1]] += alongV;
    return truth.type(voxel) !== 0;
  };
  const [side1, side2] = [filled(signs[0], 0), filled(0, signs[1])];
  return side1 && side2 ? 3 : Number(side1) + Number(side2) + Number(filled(...signs));
}

/** The colour and the brightness at a point of the surface whose outward normal is along an axis; null in the air.
 *  A face is split along its brighter diagonal. */
export function truthAt(truth, point, normal) {
  const axis = normal.findIndex((component) => Math.abs(component) > 0.5);
  const sign = Math.sign(normal[axis]);
  const voxel = point.map((value, index) => Math.floor(index === axis ? value - sign * 0.5 : value));
  const type = truth.type(voxel);
  if (type === 0) return null;
  const front = [...voxel];
  front[axis] += sign;
  const axes = [0, 1, 2].filter((index) => index !== axis);
  const [u, v] = axes.map((index) => point[index] - voxel[index]);
  const corner = (a, b) => 1 - 0.25 * cornerLevel(truth, front, axes, [a ? 1 : -1, b ? 1 : -1]);
  const [b00, b10, b11, b01] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
  const rising = u > v ? b00 + (b10 - b00) * u + (b11 - b10) * v : b00 + (b01 - b00) * v + (b11 - b01) * u;
  const w = 1 - u;
  const falling = w > v ? b10 + (b00 - b10) * w + (b01 - b00) * v : b10 + (b11 - b10) * v + (b01 - b11) * w;
  return { colour: truth.colour(type), brightness: b00 + b11 >= b10 + b01 ? rising : falling };
}
