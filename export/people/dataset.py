"""Renders shards of labelled people.

    python -m export.people.dataset --split train --images 12000 --processes 2
    python -m export.people.dataset --variety wide --out .data/people-wide    # 640 x 512: small, tilted, crowded

A shard is a function of (split, shard number) alone, so that many machines (`--cluster`) render the same set as one.
Shards that are there are kept: a stopped run goes on where it was. Format: docs/reference/formats.md. Splits share no
body, motion clip, fabric or photo.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from export.jobs import Workers, results
from export.people.augmentation import VARIETIES
from export.people.scene import SPLITS, Studio
from export.shards import ShardWriter


def render_shard(studio: Studio, number: int, images: int, path: Path) -> None:
    """Draws one shard and writes it atomically."""
    shard = ShardWriter(boxes=True)
    for k in range(images):
        rng = np.random.default_rng([SPLITS[studio.split], 7, number, k])
        sample = studio.sample(rng)
        quality = int(rng.integers(55, 96))
        shard.add(sample.image, sample.label, quality, sample.point, sample.axis, sample.keypoint)
    shard.write(path, {"split": studio.split, "shard": number, "generator": studio.variety.generator})


_studios: dict[tuple[int, int], Studio] = {}


def _work(job: tuple[str, int, int, Path, Path, bool, str]) -> int:
    cv2.setNumThreads(1)
    split, number, images, out, places, bare, variety_name = job
    variety = VARIETIES[variety_name]
    size = variety.sizes[number % len(variety.sizes)]
    if size not in _studios:
        _studios[size] = Studio(split, *size, places, points=split != "train", bare=bare, variety=variety)
    render_shard(_studios[size], number, images, out / f"shard-{number:05d}.npz")
    return images


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--split", choices=SPLITS, default="train")
    parser.add_argument("--images", type=int, default=12000, help="rounded up to whole shards (default %(default)s)")
    parser.add_argument("--per-shard", type=int, default=200)
    parser.add_argument("--first-shard", type=int, default=0)
    Workers.add_arguments(parser)
    parser.add_argument("--out", type=Path, default=Path(".data/people"))
    parser.add_argument("--places", type=Path, default=Path(".data"), help="folder of backgrounds and panoramas")
    parser.add_argument(
        "--variety", choices=VARIETIES, default="close",
        help="close: 320 x 256, mostly upright; wide: 640 x 512, small, tilted, crowded people; usual: 640 x 512, as "
             "photographs show them; animals: without people (default %(default)s)",
    )  # fmt: skip
    parser.add_argument("--bare", action="store_true", help="render people without clothes")
    options = parser.parse_args()
    out = options.out / options.split
    out.mkdir(parents=True, exist_ok=True)
    shards = range(options.first_shard, options.first_shard + -(-options.images // options.per_shard))
    common = (options.places, options.bare, options.variety)
    jobs = [(options.split, n, options.per_shard, out, *common) for n in shards]
    jobs = [job for job in jobs if not (out / f"shard-{job[1]:05d}.npz").exists()]
    try:
        with tqdm(total=len(jobs) * options.per_shard, unit="image") as bar:
            for _, images in results(Workers.of(options).run(_work, jobs)):
                bar.update(images)
    except (OSError, RuntimeError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
