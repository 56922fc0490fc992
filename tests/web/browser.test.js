// The page in headless Chromium.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { frames, heapBytes, launch, openPage, pageFolder, serve, status, waitForFrames } from './browser.js';
import { converted, projectWithPackage, root, scratch } from './native.js';

let server;
let browser;
before(async () => {
  server = await serve(pageFolder);
  browser = await launch();
});
after(async () => {
  await browser?.close();
  server?.close();
});

async function withPage(work, options) {
  const opened = await openPage(browser, server.url, options);
  try {
    await work(opened);
  } finally {
    await opened.page.close();
  }
}

test('a camera shows people, nothing is asked of another host, and a report can be copied', async () => {
  await withPage(async ({ page, requests, problems }) => {
    await page.click('#camera');
    await waitForFrames(page, 10);
    assert.equal(await page.evaluate(() => document.body.dataset.people), '1');
    for (const kind of ['contours', 'people', 'none']) await page.select('#overlay', kind);
    await page.click('#report');
    const report = JSON.parse(await page.evaluate(() => document.body.dataset.report));
    assert.equal(report.format, 'maquette-web-report');
    assert.deepEqual(report.image, [640, 480]);
    assert.ok(report.frameMs.p50 > 0 && report.stagesMs.trunk.p50 > 0);
    console.log(`in Chromium: ${report.framesPerSecond} frames a second, ${JSON.stringify(report.stagesMs.total)} ms, first overlay after ${report.firstOverlayMs.toFixed(0)} ms`);
    await page.click('#camera');
    const stopped = await frames(page);
    await new Promise((resolve) => setTimeout(resolve, 1500));
    assert.ok((await frames(page)) <= stopped + 1, 'a stopped camera gives no more frames');
    for (const url of requests) assert.ok(url.startsWith(server.url) || /^(data|blob):/.test(url), url);
    assert.deepEqual(problems, []);
  });
});

test('a page that is isolated from other origins has threads, another one works without', async () => {
  const threads = (page) => page.workers().filter((worker) => /thread/.test(worker.url())).length;
  await withPage(async ({ page }) => {
    const cores = await page.evaluate(() => navigator.hardwareConcurrency);
    assert.equal(threads(page), Math.min(cores, 4) - 1);
  });
  const other = await serve(pageFolder, { isolated: false });
  const { page, problems } = await openPage(browser, other.url);
  try {
    await (await page.$('#file')).uploadFile(converted('photo.png'));
    await waitForFrames(page, 1);
    assert.equal(await page.evaluate(() => document.body.dataset.people), '1');
    assert.equal(threads(page), 0);
    assert.deepEqual(problems, []);
  } finally {
    await page.close();
    other.close();
  }
});

test('the Content-Security-Policy forbids requests to other hosts', async () => {
  await withPage(async ({ page }) => {
    const answer = await page.evaluate(() => fetch('http://127.0.0.2/').then(() => 'sent', (error) => error.name));
    assert.equal(answer, 'TypeError');
    const policy = await page.$eval('meta[http-equiv]', (element) => element.content);
    assert.match(policy, /default-src 'none'/);
    assert.match(policy, /connect-src 'self'/);
    assert.doesNotMatch(policy, /unsafe-inline|'unsafe-eval'|https?:|\*/);
  });
});

test('a photo shows its people, and a bad file a sentence', async () => {
  await withPage(async ({ page }) => {
    const photo = converted('photo.png');
    await (await page.$('#file')).uploadFile(photo);
    await waitForFrames(page, 1);
    assert.equal(await page.evaluate(() => document.body.dataset.people), '1');
    const bad = join(scratch, 'bad.png');
    writeFileSync(bad, 'no image');
    await (await page.$('#file')).uploadFile(bad);
    await page.waitForFunction(() => document.getElementById('status').textContent.includes('no image or clip'));
  });
});

test('people wear an outfit of the user', async () => {
  await withPage(async ({ page }) => {
    await page.select('#overlay', 'outfit');
    await (await page.$('#file')).uploadFile(converted('photo.png'));
    await waitForFrames(page, 1);
    const dressed = () =>
      page.evaluate(() => {
        const { width, height } = document.getElementById('view');
        const { data } = document.getElementById('view').getContext('2d').getImageData(0, 0, width, height);
        let red = 0;
        for (let i = 0; i < data.length; i += 4) red += data[i] > 20 && data[i + 1] === 0 && data[i + 2] === 0 ? 1 : 0;
        return red / (width * height);
      });
    assert.ok((await dressed()) < 0.01, 'the outfit of the page is not red');
    await (await page.$('#texture input')).uploadFile(converted('red.png', '-vf', 'scale=64:96,lutrgb=r=255:g=0:b=0'));
    await page.waitForFunction(() => Number(document.body.dataset.frames) === 2);
    assert.ok((await dressed()) > 0.1, `${await dressed()} of the picture`);
  });
});

test('a camera that is denied gets a sentence', async () => {
  const denying = await launch({ allowsCamera: false });
  try {
    const { page } = await openPage(denying, server.url);
    await page.click('#camera');
    await page.waitForFunction(() => document.getElementById('status').textContent.includes('not allowed'));
  } finally {
    await denying.close();
  }
});

// Loads the page from a server with a fault, and returns what it says.
async function saidWith(fault, text) {
  const faulty = await serve(pageFolder, fault);
  const { page } = await openPage(browser, faulty.url, { loads: false });
  try {
    await page.waitForFunction((part) => document.getElementById('status').textContent.includes(part), {}, text);
    return await status(page);
  } finally {
    await page.close();
    faulty.close();
  }
}

test('a browser that cannot compile the core is told what is needed', async () => {
  assert.match(await saidWith({ damaged: /core.*wasm$/ }, 'does not start'), /Chrome 95, Firefox 100, Safari 16.4/);
});

test('networks that are missing, and a worker that is lost, get a sentence', async () => {
  assert.match(await saidWith({ missing: /networks/ }, '404'), /networks.*404/);
  assert.match(await saidWith({ missing: /worker/ }, 'worker'), /The worker of dense pose ended/);
});

test('a tab that is hidden stops, and goes on when it is shown', async () => {
  await withPage(async ({ page }) => {
    await page.click('#camera');
    await waitForFrames(page, 3);
    const other = await browser.newPage();
    await other.bringToFront();
    await new Promise((resolve) => setTimeout(resolve, 1000));
    await page.bringToFront();
    await other.close();
    await waitForFrames(page, (await frames(page)) + 5);
  });
});

test('memory does not grow with frames', async () => {
  await withPage(async ({ page }) => {
    await page.select('#size', '224');
    await page.waitForFunction(() => !document.getElementById('camera').disabled);
    await page.click('#camera');
    await waitForFrames(page, 50);
    const first = await heapBytes(page);
    const begin = await frames(page);
    await waitForFrames(page, begin + 150);
    const grown = ((await heapBytes(page)) - first) / 1e6;
    console.log(`the JavaScript heap grew by ${grown.toFixed(2)} MB over 150 frames`);
    assert.ok(grown < 1, `${grown} MB`);
  });
});

test('the example of the README runs in what Vite builds of an empty project', async () => {
  const { project, examples } = projectWithPackage('vite');
  writeFileSync(join(project, 'example.js'), examples[0]);
  writeFileSync(
    join(project, 'main.js'),
    `const video = document.querySelector('video');
     video.srcObject = await navigator.mediaDevices.getUserMedia({ video: true });
     await video.play();
     await import('./example.js');`,
  );
  writeFileSync(
    join(project, 'index.html'),
    '<!doctype html><link rel="icon" href="data:"><video muted playsinline></video><script type="module" src="main.js"></script>',
  );
  const vite = join(root, 'web/demo/node_modules/.bin/vite');
  execFileSync(vite, ['build', '--logLevel', 'warn', '--target', 'es2022'], { cwd: project, stdio: 'inherit' });
  const built = await serve(join(project, 'dist'));
  const page = await browser.newPage();
  try {
    const said = [];
    const finished = new Promise((resolve, reject) => {
      page.on('pageerror', reject);
      page.on('console', (message) => {
        said.push(message.text());
        if (/^in the middle: /.test(message.text())) resolve();
      });
      setTimeout(() => reject(new Error(`the example did not end; it said: ${said}`)), 120000).unref();
    });
    await page.goto(built.url);
    await finished;
    assert.match(said.join('\n'), /^person 1: [01]\.\d\d, box \d+(,\d+){3}$/m);
  } finally {
    await page.close();
    built.close();
  }
});

test('a phone screen shows everything without scrolling sideways', async () => {
  await withPage(async ({ page }) => {
    await page.setViewport({ width: 360, height: 740, isMobile: true, hasTouch: true });
    const width = await page.evaluate(() => document.documentElement.scrollWidth);
    assert.ok(width <= 360, `${width} pixels`);
    for (const id of ['camera', 'report', 'overlay']) {
      const box = await (await page.$(`#${id}`)).boundingBox();
      assert.ok(box.height >= 36 && box.x + box.width <= 360, id);
    }
  });
});
