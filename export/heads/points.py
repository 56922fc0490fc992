"""Points of made heads for the prior: signed distances, colours and template points, one file a head.

    python -m export.heads.points train --count 600 --out .data/heads/points

Everything of head k of a split depends on split and k alone. Existing files are kept, so it resumes by itself.
"""

from __future__ import annotations

import argparse
import zlib
from dataclasses import dataclass, fields
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from export.heads.shapes import DOMAIN, HeadShapes
from export.heads.surface import Head, HeadMaker
from export.heads.views import sample_lamps
from export.people import assets

SPLITS = ("train", "val", "test")
SURFACE, NEAR, FAR = 8000, 10000, 3000
NEAR_SIGMA = (0.03, 0.15)  # dm, half of the near points each


@dataclass(frozen=True)
class HeadPoints:
    """surface, normal, template: float32 [S, 3], dm; colour: uint8 [S, 3], RGB under the head's light.
    near: float32 [N, 3] and near_distance [N], dm; far and far_distance the same. vertices: float32 [V, 3], dm; visible
    [V, 3]: those under hair replaced by the hair's surface above."""

    surface: np.ndarray
    normal: np.ndarray
    template: np.ndarray
    colour: np.ndarray
    near: np.ndarray
    near_distance: np.ndarray
    far: np.ndarray
    far_distance: np.ndarray
    vertices: np.ndarray
    visible: np.ndarray


def make_maker() -> HeadMaker:
    return HeadMaker(HeadShapes(), cv2.imread(str(assets.skin_texture()))[..., ::-1])


def generator(split: str, number: int) -> np.random.Generator:
    """Of head `number` of a split."""
    return np.random.default_rng([zlib.crc32(f"heads-1/{split}".encode()), number])


def make_head(maker: HeadMaker, split: str, number: int) -> Head:
    rng = generator(split, number)
    return maker.make(maker.shapes.sample(rng), rng)


def points_of(head: Head, rng: np.random.Generator) -> HeadPoints:
    """Draws the points of a head."""
    place = head.samples(SURFACE, rng)
    surface, normal = head.points_at(place), head.normals_at(place)
    colour = np.clip(head.colours_at(place) * sample_lamps(rng).on(normal), 0, 255).astype(np.uint8)
    start = head.points_at(head.samples(NEAR, rng))
    near = start + rng.normal(size=start.shape) * np.repeat(NEAR_SIGMA, NEAR // 2)[:, None]
    far = rng.uniform(-DOMAIN, DOMAIN, (FAR, 3))
    single, own = np.float32, head.maker.shapes.head_vertices
    return HeadPoints(
        surface.astype(single), normal.astype(single), head.template_at(place).astype(single), colour,
        near.astype(single), head.distances(near)[0].astype(single),
        far.astype(single), head.distances(far)[0].astype(single),
        head.vertices[:own].astype(single), head.visible_vertices()[:own].astype(single),
    )  # fmt: skip


def read_points(folder: Path, split: str) -> list[HeadPoints]:
    """All heads of a split that are there, in their order."""
    paths = sorted((folder / split).glob("head-*.npz"))
    if not paths:
        raise FileNotFoundError(f"{folder / split} holds no heads: run `python -m export.heads.points {split}` first")
    out = []
    for path in paths:
        with np.load(path) as stored:
            out.append(HeadPoints(**{f.name: stored[f.name] for f in fields(HeadPoints)}))
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("split", choices=SPLITS)
    parser.add_argument("--count", type=int, default=600)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path(".data/heads/points"))
    arguments = parser.parse_args()
    folder = arguments.out / arguments.split
    folder.mkdir(parents=True, exist_ok=True)
    maker = make_maker()
    for number in tqdm(range(arguments.first, arguments.first + arguments.count), unit="head"):
        path = folder / f"head-{number:05}.npz"
        if path.exists():
            continue
        head = make_head(maker, arguments.split, number)
        points = points_of(head, np.random.default_rng([zlib.crc32(b"points"), number]))
        part = path.with_suffix(".part.npz")
        np.savez(part, **{f.name: getattr(points, f.name) for f in fields(points)})
        part.rename(path)


if __name__ == "__main__":
    main()
