"""Clips `shapes`: one to three shapes that move straight on, bounce off the borders and turn at random.

All chance is in the turns, so that the entropy of each frame given those before it is known exactly: likelihoods that a
network gives can be held against it. At each step a shape turns with probability `TURN` into one of eight directions,
drawn evenly; else it keeps its own. A direction that would leave the image is reflected, and choices that end in the
same state count as one. Smaller shapes lie in front, and radii are such that none is ever hidden whole, so positions
can always be told from the image, and velocities from two.
"""

from __future__ import annotations

import colorsys
from dataclasses import dataclass

import cv2
import numpy as np

from export.clips.clip import FRAMES, LARGE_PX, SIDE_PX, Clip, Frames, generator

VERSION = "shapes-1"
FPS = 10
TURN = 0.2
_RADII = (5, 7, 10)  # px of 64; 10 squared is more than 5 squared + 7 squared: two cannot hide the third
_DIRECTIONS = [(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1) if (x, y) != (0, 0)]
_KINDS = ("disc", "square", "diamond")
_SAMPLES = 4  # a pixel and axis


@dataclass(frozen=True)
class _Shape:
    kind: str
    radius: int
    speed: int  # pixels of 64 a frame and axis
    colour: tuple[float, float, float]


State = tuple[int, int, int, int]  # position x, y and direction x, y


def moved(state: State, direction: tuple[int, int], shape: _Shape) -> State:
    """One step in that direction, each axis reflected where it would leave the image."""
    out = []
    for at, step in zip(state[:2], direction, strict=True):
        if not shape.radius <= at + step * shape.speed <= SIDE_PX - 1 - shape.radius:
            step = -step
        out.append((at + step * shape.speed, step))
    (x, dx), (y, dy) = out
    return x, y, dx, dy


def next_states(state: State, shape: _Shape) -> dict[State, float]:
    """Every state after one step, with its probability."""
    chances: dict[State, float] = {}
    for direction, chance in [(state[2:], 1 - TURN), *((d, TURN / 8) for d in _DIRECTIONS)]:
        after = moved(state, direction, shape)
        chances[after] = chances.get(after, 0.0) + chance
    return chances


def _first_states(state: State, shape: _Shape) -> dict[State, float]:
    """The same for the second frame, before which no direction has been seen: all eight are as likely."""
    chances: dict[State, float] = {}
    for direction in _DIRECTIONS:
        for after, chance in next_states((*state[:2], *direction), shape).items():
            chances[after] = chances.get(after, 0.0) + chance / 8
    return chances


def _entropy(chances: dict[State, float]) -> float:
    p = np.array(list(chances.values()))
    return float(-(p * np.log2(p)).sum())


def _inside(shape: _Shape, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    if shape.kind == "disc":
        return x**2 + y**2 <= (shape.radius + 0.5) ** 2
    if shape.kind == "square":
        return np.maximum(abs(x), abs(y)) <= 0.8 * shape.radius + 0.5
    return abs(x) + abs(y) <= shape.radius + 0.5


def _drawn(shapes: list[_Shape], states: list[State], ground: np.ndarray, size: tuple[int, int]):
    """A frame uint8 [H, W, 3] and the number of the front-most shape at each pixel's centre (0: ground)."""
    width, height = size
    column = ((np.arange(width * _SAMPLES) + 0.5) / _SAMPLES) * SIDE_PX / width - 0.5
    row = ((np.arange(height * _SAMPLES) + 0.5) / _SAMPLES) * SIDE_PX / height - 0.5
    x, y = np.meshgrid(column, row)
    centre_x, centre_y = np.meshgrid((np.arange(width) + 0.5) * SIDE_PX / width - 0.5,
                                     (np.arange(height) + 0.5) * SIDE_PX / height - 0.5)  # fmt: skip
    image = np.broadcast_to(ground, (*x.shape, 3)).copy()
    front = np.zeros((height, width), np.uint8)
    order = sorted(range(len(shapes)), key=lambda k: -shapes[k].radius)
    for k in order:
        at = states[k][:2]
        image[_inside(shapes[k], x - at[0], y - at[1])] = shapes[k].colour
        front[_inside(shapes[k], centre_x - at[0], centre_y - at[1])] = k + 1
    shrunk = cv2.resize(image.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    return np.round(255 * np.clip(shrunk, 0, 1)).astype(np.uint8), front


def _frames(shapes: list[_Shape], states: list[list[State]], ground: np.ndarray, size: tuple[int, int]) -> Frames:
    drawn = [_drawn(shapes, now, ground, size) for now in states]
    scale = np.array(size, np.float32) / SIDE_PX
    motion, visible = [], []
    for now, then, (_, front), (_, front_then) in zip(states, states[1:], drawn, drawn[1:], strict=False):
        steps = np.array([(0, 0), *((b[0] - a[0], b[1] - a[1]) for a, b in zip(now, then, strict=True))], np.float32)
        motion.append(steps[front] * scale)
        at = np.round(np.stack(np.meshgrid(np.arange(size[0]), np.arange(size[1])), -1) + motion[-1]).astype(int)
        at = np.clip(at, 0, np.array(size) - 1)
        visible.append(front_then[at[..., 1], at[..., 0]] == front)
    return Frames(np.stack([image for image, _ in drawn]), np.stack(motion), np.stack(visible))


def shapes_clip(split: str, number: int, large: bool) -> Clip:
    """A function of split and number. large: whether with frames of 320 x 240 as well."""
    rng = generator("shapes", split, number)
    ground = rng.uniform(0, 1, 3) * 0.9
    radii = sorted(rng.choice(_RADII, rng.integers(1, 4), replace=False))
    shapes, states = [], []
    for radius in map(int, radii):
        colour = colorsys.hsv_to_rgb(rng.uniform(), rng.uniform(0.5, 1), rng.uniform(0.5, 1))
        if np.abs(np.array(colour) - ground).max() < 0.3:
            colour = tuple((np.array(colour) + 0.5) % 1)
        shapes.append(_Shape(str(rng.choice(_KINDS)), radius, int(rng.integers(1, 4)), colour))
        x, y = (int(v) for v in rng.integers(radius, SIDE_PX - radius, 2))
        states.append((x, y, *_DIRECTIONS[rng.integers(8)]))
    clip, bits, information = [states], [np.nan], [np.nan]
    for t in range(1, FRAMES):
        chances = [
            (_first_states if t == 1 else next_states)(s, shape) for s, shape in zip(states, shapes, strict=True)
        ]
        turned = [tuple(_DIRECTIONS[rng.integers(8)]) if rng.uniform() < TURN else s[2:] for s in states]
        states = [moved(s, d, shape) for s, d, shape in zip(states, turned, shapes, strict=True)]
        bits.append(sum(map(_entropy, chances)))
        information.append(-sum(float(np.log2(c[s])) for c, s in zip(chances, states, strict=True)))
        clip.append(states)
    facts = {"set": "shapes", "split": split, "number": number, "fps": FPS, "generator": VERSION, "assets": []}
    return Clip(
        _frames(shapes, clip, ground, (SIDE_PX, SIDE_PX)),
        _frames(shapes, clip, ground, LARGE_PX) if large else None,
        facts,
        np.array(bits, np.float32),
        np.array(information, np.float32),
    )
