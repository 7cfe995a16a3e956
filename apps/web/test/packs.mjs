// Small files for tests of resource packs.
import { crc32 } from 'node:zlib';

/** Returns a .vox file of one voxel. */
export function oneVoxel() {
  const id = (name) => Buffer.from(name).readUInt32LE();
  return Buffer.from(Uint32Array.of(id('VOX '), 150, id('MAIN'), 0, 44, id('SIZE'), 12, 0, 1, 1, 1,
                                    id('XYZI'), 8, 0, 1, 1 << 24).buffer);
}

/** Returns a zip file without compression. `files`: texts by name. */
export function zipOf(files) {
  const numbers = (...pairs) => Buffer.concat(pairs.map(([value, bytes]) => {
    const part = Buffer.alloc(bytes);
    part.writeUIntLE(value, 0, bytes);
    return part;
  }));
  const [parts, directory] = [[], []];
  let at = 0;
  for (const [name, content] of Object.entries(files)) {
    const [path, text] = [Buffer.from(name), Buffer.from(content)];
    // Version, flags, method, time, date; checksum, sizes, lengths of the name and of extra fields.
    const header = numbers([20, 2], [0, 2], [0, 2], [0, 2], [0, 2], [crc32(text), 4], [text.length, 4],
                           [text.length, 4], [path.length, 2], [0, 2]);
    parts.push(numbers([0x04034b50, 4]), header, path, text);
    directory.push(numbers([0x02014b50, 4], [20, 2]), header, Buffer.alloc(10), numbers([at, 4]), path);
    at += 4 + header.length + path.length + text.length;
  }
  const list = Buffer.concat(directory);
  const count = Object.keys(files).length;
  return Buffer.concat([...parts, list, numbers([0x06054b50, 4], [0, 4], [count, 2], [count, 2], [list.length, 4],
                                                [at, 4], [0, 2])]);
}

/** Returns a resource pack whose stone is a box of that height, in sixteenths. */
export function stonePack(height) {
  const sides = ['down', 'up', 'north', 'south', 'west', 'east'];
  const faces = Object.fromEntries(sides.map((side) => [side, { texture: '#all' }]));
  return zipOf({
    'assets/minecraft/blockstates/stone.json': JSON.stringify({ variants: { '': { model: 'block/stone' } } }),
    'assets/minecraft/models/block/stone.json':
      JSON.stringify({ elements: [{ from: [0, 0, 0], to: [16, height, 16], faces }] }),
  });
}
