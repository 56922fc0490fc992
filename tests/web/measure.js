// Processor time of a frame in WebAssembly, for tests/web/measure.py: for each line on standard input, runs FRAMES frames
// of a raw RGBA image and prints milliseconds a frame.
import { readFileSync } from 'node:fs';
import { createInterface } from 'node:readline';
import { DensePose } from 'maquette';

const [path, width, height, frames] = [process.argv[2], ...process.argv.slice(3).map(Number)];
const densepose = await DensePose.load();
const image = { width, height, data: new Uint8Array(readFileSync(path)) };
for (let i = 0; i < 20; ++i) await densepose.run(image, { stream: false });
console.log('ready');
for await (const _ of createInterface({ input: process.stdin })) {
  const begin = process.cpuUsage();
  for (let i = 0; i < frames; ++i) await densepose.run(image, { stream: false });
  const { user, system } = process.cpuUsage(begin);
  console.log((user + system) / 1000 / frames);
}
