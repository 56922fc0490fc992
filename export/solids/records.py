"""Labelled views of solids, packed into shards (docs/reference/formats.md); read without OpenCascade and Embree."""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

LIMIT_R = 16.0  # distances are clipped here
NONE, CONVEX, CONCAVE, BOUNDARY = 0, 1, 2, 3  # kinds of the nearest curve

# Planes of a record in the order in which they are packed.
PLANES = {"depth": "<f4", "distance": "<f2", "kind": "u1", "ignore": "?", "patch": "<u2"}
NO_PATCH = 65535


class RecordError(ValueError):
    """A shard is missing or damaged."""


@dataclass(frozen=True)
class Record:
    """One labelled view, still packed (about 20 kB for a crop).

    intrinsics: fx, fy, cx, cy in pixels (the centre of the first pixel is 0, 0). name: split, seed, view, crop or size,
    family, surroundings. curves: the sharp curves seen, JSON (`curves.py`); empty for crops.
    """

    name: str
    height: int
    width: int
    intrinsics: tuple[float, float, float, float]
    data: bytes
    curves: str = ""

    def seen_curves(self) -> dict:
        """Curves and corners as `curves.py` describes them. Raises RecordError for crops, which have none stored."""
        if not self.curves:
            raise RecordError(f"{self.name} has no curves stored: they come with `export.solids.dataset --whole`")
        return json.loads(self.curves)

    def decoded(self) -> dict[str, np.ndarray]:
        """depth: float32 [H, W] metres along the optical axis, 0 where nothing is. distance: float16 [H, W], to the
        nearest sharp curve in r = depth / focal length, 0..16. kind: uint8 [H, W], 0 none within 16 r, 1 convex crease,
        2 concave crease, 3 boundary. ignore: bool [H, W], no label. patch: uint16 [H, W], the smooth patch, 65535 where
        nothing is. Raises RecordError."""
        try:
            raw = zlib.decompress(self.data)
        except zlib.error as error:
            raise RecordError(f"{self.name} is damaged ({error}); make the shard again") from error
        count, out, at = self.height * self.width, {}, 0
        for plane, kind in PLANES.items():
            size = np.dtype(kind).itemsize
            flat = np.frombuffer(raw, np.uint8, count * size, at).reshape(size, count)
            flat = np.cumsum(flat, axis=1, dtype=np.uint8)
            out[plane] = np.ascontiguousarray(flat.T).view(kind).reshape(self.height, self.width)
            at += count * size
        return out


def packed(name: str, planes: dict[str, np.ndarray], intrinsics: Sequence[float], curves: str = "") -> Record:
    """Byte planes, each the difference from its left neighbour, deflated."""
    height, width = planes["depth"].shape
    parts = []
    for plane, kind in PLANES.items():
        flat = np.ascontiguousarray(planes[plane], kind).reshape(-1, 1).view(np.uint8).reshape(height * width, -1).T
        parts.append(np.diff(flat, axis=1, prepend=np.zeros((len(flat), 1), np.uint8)).tobytes())
    return Record(name, height, width, tuple(map(float, intrinsics)), zlib.compress(b"".join(parts), 4), curves)


def write_shard(path: Path, records: list[Record], meta: dict) -> None:
    """Atomically (temporary name, then rename)."""
    temporary = path.with_suffix(".partial.npz")
    np.savez(
        temporary,
        meta=np.array(json.dumps(meta)),
        name=np.array([r.name for r in records], dtype=np.str_),
        size=np.array([(r.height, r.width) for r in records], np.int32).reshape(-1, 2),
        intrinsics=np.array([r.intrinsics for r in records], np.float64).reshape(-1, 4),
        curves=np.array([r.curves for r in records], dtype=np.str_),
        data=np.frombuffer(b"".join(r.data for r in records), np.uint8),
        data_end=np.cumsum([len(r.data) for r in records], dtype=np.int64),
    )
    temporary.replace(path)


def read_records(folder: Path) -> Iterator[Record]:
    """All records of a folder's shards in order. Raises RecordError."""
    paths = sorted(folder.glob("solids-?????.npz"))
    if not paths:
        raise RecordError(
            f"{folder} has no solids-*.npz. Make some: python -m export.solids.dataset train --out {folder}"
        )
    for path in paths:
        try:
            archive = np.load(path)
        except (OSError, ValueError, zipfile.BadZipFile) as error:
            raise RecordError(f"{path} cannot be read ({error}); remove it and make it again") from error
        with archive as file:
            if not {"name", "size", "intrinsics", "curves", "data", "data_end"} <= set(file.files):
                raise RecordError(f"{path} is not a shard of solids, or of an older generator; make it again")
            ends, data = file["data_end"], file["data"]
            rows = zip(file["name"], file["size"], file["intrinsics"], file["curves"], strict=True)
            for k, (name, (height, width), intrinsics, curves) in enumerate(rows):
                own = data[ends[k - 1] if k else 0 : ends[k]].tobytes()
                yield Record(str(name), int(height), int(width), tuple(map(float, intrinsics)), own, str(curves))
