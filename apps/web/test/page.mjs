// Tests the page in headless Chromium on a static file server.
//   node page.mjs PAGE FILE.vox NATIVE.glb IMAGE.png CORPUS
import { readFile, writeFile } from 'node:fs/promises';
import { basename, join } from 'node:path';
import { headless, requirements, serve } from '../../../tests/web/browser.mjs';
import { checkAloud as check, found } from './checks.mjs';
import { oneVoxel, stonePack } from './packs.mjs';

const [page, file, nativeGlb, image, corpus] = process.argv.slice(2);
const { chromium, launcher } = await requirements('skipped, the page only');
const server = await serve((path) => (path === '/castle.vox' ? file : join(page, path === '/' ? 'index.html' : path)));
const site = `http://127.0.0.1:${server.address().port}/`;

/** Returns a volume: a ball, or a constant `value`. */
function ball(value) {
  const n = 16;
  const samples = Buffer.from(Uint8Array.from({ length: n ** 3 }, (_, i) =>
    value ?? Math.max(0, 200 - 20 * Math.hypot(i % n - 8, Math.floor(i / n) % n - 8, Math.floor(i / n / n) - 8))));
  const header = `NRRD0004\ntype: uint8\ndimension: 3\nsizes: ${n} ${n} ${n}\nencoding: raw\n\n`;
  return Buffer.concat([Buffer.from(header), samples]);
}

const browser = await launcher.launch({
  executablePath: chromium, headless: true, args: ['--disable-gpu', ...headless],
});
try {
  const tab = await browser.newPage({ viewport: { width: 1280, height: 720 }, acceptDownloads: true });
  const errors = [];
  const elsewhere = [];
  tab.on('pageerror', (error) => errors.push(String(error)));
  tab.on('console', (message) => message.type() === 'error' && errors.push(message.text()));
  tab.on('request', (request) => /^(blob|data):/.test(request.url()) || request.url().startsWith(site) ||
    elsewhere.push(request.url()));
  const status = () => tab.textContent('#status');
  const shown = (name) => tab.waitForFunction(
    (text) => document.querySelector('#status').textContent.startsWith(`${text}: `), name, { timeout: 60_000 });

  // Drops files on the page.
  const drop = async (...files) => {
    const contents = files.map(({ name, bytes }) => ({ name, text: bytes.toString('base64') }));
    const dropped = await tab.evaluateHandle((given) => {
      const transfer = new DataTransfer();
      for (const { name, text } of given)
        transfer.items.add(new File([Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))], name));
      return transfer;
    }, contents);
    await tab.dispatchEvent('body', 'drop', { dataTransfer: dropped });
  };

  await tab.goto(site);
  await tab.setInputFiles('#file', file);
  await shown(basename(file));
  const cold = await tab.evaluate(() => window.quoinPage);
  check(cold !== undefined, `the file is shown: ${await status()}`);
  const colours = async () => {
    const shot = await tab.screenshot();
    const counted = await tab.evaluate(async (bytes) => {
      const bitmap = await createImageBitmap(new Blob([new Uint8Array(bytes)]));
      const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
      context.drawImage(bitmap, 0, 0);
      const { data } = context.getImageData(100, 60, 850, 560);
      const seen = new Set();
      for (let i = 0; i < data.length; i += 4)
        seen.add((data[i] >> 3 << 10) | (data[i + 1] >> 3 << 5) | data[i + 2] >> 3);
      return seen.size;
    }, [...shot]);
    return { shot, counted };
  };
  const first = await colours();
  check(first.counted > 100, `the image has ${first.counted} colours`);
  if (image) await writeFile(image, first.shot);

  // Counts pixels that differ from all neighbours: the background shows through gaps between faces of different sizes.
  const lonely = (shot) => tab.evaluate(async (bytes) => {
    const bitmap = await createImageBitmap(new Blob([new Uint8Array(bytes)]));
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
    context.drawImage(bitmap, 0, 0);
    const { data, width, height } = context.getImageData(100, 60, 850, 560);
    const steps = [-1, 0, 1].flatMap((y) => [-1, 0, 1].map((x) => 4 * (y * width + x))).filter((step) => step !== 0);
    const differ = (one, other) => Math.max(...[0, 1, 2].map((k) => Math.abs(data[one + k] - data[other + k]))) > 60;
    let count = 0;
    for (let y = 1; y < height - 1; ++y) {
      for (let x = 1; x < width - 1; ++x) {
        const at = 4 * (y * width + x);
        count += steps.every((step) => differ(at, at + step)) ? 1 : 0;
      }
    }
    return count;
  }, [...shot]);
  const gaps = await lonely(first.shot);
  const open = await browser.newPage({ viewport: { width: 1280, height: 720 } });
  const script = await readFile(join(page, 'page.js'), 'utf8');
  await open.route('**/page.js', (route) => route.fulfill({
    contentType: 'text/javascript', body: script.replace('mvPosition.xyz += 1.414', 'mvPosition.xyz += 0.0') }));
  await open.goto(`${site}?file=castle.vox`);
  await open.waitForFunction(() => window.quoinPage !== undefined, undefined, { timeout: 60_000 });
  const gapsBefore = await lonely(await open.screenshot());
  await open.close();
  check(gaps < 30 && gapsBefore > 60, `pixels unlike all their neighbours: ${gaps}; faces as they are: ${gapsBefore}`);

  const download = async (button, timeout = 60_000) => {
    const [got] = await Promise.all([tab.waitForEvent('download', { timeout }), tab.click(button)]);
    return { name: got.suggestedFilename(), bytes: await readFile(await got.path()) };
  };
  const glb = await download('#glb');
  check(glb.bytes.equals(await readFile(nativeGlb)), `${glb.name} is the native tool's, ${glb.bytes.length} bytes`);
  const png = await download('#image');
  check(png.bytes.toString('latin1', 1, 4) === 'PNG', `${png.name} is a PNG of ${png.bytes.length} bytes`);
  const marched = await download('#march', 300_000);
  check(marched.bytes.toString('latin1', 1, 4) === 'PNG', `${marched.name}, marched: ${await status()}`);
  if (image) await writeFile(image.replace(/\.png$/, '-marched.png'), marched.bytes);

  await tab.focus('#view');
  await tab.keyboard.press('ArrowLeft');
  await tab.keyboard.press('a');
  await tab.waitForTimeout(200);
  check(!(await tab.screenshot()).equals(first.shot), 'keys turn the camera and the sun');
  await tab.keyboard.press('m');
  await tab.mouse.click(560, 420);
  await tab.mouse.click(620, 400);
  check(/units: /.test(await status()), `measured: ${await status()}`);
  await tab.keyboard.press('m');
  await tab.click('#share');
  const link = tab.url();
  check(/#camera=.*&at=.*&sun=/.test(link), `the link: ${link.slice(site.length)}`);

  const other = await browser.newPage({ viewport: { width: 1280, height: 720 } });
  await other.goto(link);
  check(/drop the same file/.test(await other.textContent('#invitation')), 'a link says what to drop');
  await other.goto(link.replace('/#', '/?file=castle.vox#'));
  await other.waitForFunction(() => window.quoinPage !== undefined, undefined, { timeout: 60_000 });
  await other.click('#share');
  check(other.url().split('#')[1] === link.split('#')[1], 'who opens the link has the same view');
  await other.close();

  const noise = Buffer.from('VOX \x96\0\0\0MAIN nothing');
  await tab.setInputFiles('#other', { name: 'noise.vox', mimeType: '', buffer: noise });
  await tab.waitForSelector('#status.error');
  check(/^noise.vox: /.test(await status()), `a broken file says so: ${await status()}`);
  const still = await download('#march', 300_000);
  check(still.bytes.toString('latin1', 1, 4) === 'PNG', `the current scene can still be rendered: ${await status()}`);
  await tab.setInputFiles('#other', file);
  await shown(basename(file));
  check(!(await tab.isVisible('#status.error')), `and the next one is shown: ${await status()}`);
  await tab.setInputFiles('#other', file);
  await tab.setInputFiles('#other', { name: 'one.vox', mimeType: '', buffer: oneVoxel() });
  await shown('one.vox');
  const facts = await tab.textContent('#facts');
  check(/^1 voxel, 1 grid, \d+ colours$/.test(facts), `of one voxel: ${facts}`);
  await tab.waitForTimeout(1_500);
  check(await tab.textContent('#name') === 'one.vox' && /^one.vox: /.test(await status()),
        `of two files the last is shown: ${await status()}`);
  await tab.setInputFiles('#other', file);
  await shown(basename(file));

  await drop({ name: 'a.vox', bytes: oneVoxel() }, { name: 'b.vox', bytes: oneVoxel() });
  check(/one file; here are 2/.test(await status()), `two files: ${await status()}`);
  await drop();
  check(/one file; here are none/.test(await status()), `no file: ${await status()}`);
  await tab.evaluate(() => {
    const large = new File(['VOX '], 'large.vox');
    Object.defineProperty(large, 'size', { value: 5e9 });
    Object.defineProperty(document.querySelector('#other'), 'files', { value: [large], configurable: true });
    document.querySelector('#other').dispatchEvent(new Event('change'));
    delete document.querySelector('#other').files;
  });
  check(/large.vox: a file of 5.0 GB/.test(await status()), `a file without end: ${await status()}`);
  // The page asks for the height encoding of an image.
  const image8 = await readFile(join(corpus, 'heights/grey_8_bits.png'));
  await drop({ name: 'hill.png', bytes: image8 });
  await tab.waitForSelector('#heights[open]');
  await tab.keyboard.press('Escape');
  check(await tab.textContent('#name') === basename(file), 'without an encoding the image is not loaded');
  await drop({ name: 'hill.png', bytes: image8 });
  await tab.waitForSelector('#heights[open]');
  await tab.fill('#metres', '2');
  await tab.click('#heights button[value=read]');
  await shown('hill.png');
  check(/ voxels, 1 grid, /.test(await tab.textContent('#facts')), `heights: ${await tab.textContent('#facts')}`);
  check((await download('#march', 300_000)).name === 'hill.png', 'which the whole module reads the same');
  await drop({ name: 'ball.nrrd', bytes: ball() });
  await shown('ball.nrrd');
  check(/^1 surface, 1 grid, /.test(await tab.textContent('#facts')), `a volume: ${await tab.textContent('#facts')}`);
  await drop({ name: 'nothing.nrrd', bytes: ball(0) });
  await shown('nothing.nrrd');
  check(/nothing in it is solid/.test(await status()), `nothing to see: ${await status()}`);
  await tab.setInputFiles('#other', file);
  await shown(basename(file));
  await tab.focus('#around');
  await tab.keyboard.press('ArrowRight');
  await tab.keyboard.press('m');
  check(await tab.getAttribute('#measure', 'aria-pressed') === 'true', 'letters are keys where a slider has the focus');
  await tab.keyboard.press('m');

  // A resource pack gives blocks of Minecraft their looks.
  await drop({ name: 'house.schem', bytes: await readFile(join(corpus, 'cases/schem-bamboo-is-glass.schem')) });
  await shown('house.schem');
  const plain = await download('#glb');
  check(plain.bytes.includes('image/png'), 'without packs the blocks have textures of the own pack');
  const saysOf = (text) => tab.waitForFunction(
    (start) => document.querySelector('#status').textContent.startsWith(start), text, { timeout: 60_000 });
  await drop({ name: 'stone.zip', bytes: stonePack(8) });
  await saysOf('stone.zip gives');
  check(await tab.textContent('#packs span') === 'stone.zip', 'the panel names the pack');
  check(!(await download('#glb')).bytes.equals(plain.bytes), 'a pack changes the blocks of the current file');
  await drop({ name: 'noise.zip', bytes: noise });
  await saysOf('noise.zip: ');
  check(await tab.isVisible('#status.error'), `no pack: ${await status()}`);
  check(await tab.textContent('#packs span') === 'stone.zip', 'a broken pack is not used');
  await tab.click('#no-packs');
  await shown('house.schem');
  check((await download('#glb')).bytes.equals(plain.bytes), 'without packs the blocks are as before');
  check(!(await tab.isVisible('#packs')), 'and none is named');
  // A file is dropped while a pack is checked.
  await tab.evaluate(() => {
    const post = Worker.prototype.postMessage;
    Worker.prototype.postMessage = function postLater(message, ...more) {
      if (message.name !== 'check') return post.call(this, message, ...more);
      window.quoinChecks = (window.quoinChecks ?? 0) + 1;
      setTimeout(() => post.call(this, message, ...more), 3000);
    };
  });
  await drop({ name: 'stone.zip', bytes: stonePack(8) });
  await tab.waitForFunction(() => window.quoinChecks === 1);
  await drop({ name: 'other.schem', bytes: await readFile(join(corpus, 'cases/schem-bamboo-is-glass.schem')) });
  await shown('other.schem');
  await tab.waitForTimeout(3500);
  check(/^other.schem: read/.test(await status()), `a pack is left out for a later file: ${await status()}`);
  check(!(await tab.isVisible('#packs')), 'and is not named');
  check((await download('#glb')).bytes.equals(plain.bytes), 'and not used');
  await tab.setInputFiles('#other', file);
  await shown(basename(file));

  const broken = await browser.newPage();
  await broken.route('**/worker.js', (route) => route.fulfill({ status: 404 }));
  await broken.goto(site);
  await broken.setInputFiles('#file', file);
  await broken.waitForSelector('#status.error', { timeout: 20_000 });
  check(true, `without a worker: ${await broken.textContent('#status')}`);
  await broken.close();
  await tab.emulateMedia({ colorScheme: 'dark' });
  await tab.setViewportSize({ width: 390, height: 800 });
  await tab.waitForTimeout(300);
  if (image) await writeFile(image.replace(/\.png$/, '-phone.png'), await tab.screenshot());
  const [view, panel] = [await tab.locator('#view').boundingBox(), await tab.locator('#panel').boundingBox()];
  check(view.height > 400 && view.y + view.height <= panel.y + 1, 'on a phone the view lies above the panel');
  await tab.setViewportSize({ width: 800, height: 390 });
  const [wide, panelBox] = [await tab.locator('#view').boundingBox(), await tab.locator('#panel').boundingBox()];
  check(wide.width > 500 && wide.x + wide.width <= panelBox.x + 1, 'in a small window the view is next to the panel');
  for (const name of ['LICENSE', 'LICENSES', 'LICENSE.three', 'NOTICE'])
    check((await tab.request.get(site + name)).ok(), `${name} is next to the page`);
  check(elsewhere.length === 0, `no request to anywhere else${elsewhere.map((url) => ` ${url}`)}`);
  check(errors.length === 0, `no error in the page${errors.map((text) => ` ${text}`)}`);
} finally {
  await browser.close();
  server.close();
}
process.exit(found.failed > 0 ? 1 : 0);
