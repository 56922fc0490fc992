// Frames a second of the page in headless Chromium, with threads and without, in turn, and growth of JavaScript's heap:
//
//   node tests/web/measure_page.js [ROUNDS] [FRAMES]      after `make web`
import { frames, heapBytes, launch, openPage, pageFolder, serve, waitForFrames } from './browser.js';

const [rounds, count] = [Number(process.argv[2] ?? 3), Number(process.argv[3] ?? 150)];
const browser = await launch();
const servers = { 'several threads': await serve(pageFolder), 'one thread': await serve(pageFolder, { isolated: false }) };
for (let round = 0; round < rounds; ++round) {
  for (const [name, server] of Object.entries(servers)) {
    const { page } = await openPage(browser, server.url);
    await page.click('#camera');
    await waitForFrames(page, 20);
    const heap = await heapBytes(page);
    await waitForFrames(page, (await frames(page)) + count);
    const grown = ((await heapBytes(page)) - heap) / 1e6;
    await page.click('#report');
    const { framesPerSecond, frameMs, stagesMs, firstOverlayMs } = JSON.parse(await page.evaluate(() => document.body.dataset.report));
    const stages = Object.entries(stagesMs).map(([stage, { p50 }]) => `${stage} ${p50}`).join(', ');
    console.log(`${name}: ${framesPerSecond} frames a second, ${frameMs.p50} ms a frame (p90 ${frameMs.p90}), first overlay after ${firstOverlayMs.toFixed(0)} ms, heap grown by ${grown.toFixed(2)} MB; ${stages}`);
    await page.close();
  }
}
await browser.close();
for (const server of Object.values(servers)) server.close();
