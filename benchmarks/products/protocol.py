"""Messages between the comparison and the process of a product: a line of JSON, then the bytes of arrays.

Needs numpy alone, because the processes of other products read it, too.
"""

from __future__ import annotations

import json
from typing import BinaryIO

import numpy as np


class ProductError(RuntimeError):
    """The process of a product ended, or said that it failed."""


def send(stream: BinaryIO, message: dict, **arrays: np.ndarray) -> None:
    """message: values of JSON."""
    described = {name: [str(array.dtype), list(array.shape)] for name, array in arrays.items()}
    stream.write(json.dumps({"message": message, "arrays": described}).encode() + b"\n")
    for array in arrays.values():
        stream.write(np.ascontiguousarray(array).tobytes())
    stream.flush()


def receive(stream: BinaryIO) -> tuple[dict, dict[str, np.ndarray]] | None:
    """The next message and its arrays; None after the last one. Raises ProductError for half a message."""
    line = stream.readline()
    if not line:
        return None
    head = json.loads(line)
    arrays = {}
    for name, (dtype, shape) in head["arrays"].items():
        size = np.dtype(dtype).itemsize * int(np.prod(shape, dtype=np.int64))
        data = stream.read(size)
        if len(data) != size:
            raise ProductError(f"the array {name} has {len(data)} of {size} bytes")
        arrays[name] = np.frombuffer(data, dtype).reshape(shape)
    return head["message"], arrays
