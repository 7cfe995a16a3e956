// Scenes with all features of ray marching, as scene files (docs/scene-files.md).
import { gzipSync } from 'node:zlib';

const edge = 64;

// The chunk at (0, 0, 0): `typeAt(x, y, z)`, below 256. `densityAt`: half floats too.
function chunk(typeAt, densityAt) {
  const palette = 256;
  const parts = [Buffer.alloc(16 + 2 * palette)];
  parts[0].writeUInt32LE(palette, 12);
  for (let i = 0; i < palette; ++i) parts[0].writeUInt16LE(i <= types.length ? i : 0, 16 + 2 * i);
  const slabs = (write) => {
    for (let z = 0; z < edge; z += 4) for (let y = 0; y < edge; y += 4) parts.push(write(y, z));
  };
  const rows = (y, z, visit) => {
    let i = 0;
    for (let dz = 0; dz < 4; ++dz) for (let dy = 0; dy < 4; ++dy) for (let x = 0; x < edge; ++x)
      visit(i++, x, y + dy, z + dz);
  };
  slabs((y, z) => {
    const slab = Buffer.alloc(4 + edge * 16, 0xFF);
    rows(y, z, (i, ...at) => slab.writeUInt8(typeAt(...at), 4 + i));
    return slab;
  });
  if (densityAt !== undefined) {
    const none = Buffer.alloc(4, 0xFF);
    parts.push(none);
    slabs((y, z) => {
      const slab = Buffer.alloc(4 + 2 * edge * 16, 0xFF);
      let before = 0;
      rows(y, z, (i, x, ...at) => {
        if (x === 0) before = 0;
        const half = halfOf(densityAt(x, ...at));
        const step = (half - before) & 0xFFFF;
        before = half;
        slab.writeUInt8(step & 0xFF, 4 + i);
        slab.writeUInt8(step >> 8, 4 + edge * 16 + i);
      });
      return slab;
    });
  }
  return gzipSync(Buffer.concat(parts)).toString('base64');
}

// A half float's bits, of a number away from 0 within the band.
function halfOf(value) {
  const size = Math.min(Math.max(Math.abs(value), 1 / 64), 8);
  const exponent = Math.min(Math.floor(Math.log2(size)), 3);
  const bits = (exponent + 15) * 1024 + Math.round((size / 2 ** exponent - 1) * 1023);
  return value < 0 ? bits | 0x8000 : bits;
}

const sceneOf = (body) => Buffer.from(JSON.stringify({ quoin_scene: 3, ...body }));

const types = [
  { colour: [150, 150, 140, 255] }, { colour: [190, 60, 40, 255] },
  { colour: [60, 120, 190, 110], visibility: 'transparent' }, { colour: [250, 220, 160, 255], emission: 3 },
  { colour: [80, 200, 120, 60], visibility: 'transparent', ior: 1.33 }, { colour: [90, 140, 60, 255] },
];

// A floor, pillars, a wall with a window, a basin of water, lanterns.
function yard(x, y, z) {
  if (y < 3) return (x >> 2) + (z >> 2) & 1 ? 1 : 6;
  if (y < 6 && x > 36 && x < 60 && z > 36 && z < 60) return x === 37 || x === 59 || z === 37 || z === 59 ? 1 : 5;
  if (x % 16 < 3 && z % 16 < 3 && x < 34) return y < 24 ? 2 : y < 26 ? 4 : 0;
  if (z === 12 && y < 20) return y > 8 && y < 16 && x % 12 > 3 ? 3 : 1;
  return 0;
}

const turn = (axis, degrees) => ({ axis, degrees });

/** Scenes by file name. */
export function scenes() {
  const voxels = [chunk(yard)];
  const stones = [chunk((...at) => [0, 1, 2, 6, 1, 2, 6][yard(...at)])];
  const ball = (x, y, z) => Math.hypot(x - 30, y - 28, z - 32) - 20 + 2 * Math.sin(x / 3) * Math.cos(z / 4);
  const hollow = (x, y, z) => Math.max(ball(x, y, z), 12 - Math.hypot(x - 30, y - 34, z - 40));
  const stripes = (x, y) => 1 + (y >> 3) % 2;
  const halves = (x, y, z) => (z > 34 ? 3 : x > 32 ? 5 : y > 20 ? 2 : 1);
  return {
    'stones.json': sceneOf({ types, grids: [{ voxels: stones }], instances: [{ grid: 0 }] }),
    'yard.json': sceneOf({ types, grids: [{ voxels }], instances: [{ grid: 0 }] }),
    'many_places.json': sceneOf({
      types, grids: [{ voxels, pivot: [32, 0, 32] }],
      instances: [
        { grid: 0 },
        { grid: 0, position: [70, 4.25, 3], rotation: turn([0, 1, 0], 33), scale: 0.5 },
        { grid: 0, position: [-48, 9, 12], rotation: turn([1, 0.2, 0.4], 71), scale: 1.25, mirrored: true },
        { grid: 0, position: [20, 30, -50], rotation: turn([0, 0, 1], 90), scale: 0.25 },
        { grid: 0, position: [8, 2.5, 6], rotation: turn([0, 1, 0], 10), scale: 0.75 },
      ],
      lamps: [{ kind: 'point', position: [10, 14, 30], intensity: 60, colour: [1, 0.5, 0.3] },
              { kind: 'spot', position: [60, 40, 20], direction: [-0.4, -1, 0.1], intensity: 900, outer_angle: 0.5 }],
    }),
    'far_away.json': sceneOf({
      types, grids: [{ voxels }], instances: [{ grid: 0, position: [3e6, -2e6, 1e6] },
                                              { grid: 0, position: [3e6 + 64, -2e6, 1e6 + 8] }],
    }),
    'field.json': sceneOf({
      types, grids: [{ voxels: [], densities: [chunk(stripes, hollow)] }, { voxels }],
      instances: [{ grid: 0, position: [0, 4, 0] }, { grid: 1, position: [0, -6, 0] },
                  { grid: 0, position: [52, 0, 14], rotation: turn([0.3, 1, 0], 40), scale: 0.6 }],
    }),
    'glass_field.json': sceneOf({
      types, grids: [{ voxels: [], densities: [chunk(halves, hollow)] }, { voxels }],
      instances: [{ grid: 0, position: [0, 4, 0] }, { grid: 1, position: [0, -6, 0] }],
    }),
  };
}
