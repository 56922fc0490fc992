"""Labelled photographs as shards for training: people as far as the teachers know them, and photographs without people.

    python -m export.teachers.shards --photos .data/photos/train --out .data/photos/shards

The format is that of rendered people (docs/formats.md), with the weaker labels of `export.surface`.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from export import surface
from export.people.dataset import BOX_ALONE, UNCERTAIN, EncodedImages, visible_boxes
from export.teachers.coarse import SOMEWHERE, coarse_labels
from export.teachers.label import PhotoLabels

LONG_SIDE = 512
LEAST_SCORE = 0.5  # of the detector; less sure boxes are regions that training leaves out
_BORDER = 0.012  # of the person's height: this close to the mask's edge a pixel may be the person or not
PER_SHARD = 100


def weak_label(labels: PhotoLabels, shape: tuple[int, int]) -> np.ndarray:
    """uint8 [H, W, 4] = (I, U, V, instance) of a photo of `shape` pixels, with I as in `export.surface`.

    Boxes without a mask are filled with UNSURE; masks lie over them. Instances: 1.. with a mask, BOX_ALONE.. with a
    box alone, UNCERTAIN.. where the detector itself is not sure.
    """
    out = np.zeros((*shape, 4), np.uint8)
    outlined = np.flatnonzero(labels.outlined)
    for k in sorted(np.flatnonzero(~labels.outlined), key=lambda k: labels.score[k]):
        x0, y0, x1, y1 = np.round(labels.box[k]).astype(int)
        first = BOX_ALONE if labels.score[k] >= LEAST_SCORE else UNCERTAIN
        out[max(y0, 0) : y1, max(x0, 0) : x1] = (surface.UNSURE, 0, 0, first + k % (UNCERTAIN - BOX_ALONE))
    for k in sorted(outlined, key=lambda k: -labels.mask[k].sum()):
        mask = labels.mask[k]
        border = max(1, round(_BORDER * float(labels.box[k, 3] - labels.box[k, 1])))
        ring = cv2.dilate(mask.astype(np.uint8), np.ones((2 * border + 1, 2 * border + 1), np.uint8)) > 0
        out[(ring | labels.doubt[k]) & ~mask & (out[..., 3] == 0), 0] = surface.UNSURE
        value = np.full(shape, surface.PERSON, np.uint8)
        if labels.sure[k]:
            region = coarse_labels(labels.point[k], labels.visible[k], mask)
            value = np.where(region == SOMEWHERE, surface.PERSON, surface.REGION + region)
            value[(region == SOMEWHERE) & labels.doubt[k]] = surface.UNSURE
        out[mask, 0] = value[mask]
        out[mask, 1:3] = 0
        out[mask, 3] = k + 1
    return out


def add_photo(stores: dict[str, EncodedImages], image: np.ndarray, label: np.ndarray) -> None:
    """image: uint8 [H, W, 3] BGR and its label, shrunk to LONG_SIDE."""
    scale = LONG_SIDE / max(image.shape[:2])
    if scale < 1:
        size = (round(image.shape[1] * scale), round(image.shape[0] * scale))
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
        label = cv2.resize(label, size, interpolation=cv2.INTER_NEAREST)
    stores["image"].add(".jpg", image, cv2.IMWRITE_JPEG_QUALITY, 92)
    stores["label"].add(".png", label, cv2.IMWRITE_PNG_COMPRESSION, 3)


def write_shards(photos: list[tuple[Path, Path | None]], out: Path) -> tuple[int, int, int]:
    """photos: image and labels (None: nobody in it). Returns the number of images, people with masks, by box alone."""
    out.mkdir(parents=True, exist_ok=True)
    masks = alone = 0
    # Mixed, so that every shard holds both kinds whatever their order in the folders.
    order = np.random.default_rng(0).permutation(len(photos))
    for first in tqdm(range(0, len(photos), PER_SHARD), desc="photographs", unit="shard", disable=None):
        stores = {"image": EncodedImages(), "label": EncodedImages()}
        for index in order[first : first + PER_SHARD]:
            path, labels = photos[index]
            image = cv2.imread(str(path))
            if image is None:
                raise ValueError(f"{path} is not an image that can be read")
            label = np.zeros((*image.shape[:2], 4), np.uint8)
            if labels is not None:
                label = weak_label(PhotoLabels.load(labels), image.shape[:2])
            _, instance, ignore = visible_boxes(label)
            masks += int((instance[~ignore] < BOX_ALONE).sum())
            alone += int((instance[~ignore] >= BOX_ALONE).sum())
            add_photo(stores, image, label)
        arrays = {"meta": np.array(json.dumps({"split": out.name, "shard": first // PER_SHARD, "generator": "photos"}))}
        for name, store in stores.items():
            arrays |= store.arrays(name)
        temporary = out / "partial.npz"
        np.savez(temporary, **arrays)
        temporary.replace(out / f"shard-{first // PER_SHARD:05d}.npz")
    return len(photos), masks, alone


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.teachers.shards", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--photos", type=Path, default=Path(".data/photos/train"), metavar="DIR")
    parser.add_argument("--labels", type=Path, default=Path(".data/teachers/labels"), metavar="DIR")
    parser.add_argument("--empty", type=Path, default=Path(".data/backgrounds/train"), metavar="DIR", help="no people")
    parser.add_argument("--out", type=Path, default=Path(".data/photos/shards/train"), metavar="DIR")
    arguments = parser.parse_args(argv)
    people = [(p, arguments.labels / f"{p.stem}.npz") for p in sorted(arguments.photos.glob("*.jpg"))]
    missing = [str(p) for p, labels in people if not labels.exists()]
    if missing or not people:
        print(f"No labels for {len(missing)} of {len(people)} photos in {arguments.photos}: run "
              f"`python -m export.teachers --photos {arguments.photos}` first.", file=sys.stderr)  # fmt: skip
        return 1
    empty = [(p, None) for p in sorted(arguments.empty.glob("*.jpg"))]
    count, masks, alone = write_shards(people + empty, arguments.out)
    print(f"{arguments.out}: {count} photographs, {len(empty)} of them without people; "
          f"{masks} people with a mask, {alone} with a box alone")  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
