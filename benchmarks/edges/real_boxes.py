"""Measures boxes in real depth frames, of which 83 show boxes on a table and 24 round things alone.

    python -m benchmarks.edges.real_boxes FOLDER          needs `make build`

FOLDER is `segmentation/mOSD` of the repository PointCloudLibrary/data on GitHub (BSD-3-Clause): the Object Segmentation
Database of Richtsfeld and others, organised point clouds of a structured-light camera with 640 x 480 pixels, 0.5 to
1.6 m away. True sizes are not known. The same few cartons stand in many frames, so that the spread of a carton's sizes
tells how well they are measured. Three of its clouds are not organised and are left out.
"""

from __future__ import annotations

import argparse
import struct
import sys
from collections import Counter
from pathlib import Path

import maquette
import numpy as np
from rich.console import Console
from rich.table import Table

# Ranges of numbers of frames, both ends included, by group.
GROUPS = {
    "boxes": {"learn": (0, 16), "test": (0, 15)},
    "stacked boxes": {"learn": (17, 24), "test": (16, 23)},
    "boxes that are partly covered": {"learn": (25, 32), "test": (24, 30)},
    "boxes and round things": {"test": (43, 64)},
    "round things alone": {"learn": (33, 44), "test": (31, 42)},
}
ROUND = "round things alone"
SAME_M = 0.009  # boxes whose sides differ by less are one carton
MIN_FRAMES = 4  # of a carton whose spread is printed
TYPES = {"F": "f", "U": "u", "I": "i"}


def decompressed(packed: bytes, size: int) -> bytes:
    """Returns the content of an LZF stream, `size` bytes. Raises ValueError if the stream is damaged."""
    made, at = bytearray(), 0
    try:
        while at < len(packed):
            control = packed[at]
            at += 1
            if control < 32:
                made += packed[at : at + control + 1]
                at += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += packed[at]
                at += 1
            start = len(made) - ((control & 31) << 8) - packed[at] - 1
            at += 1
            if start < 0:
                raise ValueError("The compressed point cloud refers to bytes before its start.")
            for k in range(start, start + length + 2):
                made.append(made[k])
    except IndexError:
        raise ValueError("The compressed point cloud ends too early.") from None
    if len(made) != size:
        raise ValueError(f"The compressed point cloud has {len(made)} bytes, not {size}.")
    return bytes(made)


def read_depth(path: Path) -> tuple[np.ndarray, maquette.Intrinsics] | None:
    """Returns depth in metres, float32 [H, W], 0 where it is unknown, and the camera of a cloud in a compressed .pcd
    file. Returns None if the cloud is not organised. Raises ValueError for another kind of file."""
    raw = path.read_bytes()
    end = raw.find(b"\nDATA binary_compressed\n")
    if end < 0:
        raise ValueError(f"{path} is no compressed .pcd file.")
    lines = raw[:end].decode().splitlines()
    head = {words[0]: words[1:] for words in map(str.split, lines) if words and words[0] != "#"}
    width, height = int(head["WIDTH"][0]), int(head["HEIGHT"][0])
    if height == 1:
        return None
    body = raw[end + len(b"\nDATA binary_compressed\n") :]
    packed, size = struct.unpack("<II", body[:8])
    content, at, planes = decompressed(body[8 : 8 + packed], size), 0, {}
    for name, kind, length in zip(head["FIELDS"], head["TYPE"], head["SIZE"], strict=True):
        planes[name] = np.frombuffer(content, TYPES[kind] + length, width * height, at).reshape(height, width)
        at += int(length) * width * height
    x, y, z = (planes[name].astype(np.float64) for name in "xyz")
    known = np.isfinite(z) & (z > 0)
    rows, columns = np.nonzero(known)
    fx, cx = _pinhole(columns, (x / np.where(known, z, 1))[known])
    fy, cy = _pinhole(rows, (y / np.where(known, z, 1))[known])
    return np.where(known, z, 0).astype(np.float32), maquette.Intrinsics(width, height, fx, fy, cx, cy)


def _pinhole(pixels: np.ndarray, slopes: np.ndarray) -> tuple[float, float]:
    """Returns the focal length and the principal point of pixels = focal * slopes + principal."""
    slope, offset = np.polyfit(pixels, slopes, 1)
    return float(1 / slope), float(-offset / slope)


def cartons_of(sizes: np.ndarray) -> list[np.ndarray]:
    """Returns the sizes [n, 3] of each carton: the largest group within SAME_M of one of its boxes first."""
    made = []
    while len(sizes):
        near = (np.abs(sizes[:, None] - sizes[None]) <= SAME_M).all(-1)
        chosen = near[near.sum(1).argmax()]
        made.append(sizes[chosen])
        sizes = sizes[~chosen]
    return made


def measure(folder: Path) -> dict:
    """Returns {"groups": rows, "cartons": rows, "boxes_ms": median}. Raises FileNotFoundError without frames."""
    if not (folder / "learn" / "learn0.pcd").exists():
        raise FileNotFoundError(f"{folder} has no learn/learn0.pcd: give segmentation/mOSD of PointCloudLibrary/data.")
    frames, with_box, count = Counter(), Counter(), Counter()
    without: dict[str, list[str]] = {}
    sizes, ms = [], []
    with maquette.Edges() as edges:
        for group, parts in GROUPS.items():
            for part, (first, last) in parts.items():
                for number in range(first, last + 1):
                    name = f"{part}{number}"
                    read = read_depth(folder / part / f"{name}.pcd")
                    if read is None:
                        continue
                    found = edges.run(*read, curves=True).curves
                    frames[group] += 1
                    with_box[group] += bool(found.boxes)
                    count[group] += len(found.boxes)
                    if bool(found.boxes) == (group == ROUND):
                        without.setdefault(group, []).append(name)
                    sizes += [box.size_m for box in found.boxes]
                    ms.append(found.boxes_ms)
    groups = [
        {"group": group, "frames": frames[group], "with_box": with_box[group], "boxes": count[group],
         "wrong": without.get(group, [])}
        for group in GROUPS
    ]  # fmt: skip
    cartons = [
        {"frames": len(of), "size_mm": np.round(1000 * np.median(of, 0)).tolist(),
         "spread_mm": float(1000 * np.median(np.abs(of - np.median(of, 0))))}
        for of in cartons_of(np.array(sizes)) if len(of) >= MIN_FRAMES
    ]  # fmt: skip
    return {"groups": groups, "cartons": cartons, "boxes_ms": float(np.median(ms))}


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.edges.real_boxes", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    options = parser.parse_args(argv)
    try:
        found = measure(options.folder)
    except (FileNotFoundError, ValueError, maquette.MaquetteError) as error:
        print(error, file=sys.stderr)
        return 1
    table = Table("frames with", "frames", "with a box", "boxes", "frames that are wrong")
    for row in found["groups"]:
        table.add_row(row["group"], str(row["frames"]), str(row["with_box"]), str(row["boxes"]), " ".join(row["wrong"]))
    console = Console()
    console.print(table)
    table = Table("carton, mm", "frames", "median deviation of a side from the median, mm")
    for row in found["cartons"]:
        size = " x ".join(f"{side:.0f}" for side in row["size_mm"])
        table.add_row(size, str(row["frames"]), f"{row['spread_mm']:.1f}")
    console.print(table)
    print(f"boxes of a frame: {found['boxes_ms']:.1f} ms")
    return 0


if __name__ == "__main__":
    sys.exit(main())
