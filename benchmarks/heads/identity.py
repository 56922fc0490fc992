"""Measures whether fitted heads are like the people in the photos: one photo each of test heads from scans.

    python -m benchmarks.heads.scanned_people
    python -m benchmarks.heads.identity --bundles sdk/models/heads-int8

Face: mean distance after alignment with scale, mm, and by the mean head's. Spread: how far faces differ between people
(root mean square of the template's vertices from their mean, each face aligned with scale), fitted and true. Right
person first: of 8 fitted heads, which are nearest to their own person. Pupils: error of their distance, mm.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from maquette import HeadBuilder, MaquetteError
from tqdm import tqdm

from benchmarks.heads.distances import MM_PER_DM, Triangles, TruePoints, aligned
from benchmarks.heads.fitted import triangles_of, z_up
from benchmarks.heads.mean_head import read_mean_head
from benchmarks.heads.photos import Photo, PhotoBackgrounds, TrueHead, generator, photo_of
from benchmarks.heads.quality import BACKGROUNDS, BUNDLE
from benchmarks.heads.tables import table
from export.heads.head_shards import is_face, read_pictures
from export.heads.scans.scanned_heads import similarity

GROUP = 8
MM_PER_M = 1000


@dataclass(frozen=True, eq=False)
class Person:
    """A test head; front [N, 3] mm: the template's vertices of the face; pupils_mm: their distance."""

    head: TrueHead
    front: np.ndarray
    pupils_mm: float

    def photo(self, view: int, backgrounds: PhotoBackgrounds) -> Photo:
        return photo_of(self.head.pictures, view, backgrounds, generator(self.head.name, view))


@dataclass(frozen=True, eq=False)
class Fitted:
    """A head of the library, mm; front: as of `Person`, other vertices."""

    mesh: Triangles
    front: np.ndarray
    pupils_mm: float


def read_people(folder: Path, count: int | None = None) -> list[Person]:
    people = []
    for path in sorted(folder.glob("scanned-*.npz"))[:count]:
        with np.load(path) as stored:
            points, face, front, pupils = (stored[name] for name in ("surface", "face", "front", "pupils"))
        true = TruePoints(points.astype(np.float64) * MM_PER_DM, face)
        distance = float(np.linalg.norm(pupils[0] - pupils[1]) * MM_PER_DM)
        people.append(Person(TrueHead(path.stem, read_pictures(path), true), front * MM_PER_DM, distance))
    if not people:
        raise FileNotFoundError(f"{folder} holds no heads: run `python -m benchmarks.heads.scanned_people` first")
    return people


def fit(builder: HeadBuilder, photo: Photo, seconds: float = 0) -> Fitted | None:
    """None: no head was found."""
    try:
        builder.clear()
        builder.add_photo(photo.rgb, photo.box)
        with builder.fit(seconds) as head:
            mesh, template = head.mesh("all"), head.mesh()
            eyes = [head.landmark(f"pupil_{side}").point_m for side in ("left", "right")]
    except MaquetteError:
        return None
    on_template = z_up(template.template_points_m) * 10
    front = z_up(template.positions_m)[is_face(on_template)] * MM_PER_M
    return Fitted(triangles_of(mesh), front, float(np.linalg.norm(eyes[0] - eyes[1]) * MM_PER_M))


def face_mm(mesh: Triangles, person: Person) -> float:
    points = person.head.true.points[person.head.true.is_face]
    return float(mesh.nearest(aligned(mesh, points)(points))[0].mean())


def spread_mm(fronts: Sequence[np.ndarray]) -> float:
    """How far faces [N, 3] of several people lie from their mean, each aligned to it with scale."""
    moved = np.stack(fronts)
    for _ in range(3):
        mean = moved.mean(0)
        moved = np.stack([similarity(face, mean) for face in moved])
    return float(np.sqrt(((moved - moved.mean(0)) ** 2).sum(-1).mean()))


def right_ones(fits: Sequence[Fitted], people: Sequence[Person]) -> tuple[int, float]:
    """How many of the fits are nearer to their own person than to all others, and the mean rank of the own one."""
    ranks = []
    for number, fitted in enumerate(fits):
        away = [face_mm(fitted.mesh, person) for person in people]
        ranks.append(1 + sum(other < away[number] for other in away))
    return ranks.count(1), float(np.mean(ranks))


def measure(bundle: Path, people: Sequence[Person], backgrounds: PhotoBackgrounds, view: int, seconds: float) -> dict:
    mean, pairs = read_mean_head(bundle), []
    with HeadBuilder(bundle, texture=False) as builder:
        for person in tqdm(people, unit="photo", disable=None):
            fitted = fit(builder, person.photo(view, backgrounds), seconds)
            if fitted:
                pairs.append((fitted, person))
    own = [face_mm(fitted.mesh, person) for fitted, person in pairs]
    of_mean = [face_mm(mean, person) for _, person in pairs]
    groups = [pairs[start : start + GROUP] for start in range(0, len(pairs) - GROUP + 1, GROUP)]
    firsts = [right_ones(*zip(*group, strict=True)) for group in groups]
    off = [abs(fitted.pupils_mm - person.pupils_mm) for fitted, person in pairs]
    return {
        "found": f"{len(pairs)} of {len(people)}", "face, mm": f"{np.mean(own):.2f}",
        "mean head": f"{np.mean(of_mean):.2f}", "ratio": f"{np.mean(own) / np.mean(of_mean):.2f}",
        "spread, mm": f"{spread_mm([fitted.front for fitted, _ in pairs]):.2f}",
        "true spread": f"{spread_mm([person.front for _, person in pairs]):.2f}",
        "right person first, of 8": ", ".join(str(count) for count, _ in firsts),
        "mean rank": f"{np.mean([rank for _, rank in firsts]):.1f}" if firsts else "",
        "pupils off by, mm": f"{np.mean(off):.1f}",
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(".data/heads/scanned"))
    parser.add_argument("--backgrounds", type=Path, default=BACKGROUNDS)
    parser.add_argument("--bundles", type=Path, nargs="+", default=[BUNDLE])
    parser.add_argument("--heads", type=int)
    parser.add_argument("--seconds", type=float, default=0)
    parser.add_argument("--view", type=int, default=0, help="0: from the front; 1: from 30 degrees")
    options = parser.parse_args()
    people, backgrounds = read_people(options.data, options.heads), PhotoBackgrounds(options.backgrounds)
    rows = [(path.name, measure(path, people, backgrounds, options.view, options.seconds)) for path in options.bundles]
    print(table(["bundle", *rows[0][1]], [[name, *row.values()] for name, row in rows]))


if __name__ == "__main__":
    main()
