"""Clips `collages`: a camera pans, zooms and rolls over a photograph, before which pieces of other photographs move.

What `pushing` lacks: the colours and textures of real places, and cameras that move. Speeds drift at random, and a
third of the cameras and pieces stand still for a while. Photographs without people (`export.photos backgrounds`),
those of the split alone.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from export.clips.clip import FRAMES, LARGE_PX, SIDE_PX, Clip, Frames, generator

VERSION = "collages-1"
PHOTOGRAPHS = Path(".data/backgrounds")
_FPS = (10, 15, 30)
_PHOTO_PX = 256  # short side of photographs as they are used
_STILL = 0.35
_SAMPLES = 2  # a pixel and axis


@dataclass(frozen=True, eq=False)
class _Layer:
    """image uint8 [h, w, 3]; cover float32 [h, w], 0..1, or None: all; from_frame [T, 2, 3]: from the frame's plane
    (4 wide, 3 high, its middle at 0) to pixels of the image."""

    image: np.ndarray
    cover: np.ndarray | None
    from_frame: np.ndarray


@functools.lru_cache(maxsize=512)
def _photograph(path: Path) -> np.ndarray:
    image = cv2.imread(str(path))[..., ::-1]
    scale = _PHOTO_PX / min(image.shape[:2])
    return cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)


def _photographs(split: str) -> list[Path]:
    paths = sorted((PHOTOGRAPHS / split).glob("*.jpg"))
    if len(paths) < 2:
        raise FileNotFoundError(
            f"{PHOTOGRAPHS / split} has {len(paths)} photographs: python -m export.photos backgrounds"
        )
    return paths


def _drift(rng: np.random.Generator, size: float, fps: float) -> np.ndarray:
    """A place that moves with a speed that drifts, [T]: `size` is the typical way in a second."""
    if rng.uniform() < _STILL:
        return np.zeros(FRAMES)
    speed, at, found = rng.normal(0, size), 0.0, []
    keep = np.exp(-1 / (fps * rng.uniform(0.5, 4)))
    for _ in range(FRAMES):
        found.append(at)
        speed = keep * speed + np.sqrt(1 - keep**2) * rng.normal(0, size)
        at += speed / fps
    return np.array(found)


def _similarities(x: np.ndarray, y: np.ndarray, angle: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """[T, 2, 3] that turn and scale a plane, and then move 0 to (x, y)."""
    cosine, sine = scale * np.cos(angle), scale * np.sin(angle)
    return np.stack([np.stack([cosine, -sine, x], -1), np.stack([sine, cosine, y], -1)], 1)


def _ground(rng: np.random.Generator, photo: np.ndarray, fps: float) -> _Layer:
    high, wide = photo.shape[:2]
    scale = min(wide / 4, high / 3) * rng.uniform(0.35, 0.9) * np.exp(0.5 * _drift(rng, 0.3, fps))
    x = wide * rng.uniform(0.35, 0.65) + scale * _drift(rng, 1.2, fps)
    y = high * rng.uniform(0.35, 0.65) + scale * _drift(rng, 0.6, fps)
    angle = rng.normal(0, 0.1) + _drift(rng, 0.15, fps)
    return _Layer(photo, None, _similarities(x, y, angle, scale))


def _piece(rng: np.random.Generator, photo: np.ndarray, fps: float) -> _Layer:
    """An irregular blob of a photograph, between a twelfth and a half of the frame's height."""
    side = int(rng.integers(48, 160))
    y, x = (int(rng.integers(0, room - side + 1)) for room in photo.shape[:2])
    rows, columns = (np.indices((side, side)) - (side - 1) / 2) / (side / 2)
    angle = np.arctan2(rows, columns)
    rim = 0.6 + sum(
        rng.normal(0, 0.2 / k) * np.cos(k * angle + rng.uniform(0, 2 * np.pi)) for k in range(2, 6)
    )  # fmt: skip
    cover = np.clip((np.clip(rim, 0.25, 0.95) - np.hypot(rows, columns)) * side / 4, 0, 1).astype(np.float32)
    stretch = rng.uniform(0.5, 1.5) * rng.uniform(0.25, 1.5) / side  # of the plane, 3 high
    scale = (1 / stretch) * np.exp(0.4 * _drift(rng, 0.3, fps))
    spin = rng.uniform(0, 2 * np.pi) + _drift(rng, rng.choice((0.2, 1.5)), fps)
    at_x, at_y = rng.uniform(-2, 2) + _drift(rng, 2, fps), rng.uniform(-1.5, 1.5) + _drift(rng, 1.2, fps)
    turned = _similarities(np.zeros(FRAMES), np.zeros(FRAMES), spin, scale)
    moved = (side - 1) / 2 - np.einsum("tij,tj->ti", turned[:, :, :2], np.stack([at_x, at_y], -1))
    return _Layer(photo[y : y + side, x : x + side], cover, np.concatenate([turned[:, :, :2], moved[..., None]], 2))


def _from_pixels(size: tuple[int, int]) -> np.ndarray:
    """[3, 3]: pixels of a frame of that size to the frame's plane."""
    width, height = size
    return np.array([[4 / width, 0, 2 / width - 2], [0, 3 / height, 1.5 / height - 1.5], [0, 0, 1]])


def _warped(image: np.ndarray, matrix: np.ndarray, size: tuple[int, int], border: int) -> np.ndarray:
    return cv2.warpAffine(image, matrix, size, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderMode=border)


def _frame(layers: list[_Layer], t: int, light: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    fine = (size[0] * _SAMPLES, size[1] * _SAMPLES)
    grid = _from_pixels(fine)
    picture = _warped(layers[0].image, layers[0].from_frame[t] @ grid, fine, cv2.BORDER_REFLECT_101).astype(np.float32)
    for layer in layers[1:]:
        matrix = layer.from_frame[t] @ grid
        cover = _warped(layer.cover, matrix, fine, cv2.BORDER_CONSTANT)[..., None]
        picture += cover * (_warped(layer.image, matrix, fine, cv2.BORDER_REPLICATE) - picture)
    shrunk = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    return np.clip(np.round(shrunk * light[t]), 0, 255).astype(np.uint8)


def _front(layers: list[_Layer], t: int, at: np.ndarray) -> np.ndarray:
    """Number of the layer seen at places `at` [..., 2] of the frame's plane."""
    front = np.zeros(at.shape[:-1], np.uint8)
    for k, layer in enumerate(layers[1:], 1):
        x, y = np.moveaxis(at @ layer.from_frame[t][:, :2].T + layer.from_frame[t][:, 2], -1, 0)
        cover = cv2.remap(
            layer.cover, x.astype(np.float32), y.astype(np.float32), cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
        )  # fmt: skip
        front[cover > 0.5] = k
    return front


def _frames(layers: list[_Layer], light: np.ndarray, size: tuple[int, int]) -> Frames:
    rgb = np.stack([_frame(layers, t, light, size) for t in range(FRAMES)])
    grid = _from_pixels(size)
    pixels = np.stack(np.meshgrid(np.arange(size[0]), np.arange(size[1])), -1).astype(np.float64)
    plane = pixels @ grid[:2, :2].T + grid[:2, 2]
    motion, visible = [], []
    for t in range(FRAMES - 1):
        front = _front(layers, t, plane)
        then = np.empty_like(plane)
        for k, layer in enumerate(layers):
            image = plane @ layer.from_frame[t][:, :2].T + layer.from_frame[t][:, 2]
            back = np.linalg.inv(layer.from_frame[t + 1][:, :2])
            own = (image - layer.from_frame[t + 1][:, 2]) @ back.T
            then[front == k] = own[front == k]
        motion.append(((then - plane) / np.diag(grid)[:2]).astype(np.float32))
        inside = (np.abs(then) <= (2, 1.5)).all(-1)
        visible.append(inside & (_front(layers, t + 1, then) == front))
    return Frames(rgb, np.stack(motion), np.stack(visible))


def collages_clip(split: str, number: int, large: bool) -> Clip:
    """A function of split and number. large: whether with frames of 320 x 240 as well."""
    rng = generator("collages", split, number)
    paths, fps = _photographs(split), float(rng.choice(_FPS))
    chosen = [paths[k] for k in rng.choice(len(paths), min(rng.integers(1, 5), len(paths)), replace=False)]
    layers = [_ground(rng, _photograph(chosen[0]), fps)]
    layers += [_piece(rng, _photograph(path), fps) for path in chosen[1:]]
    light = np.exp(np.clip(_drift(rng, 0.15, fps), -0.7, 0.4))
    names = [path.stem for path in chosen]
    facts = {"set": "collages", "split": split, "number": number, "fps": fps, "generator": VERSION, "assets": names}
    small, whole = (
        _frames(layers, light, size) if wanted else None for size, wanted in (((SIDE_PX,) * 2, True), (LARGE_PX, large))
    )
    return Clip(small, whole, facts)
