"""Binary PLY files of coloured points."""

from __future__ import annotations

from pathlib import Path

import numpy as np

_POINT = np.dtype([("xyz", "<f4", 3), ("rgb", "u1", 3)])
_PROPERTIES = ["float x", "float y", "float z", "uchar red", "uchar green", "uchar blue"]
_MOST_POINTS = 50_000_000


class PlyError(ValueError):
    """A PLY file is not one that `write_ply` writes."""


def write_ply(path: Path, xyz: np.ndarray, rgb: np.ndarray) -> None:
    """xyz float32 [N, 3], rgb uint8 [N, 3]; little-endian, vertices alone."""
    points = np.empty(len(xyz), _POINT)
    points["xyz"], points["rgb"] = xyz, rgb
    _write(path, points, _PROPERTIES)


def write_short_ply(path: Path, xyz: np.ndarray, rgb: np.ndarray) -> None:
    """The same with places rounded to whole numbers of 16 bits, 9 bytes a point; `read_ply` here does not read these,
    the SDK and `export.scenes` do."""
    whole = np.round(np.asarray(xyz))
    if not (np.abs(whole) < 2**15).all():
        raise PlyError(f"{path}: a point is {np.abs(whole).max():.0f} units away; 16 bits reach 32767.")
    points = np.empty(len(xyz), [("xyz", "<i2", 3), ("rgb", "u1", 3)])
    points["xyz"], points["rgb"] = whole, rgb
    properties = [p.replace("float", "short") for p in _PROPERTIES]
    _write(path, points, properties)


def _write(path: Path, points: np.ndarray, properties: list[str]) -> None:
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    lines += [f"property {p}" for p in properties] + ["end_header", ""]
    path.write_bytes("\n".join(lines).encode() + points.tobytes())


def read_ply(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """float32 [N, 3] and uint8 [N, 3] of a file of `write_ply`. Raises PlyError: other PLY files are for the SDK."""
    with path.open("rb") as file:
        head = file.read(400)
        end = head.find(b"end_header\n")
        lines = head[: max(end, 0)].decode("ascii", "replace").split("\n")
        if end < 0 or lines[:2] != ["ply", "format binary_little_endian 1.0"]:
            raise PlyError(f"{path} does not begin as a binary little-endian PLY file.")
        expected = [f"property {p}" for p in _PROPERTIES]
        counted = lines[2].removeprefix("element vertex ")
        if lines[3:9] != expected or not counted.isdecimal() or len(counted) > 9:
            raise PlyError(f"{path} has other vertices than float x, y, z and uchar red, green, blue.")
        count = int(counted)
        if not 0 < count <= _MOST_POINTS:
            raise PlyError(f"{path} says it has {count} points; 1 to {_MOST_POINTS} are read.")
        wanted = end + len(b"end_header\n") + count * _POINT.itemsize
        if path.stat().st_size != wanted:
            raise PlyError(f"{path} has {path.stat().st_size} bytes, {wanted} belong to its {count} points.")
        file.seek(end + len(b"end_header\n"))
        points = np.fromfile(file, _POINT, count)
    return np.ascontiguousarray(points["xyz"]), np.ascontiguousarray(points["rgb"])
