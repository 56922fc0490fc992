"""How far the places with a name are from the true ones, beside how far they say that they may be (`sigma_m`).

    python -m benchmarks.heads.alone.landmarks --heads 10

Of made test heads, one photo each in random light, camera unknown, no fit to the pixels. Size and place of the head,
which no photo tells, are taken out: the fitted places are scaled and moved to where they are nearest to the true ones.
Errors by their sigma should be 1 (root mean square over coordinates), and 95 % of them below 2.
"""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from maquette import HeadBuilder, MaquetteError
from scipy.spatial import cKDTree

from benchmarks.heads.drawing import GREY
from benchmarks.heads.quality import BUNDLE
from benchmarks.heads.tables import table
from export.heads.made_heads import make_head, make_maker
from export.heads.prior_file import read_prior
from export.heads.sampling import look_at, sample_extras, sample_lamps
from export.heads.surface import Head
from export.heads.views import HeadViews

SIDE_PX, FRAME_DM = 320, 3.6
MM_PER_M, MM_PER_DM = 1000, 100


def photo_of(head: Head, rng: np.random.Generator) -> tuple[np.ndarray, tuple[int, int, int, int]]:
    """RGB uint8 [H, W, 3], and the head's box."""
    views, distance = HeadViews(head, sample_extras(rng)), rng.uniform(5, 15)
    yaw, pitch = rng.uniform(-0.6, 0.6), rng.uniform(-0.2, 0.2)
    focal = SIDE_PX * distance / FRAME_DM
    camera = look_at(yaw, pitch, 0, distance, np.array([0, 0, -0.1]), focal, SIDE_PX)
    seen = views.seen(camera, sample_lamps(rng))
    y, x = np.nonzero(seen.mask)
    rgb = np.where(seen.present[..., None], seen.rgb, GREY).clip(0, 255).astype(np.uint8)
    return rgb, (x.min(), y.min(), x.max() + 1, y.max() + 1)


def measure_places(
    builder: HeadBuilder, head: Head, places: dict[str, Sequence[float]], rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Errors [N, 3] and sigmas [N], mm. places: on the template head, dm. Raises MaquetteError."""
    rgb, box = photo_of(head, rng)
    builder.clear()
    builder.add_photo(rgb, box)
    with builder.fit(0) as fitted:
        found = [fitted.landmark(name) for name in places]
    nearest = cKDTree(head.template_points).query(np.array(list(places.values())))[1]
    true = MM_PER_DM * head.positions[nearest].astype(np.float64)
    own = MM_PER_M * np.stack([place.point_m for place in found])
    true, own = true - true.mean(0), own - own.mean(0)
    scale = (own * true).sum() / (own * own).sum()
    return scale * own - true, scale * MM_PER_M * np.array([place.sigma_m for place in found])


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--heads", type=int, default=10)
    parser.add_argument("--bundle", type=Path, default=BUNDLE, help=f"default: {BUNDLE}")
    options = parser.parse_args(arguments)
    maker, places = make_maker(), read_prior(options.bundle / "prior.maqp").places
    rows = []
    with HeadBuilder(options.bundle) as builder:
        for number in range(options.heads):
            rng = np.random.default_rng([zlib.crc32(b"heads-landmarks"), number])
            try:
                rows.append(measure_places(builder, make_head(maker, "test", number), places, rng))
            except MaquetteError as error:
                print(f"Head {number} is left out: {error}")
    errors, sigmas = (np.stack(column) for column in zip(*rows, strict=True))
    lines = [
        [name, f"{np.sqrt(np.mean(errors[:, k] ** 2)):.1f}", f"{sigmas[:, k].mean():.1f}"]
        for k, name in enumerate(places)
    ]
    print(table(("place", "error a coordinate, mm", "sigma, mm"), lines))
    by_sigma = np.abs(errors) / sigmas[..., None]
    print(
        f"{len(rows)} heads: errors by sigma {np.sqrt(np.mean(by_sigma**2)):.2f}; below 2: {np.mean(by_sigma < 2):.0%}."
    )


if __name__ == "__main__":
    main()
