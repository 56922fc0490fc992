"""Prior files (.maqp) in numpy: written and read. The layout is that of sdk/src/head/files/prior_file.cpp, version 1
(docs/formats.md).

Bases are stored as float32, float16, or int8 with a scale for each row (their biases float16).
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from export.heads.prior import (
    MAX_ANCHORS,
    MAX_CODES,
    MAX_PLACES,
    FieldShape,
    Layer,
    Prior,
    PriorError,
    check_prior,
    check_shape,
)
from export.xxh3 import xxh3

MAGIC, VERSION = b"MAQPRI\r\n", 1
FORMATS = {"float32": 0, "float16": 1, "int8": 2}
HEAD = np.dtype(
    [
        ("magic", "S8"),
        ("version", "<u4"),
        ("head_bytes", "<u4"),
        ("check", "<u8"),  # of all that follows in the file
        ("file_bytes", "<u8"),
        ("shape", "<u4", 8),  # as in SHAPE_FIELDS
        ("smoothing", "<f4"),
        ("shape_codes", "<u4"),
        ("colour_codes", "<u4"),
        ("anchors", "<u4"),
        ("places", "<u4"),
        ("constant_format", "u1"),  # FORMATS, not int8
        ("bases_format", "u1"),  # FORMATS
        ("zero", "u1", 2),
        ("sharpness", "<f4"),
        ("cut_point", "<f4", 3),
        ("cut_normal", "<f4", 3),
        ("bounds_min", "<f4", 3),
        ("bounds_max", "<f4", 3),
        ("more_zeros", "u1", 4),
    ]
)
CHECKED = HEAD.fields["file_bytes"][1]  # from there on the check covers the file
SHAPE_FIELDS = (
    "octaves", "width", "geometry_layers", "feature", "surface_width", "surface_layers", "personal_geometry_layers",
    "personal_surface_layers",
)  # fmt: skip
FLOATS = {0: np.dtype("<f4"), 1: np.dtype("<f2")}
MAX_STORED_WEIGHT = 1e6


@dataclass(frozen=True)
class BasisError:
    """What storing the bases of a layer loses."""

    layer: int
    relative_rms: float  # of its weights and biases; 1: as large as they are
    largest: float


def prior_bytes(prior: Prior, bases: str = "int8", constant: str = "float16") -> bytes:
    """The bytes of a file. bases: of FORMATS; constant: likewise, but not int8. Raises PriorError for a prior that the
    SDK would refuse, and for numbers that such a format does not hold."""
    check_prior(prior)
    if bases not in FORMATS or constant not in FORMATS or constant == "int8":
        raise PriorError(f"bases cannot be stored as {bases} and constants as {constant}.")
    head = np.zeros((), HEAD)
    for name in ("sharpness", "cut_point", "cut_normal", "bounds_min", "bounds_max"):
        head[name] = getattr(prior, name)
    head["magic"], head["version"], head["head_bytes"] = MAGIC, VERSION, HEAD.itemsize
    head["shape"] = [getattr(prior.shape, name) for name in SHAPE_FIELDS]
    head["smoothing"] = prior.shape.smoothing
    head["shape_codes"], head["colour_codes"] = prior.shape_codes, prior.colour_codes
    head["anchors"], head["places"] = len(prior.anchor_sigma), len(prior.places)
    head["constant_format"], head["bases_format"] = FORMATS[constant], FORMATS[bases]
    parts = [part for layer in prior.constant for part in _layer_bytes(layer, constant)]
    parts += [part for layer in prior.shape_bases + prior.colour_bases for part in _layer_bytes(layer, bases)]
    parts += [_stored(values, "float32") for values in (prior.template_points, prior.anchor_mean)]
    parts += [_stored(prior.anchor_linear, "float16"), _stored(prior.anchor_sigma, "float32")]
    for name, point in prior.places.items():
        parts += [bytes([len(name.encode())]), name.encode(), _stored(point, "float32")]
    body = b"".join(parts)
    head["file_bytes"] = HEAD.itemsize + len(body)
    head["check"] = xxh3(head.tobytes()[CHECKED:] + body)
    return head.tobytes() + body


def write_prior(prior: Prior, path: Path, bases: str = "int8", constant: str = "float16") -> None:
    """Beside its place first: a crash leaves the old file. Raises what prior_bytes() raises."""
    data = prior_bytes(prior, bases, constant)
    beside = path.with_name(f"{path.name}.tmp")
    with beside.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    beside.replace(path)


def prior_from_bytes(data: bytes, name: str = "The prior in memory") -> Prior:
    """name: begins the sentence of errors. Raises PriorError for what is damaged or no prior."""
    if len(data) < HEAD.itemsize or not data.startswith(MAGIC):
        raise PriorError(f"{name} is not a prior of heads (.maqp).")
    head = np.frombuffer(data, HEAD, 1)[0]
    if head["version"] != VERSION:
        raise PriorError(f"{name} is a prior of version {head['version']}; version {VERSION} is read here.")
    if head["head_bytes"] != HEAD.itemsize or head["file_bytes"] != len(data) or head["check"] != xxh3(data[CHECKED:]):
        raise PriorError(f"{name} is cut off or damaged; copy it again.")
    shape = FieldShape(
        **dict(zip(SHAPE_FIELDS, map(int, head["shape"]), strict=True)), smoothing=float(head["smoothing"])
    )
    check_shape(shape)
    formats = int(head["constant_format"]), int(head["bases_format"])
    counts = int(head["shape_codes"]), int(head["colour_codes"])
    if formats[0] not in FLOATS or formats[1] not in FORMATS.values() or head["zero"].any() or head["more_zeros"].any():
        raise PriorError(f"{name} stores its numbers in a way that version {VERSION} does not have.")
    if max(counts) > MAX_CODES or head["anchors"] > MAX_ANCHORS or head["places"] > MAX_PLACES:
        raise PriorError(f"{name} claims more codes, anchors or places than can be used.")
    read = _Reader(data, HEAD.itemsize, name)
    constant = [read.layer(shape, index, (), formats[0]) for index in range(shape.layers)]
    bases = [
        [read.layer(shape, index, (codes,), formats[1]) for index in indices]
        for indices, codes in zip(shape.personal, counts, strict=True)
    ]
    anchors = int(head["anchors"])
    points, mean = (read.numbers((anchors, 3), FLOATS[0]) for _ in range(2))
    linear, sigma = read.numbers((anchors, 3, counts[0]), FLOATS[1]), read.numbers((anchors,), FLOATS[0])
    places = dict(read.place() for _ in range(int(head["places"])))
    read.end()
    planes = [head[key].astype(np.float32) for key in ("cut_point", "cut_normal", "bounds_min", "bounds_max")]
    prior = Prior(shape, constant, *bases, float(head["sharpness"]), *planes, points, mean, linear, sigma, places)
    check_prior(prior)
    return prior


def read_prior(path: Path) -> Prior:
    """Raises PriorError for what is damaged or no prior, OSError for what cannot be read."""
    return prior_from_bytes(path.read_bytes(), str(path))


def bases_errors(prior: Prior, bases: str = "int8") -> list[BasisError]:
    """What storing them so loses, of each personal layer."""
    stored = prior_from_bytes(prior_bytes(prior, bases))
    found = []
    geometry, surface = prior.shape.personal
    before, after = prior.shape_bases + prior.colour_bases, stored.shape_bases + stored.colour_bases
    for index, layer, kept in zip(geometry + surface, before, after, strict=True):
        true = np.concatenate([layer.weights.ravel(), layer.bias.ravel()]).astype(np.float64)
        error = np.concatenate([kept.weights.ravel(), kept.bias.ravel()]) - true
        scale = np.sqrt(np.square(true).sum())
        relative = float(np.sqrt(np.square(error).sum()) / scale) if scale > 0 else 0.0
        found.append(BasisError(index, relative, float(np.abs(error).max(initial=0))))
    return found


def _stored(values: np.ndarray, form: str) -> bytes:
    values = np.asarray(values, np.float32)
    with np.errstate(over="ignore"):
        stored = values.astype(FLOATS[FORMATS[form]])
    if not (np.abs(stored.astype(np.float32)) <= MAX_STORED_WEIGHT).all():
        raise PriorError(f"A number as large as {np.abs(values).max():g} cannot be stored as {form}; use float32.")
    return stored.tobytes()


def _layer_bytes(layer: Layer, form: str) -> list[bytes]:
    if form != "int8":
        return [_stored(layer.weights, form), _stored(layer.bias, form)]
    weights = np.asarray(layer.weights, np.float32)
    scales = (np.abs(weights).max(-1, initial=0) / 127).astype(np.float32)  # [codes, outputs]
    steps = np.divide(weights, scales[..., None], out=np.zeros_like(weights), where=scales[..., None] > 0)
    steps = np.clip(np.rint(steps), -127, 127).astype(np.int8)
    return [_stored(scales, "float32"), steps.tobytes(), _stored(layer.bias, "float16")]


class _Reader:
    """The numbers of a file, from front to back."""

    def __init__(self, data: bytes, at: int, name: str) -> None:
        self.data, self.at, self.name = data, at, name

    def numbers(self, sizes: tuple[int, ...], form: np.dtype) -> np.ndarray:
        count = int(np.prod(sizes, dtype=np.int64))
        if count * form.itemsize > len(self.data) - self.at:
            raise PriorError(f"{self.name} ends before what its head claims.")
        values = np.frombuffer(self.data, form, count, self.at).reshape(sizes)
        self.at += values.nbytes
        return values.astype(np.float32)

    def layer(self, shape: FieldShape, index: int, codes: tuple[int, ...], form: int) -> Layer:
        sizes = (*codes, shape.outputs(index), shape.inputs(index))
        if form in FLOATS:
            return Layer(self.numbers(sizes, FLOATS[form]), self.numbers(sizes[:-1], FLOATS[form]))
        scales = self.numbers(sizes[:-1], FLOATS[0])
        steps = self.numbers(sizes, np.dtype("i1"))
        return Layer(steps * scales[..., None], self.numbers(sizes[:-1], FLOATS[1]))

    def place(self) -> tuple[str, np.ndarray]:
        length = int(self.numbers((1,), np.dtype("u1"))[0])
        name = self.numbers((length,), np.dtype("u1")).astype(np.uint8).tobytes()
        return name.decode(errors="replace"), self.numbers((3,), FLOATS[0])

    def end(self) -> None:
        if self.at != len(self.data):
            raise PriorError(f"{self.name} has {len(self.data) - self.at} bytes that belong to nothing.")
