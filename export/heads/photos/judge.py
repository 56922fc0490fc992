"""How far an encoder's template points lie from the face teacher's, on faces of held-out photos.

    python -m export.heads.photos.judge --encoder .data/runs/heads-encoder/weights.pt --split val --sheet faces.png

The sheet shows each crop; the points where the teacher sees them, as bright as they weigh; the encoder's template
points there in the same colours; its own points and matte all over; and lines from where the teacher sees each point to
where the encoder does, ten times as long in the millimetres of the template (x and z).
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch

from export.heads.encoder import (
    CELL_PX,
    CELLS,
    CROP_PX,
    MATTE,
    POINT,
    UNKNOWN_MATTE,
    at_pixels,
    load_encoder,
    photo_metrics,
    run_encoder,
)
from export.heads.encoder_data import placing
from export.heads.photos.faces import HEAD, NOTHING, SPLITS, UNKNOWN, PhotoFaces, read_photos

_GREY = 127
_ZOOM = 2
_DRAWN_PX = 100.0  # a dm of error


@dataclass(frozen=True)
class PhotoCrop:
    """image uint8 RGB [192, 192, 3]; pixel float32 [P, 2] of the crop, where `template` float32 [P, 3] (dm) is seen;
    weight float32 [P]; matte float32 [48, 48], -1 where unknown."""

    image: np.ndarray
    pixel: np.ndarray
    template: np.ndarray
    weight: np.ndarray
    matte: np.ndarray


def crop_photo(faces: PhotoFaces, k: int) -> PhotoCrop:
    """A crop of face k and its head, upright in the middle."""
    place = placing(np.random.default_rng(0), False, faces.rgb.shape[1])
    nearest = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    matte = cv2.warpAffine(faces.matte[k], place.to_picture, (CROP_PX, CROP_PX), flags=nearest, borderValue=UNKNOWN)
    pixel = (faces.pixel[k] - place.to_picture[:, 2]) @ np.linalg.inv(place.linear).T
    inside = ((pixel >= 0) & (pixel <= CROP_PX - 1)).all(1)

    def cells(values: np.ndarray) -> np.ndarray:
        return values.astype(np.float32).reshape(CELLS, CELL_PX, CELLS, CELL_PX).mean((1, 3))

    known = cells((matte == HEAD) | (matte == NOTHING)) == 1
    return PhotoCrop(
        np.clip(place.cut(faces.rgb[k], cv2.BORDER_CONSTANT, (_GREY,) * 3), 0, 255).astype(np.uint8),
        pixel.astype(np.float32), faces.template.copy(), (faces.weight[k] * inside).astype(np.float32),
        np.where(known, cells(matte == HEAD), np.float32(UNKNOWN_MATTE)).astype(np.float32),
    )  # fmt: skip


def batched_photos(crops: list[PhotoCrop]) -> tuple[torch.Tensor, ...]:
    """image float32 [B, 192, 192, 3], pixel [B, P, 2], template [B, P, 3], weight [B, P], matte [B, 48, 48]."""
    columns = zip(*((c.image.astype(np.float32), c.pixel, c.template, c.weight, c.matte) for c in crops), strict=True)
    return tuple(torch.from_numpy(np.stack(column)) for column in columns)


def faces_of(folder: Path, split: str) -> list[PhotoCrop]:
    """Every face of the split."""
    return [crop_photo(f, k) for f in read_photos(folder, split) for k in range(len(f.rgb))]


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
    parser.add_argument("--sheet", type=Path, help="image to write; default: none")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    encoder, crops = load_encoder(arguments.encoder), faces_of(arguments.photos, arguments.split)
    answers = np.stack([run_encoder(encoder, crop.image) for crop in crops])
    labels = batched_photos(crops)[1:]
    every = photo_metrics(torch.from_numpy(answers), *labels)
    print(f"{len(crops)} faces: " + " ".join(f"{name}={value:.3g}" for name, value in every.items()))
    for k in range(len(crops)):
        one = photo_metrics(torch.from_numpy(answers[k : k + 1]), *(label[k : k + 1] for label in labels))
        print(f"  face {k}: mean {one['photo_mm']:.1f} mm, median {one['photo_median_mm']:.1f} mm")
    if arguments.sheet:
        sheet = np.vstack([row_of(crop, cells) for crop, cells in zip(crops, answers, strict=True)])
        cv2.imwrite(str(arguments.sheet), sheet[..., ::-1])


if __name__ == "__main__":
    main()
