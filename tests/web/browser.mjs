// A headless Chromium that shows viewer.html with models served from this machine.
import { existsSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = fileURLToPath(new URL('.', import.meta.url));
const types = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.glb': 'model/gltf-binary' };

/** Ends the process with status 77 when something is missing. */
async function requirements() {
  if (Number(process.versions.node.split('.')[0]) < 18) {
    console.log(`skipped: Node.js ${process.versions.node} is older than 18`);
    process.exit(77);
  }
  const chromium = process.env.CHROMIUM ?? '/usr/bin/chromium';
  try {
    const { chromium: launcher } = await import('playwright-core');
    await import('three');
    if (existsSync(chromium)) return { chromium, launcher };
    console.log(`skipped: no browser at ${chromium} (set CHROMIUM)`);
  } catch {
    console.log('skipped: run npm install in this folder first');
  }
  process.exit(77);
}

function serve(models, truth) {
  const server = createServer(async (request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
    const model = /^\/model\/(\d+)\.glb$/.exec(path);
    const file = model ? models[Number(model[1])] : path === '/truth.vox' && truth ? truth : join(here, path);
    try {
      const body = await readFile(file);
      response.writeHead(200, { 'Content-Type': types[extname(file)] ?? 'application/octet-stream' });
      response.end(body);
    } catch {
      response.writeHead(404).end();
    }
  });
  return new Promise((resolve) => server.listen(0, '127.0.0.1', () => resolve(server)));
}

let launched;

async function browserFor(launcher, executablePath) {
  launched ??= await launcher.launch({
    executablePath,
    headless: true,
    args: ['--no-sandbox', '--disable-gpu', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
           '--disable-background-networking', '--no-first-run'],
  });
  return launched;
}

/** Ends the browser, which all calls of withViewer share. */
export async function closeBrowser() {
  await launched?.close();
  launched = undefined;
}

/** Calls use(page) with the viewer showing the models (paths of GLB files), then closes the page; `truth` is a .vox
 *  file that the page may ask for. */
export async function withViewer(models, size, use, truth) {
  const { chromium, launcher } = await requirements();
  const server = await serve(models, truth);
  const browser = await browserFor(launcher, chromium);
  const page = await browser.newPage({ viewport: { width: size[0], height: size[1] } });
  try {
    page.on('pageerror', (error) => console.error(`page: ${error}`));
    page.on('console', (message) => message.type() === 'error' && console.error(`page: ${message.text()}`));
    await page.goto(`http://127.0.0.1:${server.address().port}/viewer.html`);
    await page.waitForFunction(() => window.viewer !== undefined);
    await page.evaluate((urls) => window.viewer.load(urls), models.map((_, index) => `/model/${index}.glb`));
    return await use(page);
  } finally {
    await page.close();
    server.close();
  }
}
