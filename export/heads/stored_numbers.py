"""Number formats that files of priors and heads share (sdk/src/head/files/stored_numbers.h): layers of the field in
float32, float16 and int8."""

from __future__ import annotations

import numpy as np

from export.heads.prior import FieldShape, Layer, PriorError, check_shape

FORMATS = {"float32": 0, "float16": 1, "int8": 2}
FLOATS = {0: np.dtype("<f4"), 1: np.dtype("<f2")}
MAX_STORED_NUMBER = 1e6

SHAPE = np.dtype(
    [
        ("octaves", "<u4"),
        ("width", "<u4"),
        ("geometry_layers", "<u4"),
        ("feature", "<u4"),
        ("surface_width", "<u4"),
        ("surface_layers", "<u4"),
        ("personal_geometry_layers", "<u4"),
        ("personal_surface_layers", "<u4"),
        ("smoothing", "<f4"),
    ]
)


def shape_of(stored: np.ndarray) -> FieldShape:
    """Reads one SHAPE. Raises PriorError for sizes that the SDK does not take."""
    shape = FieldShape(**{key: stored[key].item() for key in SHAPE.names})
    check_shape(shape)
    return shape


def stored(values: np.ndarray, form: str) -> bytes:
    """As float32 or float16. Raises PriorError for numbers that such a format does not hold."""
    values = np.asarray(values, np.float32)
    with np.errstate(over="ignore"):
        made = values.astype(FLOATS[FORMATS[form]])
    if not (np.abs(made.astype(np.float32)) <= MAX_STORED_NUMBER).all():
        raise PriorError(f"A number as large as {np.abs(values).max():g} cannot be stored as {form}; use float32.")
    return made.tobytes()


def stored_layer(layer: Layer, form: str) -> list[bytes]:
    """A layer, or its bases. Raises PriorError as stored() does."""
    if form != "int8":
        return [stored(layer.weights, form), stored(layer.bias, form)]
    weights = np.asarray(layer.weights, np.float32)
    scales = (np.abs(weights).max(-1, initial=0) / 127).astype(np.float32)  # of each row
    steps = np.divide(weights, scales[..., None], out=np.zeros_like(weights), where=scales[..., None] > 0)
    steps = np.clip(np.rint(steps), -127, 127).astype(np.int8)
    return [stored(scales, "float32"), steps.tobytes(), stored(layer.bias, "float16")]


def stored_landmark(name: str, point: np.ndarray) -> list[bytes]:
    return [bytes([len(name.encode())]), name.encode(), stored(point, "float32")]


class NumberReader:
    """The numbers of a file, from front to back. All raise PriorError where it ends before."""

    def __init__(self, data: bytes, at: int, name: str) -> None:
        self.data, self.at, self.name = data, at, name

    def records(self, count: int, form: np.dtype) -> np.ndarray:
        if count * form.itemsize > len(self.data) - self.at:
            raise PriorError(f"{self.name} ends before what its head claims.")
        values = np.frombuffer(self.data, form, count, self.at).copy()
        self.at += values.nbytes
        return values

    def numbers(self, sizes: tuple[int, ...], form: np.dtype) -> np.ndarray:
        return self.records(int(np.prod(sizes, dtype=np.int64)), form).reshape(sizes).astype(np.float32)

    def layer(self, shape: FieldShape, index: int, codes: tuple[int, ...], form: int) -> Layer:
        """codes: () of a layer, (number of codes,) of its bases."""
        sizes = (*codes, shape.outputs(index), shape.inputs(index))
        if form in FLOATS:
            return Layer(self.numbers(sizes, FLOATS[form]), self.numbers(sizes[:-1], FLOATS[form]))
        scales = self.numbers(sizes[:-1], FLOATS[0])
        steps = self.numbers(sizes, np.dtype("i1"))
        return Layer(steps * scales[..., None], self.numbers(sizes[:-1], FLOATS[1]))

    def landmark(self) -> tuple[str, np.ndarray]:
        length = int(self.records(1, np.dtype("u1"))[0])
        name = self.records(length, np.dtype("u1")).tobytes().decode(errors="replace")
        return name, self.numbers((3,), FLOATS[0])

    def end(self) -> None:
        if self.at != len(self.data):
            raise PriorError(f"{self.name} has {len(self.data) - self.at} bytes that belong to nothing.")
