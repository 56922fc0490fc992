"""Writes data/tiny_head: a small prior of heads with random numbers, and what numpy reads in it.

`priors/<format>.maqp`: with bases in float32, float16 and int8; `priors/<format>.f32`, little-endian floats: each layer
of the head with codes SHAPE_CODES and COLOUR_CODES (weights, bias), sharpness, cut (point, normal), bounds (min, max),
anchors (template points, mean, linear, sigma), template points of the places.

    python -m tests.native.generate.make_tiny_head
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from export.heads.prior import combined
from export.heads.prior_file import FORMATS, read_prior, write_prior
from tests.python.support.small_prior import small_prior

FOLDER = Path(__file__).parents[1] / "data" / "tiny_head"
SHAPE_CODES, COLOUR_CODES = (0.5, -1.25, 2.0), (-0.75, 1.5)


def write_priors(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name in FORMATS:
        path = folder / f"{name}.maqp"
        write_prior(small_prior(), path, bases=name, constant="float32" if name == "float32" else "float16")
        prior = read_prior(path)
        layers = combined(prior, np.array(SHAPE_CODES), np.array(COLOUR_CODES))
        arrays = [array for layer in layers for array in (layer.weights, layer.bias)]
        arrays += [np.array([prior.sharpness]), prior.cut_point, prior.cut_normal, prior.bounds_min, prior.bounds_max]
        arrays += [prior.template_points, prior.anchor_mean, prior.anchor_linear, prior.anchor_sigma]
        arrays += list(prior.places.values())
        np.concatenate([array.ravel() for array in arrays]).astype("<f4").tofile(path.with_suffix(".f32"))


def main() -> None:
    write_priors(FOLDER / "priors")


if __name__ == "__main__":
    main()
