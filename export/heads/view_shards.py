"""Images of made heads for the encoder, one file a head: colour, masks, template points, normals, cameras.

    python -m export.heads.view_shards train --count 600 --out .data/heads/views

Everything of head k of a split depends on split and k alone. Existing files are kept, so it resumes by itself. What is
behind the head is left to the encoder's training (`masks` says where), and so are cropping and what cameras do.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from export.heads.head_shards import LABEL_STEP, POINT_SCALE, HeadImages
from export.heads.sampling import sample_camera, sample_extras, sample_lamps
from export.heads.surface import Head
from export.heads.synthetic_heads import shard_parser, write_shards
from export.heads.views import HeadViews, Seen


def images_of(head: Head, count: int, rng: np.random.Generator) -> HeadImages:
    """Draws `count` images of a head, each in other light."""
    extras = sample_extras(rng)
    views = HeadViews(head, extras)
    rows: list[tuple] = []
    points = head.positions[np.unique(head.faces)]
    points = points[points[:, 2] > -1.6]
    for _ in range(count):
        camera = sample_camera(points, rng)
        rows.append(image_row(views.seen(camera, sample_lamps(rng))))
    return HeadImages(*(np.stack(column) for column in zip(*rows, strict=True)))


def image_row(seen: Seen) -> tuple:
    """The fields of `HeadImages` of one image."""
    camera, step = seen.camera, slice(None, None, LABEL_STEP)
    masks = np.where(seen.mask, 255, np.where(seen.present, 128, 0)).astype(np.uint8)
    normal = (seen.normal[step, step] @ camera.rotation.T) * 127
    template = np.clip(seen.template[step, step] * POINT_SCALE, -32767, 32767)
    return (
        seen.rgb.round().astype(np.uint8), masks, template.round().astype(np.int16), normal.round().astype(np.int8),
        camera.rotation, camera.world_to_camera[:, 3], np.array([camera.fx_px, camera.cx_px, camera.cy_px]),
    )  # fmt: skip


def main() -> None:
    parser = shard_parser(__doc__, Path(".data/heads/views"))
    parser.add_argument("--views", type=int, default=16, help="images a head")
    arguments = parser.parse_args()
    write_shards(arguments, "views", lambda head, rng: images_of(head, arguments.views, rng))


if __name__ == "__main__":
    main()
