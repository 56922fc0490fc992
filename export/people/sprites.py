"""Draws the walking people that the SDK's `stub:people` source shows: one sheet of RGBA tiles.

    python -m export.people.sprites --out sdk/assets/stub/people.jpg                      # other people than now
    python -m export.people.sprites --sheet SHEET --out sdk/assets/stub/people.jpg        # a sheet drawn before

Rows are people of the test split, columns the frames of one walk cycle; a tile is 128 x 256 pixels, feet near
its lower edge, the person walking towards the right. Who is drawn follows from the wardrobe and the bodies as they are
today; the people of sdk/assets are older than some of both, so they were packed from their sheet (commit 2b41f01,
sdk/assets/stub_people.webp).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from export.camera import Camera
from export.people import assets, motion
from export.people.render import Light, Person
from export.people.scene import Studio
from export.people.sprite_files import write_sheet
from export.people.wardrobe import dress

TILE_WIDTH, TILE_HEIGHT, PEOPLE, FRAMES = 128, 256, 4, 16


def walk_cycle(count: int) -> list[motion.Pose]:
    """`count` poses of one closed cycle of the walking clip."""
    root, chest, limbs = motion.bullet_clip(assets.bullet_motions() / "humanoid3d_walk.txt")
    # The cycle's length is where the limbs come back closest to where they started.
    apart = [np.abs(limbs[: len(limbs) - n] - limbs[n:]).mean() for n in range(20, len(limbs) - 1)]
    period = 20 + int(np.argmin(apart))
    picked = [round(k * period / count) for k in range(count)]
    return [motion.Pose(root[k], chest[k], chest[k], limbs[k]) for k in picked]


def drawn_sheet(places: Path) -> np.ndarray:
    """Four people, 16 frames each: rows x columns x (blue, green, red, alpha)."""
    studio = Studio("test", TILE_WIDTH, TILE_HEIGHT, places, points=False)
    up = np.array([0, -1.0, 0])
    light = Light(
        up,
        np.full(3, 0.6),
        np.full(3, 0.4),
        np.array([[-0.4, -0.7, -0.6], [0.9, 0, -0.4]]),
        np.array([[0.6] * 3, [0.2] * 3]),
    )
    focal = 900.0
    look = np.array([[1, 0, 0], [0, 0, -1], [0, 1.0, 0]])
    cycle, rows = walk_cycle(FRAMES), []
    for number in range(PEOPLE):
        shape = studio.shape(number + 3)
        layers = dress(studio.model, studio.fabrics, np.random.default_rng([8, number]))
        turn = Rotation.from_euler("z", 50 + 8 * number, degrees=True).as_matrix()
        tall = float(shape.vertices[studio.body.groups["body"], 2].max())
        distance = focal * tall * 1.06 / TILE_HEIGHT
        eye = np.array([0, -distance, 0.51 * tall])
        camera = Camera.centred(TILE_WIDTH, TILE_HEIGHT, focal, look, eye)
        tiles = []
        for pose in cycle:
            # One stream of random numbers a person keeps hands, feet and fabric still from frame to frame.
            vertices = motion.posed(studio.body, shape, pose, np.random.default_rng([9, number])) @ turn.T
            body = vertices[studio.body.groups["body"]]
            vertices = vertices - [*body[:, :2].mean(0), body[:, 2].min()]
            picture = studio.renderer.draw(
                [Person(vertices, layers)], camera, light, np.random.default_rng([10, number])
            )
            colour = picture.rgb[..., ::-1] / np.maximum(picture.alpha, 1e-3)[..., None]
            tiles.append(np.dstack([np.clip(colour, 0, 255), picture.alpha * 255]).astype(np.uint8))
        rows.append(np.concatenate(tiles, 1))
    return np.concatenate(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("sdk/assets/stub/people.jpg"), help="the mask goes beside it")
    parser.add_argument("--sheet", type=Path, help="an image of the tiles with alpha, instead of drawing some")
    parser.add_argument("--quality", type=int, default=71, help="of the JPEG")
    parser.add_argument("--places", type=Path, default=Path(".data"), help="folder of backgrounds and panoramas")
    options = parser.parse_args()
    if options.sheet is None:
        sheet = drawn_sheet(options.places)
    else:
        sheet = cv2.imread(str(options.sheet), cv2.IMREAD_UNCHANGED)
        if sheet is None or sheet.shape != (PEOPLE * TILE_HEIGHT, FRAMES * TILE_WIDTH, 4):
            parser.error(f"{options.sheet} is no image of {FRAMES * TILE_WIDTH} x {PEOPLE * TILE_HEIGHT} with alpha.")
    size_bytes = write_sheet(sheet, options.out, options.quality)
    print(f"wrote {options.out} and its mask, {size_bytes} bytes")


if __name__ == "__main__":
    main()
