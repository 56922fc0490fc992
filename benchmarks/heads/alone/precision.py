"""What int8 loses, or any bundle beside another, in heads: one photo each, no fit to the pixels, the same photos.

    python -m benchmarks.heads.alone.precision --heads 16 --bundles .data/bundles/heads-fp32 sdk/models/heads-int8

Distances from the true heads, and how much larger they are than with the first bundle, with the standard error of this
mean: differences of the same photo vary far less than heads do. A photo that a bundle finds no head in is left out and
told.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from maquette import HeadBuilder, MaquetteError

from benchmarks.heads.distances import measure
from benchmarks.heads.fitted import triangles_of
from benchmarks.heads.photos import Photo, PhotoBackgrounds, TrueHead, read_made_heads
from benchmarks.heads.quality import BUNDLE, DATA, add_photos, photos_of
from benchmarks.heads.tables import table
from export.heads.made_heads import make_maker

CELL_M = 0.003  # of meshes: their error is far below that of heads


def photos(head: TrueHead, count: int, backgrounds: PhotoBackgrounds) -> list[Photo]:
    """From the front, then from the sides."""
    numbers = dict.fromkeys([head.front(), *(head.front_and_sides() or ())])
    return photos_of(head, [number for number in numbers if number is not None][:count], backgrounds)


def distances(builder: HeadBuilder, photo: Photo, head: TrueHead) -> list[float]:
    """Face and whole head, mm. Raises MaquetteError."""
    add_photos(builder, [photo], known_focal=False)
    with builder.fit(0) as found:
        away = measure(triangles_of(found.mesh(cell_m=CELL_M)), head.true)
    return [away.face_mm, away.head_mm]


def more(rows: np.ndarray) -> str:
    """rows [N]: mean difference with its standard error."""
    return f"{rows.mean():+.3f} ± {rows.std() / len(rows) ** 0.5:.3f}"


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--heads", type=int, default=16)
    parser.add_argument("--photos", type=int, default=3, help="of each head, at most 3, each by itself")
    parser.add_argument("--split", choices=("val", "test"), default="test")
    parser.add_argument("--data", type=Path, default=DATA, help=f"views and points; default: {DATA}")
    parser.add_argument("--backgrounds", type=Path, default=Path(".data/backgrounds"), help="with a folder a split")
    parser.add_argument("--bundles", type=Path, nargs="+", default=[Path(".data/bundles/heads-fp32"), BUNDLE])
    options = parser.parse_args(arguments)
    backgrounds = PhotoBackgrounds(options.backgrounds / options.split)
    builders, rows = [HeadBuilder(bundle, threads=1) for bundle in options.bundles], []
    for head in read_made_heads(options.data, options.heads, make_maker(), options.split):
        for photo in photos(head, options.photos, backgrounds):
            try:
                rows.append([distances(builder, photo, head) for builder in builders])
            except MaquetteError as error:
                print(f"A photo of {head.name} is left out: {error}")
    of = np.array(rows)  # photos, bundles, face and head
    lines = [
        [str(bundle), f"{of[:, k, 0].mean():.3f}", more(of[:, k, 0] - of[:, 0, 0]), f"{of[:, k, 1].mean():.3f}",
         more(of[:, k, 1] - of[:, 0, 1])]
        for k, bundle in enumerate(options.bundles)
    ]  # fmt: skip
    print(table((f"{len(rows)} photos", "face, mm", "more than the first", "head, mm", "more than the first"), lines))


if __name__ == "__main__":
    main()
