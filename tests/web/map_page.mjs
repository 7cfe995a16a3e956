// Draws a map of a small Minecraft world with `quoin map`, opens its page as a file in Chromium, and uses it: drags,
// zooms, follows the address, switches dimensions and colours, opens a marker.
//
//   node map_page.mjs TOOL [FOLDER]
//
// FOLDER keeps the world, the map and screenshots. Exit status: 0 on success, 77 if Chromium or a package is missing.
import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

import { headless, requirements } from './browser.mjs';

const [tool, kept] = process.argv.slice(2);
const { chromium, launcher } = await requirements();

// ---- a world: named binary tags, big-endian, uncompressed ----

const tag = (kind, name, ...content) => Buffer.concat([Buffer.from([kind]), text(name), ...content]);
const end = Buffer.from([0]);
const int32 = (value) => { const b = Buffer.alloc(4); b.writeInt32BE(value); return b; };
function text(value) {
  const bytes = Buffer.from(value, 'utf8');
  return Buffer.concat([Buffer.from([bytes.length >> 8, bytes.length & 255]), bytes]);
}
const string = (name, value) => tag(8, name, text(value));
const compound = (name, ...content) => tag(10, name, ...content, end);
/** A list of compounds, which have no names of their own. */
const list = (name, items) =>
  tag(9, name, Buffer.from([10]), int32(items.length), ...items.map((item) => Buffer.concat([...item, end])));

const stringList = (name, value) => tag(9, name, Buffer.from([8]), int32(1), text(value));

/** A section of 16^3 blocks; `blockAt(x, y, z)` gives indices into the palette of at most 16 names. */
function section(y, palette, blockAt) {
  const longs = Buffer.alloc(2048);
  for (let i = 0; i < 4096; ++i) {
    const at = 8 * (i >> 4) + 7 - (i >> 1 & 7);
    longs[at] |= blockAt(i & 15, i >> 8, i >> 4 & 15) << (i % 2 ? 4 : 0);
  }
  return [tag(1, 'Y', Buffer.from([y & 255])),
          compound('block_states', list('palette', palette.map((name) => [string('Name', name)])),
                   tag(12, 'data', int32(256), longs))];
}

function chunk(sections, signs) {
  return compound('', tag(3, 'DataVersion', int32(3700)), list('sections', sections),
                  list('block_entities', signs.map(([x, y, z, line]) => [
                    string('id', 'minecraft:sign'), tag(3, 'x', int32(x)), tag(3, 'y', int32(y)), tag(3, 'z', int32(z)),
                    compound('front_text', stringList('messages', JSON.stringify(line)))])));
}

/** A region file; `chunkAt(x, z)` gives the content of a chunk, or null. */
function region(chunkAt) {
  const table = Buffer.alloc(8192);
  const parts = [table];
  let sector = 2;
  for (let i = 0; i < 1024; ++i) {
    const content = chunkAt(i & 31, i >> 5);
    if (!content) continue;
    const sectors = Math.ceil((content.length + 5) / 4096);
    const bytes = Buffer.alloc(sectors * 4096);
    bytes.writeUInt32BE(content.length + 1, 0);
    bytes[4] = 3;  // not compressed
    content.copy(bytes, 5);
    table.writeUInt32BE(sector << 8 | sectors, 4 * i);
    table.writeUInt32BE(1_000_000_000, 4096 + 4 * i);
    parts.push(bytes);
    sector += sectors;
  }
  return Buffer.concat(parts);
}

const palette = ['minecraft:air', 'minecraft:grass_block', 'minecraft:sand', 'minecraft:water', 'minecraft:netherrack'];
function overworld(cx, cz) {
  if (cx > 20 || cz > 20) return null;
  const blocks = section(3, palette, (x, y, z) => {
    const height = 6 + Math.round(4 * Math.sin((16 * cx + x) / 20) + 2 * Math.cos((16 * cz + z) / 13));
    return y < height ? (height < 5 ? 2 : 1) : y < 5 ? 3 : 0;
  });
  return chunk([blocks], cx === 6 && cz === 5 ? [[100, 60, 90, 'Here <b>be</b> dragons']] : []);
}
const nether = (cx, cz) => cx > 3 || cz > 3 ? null : chunk([
  section(3, palette, (x, y) => y < 8 ? 4 : 0),
  section(7, palette, () => 4)], []);  // a roof

const folder = kept ?? mkdtempSync(join(tmpdir(), 'quoin-map-'));
const world = join(folder, 'world');
const out = join(folder, 'map');
for (const [place, chunkAt] of [['region', overworld], ['DIM-1/region', nether]]) {
  mkdirSync(join(world, place), { recursive: true });
  writeFileSync(join(world, place, 'r.0.0.mca'), region(chunkAt));
}

// ---- the map ----

let failures = 0;
function check(condition, what) {
  if (condition) return;
  ++failures;
  console.error(`FAILED: ${what}`);
}

const draw = () => JSON.parse(execFileSync(tool, ['map', world, out, '--json'], { encoding: 'utf8' }));
const first = draw();
check(first.tiles_written > 4 && first.tiles_kept === 0, `a new map: ${JSON.stringify(first)}`);
const second = draw();
check(second.tiles_written === 0 && second.tiles_kept === first.tiles_written, `kept: ${JSON.stringify(second)}`);
if (!existsSync(join(out, 'index.html'))) {
  console.log('skipped: the tool was built without Leaflet');
  process.exit(77);
}

const args = ['--disable-gpu', ...headless];
const browser = await launcher.launch({ executablePath: chromium, headless: true, args });
const context = await browser.newContext({ viewport: { width: 900, height: 700 } });
const page = await context.newPage();
const requests = [];
page.on('request', (request) => requests.push(request.url()));
page.on('pageerror', (error) => check(false, `page: ${error}`));
const address = pathToFileURL(join(out, 'index.html')).href;

async function open(hash) {
  await page.goto('about:blank');
  await page.goto(address + hash);
  await page.waitForFunction(() => document.querySelectorAll('.leaflet-tile-loaded').length > 0);
  await page.waitForTimeout(400);
}
const view = () => page.evaluate(() => {
  const at = window.quoinMap.getCenter();
  return { x: at.lng, z: at.lat, zoom: window.quoinMap.getZoom(), hash: location.hash };
});
const shot = async (name) => kept && page.screenshot({ path: join(folder, `${name}.png`) });
/** The widths of the tiles that are shown, by name. */
const shown = () => page.evaluate(() => {
  const tiles = [...document.querySelectorAll('img.leaflet-tile-loaded')];
  return Object.fromEntries(tiles.map((tile) => [tile.src.replace(/.*tiles\//, ''), tile.naturalWidth]));
});

await open('');
let at = await view();
check(at.hash.startsWith('#overworld/'), `the address names the layer: ${at.hash}`);
check(Object.values(await shown()).every((width) => width === 256), 'tiles of 256 pixels are shown');
await shot('start');

await open('#overworld/0/100/90');
at = await view();
const isThere = at.zoom === 0 && Math.floor(at.x) === 100 && Math.floor(at.z) === 90;
check(isThere, `the address is followed: ${JSON.stringify(at)}`);
await page.mouse.move(450, 350);
const place = await page.textContent('#place');
check(/x (100|99), z (90|89)/.test(place), `the pointer: ${place}`);
const names = Object.keys(await shown());
check(names.some((name) => name.startsWith('18/0/0.')), `a pixel per block: ${names}`);

await page.mouse.down();
await page.mouse.move(350, 300, { steps: 5 });
await page.waitForTimeout(200);
await page.mouse.up();
await page.waitForTimeout(600);
const dragged = await view();
check(dragged.x > 150 && dragged.z > 110, `dragging moves the map: ${JSON.stringify(dragged)}`);
check(dragged.hash !== at.hash, 'and the address');

await page.mouse.wheel(0, -300);
await page.waitForTimeout(900);
check((await view()).zoom > 0, 'the wheel zooms in');
await shot('near');
for (let i = 0; i < 6; ++i) {
  await page.click('.leaflet-control-zoom-out', { force: true });
  await page.waitForTimeout(350);
}
check((await view()).zoom < -1, 'the button zooms out');
await shot('far');

for (const garbage of ['#50%', '#%E0%A4%A', '#overworld/99/1e308/0', '#overworld/0/1/NaN', '#nowhere/0/0/0']) {
  await open(garbage);
  check(Object.keys(await shown()).length > 0, `tiles are shown at ${garbage}`);
}

await open('#overworld/1/100/90');
await page.click('.marker.sign');
await page.waitForSelector('.leaflet-popup-content');
const popup = await page.textContent('.leaflet-popup-content');
check(popup.startsWith('Here <b>be</b> dragons'), `a sign shows its text as it is: ${popup}`);
await shot('sign');
await page.click('#markers');
check(await page.locator('.marker').count() === 0, 'markers can be hidden');

const isDark = () => page.evaluate(() => document.documentElement.classList.contains('dark'));
const before = await isDark();
await page.click('#dark');
check(await isDark() !== before, 'the colours switch');
await shot('dark');

await page.selectOption('#layers', 'nether');
await page.waitForTimeout(700);
check((await view()).hash.startsWith('#nether/'), 'the dimension switches');
const netherTiles = Object.keys(await shown());
check(netherTiles.length > 0 && netherTiles.every((name) => name.startsWith('nether/')), `its tiles: ${netherTiles}`);
await shot('nether');

// A phone: the bar fits, and a finger drags.
const phone = await browser.newContext({ viewport: { width: 360, height: 640 }, hasTouch: true, isMobile: true });
const small = await phone.newPage();
await small.goto(address + '#overworld/0/100/90');
await small.waitForFunction(() => document.querySelectorAll('.leaflet-tile-loaded').length > 0);
const bar = await small.locator('#bar').boundingBox();
check(bar.x >= 0 && bar.x + bar.width <= 360 && bar.height < 120, `the bar fits a phone: ${JSON.stringify(bar)}`);
if (kept) await small.screenshot({ path: join(folder, 'phone.png') });

const outside = requests.filter((url) => !url.startsWith('file:') && !url.startsWith('data:') && url !== 'about:blank');
check(outside.length === 0, `requests elsewhere: ${outside}`);
await browser.close();
if (!kept) rmSync(folder, { recursive: true });
console.log(failures === 0 ? 'the map page works' : `${failures} checks failed`);
process.exit(failures === 0 ? 0 : 1);
