// The thread of dense pose in a browser. A message {id, call, …} gets the answer {id, result} or {id, error}.
import { unpackArchive } from './archive.js';
import { Engine } from './engine.js';

let engine = null;
let canvas = null;

async function fetchBytes(url) {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url} answers ${response.status} ${response.statusText}.`);
  return new Uint8Array(await response.arrayBuffer());
}

// The pixels of an ImageBitmap, which is closed.
function readPixels(bitmap) {
  const { width, height } = bitmap;
  if (canvas === null || canvas.width !== width || canvas.height !== height) {
    canvas = new OffscreenCanvas(width, height);
  }
  const context = canvas.getContext('2d', { willReadFrequently: true });
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  return context.getImageData(0, 0, width, height);
}

const calls = {
  async load({ wasmUrl, networksUrl, options }) {
    const [wasm, networks] = await Promise.all([fetchBytes(wasmUrl), fetchBytes(networksUrl)]);
    // As many threads as the native library takes by default. Only pages that are isolated may share memory.
    const threads = self.crossOriginIsolated ? Math.min(navigator.hardwareConcurrency, 4) : 1;
    engine = await Engine.load({ wasm, files: unpackArchive(networks), options, threads });
    return { result: { version: engine.version, threads } };
  },
  async run({ image, options }) {
    const isBitmap = image instanceof ImageBitmap;
    const result = engine.run(isBitmap ? readPixels(image) : image, options);
    // The views of the core's memory become arrays of their own, which are handed over and not copied again.
    const transfer = [];
    for (const [name, plane] of Object.entries(result.planes)) {
      result.planes[name] = plane.slice();
      transfer.push(result.planes[name].buffer);
    }
    return { result, transfer };
  },
};

self.onmessage = async ({ data }) => {
  try {
    const { result, transfer = [] } = await calls[data.call](data);
    self.postMessage({ id: data.id, result }, transfer);
  } catch (error) {
    self.postMessage({ id: data.id, error: { code: error.code ?? 'MAQ_ERROR_INTERNAL', message: error.message } });
  }
};
