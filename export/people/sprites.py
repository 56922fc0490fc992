"""Draws the walking people that the SDK's `stub:people` source shows: one sheet of RGBA tiles.

    python -m export.people.sprites --out sdk/assets/stub_people.webp

Rows are people of the test split, columns the frames of one walk cycle; a tile is 128 x 256 pixels, feet near
its lower edge, the person walking towards the right.
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("sdk/assets/stub_people.webp"))
    parser.add_argument("--places", type=Path, default=Path(".data"), help="folder of backgrounds and panoramas")
    options = parser.parse_args()
    studio = Studio("test", TILE_WIDTH, TILE_HEIGHT, options.places, points=False)
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
    options.out.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(options.out), np.concatenate(rows), [cv2.IMWRITE_WEBP_QUALITY, 80])
    print(f"wrote {options.out}, {options.out.stat().st_size} bytes")


if __name__ == "__main__":
    main()
