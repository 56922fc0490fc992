"""Reads the model and the focal length of the camera from the EXIF data of a JPEG file."""

from __future__ import annotations

import struct
from pathlib import Path

_MODEL, _EXIF_FOLDER, _FOCAL_35MM = 0x0110, 0x8769, 0xA405
_LONG_SIDE_35MM = 36.0  # millimetres


def camera_of(path: Path) -> tuple[str, float]:
    """Model, and focal length as a fraction of the long side; "" and 0 where the file does not say so."""
    try:
        with open(path, "rb") as file:
            data = file.read(1 << 17)
        tiff = _tiff_of(data)
        entries = _entries(tiff, 0, set())
    except (struct.error, ValueError, IndexError):
        return "", 0.0
    focal = entries.get(_FOCAL_35MM, 0)
    model = entries.get(_MODEL, "")
    return str(model), float(focal) / _LONG_SIDE_35MM if isinstance(focal, int) and 5 <= focal <= 400 else 0.0


def _tiff_of(data: bytes) -> bytes:
    """The TIFF structure in the APP1 segment of a JPEG file (CIPA DC-008, 4.5.4)."""
    if data[:2] != b"\xff\xd8":
        raise ValueError
    at = 2
    while data[at] == 0xFF and data[at + 1] != 0xDA:
        (size,) = struct.unpack_from(">H", data, at + 2)
        if data[at + 1] == 0xE1 and data[at + 4 : at + 10] == b"Exif\0\0":
            return data[at + 10 : at + 2 + size]
        at += 2 + size
    raise ValueError


def _entries(tiff: bytes, start: int, seen: set[int]) -> dict[int, int | str]:
    """Numbers and texts of the folder of tags at `start` (0: the first), and of the EXIF folder that it names."""
    order = {b"II": "<", b"MM": ">"}[tiff[:2]] if tiff[:2] in (b"II", b"MM") else ""
    if not order:
        raise ValueError
    if start == 0:
        (start,) = struct.unpack_from(order + "I", tiff, 4)
    if start in seen:
        raise ValueError
    seen.add(start)
    (count,) = struct.unpack_from(order + "H", tiff, start)
    found: dict[int, int | str] = {}
    for k in range(count):
        tag, kind, number = struct.unpack_from(order + "HHI", tiff, start + 2 + 12 * k)
        at = start + 10 + 12 * k
        if kind == 3 and number == 1:
            (found[tag],) = struct.unpack_from(order + "H", tiff, at)
        elif kind == 4 and number == 1:
            (found[tag],) = struct.unpack_from(order + "I", tiff, at)
        elif kind == 2:
            if number > 4:
                (at,) = struct.unpack_from(order + "I", tiff, at)
            found[tag] = tiff[at : at + min(number, 100)].split(b"\0")[0].decode("latin-1").strip()
    nested = found.get(_EXIF_FOLDER)
    if isinstance(nested, int):
        found.update({k: v for k, v in _entries(tiff, nested, seen).items() if k not in found})
    return found
