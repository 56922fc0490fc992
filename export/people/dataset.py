"""Renders shards of labelled people.

    python -m export.people.dataset --split train --images 12000 --processes 2
    python -m export.people.dataset --variety wide --out .data/people-wide    # 640 x 512: small, tilted, crowded

A shard is a function of (split, shard number) alone, so several machines can render one set with
`--first-shard`. Format: docs/formats.md. Splits share no body, motion clip, fabric or photo.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from export.people.scene import SPLITS, Studio
from export.people.variety import VARIETIES

POINT_RANGE = np.array([[-1.0, -1.0, -0.1], [1.0, 1.0, 2.1]], np.float32)
MIN_PIXELS, MIN_SIDE_PX = 64, 12  # smaller people are marked "ignore"
# Instance numbers of photographs: from BOX_ALONE on people of whom only the box is known, from UNCERTAIN on regions in
# which there may be people or not ("ignore").
BOX_ALONE, UNCERTAIN = 128, 192


def visible_boxes(label: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Boxes around each instance's visible pixels.

    label: uint8 [H, W, 4]. Returns box float32 [n, 4] (right, bottom exclusive), instance uint8 [n], ignore bool [n].
    """
    box, instance, ignore = [], [], []
    for number in np.unique(label[..., 3]):
        if number:
            y, x = np.nonzero(label[..., 3] == number)
            box.append([x.min(), y.min(), x.max() + 1, y.max() + 1])
            instance.append(number)
            small = len(x) < MIN_PIXELS or max(np.ptp(x), np.ptp(y)) + 1 < MIN_SIDE_PX
            ignore.append(small or number >= UNCERTAIN)
    return (np.array(box, np.float32).reshape(-1, 4), np.array(instance, np.uint8), np.array(ignore, bool))


class EncodedImages:
    """Encoded images one after another, with their ends."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []

    def add(self, suffix: str, image: np.ndarray, *options: int) -> None:
        ok, data = cv2.imencode(suffix, image, list(options))
        if not ok:
            raise RuntimeError(f"encoding as {suffix} failed")
        self.parts.append(data.tobytes())

    def arrays(self, name: str) -> dict[str, np.ndarray]:
        ends = np.cumsum([len(p) for p in self.parts], dtype=np.int64)
        return {name: np.frombuffer(b"".join(self.parts), np.uint8), f"{name}_end": ends}


def render_shard(studio: Studio, number: int, images: int, path: Path) -> None:
    """Draws one shard and writes it whole (temporary name, then rename)."""
    stores = {"image": EncodedImages(), "label": EncodedImages(), "point": EncodedImages()}
    boxes, owners, instances, ignored = [], [], [], []
    for k in range(images):
        rng = np.random.default_rng([SPLITS[studio.split], 7, number, k])
        sample = studio.sample(rng)
        stores["image"].add(".jpg", sample.image, cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(55, 96)))
        stores["label"].add(".png", sample.label, cv2.IMWRITE_PNG_COMPRESSION, 3)
        if sample.point is not None:
            low, high = POINT_RANGE
            person = sample.label[..., 3:] > 0
            scaled = np.where(person, np.clip((sample.point - low) / (high - low), 0, 1) * 65535, 0)
            stores["point"].add(".png", scaled.astype(np.uint16), cv2.IMWRITE_PNG_COMPRESSION, 3)
        box, instance, ignore = visible_boxes(sample.label)
        boxes.append(box)
        owners.append(np.full(len(box), k, np.int32))
        instances.append(instance)
        ignored.append(ignore)
    arrays = {
        "box": np.concatenate(boxes),
        "box_image": np.concatenate(owners),
        "box_instance": np.concatenate(instances),
        "box_ignore": np.concatenate(ignored),
        "meta": np.array(json.dumps({"split": studio.split, "shard": number, "generator": studio.variety.generator})),
    }
    for name, store in stores.items():
        if store.parts:
            arrays |= store.arrays(name)
    if "point" in arrays:
        arrays["point_range"] = POINT_RANGE
    temporary = path.with_suffix(".tmp.npz")
    np.savez(temporary, **arrays)
    temporary.rename(path)


_studios: dict[tuple[int, int], Studio] = {}


def _work(job: tuple[str, int, int, Path, Path, bool, str]) -> int:
    split, number, images, out, places, bare, variety_name = job
    variety = VARIETIES[variety_name]
    size = variety.sizes[number % len(variety.sizes)]
    if size not in _studios:
        _studios[size] = Studio(split, *size, places, points=split != "train", bare=bare, variety=variety)
    render_shard(_studios[size], number, images, out / f"shard-{number:05d}.npz")
    return images


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--split", choices=SPLITS, default="train")
    parser.add_argument("--images", type=int, default=12000, help="rounded up to whole shards (default %(default)s)")
    parser.add_argument("--per-shard", type=int, default=200)
    parser.add_argument("--first-shard", type=int, default=0)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--out", type=Path, default=Path(".data/people"))
    parser.add_argument("--places", type=Path, default=Path(".data"), help="folder of backgrounds and panoramas")
    parser.add_argument(
        "--variety", choices=VARIETIES, default="close",
        help="close: 320 x 256, mostly upright; wide: 640 x 512, small, tilted, crowded people (default %(default)s)",
    )  # fmt: skip
    parser.add_argument("--bare", action="store_true", help="nobody wears clothes (export.evaluation.ablation)")
    options = parser.parse_args()
    out = options.out / options.split
    out.mkdir(parents=True, exist_ok=True)
    shards = range(options.first_shard, options.first_shard + -(-options.images // options.per_shard))
    common = (options.places, options.bare, options.variety)
    jobs = [(options.split, n, options.per_shard, out, *common) for n in shards]
    jobs = [job for job in jobs if not (out / f"shard-{job[1]:05d}.npz").exists()]
    cv2.setNumThreads(1)
    pool = multiprocessing.get_context("spawn").Pool(options.processes)
    with pool, tqdm(total=len(jobs) * options.per_shard, unit="image") as bar:
        for done in pool.imap_unordered(_work, jobs):
            bar.update(done)


if __name__ == "__main__":
    main()
