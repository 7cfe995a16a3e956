// Draws icons of block states of a resource pack with deepslate, a renderer of blocks by another author:
//
//   node block_icons.mjs REQUEST.json
//
// The request names `modules` (the folder node_modules that has deepslate), `pack` (a zip file), `out` (a file to
// write), `size` (of icons, in pixels), `cameras` (lists of 16 numbers: matrices from the block, a cube from 0 to 1, to
// the cube from -1 to 1 of the image, column by column) and `states` ([name, properties] each).
//
// Writes the 32-bit number of distinct states, the number of each state among them, then, for each distinct state, the
// tint as 3 bytes, a byte 0, and per camera an icon and its flags. An icon is rows of texels (red, green, blue, alpha)
// from the top: the texel of the first surface that is not clear there, not tinted, and neither lit nor blended. Alpha
// 0 means no surface. Flags are rows of bytes, 1 where the surface is tinted.
// Exit status: 0 on success, 77 if Chromium or a package is not installed.
import { existsSync, openSync, readFileSync, writeSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { inflateRawSync } from 'node:zlib';

import { closeBrowser, requirements, serve, withPage } from './browser.mjs';

const here = fileURLToPath(new URL('.', import.meta.url));
const statesPerCall = 64;

/** The files of a zip file by their names: each without zip64 and stored or deflated. */
function unzipped(bytes) {
  const files = new Map();
  let end = bytes.length - 22;
  while (bytes.readUInt32LE(end) !== 0x06054b50) --end;
  let at = bytes.readUInt32LE(end + 16);
  for (let count = bytes.readUInt16LE(end + 10); count > 0; --count) {
    const [nameBytes, extra, comment] = [28, 30, 32].map((offset) => bytes.readUInt16LE(at + offset));
    const local = bytes.readUInt32LE(at + 42);
    const start = local + 30 + bytes.readUInt16LE(local + 26) + bytes.readUInt16LE(local + 28);
    const packed = bytes.subarray(start, start + bytes.readUInt32LE(at + 20));
    const name = bytes.toString('utf8', at + 46, at + 46 + nameBytes);
    files.set(name, bytes.readUInt16LE(at + 10) === 8 ? inflateRawSync(packed) : packed);
    at += 46 + nameBytes + extra + comment;
  }
  return files;
}

/** The files as deepslate names them: {"minecraft:block/stone": content} of one folder. */
function named(files, folder, end, content) {
  const pattern = new RegExp(`^assets/([^/]+)/${folder}/(.+)\\.${end}$`);
  const found = {};
  for (const [path, bytes] of files) {
    const match = pattern.exec(path);
    if (match) found[`${match[1]}:${match[2]}`] = content(bytes);
  }
  return found;
}

const request = JSON.parse(readFileSync(process.argv[2], 'utf8'));
const library = join(request.modules, 'deepslate/dist/deepslate.umd.cjs');
await requirements();
if (!existsSync(library)) {
  console.log(`skipped: no deepslate in ${request.modules}`);
  process.exit(77);
}
const files = unzipped(readFileSync(request.pack));
const json = (bytes) => JSON.parse(bytes.toString('utf8'));
const content = Buffer.from(JSON.stringify({
  states: named(files, 'blockstates', 'json', json),
  models: named(files, 'models', 'json', json),
  textures: named(files, 'textures', 'png', (bytes) => bytes.toString('base64')),
}));
const server = await serve((path) => {
  if (path === '/pack.json') return content;
  return path === '/deepslate.js' ? readFileSync(library) : join(here, path);
});
const out = openSync(request.out, 'w');
await withPage(server, '/block_icons.html', [256, 256], async (page) => {
  await page.waitForFunction(() => window.icons !== undefined);
  const numbers = await page.evaluate(([size, cameras, states]) => window.icons.open(size, cameras, states),
                                      [request.size, request.cameras, request.states]);
  const count = Math.max(-1, ...numbers) + 1;
  writeSync(out, Buffer.from(Uint32Array.of(count, ...numbers).buffer));
  for (let first = 0; first < count; first += statesPerCall) {
    const images = await page.evaluate(([from, to]) => window.icons.draw(from, to),
                                       [first, Math.min(count, first + statesPerCall)]);
    writeSync(out, Buffer.from(images, 'base64'));
  }
});
await closeBrowser();
