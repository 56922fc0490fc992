"""Points of made heads for the prior: signed distances, colours and template points, one file a head.

    python -m export.heads.points train --count 600 --out .data/heads/points

Everything of head k of a split depends on split and k alone. Existing files are kept, so it resumes by itself.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from export.heads.head_shards import HeadPoints
from export.heads.sampling import sample_lamps
from export.heads.shapes import DOMAIN
from export.heads.surface import Head
from export.heads.synthetic_heads import shard_parser, write_shards

SURFACE, NEAR, FAR = 8000, 10000, 3000
NEAR_SIGMA = (0.03, 0.15)  # dm, half of the near points each


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


def main() -> None:
    arguments = shard_parser(__doc__, Path(".data/heads/points")).parse_args()
    write_shards(arguments, "points", points_of)


if __name__ == "__main__":
    main()
