// A headless Chromium, a server of files from this machine, and viewer.html with models that it shows.
import { existsSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = fileURLToPath(new URL('.', import.meta.url));
const types = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.css': 'text/css',
                '.wasm': 'application/wasm', '.glb': 'model/gltf-binary' };

/** How the browser is started: without requests of its own, drawn by a program. */
export const headless = ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
                         '--disable-background-networking', '--no-first-run'];

/** Ends the process with status 77 when something is missing; `skipped` is how it says so. */
export async function requirements(skipped = 'skipped') {
  if (Number(process.versions.node.split('.')[0]) < 18) {
    console.log(`${skipped}: Node.js ${process.versions.node} is older than 18`);
    process.exit(77);
  }
  const chromium = process.env.CHROMIUM ?? '/usr/bin/chromium';
  try {
    const { chromium: launcher } = await import('playwright-core');
    await import('three');
    if (existsSync(chromium)) return { chromium, launcher };
    console.log(`${skipped}: no browser at ${chromium} (set CHROMIUM)`);
  } catch {
    console.log(`${skipped}: run npm install in tests/web first`);
  }
  process.exit(77);
}

/** A server on this machine. `contentAt(path)`: the name of a file, or bytes. */
export function serve(contentAt) {
  const server = createServer(async (request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
    try {
      const content = contentAt(path);
      const isFile = typeof content === 'string';
      const body = isFile ? await readFile(content) : content;
      const type = types[extname(isFile ? content : path)] ?? 'application/octet-stream';
      response.writeHead(200, { 'Content-Type': type });
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
    args: ['--disable-gpu', ...headless],
  });
  return launched;
}

/** Ends the browser, which all calls of withViewer share. */
export async function closeBrowser() {
  await launched?.close();
  launched = undefined;
}

/** Calls use(page) with a page of a server, then closes the page. */
export async function withPage(server, path, size, use) {
  const { chromium, launcher } = await requirements();
  const browser = await browserFor(launcher, chromium);
  const page = await browser.newPage({ viewport: { width: size[0], height: size[1] } });
  try {
    page.on('pageerror', (error) => console.error(`page: ${error}`));
    page.on('console', (message) => message.type() === 'error' && console.error(`page: ${message.text()}`));
    await page.goto(`http://127.0.0.1:${server.address().port}${path}`);
    return await use(page);
  } finally {
    await page.close();
    server.close();
  }
}

/** Calls use(page) with the viewer showing the models (paths of GLB files), then closes the page; `truth` is a .vox
 *  file that the page may ask for. */
export async function withViewer(models, size, use, truth) {
  await requirements();
  const server = await serve((path) => {
    const model = /^\/model\/(\d+)\.glb$/.exec(path);
    return model ? models[Number(model[1])] : path === '/truth.vox' && truth ? truth : join(here, path);
  });
  return withPage(server, '/viewer.html', size, async (page) => {
    await page.waitForFunction(() => window.viewer !== undefined);
    await page.evaluate((urls) => window.viewer.load(urls), models.map((_, index) => `/model/${index}.glb`));
    return use(page);
  });
}
