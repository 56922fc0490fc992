// Draws what dense pose found over its image.
import { PART_COLOURS } from 'maquette';

const OPACITY = 0.7;
const CONTOURS = 8; // of U, and of V, in each part
const PERSON_COLOURS = [[246, 198, 82], [64, 156, 255], [232, 84, 128], [60, 184, 168], [246, 144, 70], [132, 120, 236]];

function blend(pixels, at, colour, opacity) {
  for (let channel = 0; channel < 3; ++channel) {
    pixels[at + channel] += (colour[channel] - pixels[at + channel]) * opacity;
  }
}

function drawParts(pixels, { part }) {
  for (let i = 0; i < part.length; ++i) {
    if (part[i] !== 0) blend(pixels, 4 * i, PART_COLOURS[part[i]], OPACITY);
  }
}

function drawPeople(pixels, { person }, people) {
  for (let i = 0; i < person.length; ++i) {
    if (person[i] === 0) continue;
    blend(pixels, 4 * i, PERSON_COLOURS[(people[person[i] - 1].id - 1) % PERSON_COLOURS.length], OPACITY);
  }
}

// Lines where U or V passes a multiple of 1 / CONTOURS, and around parts.
function drawContours(pixels, { part, u, v }, width) {
  const step = (value) => ((value * CONTOURS) >> 8);
  const differs = (i, j) => part[i] !== part[j] || step(u[i]) !== step(u[j]) || step(v[i]) !== step(v[j]);
  for (let i = 0; i < part.length - width - 1; ++i) {
    if (part[i] === 0 && part[i + 1] === 0 && part[i + width] === 0) continue;
    if (differs(i, i + 1) || differs(i, i + width)) blend(pixels, 4 * i, PART_COLOURS[part[i] || part[i + 1] || part[i + width]], 1);
  }
}

// Paints people with a texture of 24 tiles, 4 columns of 6 (docs/guide/texture.md), as bright as the image is there.
function drawOutfit(pixels, { part, u, v }, { width, height, data }) {
  const [tileWidth, tileHeight] = [width / 4, height / 6];
  for (let i = 0; i < part.length; ++i) {
    if (part[i] === 0) continue;
    const tile = part[i] - 1;
    const x = Math.floor(tile / 6) * tileWidth + (u[i] / 256) * tileWidth;
    const y = (tile % 6) * tileHeight + (1 - (v[i] + 1) / 256) * tileHeight;
    const from = 4 * (Math.floor(y) * width + Math.floor(x));
    const at = 4 * i;
    const light = 0.65 + (0.6 * (0.299 * pixels[at] + 0.587 * pixels[at + 1] + 0.114 * pixels[at + 2])) / 255;
    for (let channel = 0; channel < 3; ++channel) pixels[at + channel] = light * data[from + channel];
  }
}

function drawBoxes(context, people) {
  const size = Math.max(14, context.canvas.width / 40);
  context.font = `${size}px system-ui, sans-serif`;
  context.lineWidth = Math.max(2, size / 8);
  for (const { id, score, box, keypoints = [] } of people) {
    const [left, top, right, bottom] = box;
    const colour = `rgb(${PERSON_COLOURS[(id - 1) % PERSON_COLOURS.length].join(' ')})`;
    context.strokeStyle = colour;
    context.strokeRect(left, top, right - left, bottom - top);
    const text = `${id}  ${Math.round(100 * score)} %`;
    context.fillStyle = colour;
    context.fillRect(left, top, context.measureText(text).width + size, size * 1.4);
    context.fillStyle = '#111';
    context.fillText(text, left + size / 2, top + size * 1.05);
    context.fillStyle = '#fff';
    for (const { x, y, confidence } of keypoints) {
      if (confidence < 0.3) continue;
      context.beginPath();
      context.arc(x, y, size / 6, 0, 2 * Math.PI);
      context.fill();
    }
  }
}

export function drawOverlay(context, { width, height, planes, people }, { kind, showsBoxes, outfit }) {
  if (kind !== 'none') {
    const image = context.getImageData(0, 0, width, height);
    if (kind === 'parts') drawParts(image.data, planes);
    if (kind === 'people') drawPeople(image.data, planes, people);
    if (kind === 'outfit') drawOutfit(image.data, planes, outfit);
    if (kind === 'contours') drawContours(image.data, planes, width);
    context.putImageData(image, 0, 0);
  }
  if (showsBoxes) drawBoxes(context, people);
}
