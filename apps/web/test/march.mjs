// Compares WebGPU images with those of the module, in headless Chromium with a software device: the same scene, camera,
// sun and samples. Also tests the page's ray-marching mode.
//   node march.mjs PAGE ESBUILD OUT_FOLDER FILE...
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { spawnSync } from 'node:child_process';
import { tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { headless, requirements, serve } from '../../../tests/web/browser.mjs';
import { checkAloud as check, found as counts } from './checks.mjs';
import { scenes } from './march_scenes.mjs';

const [page, esbuild, out, ...files] = process.argv.slice(2);
const { chromium, launcher } = await requirements('skipped, ray marching in the browser');

// ---- The site: the page, the harness that compares images, and the files.
const work = await mkdtemp(join(tmpdir(), 'quoin-march-'));
const harness = join(work, 'marched.js');
const bundled = spawnSync(esbuild, [new URL('./marched.js', import.meta.url).pathname, '--bundle', '--format=esm',
                                    '--external:node:*', '--loader:.wgsl=text', '--log-level=warning',
                                    `--outfile=${harness}`], { stdio: 'inherit' });
if (bundled.status !== 0) process.exit(1);
const given = new Map(Object.entries(scenes()).map(([name, bytes]) => [`/${name}`, bytes]));
for (const file of files) given.set(`/${basename(file)}`, await readFile(file));
const comparing = '<!doctype html><link rel="icon" href="data:,"><script type="module" src="marched.js"></script>';
const own = new Map([['/compare.html', Buffer.from(comparing)], ['/marched.js', harness],
                     ['/', join(page, 'index.html')], ...given]);
const server = await serve((path) => own.get(path) ?? join(page, path));
const site = `http://127.0.0.1:${server.address().port}/`;

const launch = (...args) => launcher.launch({
  executablePath: chromium, headless: true, args: [...headless, ...args],
});
const withWebGpu = ['--enable-unsafe-webgpu', '--ignore-gpu-blocklist', '--enable-features=Vulkan,WebGPU',
                    '--use-vulkan=swiftshader', '--use-webgpu-adapter=swiftshader'];

// Limits for every image; the fractions are those of Quoin's Vulkan backend against its CPU renderer.
const leastClose = 0.999;  // within 2 of 255
const width = 128;
const height = 72;
const suns = [undefined, [-0.2, 0.15, 0.9]];
const inPage = 'stones.json';  // for testing the page: a scene that software renders quickly

async function compareImages(tab) {
  let worst = 1;
  let all = 0;
  let equal = 0;
  let largest = 0;
  for (const address of given.keys()) {
    const views = (address === '/many_places.json' ? suns.slice(0, 1) : suns).map((sun) => ({ width, height, sun }));
    const { has, bytes, opening, name, found } = await tab.evaluate(
      ([from, list, options]) => window.compare(from, list, options),
      [address.slice(1), views, { samples: 2, keeps: true }]);
    for (const [i, one] of found.entries()) {
      const share = one.close / one.pixels;
      worst = Math.min(worst, share);
      all += one.pixels;
      equal += one.equal;
      largest = Math.max(largest, one.largest);
      const { largest: off, milliseconds, byModule } = one;
      check(share >= leastClose && one.colours > 20, `${address} ${i}: ${(100 * share).toFixed(3)} % within 2, ${
        (100 * one.equal / one.pixels).toFixed(3)} % equal, at most ${off}; ${milliseconds.toFixed(0)} ms a sample, ${
        byModule.toFixed(0)} by the module; has ${has}, ${bytes} bytes, opened in ${opening.toFixed(0)} ms on ${name}`);
      for (const [k, image] of one.images.entries())
        await writeFile(join(out, `marched${address.replaceAll('/', '-')}-${i}-${k === 0 ? 'device' : 'module'}.png`),
                        Buffer.from(image));
    }
  }
  console.log(`all: ${(100 * equal / all).toFixed(3)} % of ${all} pixels equal, the worst image ${
    (100 * worst).toFixed(3)} % within 2, the largest difference ${largest}`);
}

function watch(tab, errors) {
  tab.on('pageerror', (error) => errors.push(String(error)));
  // The WebGL driver prints remarks about speed.
  tab.on('console', (message) => ['error', 'warning'].includes(message.type()) &&
    !message.text().startsWith('[.WebGL') && errors.push(message.text()));
}

async function openInPage(browser) {
  const tab = await browser.newPage({ viewport: { width: 320, height: 240 }, acceptDownloads: true });
  await tab.addInitScript(() => {
    window.devices = [];
    const request = globalThis.GPUAdapter?.prototype.requestDevice;
    if (request === undefined) return;
    GPUAdapter.prototype.requestDevice = async function (...options) {
      window.devices.push(await request.apply(this, options));
      return window.devices.at(-1);
    };
  });
  await tab.goto(`${site}?file=${inPage}`);
  await tab.waitForFunction(() => window.quoinPage !== undefined, undefined, { timeout: 60_000 });
  return tab;
}
const drawnBy = (tab, by, samples) => tab.waitForFunction(
  ([name, least]) => window.quoinMarched?.by.startsWith(name) && window.quoinMarched.samples >= least &&
    window.quoinMarched.width === innerWidth, [by, samples], { timeout: 240_000 });

async function download(tab, button) {
  const [got] = await Promise.all([tab.waitForEvent('download', { timeout: 120_000 }), tab.click(button)]);
  return [...await readFile(await got.path())];
}

// Returns the mean byte difference of two PNGs.
const meanDifference = (tab, one, other) => tab.evaluate(async (both) => {
  const pixels = await Promise.all(both.map(async (bytes) => {
    const bitmap = await createImageBitmap(new Blob([new Uint8Array(bytes)]));
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
    context.drawImage(bitmap, 0, 0);
    return context.getImageData(0, 0, bitmap.width, bitmap.height).data;
  }));
  if (pixels[0].length !== pixels[1].length) return Infinity;
  return pixels[0].reduce((sum, value, i) => sum + Math.abs(value - pixels[1][i]), 0) / pixels[0].length;
}, [one, other]);

async function usePage(browser, errors) {
  const tab = await openInPage(browser);
  watch(tab, errors);
  await tab.focus('#view');
  await tab.keyboard.press('r');
  await drawnBy(tab, 'WebGPU', 4);
  const note = () => tab.textContent('#marching');
  check(await tab.isVisible('canvas.marched'), `the page marches: ${await note()}`);
  await writeFile(join(out, 'marched-page.png'), await tab.screenshot({ timeout: 120_000 }));
  const before = await download(tab, '#march');
  const same = await meanDifference(tab, await download(tab, '#image'), before);
  check(same < 2, `by WebGPU the page has the module's image except for its samples: ${same.toFixed(2)} off`);
  for (let i = 0; i < 12; ++i) await tab.keyboard.press('a');
  for (let i = 0; i < 4; ++i) await tab.keyboard.press('s');
  const later = await download(tab, '#march');
  const other = await meanDifference(tab, before, later);
  const again = await meanDifference(tab, await download(tab, '#image'), later);
  check(other > 4 && again < 2, `the page's sun is that of both: ${again.toFixed(2)} off, ${
    other.toFixed(2)} from before`);
  await tab.keyboard.press('ArrowLeft');
  await tab.waitForFunction(() => window.quoinMarched.width < innerWidth, undefined, { timeout: 60_000 });
  check(true, `what moves is coarser: ${await note()}`);
  await tab.evaluate(() => window.devices.at(-1).destroy());
  await drawnBy(tab, 'the processor', 1);
  const status = await tab.textContent('#status');
  check(/the processor draws/.test(status), `a device that is gone: ${status} ${await note()}`);
  await tab.keyboard.press('r');
  check(!await tab.evaluate(() => document.querySelector('canvas.marched') !== null), 'and the mode ends');
  await tab.close();
}

async function useWithoutWebGpu() {
  const browser = await launch('--disable-gpu');
  try {
    const tab = await openInPage(browser);
    await tab.click('#rays');
    await drawnBy(tab, 'the processor', 1);
    const status = await tab.textContent('#status');
    check(/WebGPU.*the processor draws/.test(status) && await tab.isVisible('canvas.marched'),
          `without an adapter the page says so: ${status} ${await tab.textContent('#marching')}`);
  } finally {
    await browser.close();
  }
}

const browser = await launch(...withWebGpu);
try {
  const errors = [];
  const tab = await browser.newPage();
  watch(tab, errors);
  await tab.goto(`${site}compare.html`);
  await tab.waitForFunction(() => window.compare !== undefined);
  if (await tab.evaluate(async () => await navigator.gpu?.requestAdapter() ?? null) === null) {
    console.log('skipped, ray marching in the browser: this Chromium has no software WebGPU');
    process.exitCode = 77;
  } else {
    await compareImages(tab);
    const small = await tab.evaluate(([from]) => window.openOnSmallDevice(from, 1024), [[...given.keys()][0].slice(1)]);
    check(/scene needs .*, but the adapter binds at most 1 KiB/.test(small), `a device without room says so: ${small}`);
    const codes = await tab.evaluate((from) => window.misuse(from), inPage);
    const isRefused = codes.slice(0, -1).every((code) => code === 'invalid_argument') && codes.at(-1) === 'bad_handle';
    check(isRefused, `invalid calls are refused: ${codes.join(', ')}`);
    await tab.close();
    await usePage(browser, errors);
    check(errors.length === 0, `no error of shaders or page${errors.map((text) => ` ${text}`).join('')}`);
    await useWithoutWebGpu();
  }
} finally {
  await browser.close();
  server.close();
  await rm(work, { recursive: true });
}
process.exit(counts.failed > 0 ? 1 : process.exitCode ?? 0);
