"""Heads made by number, and the commands that write one file of each (`points`, `view_shards`).

Everything of head k of a split depends on split and k alone. Existing files are kept, so a command resumes by itself.
"""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from export.heads.head_shards import SPLITS, HeadImages, HeadPoints, head_path
from export.heads.scans.scanned_heads import ScannedHeads, read_scanned_heads, sample_scanned
from export.heads.shapes import HeadShapes
from export.heads.surface import Head, HeadMaker
from export.people import assets

ADULT = 0.7  # the age of scanned heads, which decides about beards alone


def make_maker() -> HeadMaker:
    return HeadMaker(HeadShapes(), cv2.imread(str(assets.skin_texture()))[..., ::-1])


def generator(split: str, number: int) -> np.random.Generator:
    """The random generator of head `number` of a split."""
    return np.random.default_rng([zlib.crc32(f"heads-1/{split}".encode()), number])


def make_head(maker: HeadMaker, split: str, number: int, scans: ScannedHeads | None = None) -> Head:
    """scans: the head has one of these shapes instead of MakeHuman's."""
    if scans:
        rng = generator(f"scans/{split}", number)
        vertices = sample_scanned(scans, maker.shapes, rng)
        style = maker.barber.sample(rng, float(rng.random()), ADULT)
        return Head(maker, vertices, style, maker.barber.shells(vertices, style, rng), rng)
    rng = generator(split, number)
    return maker.make(maker.shapes.sample(rng), rng)


def shard_parser(description: str, out: Path) -> argparse.ArgumentParser:
    """The options of a command that writes files of heads."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("split", choices=SPLITS)
    parser.add_argument("--count", type=int, default=600, help="heads")
    parser.add_argument("--first", type=int, default=0, help="number of the first head")
    parser.add_argument("--out", type=Path, default=out)
    parser.add_argument("--scans", type=Path, help="shapes of `export.heads.scans.registration` instead of MakeHuman's")
    return parser


def write_shards(
    arguments: argparse.Namespace, kind: str, make: Callable[[Head, np.random.Generator], HeadPoints | HeadImages]
) -> None:
    """One file for each head that has none yet; each appears atomically. kind: what the random numbers depend on
    beside the head's own."""
    maker = make_maker()
    scans = read_scanned_heads(arguments.scans) if arguments.scans else None
    for number in tqdm(range(arguments.first, arguments.first + arguments.count), unit="head"):
        path = head_path(arguments.out, arguments.split, number)
        if path.exists():
            continue
        head = make_head(maker, arguments.split, number, scans)
        made = make(head, np.random.default_rng([zlib.crc32(kind.encode()), number]))
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(".part.npz")
        np.savez(part, **{f.name: getattr(made, f.name) for f in fields(made)})
        part.rename(path)
