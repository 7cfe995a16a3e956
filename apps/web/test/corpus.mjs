// Real files: the module reads and writes the same as the native tool.
//   node corpus.mjs PACKAGE TOOL FOLDER...
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readdirSync, readFileSync, rmSync, statSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { extname, join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { inflateSync } from 'node:zlib';

const [packageFolder, tool, ...folders] = process.argv.slice(2);
const { load } = await import(pathToFileURL(join(packageFolder, 'quoin.js')));
const scratch = mkdtempSync(join(tmpdir(), 'quoin-web-'));

/** Returns the missing libraries or sidecar files that the module reports; else undefined. */
function lacks(message) {
  if (/only from a path|beside it/.test(message)) return 'files beside them';
  return /LZ4|without (tinyobjloader|tinygltf)/.exec(message)?.[0].replace('without ', '');
}

function filesBelow(path) {
  if (!statSync(path).isDirectory()) return [path];
  return readdirSync(path).sort().flatMap((name) => filesBelow(join(path, name)));
}

function native(args, input) {
  try {
    execFileSync(tool, args, { stdio: [input ? 'pipe' : 'ignore', 'ignore', 'pipe'], input });
    return true;
  } catch {
    return false;
  }
}

/** Returns the pixels of an 8-bit RGB PNG, as written by the tool. */
function pixelsOf(png) {
  const view = new DataView(png.buffer, png.byteOffset, png.byteLength);
  const [width, height] = [view.getUint32(16), view.getUint32(20)];
  if (png[24] !== 8 || png[25] !== 2) throw new Error('the PNG is not of 8-bit RGB');
  const parts = [];
  for (let at = 8; at < png.length; at += 12 + view.getUint32(at)) {
    if (png.toString('latin1', at + 4, at + 8) !== 'IDAT') continue;
    parts.push(png.subarray(at + 8, at + 8 + view.getUint32(at)));
  }
  const rows = inflateSync(Buffer.concat(parts));
  const stride = 3 * width;
  const out = new Uint8Array(stride * height);
  for (let y = 0; y < height; ++y) {
    const filter = rows[y * (stride + 1)];
    for (let x = 0; x < stride; ++x) {
      const left = x < 3 ? 0 : out[y * stride + x - 3];
      const above = y === 0 ? 0 : out[(y - 1) * stride + x];
      const corner = x < 3 || y === 0 ? 0 : out[(y - 1) * stride + x - 3];
      const guess = left + above - corner;
      const [a, b, c] = [left, above, corner].map((value) => Math.abs(guess - value));
      const paeth = a <= b && a <= c ? left : b <= c ? above : corner;
      const predicted = [0, left, above, (left + above) >> 1, paeth][filter];
      out[y * stride + x] = rows[y * (stride + 1) + 1 + x] + predicted;
    }
  }
  return out;
}

const isVolume = /\.(nii|nrrd|gz)$/;
const jsonOf = (glb) => JSON.parse(glb.toString('utf8', 20, 20 + glb.readUInt32LE(12)));

/** Returns how much of two GLBs is equal: all, all but names, or the arrays; undefined if the arrays differ. */
function sameness(expected, glb) {
  if (expected.equals(glb)) return 'all';
  const arrays = (bytes) => bytes.subarray(20 + bytes.readUInt32LE(12));
  if (!arrays(expected).equals(arrays(glb))) return undefined;
  const nameless = (bytes) => JSON.stringify(jsonOf(bytes), (key, value) => key === 'name' ? undefined : value);
  return nameless(expected) === nameless(glb) ? 'all but names' : 'arrays';
}

/** Returns true if enough is equal. Bytes lack the file name, which the tool gives to volumes and voxelised triangles,
 *  and the tool's metres of volumes. */
function isEnough(same, file, scene) {
  if (isVolume.test(file)) return same !== undefined;
  return same === 'all' || (same === 'all but names' && scene.warnings.some((text) => text.startsWith('voxelised')));
}

/** Returns true if a volume has non-cubic or sheared voxels. The tool then transforms its mesh, while loading it as a
 *  scene resamples it, so the surfaces differ. */
function isStretched(file, glb) {
  if (!isVolume.test(file)) return false;
  const { nodes } = jsonOf(glb);
  return nodes.some(({ scale }) => !scale || scale[0] !== scale[1] || scale[0] !== scale[2]);
}

const counts = { same: { all: 0, 'all but names': 0, arrays: 0 }, compared: 0, stretched: 0, images: 0, refused: 0,
                 lacking: {}, wrong: 0 };
function wrong(file, why) {
  ++counts.wrong;
  console.log(`WRONG ${file}: ${why}`);
}

for (const file of folders.flatMap(filesBelow)) {
  const out = join(scratch, 'out.glb');
  rmSync(out, { force: true });
  // From standard input, so that the tool has no file name either.
  const bytes = readFileSync(file);
  const isRead = native(['convert', '-', out], bytes);
  let scene;
  let glb;
  try {
    scene = await load(bytes);
    glb = Buffer.from(scene.glb().buffer);
  } catch (error) {
    const what = lacks(error.message);
    if (!isRead) ++counts.refused;
    else if (what) counts.lacking[what] = (counts.lacking[what] ?? 0) + 1;
    else wrong(file, `native reads it, the module does not: ${error.code}: ${error.message}`);
    continue;
  }
  const expected = isRead ? readFileSync(out) : undefined;
  const same = isRead ? sameness(expected, glb) : undefined;
  if (!isRead) {
    wrong(file, 'the module reads it, native does not');
  } else if (isStretched(file, expected)) {
    ++counts.stretched;
  } else if (!isEnough(same, file, scene)) {
    wrong(file, `another GLB, of ${glb.length} bytes; the same: ${same ?? 'nothing'}`);
  } else {
    ++counts.compared;
    ++counts.same[same];
    const image = join(scratch, 'out.png');
    if (extname(file) === '.vox' && counts.compared % 8 === 0 &&
        native(['render', file, '-o', image, '--size', '96x64', '--samples', '4'])) {
      const { rgba } = scene.render({ width: 96, height: 64, samples: 4 });
      const pixels = pixelsOf(readFileSync(image));
      let different = 0;
      for (let i = 0; i < 96 * 64 * 3; ++i) different += pixels[i] !== rgba[4 * Math.floor(i / 3) + (i % 3)] ? 1 : 0;
      if (different > 0) wrong(file, `${different} channels of the image differ`);
      else ++counts.images;
    }
  }
  scene.free();
}
rmSync(scratch, { recursive: true });
const lacking = Object.entries(counts.lacking).map(([what, count]) => `${count} for ${what}`).join(', ') || 'none';
console.log(`GLBs that are the tool's: ${counts.same.all}; but for names, where triangles were voxelised: ${
  counts.same['all but names']}; only their arrays, of volumes: ${counts.same.arrays}`);
console.log(`images that are the tool's: ${counts.images}; files that both refuse: ${counts.refused}`);
console.log(`not compared: volumes that the tool stretches and the module resamples: ${
  counts.stretched}; what the module lacks and the tool reads: ${lacking}`);
if (counts.wrong > 0) console.log(`WRONG: ${counts.wrong}`);
if (counts.wrong > 0 || counts.compared === 0) process.exit(1);
