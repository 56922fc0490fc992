"""Pictures of made heads for the encoder, one file a head: colour, masks, template points, normals, cameras.

    python -m export.heads.view_shards train --count 600 --out .data/heads/views

Everything of head k of a split depends on split and k alone. Existing files are kept, so it resumes by itself. What is
behind the head is left to the encoder's training (`masks` says where), and so are cropping and what cameras do.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from export.camera import Camera
from export.heads.head_shards import CROP_SIDES, LABEL_STEP, POINT_SCALE, SIDE, HeadPictures
from export.heads.made_heads import shard_parser, write_shards
from export.heads.surface import Head
from export.heads.views import HeadViews, Seen, look_at, sample_extras, sample_lamps


def sample_camera(points: np.ndarray, rng: np.random.Generator) -> Camera:
    """Mostly of faces from the front and sides, from 35 cm to 3 m; the picture is a square around a head's points."""
    u = rng.random()
    yaw = rng.normal(0, 0.45) if u < 0.55 else rng.uniform(-1.9, 1.9) if u < 0.88 else rng.uniform(-np.pi, np.pi)
    pitch, roll = np.clip(rng.normal(0, 0.22), -0.8, 0.8), np.clip(rng.normal(0, 0.22), -0.9, 0.9)
    distance = float(np.exp(rng.uniform(np.log(3.5), np.log(30))))
    camera = look_at(yaw, pitch, roll, distance, np.zeros(3), 100.0, SIDE)
    pixels, _ = camera.projected(points)
    low, high = pixels.min(0), pixels.max(0)
    zoom = SIDE / (CROP_SIDES * (high - low).max() * rng.uniform(0.85, 1.15))
    # Crops are seldom in the middle of the photos that they are cut from: the principal point is wherever it is.
    middle = ((low + high) / 2 - camera.cx_px) * zoom + rng.normal(0, 0.04 * SIDE, 2)
    centre = (SIDE - 1) / 2 - middle
    intrinsics = np.array([[100.0 * zoom, 0, centre[0]], [0, 100.0 * zoom, centre[1]], [0, 0, 1]])
    return Camera.of_intrinsics(SIDE, SIDE, intrinsics, camera.rotation, camera.centre)


def pictures_of(head: Head, count: int, rng: np.random.Generator) -> HeadPictures:
    """Draws `count` pictures of a head, each in other light."""
    extras = sample_extras(rng)
    views = HeadViews(head, extras)
    rows: list[tuple] = []
    points = head.positions[np.unique(head.faces)]
    points = points[points[:, 2] > -1.6]
    for _ in range(count):
        camera = sample_camera(points, rng)
        rows.append(picture_row(views.seen(camera, sample_lamps(rng))))
    return HeadPictures(*(np.stack(column) for column in zip(*rows, strict=True)))


def picture_row(seen: Seen) -> tuple:
    """The fields of `HeadPictures` of one picture."""
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
    parser.add_argument("--views", type=int, default=16, help="pictures a head")
    arguments = parser.parse_args()
    write_shards(arguments, "views", lambda head, rng: pictures_of(head, arguments.views, rng))


if __name__ == "__main__":
    main()
