"""Runs the extraction of curves on given distance fields, which it writes to a file."""

from __future__ import annotations

import json
import struct
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np

from export.solids.records import LIMIT_R

PROGRAM = Path("build/release/benchmarks/native/extract_edge_curves")


def pack_field(
    file: BinaryIO, intrinsics: Sequence[float], distance: np.ndarray, depth: np.ndarray, kind: np.ndarray
) -> None:
    """Appends one view. intrinsics: fx, fy, cx, cy in pixels. Planes [H, W]: distance in r, depth in metres, kind as in
    the C++ field (0 none, 1 crease, 2 boundary)."""
    height, width = distance.shape
    file.write(struct.pack("<2i6d", width, height, *intrinsics, LIMIT_R, 0.0))  # 0: the expected error of the field
    for plane, to in ((distance, "<f4"), (depth, "<f4"), (kind, "u1")):
        file.write(np.ascontiguousarray(plane, to).tobytes())


def extracted(path: Path) -> Iterator[dict]:
    """Yields the program's JSON document of each view in the file. Raises FileNotFoundError without the program,
    CalledProcessError where it fails."""
    if not PROGRAM.exists():
        raise FileNotFoundError(f"{PROGRAM} is not there: cmake --build --preset release --target {PROGRAM.name}")
    run = subprocess.run([PROGRAM, path], stdout=subprocess.PIPE, text=True, check=True)
    return (json.loads(line) for line in run.stdout.splitlines())
