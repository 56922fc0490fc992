// Dense pose beside MediaPipe's pose landmarker for browsers, on the same simulated camera in the same Chromium, in turn:
//
//   npm install --no-save --prefix build/web/mediapipe @mediapipe/tasks-vision@1.1.0
//   python -c "from benchmarks.products.install import install; print(install().tasks['full'])"
//   node tests/web/measure_mediapipe.js .data/products/pose_landmarker_full.task [ROUNDS] [FRAMES]      after `make web`
import { copyFileSync, cpSync, mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { launch, openPage, pageFolder, serve, waitForFrames } from './browser.js';
import { root } from './native.js';

const [task, rounds, count] = [process.argv[2], Number(process.argv[3] ?? 3), Number(process.argv[4] ?? 150)];
const folder = join(root, 'build/web/mediapipe/page');
mkdirSync(folder, { recursive: true });
cpSync(join(root, 'build/web/mediapipe/node_modules/@mediapipe/tasks-vision'), join(folder, 'tasks'), { recursive: true });
copyFileSync(task, join(folder, 'pose.task'));
writeFileSync(join(folder, 'index.html'), '<!doctype html><link rel="icon" href="data:"><video muted playsinline></video><script type="module" src="page.js"></script>');
writeFileSync(
  join(folder, 'page.js'),
  `import { FilesetResolver, PoseLandmarker } from './tasks/vision_bundle.mjs';
   const landmarker = await PoseLandmarker.createFromOptions(await FilesetResolver.forVisionTasks('./tasks/wasm'), {
     baseOptions: { modelAssetPath: './pose.task', delegate: 'CPU' },
     runningMode: 'VIDEO',
     numPoses: 4,
   });
   const video = document.querySelector('video');
   video.srcObject = await navigator.mediaDevices.getUserMedia({ video: { width: 640, height: 480 } });
   await video.play();
   const times = [];
   let people = 0;
   while (times.length < ${count} + 20) {
     await new Promise((resolve) => video.requestVideoFrameCallback(resolve));
     const begin = performance.now();
     people = landmarker.detectForVideo(video, begin).landmarks.length;
     times.push([begin, performance.now() - begin]);
     if (times.length === 1) document.body.dataset.first = performance.now();
   }
   const measured = times.slice(20);
   const ms = measured.map(([, time]) => time).sort((a, b) => a - b);
   document.body.dataset.report = JSON.stringify({
     people,
     framesPerSecond: (1000 * (measured.length - 1)) / (measured.at(-1)[0] - measured[0][0]),
     frameMs: { p50: ms[ms.length >> 1], p90: ms[Math.floor(0.9 * ms.length)] },
     firstOverlayMs: Number(document.body.dataset.first),
   });`,
);

const browser = await launch();
const servers = { ours: await serve(pageFolder), theirs: await serve(folder) };
const line = (name, { framesPerSecond, frameMs, firstOverlayMs, people }) =>
  console.log(`${name}: ${framesPerSecond.toFixed(1)} frames a second, ${frameMs.p50.toFixed(1)} ms a frame (p90 ${frameMs.p90.toFixed(1)}), first result after ${firstOverlayMs.toFixed(0)} ms, ${people} people`);
for (let round = 0; round < rounds; ++round) {
  const { page } = await openPage(browser, servers.ours.url);
  await page.click('#camera');
  await waitForFrames(page, count + 20);
  await page.click('#report');
  line('dense pose', JSON.parse(await page.evaluate(() => document.body.dataset.report)));
  await page.close();
  const other = await browser.newPage();
  other.on('pageerror', (error) => console.log(error.message));
  other.on('console', (message) => message.type() === 'error' && !message.text().startsWith('INFO') && console.log(message.text()));
  other.setDefaultTimeout(60000);
  await other.goto(servers.theirs.url);
  await other.waitForFunction(() => document.body.dataset.report !== undefined);
  line('MediaPipe', JSON.parse(await other.evaluate(() => document.body.dataset.report)));
  await other.close();
}
await browser.close();
for (const server of Object.values(servers)) server.close();
