// Tests the npm package: installs it in an empty folder, compiles with strict types, runs and bundles.
//   node package.mjs QUOIN.tgz TSC FILE ESBUILD
import { execFileSync } from 'node:child_process';
import { cpSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';

const [tarball, tsc, file, esbuild] = process.argv.slice(2).map((path) => resolve(path));
const folder = mkdtempSync(join(tmpdir(), 'quoin-package-'));
const run = (program, ...args) => execFileSync(program, args, { cwd: folder, stdio: ['ignore', 'pipe', 'inherit'] });

writeFileSync(join(folder, 'package.json'), '{"type": "module", "private": true}\n');
run('npm', 'install', '--silent', '--no-audit', '--no-fund', '--offline', tarball);
writeFileSync(join(folder, 'use.ts'), `
import { load, meshLabels, start, surfaceNets, toThree, QuoinError } from 'quoin';
import type { ErrorCode, Heights, Hits, LabelMesh, LoadOptions, Mesh, Scene } from 'quoin';

export async function use(bytes: Uint8Array): Promise<number> {
  await start(undefined, { small: true });
  const scene: Scene = await load(bytes, { small: true, frame: 2, progress: (fraction) => fraction < 2 });
  const glb: Uint8Array = scene.glb({ smooth: false, watertight: true });
  const heights: Heights = { encoding: 'grey', metresPerPixel: 2 };
  const options: LoadOptions = bytes.length === 8 ? { raw: { shape: [2, 2, 2], type: 'uint8' }, iso: 3 } : { heights };
  await load(bytes, options);
  const mesh: Mesh = await surfaceNets(new Float32Array(8), [2, 2, 2], 0.5, { spacing: [1, 1, 2] });
  const image = scene.render({ width: 8, height: 8, camera: { position: [1, 2, 3], lookAt: [0, 0, 0] } });
  const hits: Hits = scene.rays([0, 9, 0], new Float32Array([0, -1, 0]), { maxT: 20 });
  const labels: LabelMesh<number> = await meshLabels(new Uint8Array(8), [2, 2, 2], { background: 1 });
  const large: LabelMesh<bigint> = await meshLabels(new BigInt64Array(8), [2, 2, 2], { relaxationSteps: 0 });
  const behind: bigint | undefined = large.interfaces[0]?.back;
  console.log(hits.t.length + hits.voxel.length, labels.interfaces.length, behind);
  class Loader { async parseAsync(_data: ArrayBuffer, _path: string) { return { scene: { name: 'group' } }; } }
  const group = await toThree(scene, Loader);
  try {
    scene.mesh(0);
  } catch (error) {
    if (error instanceof QuoinError) { const code: ErrorCode = error.code; console.log(code); }
  }
  scene.free();
  return glb.length + mesh.indices.length + image.rgba.length + group.name.length + (mesh.colours?.length ?? 0);
}
// @ts-expect-error: bytes, not a path
void load('castle.vox');
// @ts-expect-error: not a value type
void load(new Uint8Array(8), { raw: { shape: [2, 2, 2], type: 'int12' } });
// @ts-expect-error: labels are integers
void meshLabels(new Float32Array(8), [2, 2, 2]);
`);
run(process.execPath, tsc, '--strict', '--noEmit', '--exactOptionalPropertyTypes', '--noUncheckedIndexedAccess',
    '--target', 'es2022', '--module', 'nodenext', 'use.ts', 'node_modules/quoin/quoin.d.ts');
// Without the browser's types, which Node.js projects lack.
writeFileSync(join(folder, 'node.d.ts'), 'declare class URL { constructor(text: string); }\n');
run(process.execPath, tsc, '--strict', '--noEmit', '--target', 'es2022', '--lib', 'es2022', '--module', 'nodenext',
    'node.d.ts', 'node_modules/quoin/quoin.d.ts');
writeFileSync(join(folder, 'use.mjs'), `
import { readFileSync } from 'node:fs';
import { load } from 'quoin';
const scene = await load(readFileSync(process.argv[2]));
if (scene.glb().length < 1000 || scene.grids.length === 0) process.exit(1);
console.log(\`package: \${scene.grids.length} grids, a GLB of \${scene.glb().length} bytes\`);
`);
process.stdout.write(run(process.execPath, 'use.mjs', file));
// Bundles for browsers, without Node.js, with the modules next to the bundle.
writeFileSync(join(folder, 'page.mjs'), `
import { load } from 'quoin';
export const lengthOfGlb = async (bytes) => (await load(bytes)).glb().length;
`);
run(esbuild, 'page.mjs', '--bundle', '--minify', '--format=esm', '--platform=browser', '--log-level=error',
    '--outfile=bundled/page.mjs');
cpSync(join(folder, 'node_modules/quoin/quoin.wasm'), join(folder, 'bundled/quoin.wasm'));
const { lengthOfGlb } = await import(pathToFileURL(join(folder, 'bundled/page.mjs')));
console.log(`bundled: a GLB of ${await lengthOfGlb(readFileSync(file))} bytes`);
const licences = readFileSync(join(folder, 'node_modules/quoin/LICENSES'), 'utf8');
for (const name of ['zlib', 'libpng', 'LLVM', 'wasi-libc', 'GLM', 'nlohmann-json', 'robin-map', 'tl::expected',
                    'tinygltf', 'tinyobjloader', 'meshoptimizer'])
  if (!licences.includes(`======== ${name}`)) throw new Error(`the package does not have the licence of ${name}`);
rmSync(folder, { recursive: true });
