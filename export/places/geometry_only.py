"""A stock of plain things made here: rooms for tests, without any package."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from export.people.props import box, cylinder, joined, sphere
from export.places.catalogue import Asset, Model
from export.places.mesh import Material, Part, part_of

_OWN = Asset("plain things", "maquette", "0.1.0", "Apache-2.0")


@dataclass(eq=False)
class PlainStock:
    """Boxes, cylinders and ellipsoids in each kind; textures of noise. Splits differ in sizes and colours."""

    split: str = "train"
    people: None = None

    def __post_init__(self) -> None:
        rng = np.random.default_rng(["train", "val", "test"].index(self.split))
        self.models, self._parts = [], {}
        for kind, low, high, count in (
            ("floor", 0.4, 1.2, 6), ("small", 0.08, 0.3, 6), ("wall", 0.2, 0.5, 2), ("ceiling", 0.2, 0.5, 1),
            ("large", 1.5, 3.0, 1),
        ):  # fmt: skip
            for k in range(count):
                size = tuple(map(float, rng.uniform(low, high, 3)))
                name = f"{self.split} {kind} {k}"
                model = Model(name, Path(), size, kind, "", 1.2 if kind == "wall" else 0.0, np.eye(3), _OWN)
                self.models.append(model)
                self._parts[name] = _shape(k % 3, size, rng)

    def of_kind(self, *kinds: str) -> list[Model]:
        return [m for m in self.models if m.kind in kinds]

    def parts(self, model: Model) -> tuple[Part, ...]:
        return self._parts[model.name]

    def tile(self, rng: np.random.Generator, wanted: str) -> tuple[np.ndarray, Asset]:
        return rng.integers(60, 220, (64, 64, 3), dtype=np.uint8), _OWN

    def photo(self, rng: np.random.Generator) -> tuple[np.ndarray, Asset]:
        return np.repeat(np.repeat(rng.integers(0, 255, (9, 12, 3), dtype=np.uint8), 16, 0), 16, 1), _OWN

    def panorama(self, rng: np.random.Generator) -> tuple[np.ndarray, Asset]:
        rows = np.linspace(1.2, 0.2, 32)[:, None, None]
        sky = (rows * rng.uniform(0.5, 1, 3) * np.ones((32, 64, 1))).astype(np.float32)
        sky[6:9, 20:23] = 40
        return sky, _OWN


def _shape(kind: int, size: tuple[float, float, float], rng: np.random.Generator) -> tuple[Part, ...]:
    w, d, h = size
    material = Material(colour=tuple(map(float, rng.uniform(0.2, 1, 3))), specular=0.3)
    if kind == 0:
        return (part_of(box((w, d, h), (0, 0, h / 2)), material),)
    if kind == 1:
        foot = box((w, d, h * 0.2), (0, 0, h * 0.1))
        return (part_of(joined(foot, cylinder(min(w, d) / 3, h * 0.8, (0, 0, h * 0.6))), material, smooth=True),)
    return (part_of(sphere((w / 2, d / 2, h / 2), (0, 0, h / 2), rings=16, sides=24), material, smooth=True),)
