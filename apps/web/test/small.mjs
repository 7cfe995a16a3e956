// The small module writes the same as the whole one, and reports missing functions.
//   node small.mjs PACKAGE FOLDER...
import { readdirSync, readFileSync, statSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { gzipSync } from 'node:zlib';

const [packageFolder, ...folders] = process.argv.slice(2);
const { load, QuoinError } = await import(pathToFileURL(join(packageFolder, 'quoin.js')));
const counts = { small: 0, whole: 0, refused: 0, wrong: 0 };

function wrong(file, why) {
  ++counts.wrong;
  console.log(`WRONG ${file}: ${why}`);
}

function filesBelow(path) {
  if (!statSync(path).isDirectory()) return [path];
  return readdirSync(path).sort().flatMap((name) => filesBelow(join(path, name)));
}

async function tried(bytes, options) {
  try {
    return { scene: await load(bytes, options) };
  } catch (error) {
    if (!(error instanceof QuoinError)) throw error;
    return { error };
  }
}

/** Returns true if a scene is from the small module and has no rays. */
function isSmall(scene) {
  try {
    scene.rays([], []);
    return scene.isSmall;
  } catch (error) {
    if (error.code !== 'unsupported' || !scene.isSmall) throw error;
    return true;
  }
}

for (const file of folders.flatMap(filesBelow)) {
  const bytes = readFileSync(file);
  if (bytes.length > 4e6) continue;
  const [few, all] = [await tried(bytes, { small: true }), await tried(bytes)];
  const isVox = bytes.toString('latin1', 0, 4) === 'VOX ';
  if (few.error || all.error) {
    ++counts.refused;
    if (few.error?.code !== all.error?.code || few.error?.message !== all.error?.message)
      wrong(file, `small: ${few.error ?? 'read'}; whole: ${all.error ?? 'read'}`);
  } else if (isSmall(few.scene) !== isVox) {
    wrong(file, `is read by the ${isVox ? 'whole' : 'small'} module`);
  } else if (isVox) {
    ++counts.small;
    for (const options of [{}, { smooth: true }]) {
      if (!Buffer.from(few.scene.glb(options)).equals(Buffer.from(all.scene.glb(options))))
        wrong(file, `another GLB with ${JSON.stringify(options)}`);
    }
    if (!Buffer.from(few.scene.file('.vox')).equals(Buffer.from(all.scene.file('.vox')))) wrong(file, 'another .vox');
    if (few.scene.warnings.join() !== all.scene.warnings.join()) wrong(file, 'other warnings');
  } else {
    ++counts.whole;
  }
  few.scene?.free();
  all.scene?.free();
}
const sizes = ['quoin-small.wasm', 'quoin.wasm'].map((name) => readFileSync(join(packageFolder, name)));
const [small, whole] = sizes.map((bytes) => [bytes.length, gzipSync(bytes, { level: 9 }).length]);
console.log(`small module: ${small[0]} bytes, ${small[1]} gzipped; whole: ${whole[0]}, ${whole[1]} gzipped`);
console.log(`the small module reads and writes ${counts.small} files as the whole one does; leaves it ${
  counts.whole}; both refuse ${counts.refused}`);
if (counts.wrong > 0 || counts.small === 0 || counts.whole === 0) process.exit(1);
