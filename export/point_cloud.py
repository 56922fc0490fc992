"""Point clouds in PLY files: ASCII and binary little-endian, positions and colours of the element `vertex`.

For rendered places and captures alike; the SDK has a reader of its own (sdk/src/scene/capture/ply_reader.h)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "<i2", "int16": "<i2", "ushort": "<u2",
    "uint16": "<u2", "int": "<i4", "int32": "<i4", "uint": "<u4", "uint32": "<u4", "float": "<f4", "float32": "<f4",
    "double": "<f8", "float64": "<f8",
}  # fmt: skip
_FORMATS = ("ascii", "binary_little_endian")
MAX_HEADER_BYTES = 65536
MAX_POINTS = 50_000_000


class PointCloudError(ValueError):
    """A file is not a cloud that can be read; the sentence says why."""


@dataclass(frozen=True, eq=False)
class PointCloud:
    """positions: float64 [P, 3]. colours: float32 [P, 3] in 0..1, grey where the file has none. dropped: how many
    points of the file were not finite."""

    positions: np.ndarray
    colours: np.ndarray
    dropped: int = 0


def write_ply(path: Path, xyz: np.ndarray, rgb: np.ndarray) -> None:
    """xyz float32 [P, 3], or int16 for files of 9 bytes a point instead of 15, rgb uint8 [P, 3]; binary little-endian,
    vertices alone."""
    place, kind = ("short", "<i2") if xyz.dtype == np.int16 else ("float", "<f4")
    points = np.empty(len(xyz), [("xyz", kind, 3), ("rgb", "u1", 3)])
    points["xyz"], points["rgb"] = xyz, rgb
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(xyz)}"]
    lines += [f"property {place} {axis}" for axis in "xyz"]
    lines += [f"property uchar {name}" for name in ("red", "green", "blue")] + ["end_header", ""]
    path.write_bytes("\n".join(lines).encode() + points.tobytes())


def evenly_spread(
    xyz: np.ndarray, rgb: np.ndarray, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """At most `count` of the points [N, 3], nearly that many: one of each cell of a grid as fine as that allows."""
    order = rng.permutation(len(xyz))
    xyz, rgb = xyz[order], rgb[order]
    low, high = 0.0, float(np.ptp(xyz, axis=0).max()) + 1e-9
    first = np.arange(min(count, len(xyz)))
    if len(xyz) > count:
        for _ in range(16):
            middle = (low + high) / 2
            cell = ((xyz - xyz.min(0)) / middle).astype(np.int64)
            key = (cell[:, 0] << 42) + (cell[:, 1] << 21) + cell[:, 2]
            found = np.unique(key, return_index=True)[1]
            if len(found) > count:
                low = middle
            else:
                high, first = middle, found
    return xyz[first], rgb[first]


def read_ply(path: Path) -> PointCloud:
    """Raises PointCloudError."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise PointCloudError(f"{path} cannot be read: {error}.") from None
    end = data.find(b"end_header", 0, MAX_HEADER_BYTES)
    start = data.find(b"\n", end) + 1
    if not data.startswith(b"ply") or end < 0 or not start:
        raise PointCloudError(f"{path} is not a PLY file: it has no header.")
    kind, count, fields = _header(data[:end].decode("ascii", "replace"), path)
    row = np.dtype(fields)
    try:
        if kind == "ascii":
            text = data[start:].split(b"\n", count)[:count]
            table = np.loadtxt(text, dtype=row, ndmin=1) if count else np.empty(0, row)
        else:
            table = np.frombuffer(data, row, count, start)
    except ValueError as error:
        raise PointCloudError(f"{path} does not hold the {count} points its header promises: {error}.") from None
    if len(table) != count:
        raise PointCloudError(f"{path} has {len(table)} points, but its header promises {count}.")
    positions = np.stack([table[axis].astype(np.float64) for axis in "xyz"], 1)
    colours = np.full((count, 3), 0.5, np.float32)
    if {"red", "green", "blue"} <= set(row.names):
        whole = 1.0 if row["red"].kind == "f" else float(np.iinfo(row["red"]).max)
        colours = np.stack([table[name].astype(np.float32) / whole for name in ("red", "green", "blue")], 1)
    finite = np.isfinite(positions).all(1) & np.isfinite(colours).all(1)
    return PointCloud(positions[finite], colours[finite], int((~finite).sum()))


def _header(text: str, path: Path) -> tuple[str, int, list[tuple[str, str]]]:
    """Format, number of points, and their properties."""
    kind, count, fields, element = "", -1, [], ""
    for line in text.splitlines()[1:]:
        words = line.split()
        match words:
            case ["format", name, "1.0"]:
                kind = name
            case ["element", name, number]:
                if name == "vertex" and count >= 0:
                    raise PointCloudError(f"{path} has the element vertex twice.")
                if not fields and name != "vertex" and element == "":
                    raise PointCloudError(f"{path} begins with the element {name}; only clouds are read.")
                element = name
                if name == "vertex":
                    count = int(number) if number.isdecimal() and len(number) < 10 else MAX_POINTS + 1
            case ["property", name, title] if element == "vertex":
                if name not in _TYPES or title in dict(fields):
                    raise PointCloudError(f"{path}: a point's property {name} {title} is unknown or there twice.")
                fields.append((title, _TYPES[name]))
            case ["property", "list", *_] if element == "vertex":
                raise PointCloudError(f"{path}: points have a property that is a list.")
    if kind not in _FORMATS:
        raise PointCloudError(f"{path} has the format {kind!r}; {' and '.join(_FORMATS)} are read.")
    if not 0 <= count <= MAX_POINTS:
        raise PointCloudError(f"{path} has no number of points that can be read; at most {MAX_POINTS} are.")
    if not {"x", "y", "z"} <= set(dict(fields)):
        raise PointCloudError(f"{path}: points have no x, y and z.")
    return kind, count, fields
