// Chromium with the page, from a server that counts what is asked of it.
import { createReadStream, existsSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import puppeteer from 'puppeteer-core';
import { converted, root } from './native.js';

const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.css': 'text/css', '.wasm': 'application/wasm' };

// Serves a folder on this machine; `close` ends it. Files whose names match `damaged` have other bytes, those that match
// `missing` are not there. A page is `isolated` from other origins where threads are wanted.
export async function serve(folder, { damaged = /^$/, missing = /^$/, isolated = true } = {}) {
  const isolation = isolated
    ? { 'cross-origin-opener-policy': 'same-origin', 'cross-origin-embedder-policy': 'require-corp' }
    : {};
  const server = createServer((request, response) => {
    const path = normalize(new URL(request.url, 'http://localhost').pathname);
    const file = join(folder, path.endsWith('/') ? `${path}index.html` : path);
    if (!existsSync(file) || !statSync(file).isFile() || missing.test(file)) {
      response.writeHead(404).end();
      return;
    }
    response.writeHead(200, { 'content-type': TYPES[extname(file)] ?? 'application/octet-stream', ...isolation });
    if (damaged.test(file)) response.end('damaged');
    else createReadStream(file).pipe(response);
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return { url: `http://127.0.0.1:${server.address().port}/`, close: () => server.close() };
}

// A clip of one person, 640 x 480, as a fake camera plays it.
export function cameraClip() {
  return converted('camera.y4m', '-vf', 'scale=480:480,pad=640:480:80:0:gray,loop=14:1:0', '-r', '30', '-pix_fmt', 'yuv420p');
}

export async function launch({ camera = cameraClip(), allowsCamera = true, flags = [] } = {}) {
  return puppeteer.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    headless: true,
    acceptInsecureCerts: false,
    protocolTimeout: 300000,
    args: [
      '--no-sandbox',
      '--disable-gpu',
      '--use-fake-device-for-media-stream',
      `--use-file-for-fake-video-capture=${camera}`,
      ...(allowsCamera ? ['--use-fake-ui-for-media-stream'] : ['--deny-permission-prompts']),
      ...flags,
    ],
  });
}

// Opens the page and waits until its networks are there. `requests` are all addresses that it asked for.
export async function openPage(browser, url, { loads = true } = {}) {
  const page = await browser.newPage();
  page.setDefaultTimeout(240000);
  const requests = [];
  const problems = [];
  page.on('request', (request) => requests.push(request.url()));
  page.on('pageerror', (error) => problems.push(error.message));
  page.on('console', (message) => message.type() === 'error' && problems.push(message.text()));
  await page.goto(url);
  if (loads) await page.waitForFunction(() => !document.getElementById('camera').disabled);
  return { page, requests, problems };
}

// Bytes of JavaScript's heap that are in use.
export async function heapBytes(page) {
  const session = await page.createCDPSession();
  await session.send('HeapProfiler.collectGarbage');
  return (await page.metrics()).JSHeapUsedSize;
}

export const frames = (page) => page.evaluate(() => Number(document.body.dataset.frames ?? 0));
export const waitForFrames = (page, count) =>
  page.waitForFunction((wanted) => Number(document.body.dataset.frames ?? 0) >= wanted, {}, count);
export const status = (page) => page.$eval('#status', (element) => element.textContent);
export const pageFolder = join(root, 'build/web/page');
