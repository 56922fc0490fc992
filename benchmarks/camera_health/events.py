"""Puts an event into a film: a cut, a freeze, a black camera, a covered camera, a knocked camera, or an object."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

WIDTH_PX, HEIGHT_PX = 320, 240
MARGIN = 1.4  # films are this much larger than their window, so that a knocked camera has something to show
BEFORE, AFTER = 36, 30  # frames around the first frame of an event
KINDS = ("cut", "freeze", "black", "covered", "moved", "object")


@dataclass(frozen=True)
class Staged:
    """A film with an event. frames: BGR uint8 [T, 240, 320, 3]; `at`: index of the first frame of the event."""

    kind: str
    frames: np.ndarray
    at: int


def window(film: np.ndarray, x: float = 0, y: float = 0, degrees: float = 0) -> np.ndarray:
    """The middle of each frame [T, H, W, 3], moved by x, y pixels and turned: [T, 240, 320, 3]."""
    height, width = film.shape[1:3]
    turn = cv2.getRotationMatrix2D((width / 2, height / 2), degrees, 1)
    turn[:, 2] += ((WIDTH_PX - width) / 2 - x, (HEIGHT_PX - height) / 2 - y)
    return np.stack([cv2.warpAffine(frame, turn, (WIDTH_PX, HEIGHT_PX), borderMode=cv2.BORDER_REFLECT)
                     for frame in film])  # fmt: skip


def sensor_noise(random: np.random.Generator, frames: np.ndarray, sigma: float = 1.5) -> np.ndarray:
    return np.clip(frames + random.normal(0, sigma, frames.shape), 0, 255).astype(np.uint8)


def cut(film: np.ndarray, other: np.ndarray, at: int, random: np.random.Generator) -> np.ndarray:
    """Another film goes on from there."""
    return np.concatenate([film[:at], other[: len(film) - at]])


def freeze(film: np.ndarray, other: np.ndarray, at: int, random: np.random.Generator) -> np.ndarray:
    """The frame before is repeated for a second."""
    frozen = film.copy()
    frozen[at : at + 30] = film[at - 1]
    return frozen


def black(film: np.ndarray, other: np.ndarray, at: int, random: np.random.Generator) -> np.ndarray:
    """The camera shows black with noise; in half of the films after two dark frames."""
    dark = film.astype(np.float32)
    fading = int(random.integers(0, 2)) * 2
    dark[at + fading :] = random.choice([0, 8, 16])
    for i in range(fading):
        dark[at + i] *= 0.5 / (i + 1)
    return np.concatenate([film[:at], sensor_noise(random, dark[at:])])


def covered(film: np.ndarray, other: np.ndarray, at: int, random: np.random.Generator) -> np.ndarray:
    """A hand or cloth comes in from a side within 1 to 8 frames: blurred rim, hardly any texture, covering half of the
    frame to all of it."""
    share, steps = random.uniform(0.5, 1.15), int(random.integers(1, 9))
    colour = np.array(random.choice([[30, 30, 30], [90, 110, 160], [60, 60, 70], [120, 120, 125], [40, 50, 90]]))
    side = int(random.integers(0, 4))
    ramp = np.linspace(0, 1, WIDTH_PX if side < 2 else HEIGHT_PX, dtype=np.float32)
    ramp = np.broadcast_to(ramp if side < 2 else ramp[:, None], (HEIGHT_PX, WIDTH_PX))
    ramp = 1 - ramp if side % 2 else ramp
    shade = cv2.resize(random.uniform(0.8, 1.2, (3, 4)).astype(np.float32), (WIDTH_PX, HEIGHT_PX))[..., None]
    cover, covered_film = colour * shade, film.astype(np.float32)
    for i in range(at, len(film)):
        reach = share * min(1, (i - at + 1) / steps) + random.normal(0, 0.004)
        mask = np.clip((reach - ramp) / 0.12 + 0.5, 0, 1)[..., None]
        covered_film[i] = film[i] * (1 - mask) + cover * mask
    return np.concatenate([film[:at], sensor_noise(random, covered_film[at:])])


def moved(larger: np.ndarray, at: int, random: np.random.Generator) -> np.ndarray:
    """The camera is knocked within 1 to 4 frames and stays so: by an eighth to a fifth of the frame, with some roll and
    the blur of the movement."""
    angle, length = random.uniform(0, 2 * np.pi), random.uniform(0.125, 0.2) * WIDTH_PX
    x, y = np.clip(length * np.cos(angle), -62, 62), np.clip(length * np.sin(angle), -46, 46)
    roll, steps = random.uniform(-4, 4), int(random.integers(1, 5))
    frames = []
    for i, frame in enumerate(larger):
        share = min(1, max(0, (i - at + 1) / steps))
        before = min(1, max(0, (i - at) / steps))
        half = [window(frame[None], s * x, s * y, s * roll)[0] for s in np.linspace(before, share, 5)[2:]]
        frames.append(half[-1] if before == share or i == at + steps - 1 else np.mean(half, 0).astype(np.uint8))
    return np.stack(frames)


def with_object(film: np.ndarray, other: np.ndarray, at: int, random: np.random.Generator) -> np.ndarray:
    """A piece of another film appears, an ellipse of 5 to 15 % of the frame, and stays."""
    area = random.choice([0.05, 0.15]) * WIDTH_PX * HEIGHT_PX
    ratio = random.uniform(0.7, 1.4)
    a, b = np.sqrt(area / np.pi * ratio), np.sqrt(area / np.pi / ratio)
    x, y = random.uniform(a + 4, WIDTH_PX - a - 4), random.uniform(b + 4, HEIGHT_PX - b - 4)
    mask = np.zeros((HEIGHT_PX, WIDTH_PX), np.float32)
    cv2.ellipse(mask, (int(x), int(y)), (int(a), int(b)), 0, 0, 360, 1, -1)
    mask = cv2.GaussianBlur(mask, (0, 0), 1.5)[..., None]
    pasted = film[at:] * (1 - mask) + other[0] * mask
    return np.concatenate([film[:at], sensor_noise(random, pasted)])


def staged(kind: str, larger: np.ndarray, other: np.ndarray, seed: int) -> Staged:
    """The event in a part of a film. larger: BGR uint8 [BEFORE + AFTER, 336, 448, 3]; other: the same of another."""
    random = np.random.default_rng(seed)
    if kind == "moved":
        return Staged(kind, moved(larger, BEFORE, random), BEFORE)
    make = {"cut": cut, "freeze": freeze, "black": black, "covered": covered, "object": with_object}[kind]
    return Staged(kind, make(window(larger), window(other), BEFORE, random), BEFORE)
