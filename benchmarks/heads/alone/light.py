"""How much of a photo's light is left in a head's texture, with `texture_unlit` and without.

    python -m benchmarks.heads.alone.light --heads 12

Of made test heads, one photo each in light that is drawn at random, known camera, no fit to the pixels. The texture, as
the photo's camera sees it, beside the head's own colours without light from there: root mean square difference over the
pixels that show both, in grey levels, after the gain of each channel that makes it least. The photo itself has as much
light as there can be.
"""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean

import cv2
import numpy as np
from maquette import HeadBuilder

from benchmarks.heads.drawing import GREY, DrawnMesh
from benchmarks.heads.fitted import cameras_of
from benchmarks.heads.quality import BUNDLE
from benchmarks.heads.tables import table
from export.heads.made_heads import make_head, make_maker
from export.heads.sampling import Lamps, look_at, sample_extras, sample_lamps
from export.heads.surface import HeadMaker
from export.heads.views import HeadViews

SIDE_PX, TEXTURE_PX = 200, 512
DISTANCE_DM, FRAME_DM = 8.0, 3.6
MAX_YAW = 0.5
EDGE_PX = 4  # nothing is compared so near the border of either
EVEN = Lamps(np.ones(3), np.array([[0.0, -1, 0]]), np.zeros((1, 3)), gloss=0.0)


def left_over(found: np.ndarray, own: np.ndarray) -> float:
    """found, own: RGB [N, 3]; the difference after a gain of each channel."""
    found, own = found.astype(np.float64), own.astype(np.float64)
    gain = (found * own).sum(0) / np.maximum((found * found).sum(0), 1e-9)
    return float(np.sqrt(np.mean((gain * found - own) ** 2)))


def measure_light(maker: HeadMaker, builders: Sequence[HeadBuilder], number: int) -> list[float]:
    """Of the photo, then of each builder's texture."""
    rng = np.random.default_rng([zlib.crc32(b"heads-light"), number])
    views = HeadViews(make_head(maker, "test", number), sample_extras(rng))
    focal = SIDE_PX * DISTANCE_DM / FRAME_DM
    camera = look_at(rng.uniform(-MAX_YAW, MAX_YAW), 0.1, 0.0, DISTANCE_DM, np.array([0, 0, -0.1]), focal, SIDE_PX)
    photo, own = views.seen(camera, sample_lamps(rng)), views.seen(camera, EVEN)
    rgb = np.where(photo.present[..., None], photo.rgb, GREY).clip(0, 255).round().astype(np.uint8)
    y, x = np.nonzero(photo.mask)
    box = (x.min(), y.min(), x.max() + 1, y.max() + 1)
    pictures, shown = [rgb], photo.mask
    for builder in builders:
        builder.clear()
        builder.add_photo(rgb, box, focal_px=focal)
        with builder.fit(0) as head:
            drawn, present = DrawnMesh.of(head.mesh(cell_m=0.003)).shown(cameras_of(head)[0])
        pictures.append(drawn)
        shown = shown & present
    inside = cv2.erode(shown.astype(np.uint8), np.ones((2 * EDGE_PX + 1, 2 * EDGE_PX + 1), np.uint8)) > 0
    return [left_over(picture[inside], own.rgb[inside]) for picture in pictures]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--heads", type=int, default=12)
    parser.add_argument("--bundle", type=Path, default=BUNDLE, help=f"default: {BUNDLE}")
    options = parser.parse_args(arguments)
    maker = make_maker()
    with (
        HeadBuilder(options.bundle, texture_px=TEXTURE_PX) as lit,
        HeadBuilder(options.bundle, texture_px=TEXTURE_PX, texture_unlit=1) as unlit,
    ):
        rows = [measure_light(maker, (lit, unlit), number) for number in range(options.heads)]
    names = ("the photo", "texture", "texture_unlit")
    lines = [[name, f"{fmean(column):.1f}"] for name, column in zip(names, zip(*rows, strict=True), strict=True)]
    print(table(("", "grey levels"), lines))
    print(f"Less with texture_unlit than without: {sum(row[2] < row[1] for row in rows)} of {len(rows)} heads.")


if __name__ == "__main__":
    main()
