"""Writes recordings (`.maqrec`, docs/reference/formats.md) of JPEG frames, which the SDK plays, and reads them."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from pathlib import Path

from export.xxh3 import xxh3

_MAGIC, _END = b"MAQREC\r\n", b"MAQEND\r\n"
_VERSION, _JPEG = 1, 100
_HEAD = struct.Struct("<8sIIQ")
_FRAME = struct.Struct("<II")
_REST = struct.Struct("<qQIiiiiIQQ")


class RecordingError(ValueError):
    """A file is no recording of JPEG frames, or it is damaged."""


def write_recording(path: Path, frames: Sequence[bytes], time_ns: Sequence[int], size: tuple[int, int], fps: float):
    """frames: JPEG files of `size` (width, height). Written under another name, then renamed."""
    about = json.dumps({"made_by": "export.people.clips", "source": path.name, "fps": fps}).encode()
    parts = [_HEAD.pack(_MAGIC, _VERSION, len(about), xxh3(about)), about]
    at, index = len(parts[0]) + len(about), b""
    for k, (data, time) in enumerate(zip(frames, time_ns, strict=True)):
        rest = _REST.pack(int(time), k, _JPEG, *size, 0, 0, 0, len(data), xxh3(data))
        parts += [_FRAME.pack(0x4651414D, xxh3(rest) & 0xFFFFFFFF), rest, data]
        index += struct.pack("<Qq", at, int(time))
        at += _FRAME.size + _REST.size + len(data)
    parts += [index, struct.pack("<QQ8s", at, xxh3(index), _END)]
    partial = path.with_name(f".{path.name}.partial")
    partial.write_bytes(b"".join(parts))
    partial.rename(path)


def read_jpegs(path: Path) -> list[bytes]:
    """The JPEG files of all frames. Raises RecordingError, and OSError for a file that cannot be read."""
    data = path.read_bytes()
    if len(data) < _HEAD.size or not data.startswith(_MAGIC):
        raise RecordingError(f"{path} is no recording: it does not begin with MAQREC. Render the clip again.")
    at = _HEAD.size + _HEAD.unpack_from(data)[2]
    found = []
    while data[at : at + 4] == b"MAQF" and at + _FRAME.size + _REST.size <= len(data):
        rest = _REST.unpack_from(data, at + _FRAME.size)
        encoding, length = rest[2], rest[8]
        at += _FRAME.size + _REST.size
        if encoding != _JPEG or at + length > len(data):
            raise RecordingError(f"Frame {len(found)} of {path} is no whole JPEG file. Render the clip again.")
        found.append(data[at : at + length])
        at += length
    return found
