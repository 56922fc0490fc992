"""A stock whose every part is CC0 or drawn here, for places that are given away: furniture, textures by code.

Models are those of the split; what else a room needs (floors, images, the light around) is drawn from the same random
numbers as the rest. No people.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from export.places.assets import split_of
from export.places.catalogue import Asset, Model, family_of_model, load_models, parts_of
from export.places.mesh import Part
from export.places.rooms import checks, noise, planks

DRAWN = Asset("textures and pictures", "maquette", "0.1.0", "CC0-1.0", "drawn by export/places")


@dataclass(eq=False)
class FreeStock:
    """A stock like `catalogue.Stock`, without tiles, photographs, panoramas and people of packages."""

    split: str
    people: None = None
    models: list[Model] = field(init=False)

    def __post_init__(self) -> None:
        self.models = [m for m in load_models() if split_of(family_of_model(m.name)) == self.split]

    def of_kind(self, *kinds: str) -> list[Model]:
        return [m for m in self.models if m.kind in kinds]

    def parts(self, model: Model) -> tuple[Part, ...]:
        return parts_of(model)

    def tile(self, rng: np.random.Generator, wanted: str) -> tuple[np.ndarray, Asset]:
        draw = (planks, checks, bricks, weave)[rng.integers(4)]
        return draw(rng), DRAWN

    def photo(self, rng: np.random.Generator) -> tuple[np.ndarray, Asset]:
        return landscape(rng), DRAWN

    def panorama(self, rng: np.random.Generator) -> tuple[np.ndarray, Asset]:
        """A room around: brighter above, with windows on two sides. Radiance float32 [128, 256, 3]."""
        rows = np.linspace(0.9, 0.25, 128)[:, None, None] * (1 + rng.normal(0, 0.06, 3))
        room = (rows * np.ones((128, 256, 1))).astype(np.float32)
        for middle in rng.uniform(0, 256, 2):
            room[36:60, (np.arange(-14, 14) + int(middle)) % 256] = 3.0
        return cv2.GaussianBlur(room, (0, 0), 1.2), DRAWN


def bricks(rng: np.random.Generator, side: int = 512) -> np.ndarray:
    """Bricks, or long tiles: uint8 [side, side, 3], without a seam at its borders."""
    rows, columns = int(rng.integers(4, 9)) * 2, int(rng.integers(3, 6))
    y, x = np.mgrid[:side, :side] / side
    row = (y * rows).astype(int)
    along = x * columns + 0.5 * (row % 2)
    column = along.astype(int) % columns
    shade = rng.normal(1, 0.1, (rows, columns))[row, column]
    image = rng.uniform(110, 190) * np.array([1.15, 0.85, 0.7]) * rng.uniform(0.9, 1.1, 3) * shade[..., None]
    gap_px = 2.0
    across, down = np.abs(along - np.round(along)) / columns, np.abs(y - np.round(y * rows) / rows)
    image[(across * side < gap_px) | (down * side < gap_px)] = rng.uniform(170, 215)
    return np.clip(image * (noise(rng, 4, side) / 225.0), 0, 255).astype(np.uint8)


def weave(rng: np.random.Generator, side: int = 256) -> np.ndarray:
    """A carpet of two colours with a border in bands: uint8 [side, side, 3]."""
    one, two, three = rng.uniform(40, 230, (3, 3))
    y, x = np.mgrid[:side, :side] * (2 / side) - 1
    inwards = np.maximum(np.abs(x), np.abs(y))
    period = int(rng.integers(4, 9))
    diamonds = (np.abs((x * period) % 2 - 1) + np.abs((y * period) % 2 - 1)) < rng.uniform(0.6, 1.1)
    image = np.where(diamonds[..., None], one, two)
    image = np.where((inwards > 0.8)[..., None], three, image)
    image = np.where(((inwards > 0.86) & (inwards < 0.92))[..., None], one, image)
    thread = 1 + 0.05 * ((np.arange(side)[:, None] + np.arange(side)[None]) % 2)
    return np.clip(image * thread[..., None] * (noise(rng, 5, side) / 225.0), 0, 255).astype(np.uint8)


def landscape(rng: np.random.Generator, height: int = 360, width: int = 480) -> np.ndarray:
    """A painted view: sky, a sun, ranges of hills that fade with distance. uint8 [height, width, 3]."""
    y, x = np.mgrid[:height, :width].astype(np.float32)
    top, low = rng.uniform(60, 170, 3) + [0, 20, 70], rng.uniform(190, 250, 3)
    image = top + (low - top) * (y / height)[..., None]
    sun = rng.uniform(0.15, 0.85) * width, rng.uniform(0.1, 0.45) * height
    away = np.hypot(x - sun[0], y - sun[1]) / height
    image += 110 * np.exp(-((away / 0.16) ** 2))[..., None] * [1, 0.9, 0.6]
    image[away < 0.055] = [255, 246, 205]
    near = rng.uniform(20, 120, 3) * [0.8, 1.1, 0.8]
    ranges = int(rng.integers(3, 6))
    for k in range(ranges):
        share = (k + 1) / ranges
        ridge = (0.45 + 0.4 * share) * height * np.ones(width)
        for octave in range(1, 6):
            wave = 2 * np.pi * (octave**1.6) * x[0] / width * rng.uniform(0.6, 1.4) + rng.uniform(0, 2 * np.pi)
            ridge += 0.07 * height / octave * np.sin(wave)
        hill = (low * (1 - share) + near * share) * rng.uniform(0.9, 1.1)
        grain = 1 + 0.1 * np.sin(0.35 * x + 0.9 * y + 3 * np.sin(0.05 * x + k)) * share
        image = np.where((y > ridge)[..., None], hill * grain[..., None], image)
    return np.clip(image, 0, 255).astype(np.uint8)
