// Dense pose in node, on the thread of the caller.
import { readFile } from 'node:fs/promises';
import { unpackArchive } from './archive.js';
import { Engine } from './engine.js';

export { MaquetteError } from './errors.js';
export { KEYPOINT_NAMES, PART_COLOURS, PART_NAMES } from './names.js';

export class DensePose {
  static async load(options = {}) {
    const [wasm, networks] = await Promise.all(
      ['./maquette-core.wasm', './networks.bin'].map((file) => readFile(new URL(file, import.meta.url))),
    );
    return new DensePose(await Engine.load({ wasm, files: unpackArchive(networks), options }));
  }

  #engine;

  constructor(engine) {
    this.#engine = engine;
  }

  async run(image, options) {
    return this.#engine.run(image, options);
  }

  close() {
    this.#engine.close();
  }
}
