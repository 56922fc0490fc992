// What the native library says, and images as both see them.
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { PNG } from 'pngjs';

export const root = dirname(dirname(dirname(fileURLToPath(import.meta.url))));
export const scratch = join(root, 'build/web/tests');
export const native = process.env.MAQUETTE ?? join(root, 'build/release/stage/bin/maquette');
mkdirSync(scratch, { recursive: true });

// Converts with ffmpeg and returns the path: photo.jpg in another form.
export function converted(name, ...filters) {
  const path = join(scratch, name);
  execFileSync('ffmpeg', ['-v', 'error', '-y', '-i', join(root, 'tests/media/photo.jpg'), ...filters, path]);
  return path;
}

export function readPng(path) {
  return PNG.sync.read(readFileSync(path));
}

// Body part, U, V and person of each pixel, by the program `maquette`.
export function nativePlanes(path, ...options) {
  const out = join(scratch, 'native');
  execFileSync(native, ['densepose', path, '--out', out, '--threads', '1', ...options], { stdio: 'pipe' });
  const stem = path.replace(/^.*\//, '').replace(/\.png$/, '');
  const surface = readPng(join(out, `${stem}_IUV.png`));
  const people = readPng(join(out, `${stem}_INDS.png`));
  // The file's channels are B, G, R: I, U, V.
  const plane = (image, channel) => Uint8Array.from({ length: image.width * image.height }, (_, i) => image.data[4 * i + channel]);
  return { part: plane(surface, 2), u: plane(surface, 1), v: plane(surface, 0), person: plane(people, 0) };
}

export function share(a, b) {
  return a.reduce((same, value, i) => same + (value === b[i] ? 1 : 0), 0) / a.length;
}

// A new project with the packed package installed, and the examples of its README in JavaScript.
export function projectWithPackage(name) {
  const project = join(scratch, name);
  rmSync(project, { recursive: true, force: true });
  mkdirSync(project, { recursive: true });
  writeFileSync(join(project, 'package.json'), '{"type": "module", "private": true}');
  const tarball = readdirSync(join(root, 'build/web')).find((file) => file.endsWith('.tgz'));
  execFileSync('npm', ['install', '--silent', '--no-audit', '--no-fund', join(root, 'build/web', tarball)], { cwd: project });
  const readme = readFileSync(join(project, 'node_modules/maquette/README.md'), 'utf8');
  return { project, examples: [...readme.matchAll(/```js\n(.*?)```/gs)].map(([, code]) => code) };
}
