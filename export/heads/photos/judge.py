"""How far an encoder's template points lie from the face teacher's, on faces of held-out photos.

    python -m export.heads.photos.judge --encoder .data/runs/heads-encoder/weights.pt --split val --sheet faces.png

The sheet shows each crop; the points where the teacher sees them, as bright as they weigh; the encoder's template
points there in the same colours; its own points and matte all over; and lines from where the teacher sees each point to
where the encoder does, ten times as long in the millimetres of the template (x and z).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np
import torch

from export.heads.encoder import CROP_PX, MATTE, POINT, at_pixels, load_encoder, photo_figures, run_encoder
from export.heads.photos.crops import PhotoCrop, batched_photos, crop_photo
from export.heads.photos.faces import SPLITS, read_photos

_ZOOM = 2
_DRAWN_PX = 100.0  # a dm of error


def faces_of(folder: Path, split: str) -> list[PhotoCrop]:
    """Every face of the split, upright in the middle of its crop."""
    rng = np.random.default_rng(1)
    return [crop_photo(f, k, None, rng, augment=False) for f in read_photos(folder, split) for k in range(len(f.rgb))]


def coloured(points: np.ndarray) -> np.ndarray:
    """RGB of template points (dm), as the samples of the training show them."""
    return np.clip((points / 3 + 0.5) * 255, 0, 255)


def row_of(crop: PhotoCrop, cells: np.ndarray) -> np.ndarray:
    """One row of the sheet, RGB. cells: the encoder's answer [48, 48, 8]."""
    side = _ZOOM * CROP_PX
    image = cv2.resize(crop.image, (side, side), interpolation=cv2.INTER_LINEAR)
    found = at_pixels(torch.from_numpy(cells)[None], torch.from_numpy(crop.pixel)[None])[0, :, POINT].numpy()
    tiles = [image.copy() for _ in range(4)]
    for at, true, ours, weight in zip(crop.pixel, crop.template, found, crop.weight, strict=True):
        if weight < 0.1:
            continue
        start = np.round((at + 0.5) * _ZOOM).astype(int)
        for tile, point in ((tiles[1], true), (tiles[2], ours)):
            cv2.circle(tile, start.tolist(), 2, coloured(point).tolist(), -1)
        off = _DRAWN_PX * (ours - true)[[0, 2]] * [1, -1]
        cv2.line(tiles[3], start.tolist(), np.round(start + off).astype(int).tolist(), (255, 230, 0), 1, cv2.LINE_AA)
        cv2.circle(tiles[3], start.tolist(), 1, (0, 255, 0), -1)
    matte = (cells[..., MATTE] > 0)[..., None]
    dense = cv2.resize(
        (coloured(cells[..., POINT]) * matte).astype(np.uint8), (side, side), interpolation=cv2.INTER_NEAREST
    )
    return np.hstack([*tiles, dense])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--encoder", type=Path, default=Path(".data/runs/heads-encoder/weights.pt"))
    parser.add_argument("--photos", type=Path, default=Path(".data/heads/photos"))
    parser.add_argument("--split", choices=SPLITS, default="val")
    parser.add_argument("--sheet", type=Path, help="picture to write; default: none")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    encoder, crops = load_encoder(arguments.encoder), faces_of(arguments.photos, arguments.split)
    answers = np.stack([run_encoder(encoder, crop.image) for crop in crops])
    labels = batched_photos(crops)[1:]
    every = photo_figures(torch.from_numpy(answers), *labels)
    print(f"{len(crops)} faces: " + " ".join(f"{name}={value:.3g}" for name, value in every.items()))
    for k in range(len(crops)):
        one = photo_figures(torch.from_numpy(answers[k : k + 1]), *(label[k : k + 1] for label in labels))
        print(f"  face {k}: mean {one['photo_mm']:.1f} mm, median {one['photo_median_mm']:.1f} mm")
    if arguments.sheet:
        sheet = np.vstack([row_of(crop, cells) for crop, cells in zip(crops, answers, strict=True)])
        cv2.imwrite(str(arguments.sheet), sheet[..., ::-1])


if __name__ == "__main__":
    main()
