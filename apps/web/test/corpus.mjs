// The real files: what the module reads and writes is what the native tool does.
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

/** Whether the module says that a library is left out there, or that a file lies beside the one that was given. */
function isLeftOut(file, message) {
  return /LZ4|only from a path|beside it/.test(message) ||
    (/\.(obj|glb|gltf)$/i.test(file) && message.includes('not a file of any format'));
}

function filesBelow(path) {
  if (!statSync(path).isDirectory()) return [path];
  return readdirSync(path).sort().flatMap((name) => filesBelow(join(path, name)));
}

function native(...args) {
  try {
    execFileSync(tool, args, { stdio: ['ignore', 'ignore', 'pipe'] });
    return true;
  } catch {
    return false;
  }
}

/** The pixels of a PNG of 8-bit RGB, as the tool writes them. */
function pixelsOf(png) {
  const view = new DataView(png.buffer, png.byteOffset, png.byteLength);
  const [width, height] = [view.getUint32(16), view.getUint32(20)];
  if (png[24] !== 8 || png[25] !== 2) throw new Error('the PNG is not of 8-bit RGB');
  const parts = [];
  for (let at = 8; at < png.length; at += 12 + view.getUint32(at)) {
    if (png.toString('latin1', at + 4, at + 8) === 'IDAT') parts.push(png.subarray(at + 8, at + 8 + view.getUint32(at)));
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

/** What a GLB holds beside its JSON. Of volumes the tool writes the file's name and metres, which bytes do not tell. */
function isSame(expected, glb, file) {
  if (expected.equals(glb)) return true;
  const arrays = (bytes) => bytes.subarray(20 + bytes.readUInt32LE(12));
  return isVolume.test(file) && arrays(expected).equals(arrays(Buffer.from(glb)));
}

/** Whether the tool places a volume's vertices by a matrix or stretches its mesh, since its voxels are long or askew, where
 *  reading it as a scene resamples it: then they are two surfaces. */
function isStretched(file, glb) {
  if (!isVolume.test(file)) return false;
  const { nodes } = JSON.parse(glb.toString('utf8', 20, 20 + glb.readUInt32LE(12)));
  return nodes.some(({ scale }) => !scale || scale[0] !== scale[1] || scale[0] !== scale[2]);
}

const counts = { same: 0, notCompared: 0, pictures: 0, refused: 0, leftOut: 0, wrong: 0 };
function wrong(file, why) {
  ++counts.wrong;
  console.log(`WRONG ${file}: ${why}`);
}

for (const file of folders.flatMap(filesBelow)) {
  const out = join(scratch, 'out.glb');
  rmSync(out, { force: true });
  const isRead = native('convert', file, out);
  let scene;
  let glb;
  try {
    scene = await load(readFileSync(file));
    glb = scene.glb();
  } catch (error) {
    if (!isRead) ++counts.refused;
    else if (isLeftOut(file, error.message)) ++counts.leftOut;
    else wrong(file, `native reads it, the module does not: ${error.code}: ${error.message}`);
    continue;
  }
  if (!isRead) {
    wrong(file, 'the module reads it, native does not');
  } else if (isStretched(file, readFileSync(out))) {
    ++counts.notCompared;
  } else if (!isSame(readFileSync(out), glb, file)) {
    wrong(file, `another GLB, of ${glb.length} bytes`);
  } else {
    ++counts.same;
    const picture = join(scratch, 'out.png');
    if (extname(file) === '.vox' && counts.same % 8 === 0 &&
        native('render', file, '-o', picture, '--size', '96x64', '--samples', '4')) {
      const { rgba } = scene.render({ width: 96, height: 64, samples: 4 });
      const expected = pixelsOf(readFileSync(picture));
      let different = 0;
      for (let i = 0; i < 96 * 64 * 3; ++i) different += expected[i] !== rgba[4 * Math.floor(i / 3) + (i % 3)] ? 1 : 0;
      if (different > 0) wrong(file, `${different} channels of the picture differ`);
      else ++counts.pictures;
    }
  }
  scene.free();
}
rmSync(scratch, { recursive: true });
console.log(JSON.stringify(counts));
if (counts.wrong > 0 || counts.same === 0) process.exit(1);
