"""Tables that a runtime looks up around the graphs of the transformer, in a file (.maqr, docs/reference/formats.md):
embedding rows of codes, and the relative bias of the slice network."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from export.checked_file import START, checked_head, signed
from export.prediction.config import CODE_SIDE
from export.prediction.transformer import LatentTransformer

MAGIC, VERSION = b"MAQROW\r\n", 1
SIZES = ("slices", "entries", "side", "before", "frames", "embedding", "width", "layers", "heads", "row_bytes")
HEAD = np.dtype([*START, *((name, "<u4") for name in SIZES)])
LIMITS = {"slices": 16, "entries": 1024, "side": 64, "before": 16, "frames": 17, "embedding": 1024, "width": 4096,
          "layers": 64, "heads": 64}  # fmt: skip


class RowFileError(ValueError):
    """A file of rows, or what is to be one, is not what it must be; the sentence says why."""


@dataclass(frozen=True, eq=False)
class TransformerTables:
    """before: frames of the stream that are seen. float32: context_rows [frames * slices * K, embedding], of codes of
    those, oldest first, and of one made from motion where there are frames = before + 1; slice_rows [slices * K,
    embedding], of the frame itself; earlier [slice][slice before] [K, width]; row_bias and column_bias [layers, heads,
    31], of the slice network, by query less key."""

    before: int
    context_rows: np.ndarray
    slice_rows: np.ndarray
    earlier: list[list[np.ndarray]]
    row_bias: np.ndarray
    column_bias: np.ndarray

    @staticmethod
    def of(net: LatentTransformer) -> TransformerTables:
        layers = net.slices.layers
        return TransformerTables(
            net.shape.frames,
            net.context.rows.weight.detach().numpy()[:-1],
            net.slices.rows.weight.detach().numpy(),
            [[table.weight.detach().numpy() for table in tables] for tables in net.heads.earlier],
            np.stack([layer.rows.detach().numpy() for layer in layers]),
            np.stack([layer.columns.detach().numpy() for layer in layers]),
        )

    @property
    def frames(self) -> int:
        """How many are given to the context network."""
        return len(self.context_rows) // len(self.slice_rows)


def _stored(rows: np.ndarray, row_bytes: int) -> bytes:
    """Rows as float32; or a scale of each row, then bytes."""
    if row_bytes == 4:
        return rows.astype("<f4").tobytes()
    scale = (np.abs(rows).max(1) / 127).astype("<f4")
    steps = np.rint(rows / np.maximum(scale, np.finfo(np.float32).tiny)[:, None]).clip(-127, 127)
    return scale.tobytes() + steps.astype(np.int8).tobytes()


def transformer_bytes(tables: TransformerTables, row_bytes: int = 4) -> bytes:
    """The file of a transformer's tables. row_bytes: 4 keeps rows as they are, 1 as bytes with a scale a row. Raises
    RowFileError for numbers that are not finite."""
    slices = len(tables.earlier)
    entries = len(tables.slice_rows) // slices
    groups = [tables.context_rows, tables.slice_rows, *(rows for own in tables.earlier for rows in own)]
    biases = [tables.row_bias, tables.column_bias]
    if not all(np.isfinite(array).all() for array in (*groups, *biases)):
        raise RowFileError("A row or a bias is not finite.")
    head = np.zeros((), HEAD)
    width = tables.earlier[-1][0].shape[1] if slices > 1 else 0
    layers, heads = tables.row_bias.shape[:2]
    frames, embedding = tables.frames, tables.slice_rows.shape[1]
    values = (slices, entries, CODE_SIDE, tables.before, frames, embedding, width, layers, heads, row_bytes)
    for name, value in zip(SIZES, values, strict=True):
        head[name] = value
    _check_sizes(head, "The file")
    body = b"".join(_stored(rows, row_bytes) for rows in groups) + b"".join(a.astype("<f4").tobytes() for a in biases)
    return signed(head, MAGIC, VERSION, body)


def read_transformer_file(path: Path) -> TransformerTables:
    """Raises RowFileError where it is no such file, or is damaged."""
    data = path.read_bytes()
    head = checked_head(data, HEAD, MAGIC, VERSION, path.name, "a file of rows (.maqr)", RowFileError)
    _check_sizes(head, path.name)
    slices, entries, side, before, frames, embedding, width, layers, heads, row_bytes = (int(head[n]) for n in SIZES)
    left = memoryview(data)[HEAD.itemsize :]

    def taken(count: int, form: str) -> np.ndarray:
        nonlocal left
        size = count * np.dtype(form).itemsize
        if size > len(left):
            raise RowFileError(f"{path.name} ends before what its head claims.")
        part, left = np.frombuffer(left[:size], form), left[size:]
        return part

    def rows(count: int, columns: int) -> np.ndarray:
        if row_bytes == 4:
            return taken(count * columns, "<f4").reshape(count, columns)
        scale = taken(count, "<f4")
        return taken(count * columns, "i1").reshape(count, columns) * scale[:, None]

    context_rows, slice_rows = rows(frames * slices * entries, embedding), rows(slices * entries, embedding)
    earlier = [[rows(entries, width) for _ in range(k)] for k in range(slices)]
    biases = [taken(layers * heads * (2 * side - 1), "<f4").reshape(layers, heads, -1) for _ in range(2)]
    if len(left):
        raise RowFileError(f"{path.name} goes on after what its head claims.")
    tables = TransformerTables(before, context_rows, slice_rows, earlier, *biases)
    groups = (context_rows, slice_rows, *(own for of_slice in earlier for own in of_slice), *biases)
    if not all(np.isfinite(array).all() for array in groups):
        raise RowFileError(f"{path.name} has a number that is not finite.")
    return tables


def _check_sizes(head: np.ndarray, name: str) -> None:
    for field, limit in LIMITS.items():
        if not 1 <= int(head[field]) <= limit:
            raise RowFileError(f"{name} has {field} of {int(head[field])}; 1 to {limit} are allowed.")
    if int(head["frames"]) - int(head["before"]) not in (0, 1):
        raise RowFileError(f"{name} has {int(head['frames'])} frames, of which {int(head['before'])} are the stream's.")
    if int(head["row_bytes"]) not in (1, 4):
        raise RowFileError(f"{name} has numbers of {int(head['row_bytes'])} bytes; 1 or 4 are allowed.")
