// The page: images from a camera or a file go through dense pose, and what it finds is drawn over them.
import { DensePose } from 'maquette';
import { drawOverlay } from './overlay.js';
import { Measurements } from './measurements.js';
import defaultOutfit from '../../desktop_demo/assets/outfit.png';

const element = (id) => document.getElementById(id);
const canvas = element('view');
const context = canvas.getContext('2d', { willReadFrequently: true });
const video = element('video');
const started = performance.now();

let densepose = null;
let measurements = new Measurements();
let run = 0; // of the source that is shown; a new one ends the loop of the one before
let outfit = null; // the pixels of a texture
let photo = null; // the last photo, shown again when a setting changes

function say(text) {
  element('status').textContent = text;
}

async function wear(file) {
  const image = await createImageBitmap(file);
  const texture = new OffscreenCanvas(image.width, image.height).getContext('2d');
  texture.drawImage(image, 0, 0);
  outfit = texture.getImageData(0, 0, image.width, image.height);
  image.close();
}

async function load() {
  if (outfit === null) await wear(await (await fetch(defaultOutfit)).blob());
  densepose?.close();
  densepose = null;
  const begin = performance.now();
  densepose = await DensePose.load({ keypoints: element('keypoints').checked, longSide: Number(element('size').value) });
  measurements = new Measurements({ loadMs: performance.now() - begin });
  for (const id of ['camera', 'file']) element(id).disabled = false;
}

// Loads again after a failure or a change of settings, and goes on with what was shown.
async function reload() {
  try {
    await load();
    if (photo !== null) await showPhoto(photo);
  } catch (error) {
    say(error.message);
  }
}

function show(image, result) {
  if (canvas.width !== result.width || canvas.height !== result.height) {
    canvas.width = result.width;
    canvas.height = result.height;
  }
  context.drawImage(image, 0, 0);
  drawOverlay(context, result, { kind: element('overlay').value, showsBoxes: element('ids').checked, outfit });
  document.body.dataset.people = result.people.length;
  document.body.dataset.frames = measurements.count;
  if (measurements.count === 1) measurements.firstOverlayMs = performance.now() - started;
  element('times').textContent = measurements.line(result);
}

async function process(image, options) {
  const begin = performance.now();
  const result = await densepose.run(image, options);
  measurements.add(performance.now() - begin, result);
  return result;
}

async function showPhoto(image) {
  photo = image;
  show(image, await process(image, { stream: false }));
  say('');
}

// The newest frame of the video, from the time it is there until it is taken.
function watchVideo(isOver) {
  let newest = null;
  let arrived = () => {};
  (async () => {
    while (!isOver()) {
      await new Promise((resolve) => video.requestVideoFrameCallback(resolve));
      if (isOver()) break;
      newest?.close();
      newest = await createImageBitmap(video);
      arrived();
    }
    newest?.close();
    newest = null;
    arrived();
  })();
  const take = () => {
    const frame = newest;
    newest = null;
    return frame;
  };
  return {
    take,
    // Waits for one; null when it is over.
    async next() {
      if (newest === null && !isOver()) await new Promise((resolve) => (arrived = resolve));
      return take();
    },
  };
}

// Frames of the video until another source is shown. What was found is drawn while the worker has the next frame.
async function showVideo() {
  const mine = ++run;
  photo = null;
  const frames = watchVideo(() => mine !== run);
  let isFirst = true;
  const begin = (frame) => {
    const work = frame && process(frame, { timeMs: performance.now(), stream: !isFirst });
    isFirst = false;
    work?.catch(() => {}); // it is awaited later
    return work;
  };
  let frame = await frames.next();
  let work = begin(frame);
  while (mine === run && frame !== null) {
    try {
      const result = await work;
      const following = frames.take();
      work = begin(following);
      if (mine === run) show(frame, result);
      frame.close();
      frame = following;
      say('');
    } catch (error) {
      say(error.message);
      await reload();
      isFirst = true;
      frame.close();
      frame = null;
    }
    if (frame === null && mine === run) {
      frame = await frames.next();
      work = begin(frame);
    }
  }
  frame?.close();
}

function stopVideo() {
  ++run;
  for (const track of video.srcObject?.getTracks() ?? []) track.stop();
  video.srcObject = null;
  if (video.src !== '') URL.revokeObjectURL(video.src);
  video.removeAttribute('src');
  element('camera').textContent = 'Start camera';
}

async function startCamera() {
  say('Waiting for the camera …');
  let stream;
  try {
    stream = await navigator.mediaDevices.getUserMedia({ video: { width: 640, height: 480, facingMode: 'user' } });
  } catch (error) {
    const isDenied = error.name === 'NotAllowedError';
    say(isDenied ? 'The browser was not allowed to use the camera. Allow it, or drop a photo or clip.' : `There is no camera (${error.message}).`);
    return;
  }
  video.srcObject = stream;
  await video.play();
  element('camera').textContent = 'Stop camera';
  await showVideo();
}

async function open(file) {
  stopVideo();
  try {
    if (file.type.startsWith('video/')) {
      video.src = URL.createObjectURL(file);
      video.loop = true;
      await video.play();
      await showVideo();
    } else {
      await showPhoto(await createImageBitmap(file));
    }
  } catch {
    say(`${file.name} is no image or clip that this browser reads. Try a JPEG, PNG, WebP, MP4 or WebM.`);
  }
}

element('camera').addEventListener('click', () => {
  if (video.srcObject === null) {
    stopVideo();
    startCamera().catch((error) => say(error.message));
  } else {
    stopVideo();
  }
});
element('file').addEventListener('change', ({ target }) => {
  if (target.files.length > 0) open(target.files[0]);
  target.value = '';
});
for (const id of ['keypoints', 'size']) element(id).addEventListener('change', reload);
for (const id of ['overlay', 'ids']) {
  element(id).addEventListener('change', () => {
    element('texture').hidden = element('overlay').value !== 'outfit';
    if (photo !== null) showPhoto(photo);
  });
}
element('texture').addEventListener('change', async ({ target }) => {
  const [file] = target.files;
  target.value = '';
  if (file === undefined) return;
  try {
    await wear(file);
    if (photo !== null) await showPhoto(photo);
  } catch {
    say(`${file.name} is no image. Take a texture of 24 tiles, such as \`maquette densepose --textures\` writes.`);
  }
});
element('report').addEventListener('click', async () => {
  const text = JSON.stringify(measurements.report(), null, 2);
  document.body.dataset.report = text;
  try {
    await navigator.clipboard.writeText(text);
    say('The report is in the clipboard.');
  } catch (error) {
    say(`The report cannot be copied (${error.message}).`);
  }
});

const stage = element('stage');
document.addEventListener('dragover', (event) => {
  event.preventDefault();
  stage.classList.add('dropping');
});
document.addEventListener('dragleave', () => stage.classList.remove('dropping'));
document.addEventListener('drop', (event) => {
  event.preventDefault();
  stage.classList.remove('dropping');
  if (event.dataTransfer.files.length > 0) open(event.dataTransfer.files[0]);
});

load().then(
  () => say('Start the camera, or drop a photo or clip here.'),
  (error) => say(error.message),
);
