"""Codes of frames in a file (.maqc, docs/reference/formats.md): the vector of each code, and how likely the code is by
itself and after the one before it.

Probabilities are stored as bits, -log2 p, in steps of 1/16 up to 15.9, one byte each.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from export.checked_file import START, checked_head, signed

MAGIC, VERSION = b"MAQCOD\r\n", 1
HEAD = np.dtype([*START, ("slices", "<u4"), ("entries", "<u4"), ("width", "<u4"), ("side", "<u4")])
STEPS_OF_BIT = 16
MAX_SLICES, MAX_ENTRIES, MAX_WIDTH, MAX_SIDE = 16, 1024, 256, 64


class CodeFileError(ValueError):
    """A file of codes, or what is to be one, is not what it must be; the sentence says why."""


@dataclass(frozen=True, eq=False)
class FrameCodes:
    """entries float32 [slices, K, width]: what codes stand for. frequency_bits [slices, K], after_bits [slices, K, K]
    (of the code on the last axis after another): float32, as stored. side: cells of a frame in a row."""

    entries: np.ndarray
    frequency_bits: np.ndarray
    after_bits: np.ndarray
    side: int


def prior_of(codes: FrameCodes) -> np.ndarray:
    """float32 [slices, K + 1, K]: natural logarithms of the probabilities of a code, by the one before; the last row is
    of a code by itself."""
    bits = np.concatenate([codes.after_bits, codes.frequency_bits[:, None]], 1)
    return (bits * -np.log(2)).astype(np.float32)


def stored_bits(log_probability: np.ndarray) -> np.ndarray:
    """Natural logarithms of probabilities as bytes. Raises CodeFileError for one that is no probability."""
    bits = -np.asarray(log_probability, np.float64) / np.log(2)
    if not (bits >= -1e-6).all():
        raise CodeFileError("A probability above 1, or one that is no number, cannot be stored.")
    return np.rint(np.minimum(bits * STEPS_OF_BIT, 255)).clip(0).astype(np.uint8)


def code_bytes(entries: np.ndarray, frequency: np.ndarray, after: np.ndarray, side: int) -> bytes:
    """The file of entries [slices, K, width] and of natural logarithms of probabilities [slices, K] and [slices, K, K].
    Raises CodeFileError for other shapes and for numbers that are not finite."""
    slices, count, width = entries.shape
    if frequency.shape != (slices, count) or after.shape != (slices, count, count):
        raise CodeFileError(f"{entries.shape}, {frequency.shape} and {after.shape} do not belong together.")
    if not np.isfinite(entries).all():
        raise CodeFileError("An entry is not finite.")
    head = np.zeros((), HEAD)
    head["slices"], head["entries"], head["width"], head["side"] = slices, count, width, side
    _check_sizes(head, "The file")
    body = entries.astype("<f4").tobytes() + stored_bits(frequency).tobytes() + stored_bits(after).tobytes()
    return signed(head, MAGIC, VERSION, body)


def read_code_file(path: Path) -> FrameCodes:
    """Raises CodeFileError where it is no such file, or is damaged."""
    data = path.read_bytes()
    head = checked_head(data, HEAD, MAGIC, VERSION, path.name, "a file of codes (.maqc)", CodeFileError)
    _check_sizes(head, path.name)
    slices, count, width = (int(head[name]) for name in ("slices", "entries", "width"))
    sizes = [4 * slices * count * width, slices * count, slices * count * count]
    if HEAD.itemsize + sum(sizes) != len(data):
        raise CodeFileError(f"{path.name} has {len(data)} bytes; its head claims {HEAD.itemsize + sum(sizes)}.")
    parts = np.split(np.frombuffer(data, np.uint8, offset=HEAD.itemsize), np.cumsum(sizes)[:-1])
    entries = parts[0].view("<f4").reshape(slices, count, width).astype(np.float32)
    if not np.isfinite(entries).all():
        raise CodeFileError(f"{path.name} has an entry that is not finite.")
    frequency, after = (part.astype(np.float32) / STEPS_OF_BIT for part in parts[1:])
    return FrameCodes(entries, frequency.reshape(slices, count), after.reshape(slices, count, count), int(head["side"]))


def _check_sizes(head: np.ndarray, name: str) -> None:
    limits = {"slices": MAX_SLICES, "entries": MAX_ENTRIES, "width": MAX_WIDTH, "side": MAX_SIDE}
    for field, limit in limits.items():
        if not 1 <= int(head[field]) <= limit:
            raise CodeFileError(f"{name} has {field} of {int(head[field])}; 1 to {limit} are allowed.")
