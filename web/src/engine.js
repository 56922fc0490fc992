// The WebAssembly core as objects of JavaScript, on the thread of the caller. densepose.js puts it on a worker.
import createCore from './maquette-core.mjs';
import { MaquetteError } from './errors.js';
import { createMemory } from './memory.js';

// The options in the order of native/binding.cpp, with the values of their names.
const OPTIONS = [
  ['preset', { stream: 0, photo: 1 }],
  ['longSide'],
  ['scoreThreshold'],
  ['maxPeople'],
  ['maxProposals'],
  ['keyFrameInterval'],
  ['minPersonHeight'],
  ['detail', { surface: 0, part: 1 }],
  ['personCrops', { auto: 1, all: 2, off: 3 }],
  ['personCropSide'],
  ['keypoints', { false: 0, true: 1 }],
  ['steadiness'],
];

const STATS = [
  'preprocessMs',
  'trunkMs',
  'proposalsMs',
  'boxHeadMs',
  'denseHeadMs',
  'cropsMs',
  'decodeMs',
  'keypointsMs',
  'totalMs',
  'networkWidth',
  'networkHeight',
];

const PLANES = { part: 1, u: 2, v: 3, person: 4 };
const KEYPOINTS = 33;

// An option as the number that the core takes; 0 is the default.
function optionNumber(options, [name, names]) {
  const value = options[name];
  if (value === undefined || value === null) return 0;
  if (names !== undefined) {
    if (!Object.hasOwn(names, value)) {
      throw new MaquetteError(
        'MAQ_ERROR_INVALID_ARGUMENT',
        `${name} is ${JSON.stringify(value)}, but must be ${Object.keys(names).join(' or ')}.`,
      );
    }
    return names[value];
  }
  if (typeof value !== 'number' || !Number.isFinite(value)) {
    throw new MaquetteError('MAQ_ERROR_INVALID_ARGUMENT', `${name} is ${JSON.stringify(value)}, but must be a number.`);
  }
  return value;
}

function checkOptions(options) {
  for (const name of Object.keys(options)) {
    if (!OPTIONS.some(([known]) => known === name)) {
      throw new MaquetteError(
        'MAQ_ERROR_INVALID_ARGUMENT',
        `There is no option ${name}; the options are ${OPTIONS.map(([known]) => known).join(', ')}.`,
      );
    }
  }
  return OPTIONS.map((option) => optionNumber(options, option));
}

// A worker for a thread that the core will start.
function startThread(pool) {
  const worker = new Worker(new URL('./thread.js', import.meta.url), { type: 'module' });
  pool.unusedWorkers.push(worker);
  return new Promise((resolve, reject) => {
    pool.loadWasmModuleToWorker(worker, resolve);
    worker.onerror = ({ message }) => reject(new Error(`a thread ended: ${message ?? 'no reason'}`));
  });
}

export class Engine {
  // `wasm` and `files` (name to bytes) as the package brings them. More than one thread only where memory can be sent to
  // workers.
  static async load({ wasm, files, options = {}, threads = 1 }) {
    const numbers = [...checkOptions(options), threads];
    const memory = createMemory();
    let core;
    try {
      core = await createCore({
        wasmBinary: wasm,
        wasmMemory: memory,
        printErr() {}, // what it says is in the error
      });
      await Promise.all(Array.from({ length: threads - 1 }, () => startThread(core.PThread)));
    } catch (error) {
      throw new MaquetteError(
        'MAQ_ERROR_UNSUPPORTED',
        `The WebAssembly core does not start (${error.message}). A browser with SIMD and exceptions in WebAssembly is ` +
          'needed: Chrome 95, Firefox 100, Safari 16.4 or newer.',
      );
    }
    return new Engine(core, memory, files, numbers, options.keypoints === true);
  }

  #core;
  #memory;
  #self = 0;
  #hasKeypoints;
  #scratch;
  #frame = 0;

  constructor(core, memory, files, numbers, hasKeypoints) {
    this.#core = core;
    this.#memory = memory;
    this.#hasKeypoints = hasKeypoints;
    this.#scratch = core._malloc(8 * (6 + 3 * KEYPOINTS));
    for (const [name, bytes] of Object.entries(files)) {
      const text = this.#text(name);
      const at = core._maq_web_add_file(text, bytes.length);
      this.#bytes.set(bytes, at);
      core._free(text);
    }
    core.HEAPF64.set(numbers, this.#scratch / 8);
    const made = core._malloc(4);
    const status = core._maq_web_create(this.#scratch, made);
    this.#self = core.HEAPU32[made / 4];
    core._free(made);
    this.#check(status);
  }

  get version() {
    return this.#core.UTF8ToString(this.#core._maq_web_version());
  }

  // Runs on RGBA pixels. `stream`: whether the image follows the one before. The planes are views into the core's
  // memory, valid until the next call.
  run({ width, height, data }, { timeMs = 0, stream = true } = {}) {
    if (this.#self === 0) throw new MaquetteError('MAQ_ERROR_INVALID_ARGUMENT', 'The object was closed.');
    const core = this.#core;
    if (data.length !== 4 * width * height) {
      throw new MaquetteError(
        'MAQ_ERROR_INVALID_ARGUMENT',
        `The image has ${data.length} bytes, but ${width} x ${height} pixels of RGBA have ${4 * width * height}.`,
      );
    }
    const pixels = core._maq_web_pixels(this.#self, width, height);
    this.#bytes.set(data, pixels);
    this.#frame = stream ? this.#frame : 0;
    this.#check(core._maq_web_run(this.#self, this.#frame, timeMs));
    this.#frame += 1;
    return { width, height, people: this.#people(), planes: this.#planes(width * height), stats: this.#stats() };
  }

  close() {
    if (this.#self !== 0) this.#core._maq_web_destroy(this.#self);
    this.#self = 0;
  }

  // The sizes of the core's memory, for tests.
  get memoryBytes() {
    return this.#memory.buffer.byteLength;
  }

  // All of the memory, which may have grown since the last call.
  get #bytes() {
    return new Uint8Array(this.#memory.buffer);
  }

  #text(text) {
    const size = this.#core.lengthBytesUTF8(text) + 1;
    const at = this.#core._malloc(size);
    this.#core.stringToUTF8(text, at, size);
    return at;
  }

  #check(status) {
    if (status === 0) return;
    const core = this.#core;
    throw new MaquetteError(
      core.UTF8ToString(core._maq_web_status_name(status)),
      core.UTF8ToString(core._maq_web_error_text()),
    );
  }

  #people() {
    const core = this.#core;
    const people = [];
    for (let index = 0; index < core._maq_web_person_count(this.#self); ++index) {
      this.#check(core._maq_web_person(this.#self, index, this.#scratch, this.#hasKeypoints ? 1 : 0));
      const at = this.#scratch / 8;
      const values = core.HEAPF64.slice(at, at + 6 + (this.#hasKeypoints ? 3 * KEYPOINTS : 0));
      const person = { id: values[0], score: values[1], box: Array.from(values.subarray(2, 6)) };
      if (this.#hasKeypoints) {
        person.keypoints = Array.from({ length: KEYPOINTS }, (_, i) => ({
          x: values[6 + 3 * i],
          y: values[7 + 3 * i],
          confidence: values[8 + 3 * i],
        }));
      }
      people.push(person);
    }
    return people;
  }

  #planes(size) {
    const core = this.#core;
    return Object.fromEntries(
      Object.entries(PLANES).map(([name, number]) => {
        const at = core._maq_web_plane(this.#self, number);
        return [name, this.#bytes.subarray(at, at + size)];
      }),
    );
  }

  #stats() {
    this.#check(this.#core._maq_web_stats(this.#self, this.#scratch));
    const at = this.#scratch / 8;
    return Object.fromEntries(STATS.map((name, index) => [name, this.#core.HEAPF64[at + index]]));
  }
}
