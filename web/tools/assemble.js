// Puts the npm package together:
//
//   node web/tools/assemble.js build/web/package
//
// Names of parts and keypoints come from the core, and the version from the project, so that they cannot differ.
import { cpSync, mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

const web = dirname(dirname(fileURLToPath(import.meta.url)));
const root = dirname(web);
const target = resolve(process.argv[2]);
const bundle = join(root, 'sdk/models/densepose-b-int8');

rmSync(target, { recursive: true, force: true });
mkdirSync(target, { recursive: true });
cpSync(join(web, 'src'), target, { recursive: true });
cpSync(join(root, 'build/web/core/maquette-core.wasm'), join(target, 'maquette-core.wasm'));
// Emscripten starts threads from a script of its own, which bundlers cannot read; engine.js starts thread.js before.
const [before, after, ...more] = readFileSync(join(root, 'build/web/core/maquette-core.mjs'), 'utf8').split(
  'new Worker(new URL("maquette-core.worker.js",import.meta.url))',
);
if (after === undefined || more.length > 0) throw new Error('Another version of emscripten starts threads in another way.');
writeFileSync(join(target, 'maquette-core.mjs'), `${before}undefined${after}`);
cpSync(join(root, 'LICENSE'), join(target, 'LICENSE'));
cpSync(join(root, 'sdk/licenses/nlohmann-json.txt'), join(target, 'LICENSE-nlohmann-json.txt'));
cpSync(join(bundle, 'CREDITS.tsv'), join(target, 'CREDITS.tsv'));
cpSync(join(bundle, 'MODEL_CARD.md'), join(target, 'MODEL_CARD.md'));
cpSync(join(web, 'README.md'), join(target, 'README.md'));

const { packArchive } = await import(pathToFileURL(join(target, 'archive.js')));
const manifest = JSON.parse(readFileSync(join(bundle, 'manifest.json'), 'utf8'));
const files = ['manifest.json', ...Object.keys(manifest.files)];
writeFileSync(
  join(target, 'networks.bin'),
  packArchive(Object.fromEntries(files.map((file) => [file, new Uint8Array(readFileSync(join(bundle, file)))]))),
);

const { default: createCore } = await import(pathToFileURL(join(target, 'maquette-core.mjs')));
const { createMemory } = await import(pathToFileURL(join(target, 'memory.js')));
const core = await createCore({
  wasmBinary: readFileSync(join(target, 'maquette-core.wasm')),
  wasmMemory: createMemory(),
});
const text = (at) => core.UTF8ToString(at);
const parts = Array.from({ length: 25 }, (_, part) => text(core._maq_web_part_name(part)));
const keypoints = Array.from({ length: 33 }, (_, keypoint) => text(core._maq_web_keypoint_name(keypoint)));
const rgb = core._malloc(3);
const colours = parts.map((_, part) => {
  core._maq_web_part_colour(part, rgb);
  return Array.from(core.HEAPU8.subarray(rgb, rgb + 3));
});
const list = (values) => `[\n${values.map((value) => `  ${JSON.stringify(value)},\n`).join('')}]`;
writeFileSync(
  join(target, 'names.js'),
  [
    '// Of the core, by number: the body parts from 0 (background) to 24, their colours, and the keypoints.',
    `export const PART_NAMES = ${list(parts)};`,
    `export const PART_COLOURS = ${list(colours)};`,
    `export const KEYPOINT_NAMES = ${list(keypoints)};\n`,
  ].join('\n'),
);

const version = text(core._maq_web_version());
const json = JSON.parse(readFileSync(join(web, 'package.json'), 'utf8'));
writeFileSync(
  join(target, 'package.json'),
  `${JSON.stringify({ ...json, version, files: readdirSync(target).filter((file) => file !== 'package.json') }, null, 2)}\n`,
);
