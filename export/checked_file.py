"""How binary files of the SDK begin, and how they are written: a magic, versions, sizes, and a check of all that
follows (sdk/src/core/files)."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from export.xxh3 import xxh3

# The first fields of any head.
START = [
    ("magic", "S8"),
    ("version", "<u4"),
    ("head_bytes", "<u4"),
    ("check", "<u8"),  # of all that follows in the file
    ("file_bytes", "<u8"),
]
CHECKED = np.dtype(START).fields["file_bytes"][1]  # from there on the check covers the file


def signed(head: np.ndarray, magic: bytes, version: int, body: bytes) -> bytes:
    """A whole file: `head`, whose start is filled in, and what follows."""
    head["magic"], head["version"], head["head_bytes"] = magic, version, head.dtype.itemsize
    head["file_bytes"] = head.dtype.itemsize + len(body)
    head["check"] = xxh3(head.tobytes()[CHECKED:] + body)
    return head.tobytes() + body


def write_whole(data: bytes, path: Path) -> None:
    """Beside its place first: a crash leaves the old file."""
    beside = path.with_name(f"{path.name}.tmp")
    with beside.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    beside.replace(path)


def checked_head(
    data: bytes, form: np.dtype, magic: bytes, version: int, name: str, kind: str, error: type[ValueError] = ValueError
) -> np.ndarray:
    """The head of a file of that kind ("a head (.maqh)"). Raises `error` for another file, version or check."""
    if len(data) < form.itemsize or not data.startswith(magic):
        raise error(f"{name} is not {kind}.")
    head = np.frombuffer(data, form, 1)[0]
    if head["version"] != version:
        raise error(f"{name} is {kind} of version {head['version']}; version {version} is read here.")
    if head["head_bytes"] != form.itemsize or head["file_bytes"] != len(data) or head["check"] != xxh3(data[CHECKED:]):
        raise error(f"{name} is cut off or damaged; copy it again.")
    return head
