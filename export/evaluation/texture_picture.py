"""Draws the texture of the first person of a clip, and a photo whose people wear it.

python -m export.evaluation.texture_picture --clip tests/media/clip.mp4 --photo tests/media/photo.jpg
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import cv2
import maquette
import numpy as np

HEIGHT_PX = 384
SQUARE_PX = 8  # of the chequered ground where no frame showed the surface


def texture_of(clip: Path, densepose: maquette.DensePose) -> tuple[np.ndarray, np.ndarray]:
    """A frame in the middle of the clip, RGB, and the texture of the person with id 1, RGBA."""
    texture, frames = maquette.DensePoseTexture(), []
    with maquette.Source(clip) as source:
        for frame in source:
            result = densepose.run(frame)
            for index, person in enumerate(result.people):
                if person.id == 1:
                    texture.add_person(result, index, frame)
            frames.append(frame.pixels())
    return frames[len(frames) // 2], texture.draw()


def on_squares(rgba: np.ndarray) -> np.ndarray:
    """An RGBA image [H, W, 4] over chequered grey, RGB."""
    y, x = np.indices(rgba.shape[:2]) // SQUARE_PX
    ground = np.where((y + x) % 2, 200, 235)[..., None]
    alpha = rgba[..., 3:] / 255
    return np.round(rgba[..., :3] * alpha + ground * (1 - alpha)).astype(np.uint8)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clip", type=Path)
    parser.add_argument("--out", type=Path, default=Path("docs/images/texture.jpg"))
    options = parser.parse_args()
    frame, texture = texture_of(options.clip, maquette.DensePose())
    images = [frame, on_squares(texture)]
    scaled = [
        cv2.resize(i, (round(i.shape[1] * HEIGHT_PX / i.shape[0]), HEIGHT_PX), interpolation=cv2.INTER_AREA)
        for i in images
    ]
    cv2.imwrite(str(options.out), np.hstack(scaled)[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 88])
    print(f"Written: {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
