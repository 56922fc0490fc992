import { launch, openPage, pageFolder, serve, waitForFrames } from './browser.js';
const browser = await launch(); const server = await serve(pageFolder);
const page = await browser.newPage();
page.on('console', (m) => console.log('console', m.text()));
page.on('workercreated', (w) => w.on('console', (m) => console.log('worker', w.url(), m.text())));
await page.goto(server.url);
await page.waitForFunction(() => !document.getElementById('camera').disabled);
await page.click('#camera'); await waitForFrames(page, 10);
await browser.close(); server.close();
