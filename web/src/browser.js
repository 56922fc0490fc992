// Dense pose in a browser, on a worker of its own.
import { MaquetteError } from './errors.js';

export { MaquetteError } from './errors.js';
export { KEYPOINT_NAMES, PART_COLOURS, PART_NAMES } from './names.js';

export class DensePose {
  static async load(options = {}) {
    const worker = new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
    const densepose = new DensePose(worker);
    try {
      await densepose.#call({
        call: 'load',
        wasmUrl: new URL('./maquette-core.wasm', import.meta.url).href,
        networksUrl: new URL('./networks.bin', import.meta.url).href,
        options,
      });
    } catch (error) {
      densepose.close();
      throw error;
    }
    return densepose;
  }

  #worker;
  #waiting = new Map();
  #last = 0;

  constructor(worker) {
    this.#worker = worker;
    worker.onmessage = ({ data }) => {
      const { resolve, reject } = this.#waiting.get(data.id) ?? {};
      this.#waiting.delete(data.id);
      if (data.error !== undefined) reject?.(new MaquetteError(data.error.code, data.error.message));
      else resolve?.(data.result);
    };
    worker.onerror = (event) => {
      event.preventDefault();
      this.#end('MAQ_ERROR_INTERNAL', `The worker of dense pose ended (${event.message ?? 'no reason'}); load it again.`);
    };
  }

  async run(image, options = {}) {
    if (image instanceof ImageData) {
      const { width, height, data } = image;
      return this.#call({ call: 'run', image: { width, height, data }, options });
    }
    let bitmap;
    try {
      bitmap = await createImageBitmap(image);
    } catch (error) {
      throw new MaquetteError(
        'MAQ_ERROR_UNREADABLE',
        `The image cannot be read (${error.message}); give an ImageData, canvas, image, video or VideoFrame with pixels.`,
      );
    }
    return this.#call({ call: 'run', image: bitmap, options }, [bitmap]);
  }

  close() {
    this.#end('MAQ_CANCELLED', 'The object was closed.');
  }

  #call(message, transfer = []) {
    if (this.#worker === null) {
      return Promise.reject(new MaquetteError('MAQ_ERROR_INVALID_ARGUMENT', 'The object was closed.'));
    }
    const id = ++this.#last;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject });
      this.#worker.postMessage({ ...message, id }, transfer);
    });
  }

  #end(code, text) {
    this.#worker?.terminate();
    this.#worker = null;
    for (const { reject } of this.#waiting.values()) reject(new MaquetteError(code, text));
    this.#waiting.clear();
  }
}
