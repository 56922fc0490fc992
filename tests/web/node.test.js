// The npm package in node.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { gzipSync } from 'node:zlib';
import { readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { DensePose, KEYPOINT_NAMES, MaquetteError, PART_COLOURS, PART_NAMES } from 'maquette';
import { converted, nativePlanes, projectWithPackage, readPng, root, share } from './native.js';

const photo = converted('photo.png');
const image = readPng(photo);

for (const preset of ['stream', 'photo']) {
  test(`labels of a photo are those of the native library, preset ${preset}`, async () => {
    const densepose = await DensePose.load({ preset });
    const { people, planes } = await densepose.run(image, { stream: false });
    const expected = nativePlanes(photo, '--preset', preset);
    assert.equal(people.length, 1);
    for (const name of ['part', 'person', 'u', 'v']) {
      const same = share(planes[name], expected[name]);
      console.log(`${preset}, ${name}: ${(100 * same).toFixed(3)} % of the pixels are the same`);
      assert.ok(same >= 0.995, `${name}: ${same}`);
    }
    densepose.close();
  });
}

test('a person in a stream keeps the id, and has 33 keypoints where they are asked for', async () => {
  const densepose = await DensePose.load({ keypoints: true });
  for (let frame = 0; frame < 3; ++frame) {
    const { people } = await densepose.run(image, { timeMs: 33 * frame });
    assert.equal(people[0].id, 1);
    assert.equal(people[0].keypoints.length, KEYPOINT_NAMES.length);
    const nose = people[0].keypoints[KEYPOINT_NAMES.indexOf('nose')];
    const [left, top, right, bottom] = people[0].box;
    assert.ok(nose.x > left && nose.x < right && nose.y > top && nose.y < bottom);
  }
  densepose.close();
});

test('names and colours are those of the core', () => {
  assert.equal(PART_NAMES.length, 25);
  assert.equal(PART_NAMES[2], 'torso, front');
  assert.deepEqual(PART_COLOURS[2], [246, 198, 82]);
});

test('wrong arguments are refused with the sentence of the C API', async () => {
  const refuses = (promise, code, text) =>
    assert.rejects(promise, (error) => error instanceof MaquetteError && error.code === code && text.test(error.message));
  await refuses(DensePose.load({ maxPeople: 1000 }), 'MAQ_ERROR_INVALID_ARGUMENT', /config\.max_people is 1000/);
  await refuses(DensePose.load({ preset: 'film' }), 'MAQ_ERROR_INVALID_ARGUMENT', /preset is "film", but must be stream or photo/);
  await refuses(DensePose.load({ people: 1 }), 'MAQ_ERROR_INVALID_ARGUMENT', /There is no option people/);
  await refuses(DensePose.load({ steadiness: Number.NaN }), 'MAQ_ERROR_INVALID_ARGUMENT', /steadiness/);
  const densepose = await DensePose.load();
  await refuses(densepose.run({ width: 0, height: 0, data: new Uint8Array(0) }), 'MAQ_ERROR_IMAGE_SIZE', /0 x 0 pixels/);
  await refuses(densepose.run({ width: 8, height: 8, data: new Uint8Array(3) }), 'MAQ_ERROR_INVALID_ARGUMENT', /has 3 bytes/);
  await densepose.run({ width: 1, height: 1, data: new Uint8Array(4) });
  const { people } = await densepose.run(image, { stream: false });
  assert.equal(people.length, 1, 'the object goes on after errors');
  densepose.close();
  densepose.close();
  await refuses(densepose.run(image), 'MAQ_ERROR_INVALID_ARGUMENT', /was closed/);
});

test('memory does not grow over 1,000 frames', async () => {
  const { Engine } = await import(new URL('../../build/web/package/engine.js', import.meta.url));
  const { unpackArchive } = await import(new URL('../../build/web/package/archive.js', import.meta.url));
  const file = (name) => readFileSync(join(root, 'build/web/package', name));
  const engine = await Engine.load({
    wasm: file('maquette-core.wasm'),
    files: unpackArchive(file('networks.bin')),
    options: { longSide: 96 },
  });
  const small = readPng(converted('small.png', '-vf', 'scale=128:128'));
  const run = () => engine.run(small);
  for (let i = 0; i < 50; ++i) run();
  const before = engine.memoryBytes;
  for (let i = 0; i < 1000; ++i) run();
  assert.equal(engine.memoryBytes, before);
  engine.close();
});

test('a damaged bundle is refused', async () => {
  const { Engine } = await import(new URL('../../build/web/package/engine.js', import.meta.url));
  const { unpackArchive } = await import(new URL('../../build/web/package/archive.js', import.meta.url));
  const file = (name) => readFileSync(join(root, 'build/web/package', name));
  const files = { ...unpackArchive(new Uint8Array(file('networks.bin'))) };
  files['trunk.onnx'] = files['trunk.onnx'].slice();
  files['trunk.onnx'][1000] ^= 1;
  await assert.rejects(Engine.load({ wasm: file('maquette-core.wasm'), files }), { code: 'MAQ_ERROR_BAD_BUNDLE' });
  await assert.rejects(Engine.load({ wasm: new Uint8Array(8), files }), { code: 'MAQ_ERROR_UNSUPPORTED' });
});

test('options of the types are those of the C API', () => {
  const header = readFileSync(join(root, 'sdk/include/maquette/densepose.h'), 'utf8');
  const struct = header.match(/typedef struct maq_densepose_config \{(.*?)\} maq_densepose_config;/s)[1];
  const fields = [...struct.matchAll(/^ {2}[a-z_0-9]+ ([a-z_]+);/gm)].map(([, name]) => name);
  const camel = (name) =>
    name.replace(/^has_/, '').replace('person_crop_px', 'person_crop_side').replace(/_px$/, '').replace(/_(.)/g, (_, letter) => letter.toUpperCase());
  const expected = fields.filter((name) => !['struct_size', 'model', 'result_pool_size'].includes(name)).map(camel).sort();
  const types = readFileSync(join(root, 'web/src/index.d.ts'), 'utf8');
  const options = types.match(/interface DensePoseOptions \{(.*?)\n\}/s)[1];
  assert.deepEqual([...options.matchAll(/^ {2}(\w+)\?:/gm)].map(([, name]) => name).sort(), expected);
});

test('the packed package installs in an empty project and runs the example of its README', () => {
  const { project, examples } = projectWithPackage('project');
  writeFileSync(join(project, 'node.js'), examples[1]);
  assert.match(execFileSync('node', ['node.js'], { cwd: project, encoding: 'utf8' }), /^0 people$/m);
  writeFileSync(join(project, 'browser.ts'), examples[0].replace("querySelector('video')", "querySelector('video')!"));
  const tsc = join(root, 'tests/web/node_modules/.bin/tsc');
  const flags = ['--noEmit', '--strict', '--module', 'nodenext', '--target', 'es2022', '--lib', 'es2022,dom', 'browser.ts'];
  execFileSync(tsc, flags, { cwd: project, stdio: 'inherit' });
});

test('page, core and networks stay small', () => {
  const folder = join(root, 'build/web/page');
  const files = ['index.html', ...readdirSync(join(folder, 'assets')).map((name) => `assets/${name}`)];
  const size = files.reduce((sum, name) => sum + gzipSync(readFileSync(join(folder, name)), { level: 9 }).length, 0);
  console.log(`the page has ${(size / 1e6).toFixed(2)} MB, compressed with gzip`);
  assert.ok(size <= 4e6, `${size} bytes`);
});
