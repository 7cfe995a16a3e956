// Converts every .vox file below a folder with the tool and checks the results:
// node check_tool.mjs TOOL FOLDER [--pixels N] [--occluded] [--smooth] [--packed] [--lit]
//
// --lit adds propagated light to vertices; pixels are then compared with the GLB alone. --packed quantizes and
// compresses. --smooth makes smooth meshes, and also converts volumes below the folder.
//
// Every GLB must pass the validator without a message. N of them (default 4, spread over the list) must pass the pixel
// check against their voxels. Files that the tool rejects are listed; it must reject them with status 1, one line and
// no output file. Exit status: 0 on success, 1 on failure, 77 if a program is not installed.
import { spawnSync } from 'node:child_process';
import { existsSync, mkdtempSync, readdirSync, rmSync, statSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';

const here = fileURLToPath(new URL('.', import.meta.url));
const { values, positionals } = parseArgs({ allowPositionals: true, options: {
  pixels: { type: 'string', default: '4' }, occluded: { type: 'boolean', default: false }, smooth: { type: 'boolean', default: false },
  packed: { type: 'boolean', default: false }, lit: { type: 'boolean', default: false },
} });
const [tool, folder] = positionals;
if (!existsSync(tool ?? '') || !existsSync(folder ?? '')) {
  console.log('skipped: no such tool or folder');
  process.exit(77);
}

const endings = values.smooth ? /\.(vox|nii|nii\.gz|nrrd)$/ : /\.vox$/;
const work = mkdtempSync(join(tmpdir(), 'quoin-web-'));
const script = (name, ...rest) => spawnSync(process.execPath, [join(here, name), ...rest], { stdio: 'inherit' }).status;

function convertAll(sources) {
  const [written, faults] = [[], []];
  for (const source of sources) {
    const glb = join(work, `${basename(source).replace(endings, '')}.glb`);
    const flags = [...(values.smooth ? ['--mesher', 'smooth'] : []), ...(values.packed ? ['--quantize', '--compress'] : []),
      ...(values.lit ? ['--light', 'propagated'] : [])];
    const run = spawnSync(tool, ['convert', source, glb, '--json', ...flags], { encoding: 'utf8' });
    if (run.status === 0 && JSON.parse(run.stdout).bytes > 0) {
      written.push([source, glb]);
    } else if (run.status === 1 && run.stderr.trim().split('\n').length === 1 && !existsSync(glb)) {
      console.log(`refused: ${run.stderr.trim()}`);
    } else {
      faults.push(source);
      console.log(`FAILED ${source}: status ${run.status} ${run.stderr}`);
    }
  }
  return [written, faults];
}

/** 77 (skipped) when nothing failed but something was not installed. */
function check() {
  const sources = readdirSync(folder, { recursive: true }).filter((name) => endings.test(name)).sort();
  const [written, faults] = convertAll(sources.map((name) => join(folder, name)));
  const statuses = [faults.length === 0 && written.length > 0 ? 0 : 1];
  // The validator reports compression that it does not know.
  statuses.push(script('validate.mjs', ...(values.packed ? [] : ['--strict']), ...written.map(([, glb]) => glb)));
  // A software driver takes seconds per megabyte.
  const small = written.filter(([, glb]) => statSync(glb).size < 1e6);
  const step = Math.max(1, Math.floor(small.length / Math.max(1, Number(values.pixels))));
  // The voxels define the look of blocks, not of smooth surfaces.
  const sampled = small.filter((_, i) => i % step === 0).slice(0, Number(values.pixels));
  const pairs = sampled.map(([source, glb]) => (values.smooth || values.lit ? glb : `${glb}=${source}`));
  if (pairs.length > 0) statuses.push(script('pixels.mjs', ...(values.occluded ? ['--occluded'] : []), ...pairs));
  const bad = statuses.filter((status) => status !== 0);
  return bad.some((status) => status !== 77) ? 1 : bad.length > 0 ? 77 : 0;
}

try {
  process.exitCode = check();
} finally {
  rmSync(work, { recursive: true });
}
