// Converts every .vox file below a folder with the tool and checks the results:
// node check_tool.mjs TOOL FOLDER [--pixels N] [--occluded] [--smooth] [--packed] [--lit]
//
// With --lit they have propagated light at their vertices, and pixels are compared with the file alone.
// With --packed they are quantized and compressed. With --smooth they become smooth meshes, and volumes below the folder too.
// Every GLB must pass the validator without a message, and N of them (default 4, spread over the list) the pixel check
// against their voxels. Files that the tool refuses are listed, and count only when it did not refuse them properly (status 1, one
// line, no file). Exit status: 0 all right, 1 not, 77 when something is not installed.
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
  // Finding the surface under a pixel tries every triangle.
  const small = written.filter(([, glb]) => statSync(glb).size < 1e6);
  const step = Math.max(1, Math.floor(small.length / Math.max(1, Number(values.pixels))));
  // Voxels tell what blocks look like, not what smooth surfaces do.
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
