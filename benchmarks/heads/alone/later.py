"""Photos that are added to a saved head, one after the other, beside the same photos all at once.

    python -m benchmarks.heads.alone.later --heads 6 --split val

Of made heads: the photo from the front, then those from both sides; whole heads and faces against the true ones.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from maquette import Head, HeadBuilder

from benchmarks.heads.distances import measure
from benchmarks.heads.fitted import triangles_of
from benchmarks.heads.mean_head import read_mean_head
from benchmarks.heads.photos import Photo, PhotoBackgrounds, read_made_heads
from benchmarks.heads.quality import BUNDLE, DATA, add_photos, photos_of
from benchmarks.heads.tables import table
from export.heads.made_heads import make_maker

NAMES = ("mean head", "front", "all three at once", "front, then both sides", "one after the other", "both sides alone")


def fitted(builder: HeadBuilder, photos: Sequence[Photo], seconds: float, earlier: Head | None = None) -> Head:
    """As it is after a file."""
    add_photos(builder, photos, known_focal=False)
    if earlier is not None:
        builder.add_head(earlier)
    with builder.fit(seconds) as head, tempfile.TemporaryDirectory() as folder:
        head.save(Path(folder) / "a.maqh")
        return Head.open(Path(folder) / "a.maqh")


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--heads", type=int, default=12)
    parser.add_argument("--split", choices=("val", "test"), default="test")
    parser.add_argument("--seconds", type=float, default=0)
    parser.add_argument("--data", type=Path, default=DATA, help=f"views and points; default: {DATA}")
    parser.add_argument("--backgrounds", type=Path, default=Path(".data/backgrounds"), help="with a folder a split")
    parser.add_argument("--bundle", type=Path, default=BUNDLE, help=f"default: {BUNDLE}")
    options = parser.parse_args(arguments)
    mean, backgrounds = read_mean_head(options.bundle), PhotoBackgrounds(options.backgrounds / options.split)
    rows = []
    with HeadBuilder(options.bundle) as builder:
        for truth in read_made_heads(options.data, options.heads, make_maker(), options.split):
            numbers = truth.front_and_sides()
            if numbers is None:
                continue
            front, *sides = photos_of(truth, numbers, backgrounds)
            first = fitted(builder, [front], options.seconds)
            second = fitted(builder, sides[:1], options.seconds, first)
            heads = [
                first,
                fitted(builder, [front, *sides], options.seconds),
                fitted(builder, sides, options.seconds, first),
                fitted(builder, sides[1:], options.seconds, second),
                fitted(builder, sides, options.seconds),
            ]
            found = [measure(mesh, truth.true) for mesh in (mean, *(triangles_of(head.mesh("all")) for head in heads))]
            rows.append([[of.face_mm, of.head_mm] for of in found])
            print(truth.name, *(f"{face:.2f} {head:.2f}" for face, head in rows[-1]), flush=True)
    means = np.mean(rows, 0)
    lines = [
        [name, f"{face:.2f}", f"{face / means[0, 0]:.2f}", f"{head:.2f}", f"{head / means[0, 1]:.2f}"]
        for name, (face, head) in zip(NAMES, means, strict=True)
    ]
    print(table((f"{len(rows)} heads", "face, mm", "by mean head", "head, mm", "by mean head"), lines))


if __name__ == "__main__":
    main()
