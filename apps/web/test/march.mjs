// Pictures by WebGPU against those of the module, in headless Chromium with a processor for a graphics card: the same
// scene, camera, sun and samples. And the mode of the page that shows them.
//   node march.mjs PAGE ESBUILD OUT_FOLDER FILE...
import { existsSync } from 'node:fs';
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import { spawnSync } from 'node:child_process';
import { tmpdir } from 'node:os';
import { basename, extname, join } from 'node:path';
import { scenes } from './march_scenes.mjs';

const [page, esbuild, out, ...files] = process.argv.slice(2);
const require = createRequire(new URL('../../../tests/web/package.json', import.meta.url));
const executablePath = process.env.CHROMIUM ?? '/usr/bin/chromium';
function skip(why) {
  console.log(`skipped, what is marched in the browser: ${why}`);
  process.exit(77);
}
if (!existsSync(executablePath)) skip(`no browser at ${executablePath} (set CHROMIUM)`);
let chromium;
try {
  ({ chromium } = require('playwright-core'));
} catch {
  skip('run npm install in tests/web first');
}

let failed = 0;
function check(isRight, what) {
  if (!isRight) ++failed;
  console.log(`${isRight ? 'right' : 'WRONG'}: ${what}`);
}

// ---- The site: the page, the harness in which pictures are compared, and the files.
const work = await mkdtemp(join(tmpdir(), 'quoin-march-'));
const harness = join(work, 'marched.js');
const bundled = spawnSync(esbuild, [new URL('./marched.js', import.meta.url).pathname, '--bundle', '--format=esm',
                                    '--external:node:*', '--loader:.wgsl=text', '--log-level=warning',
                                    `--outfile=${harness}`], { stdio: 'inherit' });
if (bundled.status !== 0) process.exit(1);
const given = new Map();
for (const file of files) given.set(`/${basename(file)}`, await readFile(file));
for (const [name, bytes] of Object.entries(scenes())) given.set(`/${name}`, bytes);
const types = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.wasm': 'application/wasm' };
const server = createServer(async (request, response) => {
  const path = decodeURIComponent(new URL(request.url, 'http://localhost').pathname);
  try {
    const body = path === '/compare.html' ? '<!doctype html><script type="module" src="marched.js"></script>'
      : path === '/marched.js' ? await readFile(harness)
      : given.get(path) ?? await readFile(join(page, path === '/' ? 'index.html' : path));
    const from = path === '/' ? '.html' : extname(path);
    response.writeHead(200, { 'Content-Type': types[from] ?? 'application/octet-stream' });
    response.end(body);
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((done) => server.listen(0, '127.0.0.1', done));
const site = `http://127.0.0.1:${server.address().port}/`;

const launch = (...args) => chromium.launch({
  executablePath, headless: true,
  args: ['--no-sandbox', '--disable-background-networking', '--no-first-run', '--use-gl=angle', '--use-angle=swiftshader',
         '--enable-unsafe-swiftshader', ...args],
});
const withWebGpu = ['--enable-unsafe-webgpu', '--ignore-gpu-blocklist', '--enable-features=Vulkan,WebGPU',
                    '--use-vulkan=swiftshader', '--use-webgpu-adapter=swiftshader'];

// What is asked of every picture; the shares are those of Quoin's Vulkan backend against its processor's.
const leastClose = 0.999;  // within 2 of 255
const width = 320;
const height = 180;
const suns = [undefined, [1, 0.5, -0.4], [-0.2, 0.15, 0.9]];

async function comparePictures(tab) {
  let worst = 1;
  let all = 0;
  let equal = 0;
  let largest = 0;
  for (const address of given.keys()) {
    const views = suns.map((sun) => ({ width, height, sun }));
    const { has, bytes, opening, name, found } = await tab.evaluate(
      ([from, list, options]) => window.compare(from, list, options),
      [address.slice(1), views, { samples: 2, keeps: out !== '-' }]);
    for (const [i, one] of found.entries()) {
      const share = one.close / one.pixels;
      worst = Math.min(worst, share);
      all += one.pixels;
      equal += one.equal;
      largest = Math.max(largest, one.largest);
      check(share >= leastClose && one.colours > 20, `${address} ${i}: ${(100 * share).toFixed(3)} % within 2, ${
        (100 * one.equal / one.pixels).toFixed(3)} % equal, at most ${one.largest}; ${one.milliseconds.toFixed(0)} ms a sample, ${
        one.byModule.toFixed(0)} by the module; has ${has}, ${bytes} bytes, opened in ${opening.toFixed(0)} ms on ${name}`);
      for (const [k, picture] of one.pictures.entries())
        await writeFile(join(out, `marched${address.replaceAll('/', '-')}-${i}-${k === 0 ? 'device' : 'module'}.png`),
                        Buffer.from(picture));
    }
  }
  console.log(`all: ${(100 * equal / all).toFixed(3)} % of ${all} pixels equal, the worst picture ${
    (100 * worst).toFixed(3)} % within 2, the largest difference ${largest}`);
}

const browser = await launch(...withWebGpu);
try {
  const tab = await browser.newPage();
  const errors = [];
  tab.on('pageerror', (error) => errors.push(String(error)));
  tab.on('console', (message) => ['error', 'warning'].includes(message.type()) && errors.push(message.text()));
  await tab.goto(`${site}compare.html`);
  await tab.waitForFunction(() => window.compare !== undefined);
  if (await tab.evaluate(async () => await navigator.gpu?.requestAdapter() ?? null) === null) {
    console.log('skipped, what is marched in the browser: this Chromium has no WebGPU on a processor');
    process.exitCode = 77;
  } else {
    await comparePictures(tab);
    const small = await tab.evaluate(([from]) => window.openOnSmallDevice(from, 1024), [[...given.keys()][0].slice(1)]);
    check(/the scene takes .* MiB there, and the adapter binds/.test(small), `a device without room says so: ${small}`);
    check(errors.length === 0, `no error of the shaders${errors.map((text) => ` ${text}`)}`);
  }
} finally {
  await browser.close();
  server.close();
  await rm(work, { recursive: true });
}
process.exit(failed > 0 ? 1 : process.exitCode ?? 0);
