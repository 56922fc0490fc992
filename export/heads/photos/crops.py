"""Training crops of real faces (`faces`), and batches that mix them with made heads."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import torch

from export.heads.encoder import CELL_PX, CELLS, CROP_PX
from export.heads.encoder_data import FACE_FRACTION, Backgrounds, CropStream, as_cameras_see, occluded, placing
from export.heads.photos.faces import HEAD, NOTHING, UNKNOWN, PhotoFaces

_GREY = 127
UNKNOWN_MATTE = -1.0


@dataclass(frozen=True)
class PhotoCrop:
    """image uint8 RGB [192, 192, 3]; pixel float32 [P, 2] of the crop, where `template` float32 [P, 3] (dm) is seen;
    weight float32 [P]; matte float32 [48, 48], -1 where unknown."""

    image: np.ndarray
    pixel: np.ndarray
    template: np.ndarray
    weight: np.ndarray
    matte: np.ndarray


def crop_photo(
    faces: PhotoFaces,
    k: int,
    backgrounds: Backgrounds | None,
    rng: np.random.Generator,
    augment: bool = True,
    of_face: bool = False,
) -> PhotoCrop:
    """A crop of face k, with its head or, `of_face`, alone, placed and spoilt as those of made heads are. Without
    `augment` no backgrounds are needed."""
    seen = faces.pixel[k][faces.weight[k] > 0]
    box = np.concatenate([seen.min(0), seen.max(0)]) if of_face and len(seen) else None
    place = placing(rng, augment, faces.rgb.shape[1], box)
    to_picture = place.to_picture
    around = cv2.BORDER_REPLICATE if augment and rng.random() < 0.5 else cv2.BORDER_CONSTANT
    image = place.cut(faces.rgb[k], around, (_GREY,) * 3)
    nearest = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    matte = cv2.warpAffine(faces.matte[k], to_picture, (CROP_PX, CROP_PX), flags=nearest, borderValue=UNKNOWN)
    pixel = (faces.pixel[k] - to_picture[:, 2]) @ np.linalg.inv(place.linear).T
    template, weight = faces.template.copy(), faces.weight[k] * ((pixel >= 0) & (pixel <= CROP_PX - 1)).all(1)
    share = (matte == HEAD).astype(np.float32)
    if augment and rng.random() < 0.3:
        image, part = occluded(image, backgrounds, rng)
        at = np.clip(np.round(pixel).astype(int), 0, CROP_PX - 1)
        weight = weight * (part[at[:, 1], at[:, 0]] < 0.5)
        share = share * (1 - part)
    if place.mirrored:
        template[:, 0] *= -1
    if augment:
        image = as_cameras_see(image, rng)

    def cells(values: np.ndarray) -> np.ndarray:
        return values.reshape(CELLS, CELL_PX, CELLS, CELL_PX).mean((1, 3))

    known = cells(((matte == HEAD) | (matte == NOTHING)).astype(np.float32)) == 1
    return PhotoCrop(
        np.clip(image, 0, 255).astype(np.uint8), pixel.astype(np.float32), template, weight.astype(np.float32),
        np.where(known, cells(share), np.float32(UNKNOWN_MATTE)).astype(np.float32),
    )  # fmt: skip


def batched_photos(crops: list[PhotoCrop]) -> tuple[torch.Tensor, ...]:
    """image float32 [B, 192, 192, 3], pixel [B, P, 2], template [B, P, 3], weight [B, P], matte [B, 48, 48]."""
    columns = zip(*((c.image.astype(np.float32), c.pixel, c.template, c.weight, c.matte) for c in crops), strict=True)
    return tuple(torch.from_numpy(np.stack(column)) for column in columns)


class MixedStream(CropStream):
    """Batches of made heads and real faces: ((image, template, matte, normal), (image, pixel, template, weight,
    matte)), together `batch` crops, `share` of them photos in the mean and one at least."""

    def __init__(self, *made, photos: list[PhotoFaces], share: float) -> None:
        super().__init__(*made)
        if not 0 < share < 1:
            raise ValueError(f"the share of photos is {share}: give a number between 0 and 1.")
        self.faces = [(faces, k) for faces in photos for k in range(len(faces.rgb))]
        self.share = share

    def random_batch(self, rng: np.random.Generator, count: int):
        wanted = int(np.floor(self.share * count + rng.random()))
        wanted = min(max(wanted, 1), count - 1)
        crops = [
            crop_photo(
                *self.faces[rng.integers(len(self.faces))], self.backgrounds, rng, of_face=rng.random() < FACE_FRACTION
            )
            for _ in range(wanted)
        ]
        return super().random_batch(rng, count - wanted), batched_photos(crops)
