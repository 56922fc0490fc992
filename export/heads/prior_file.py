"""Prior files (.maqp) in numpy: written and read. The layout is that of sdk/src/head/files/file_format.h, version 1
(docs/reference/formats.md).

Bases are stored as float32, float16, or int8 with a scale for each row (their biases float16).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from export.checked_file import START, checked_head, signed, write_whole
from export.heads.prior import MAX_ANCHORS, MAX_CODES, MAX_LANDMARKS, Prior, PriorError, check_prior
from export.heads.stored_numbers import (
    FLOATS,
    FORMATS,
    SHAPE,
    NumberReader,
    shape_of,
    stored,
    stored_landmark,
    stored_layer,
)

MAGIC, VERSION = b"MAQPRI\r\n", 1
HEAD = np.dtype(
    [
        *START,
        ("shape", SHAPE),
        ("shape_codes", "<u4"),
        ("colour_codes", "<u4"),
        ("anchors", "<u4"),
        ("landmarks", "<u4"),
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


@dataclass(frozen=True)
class BasisError:
    """Error from storing the bases of a layer."""

    layer: int
    relative_rms: float  # of its weights and biases; 1: as large as they are
    largest: float


def prior_bytes(prior: Prior, bases: str = "int8", constant: str = "float16") -> bytes:
    """The bytes of a file. bases, constant: one of FORMATS each, constant not int8. Raises PriorError for a prior that
    the SDK would refuse, and for numbers that such a format does not hold."""
    check_prior(prior)
    if bases not in FORMATS or constant not in FORMATS or constant == "int8":
        raise PriorError(f"Bases cannot be stored as {bases} and constants as {constant}.")
    head = np.zeros((), HEAD)
    for name in ("shape_codes", "colour_codes", "sharpness", "cut_point", "cut_normal", "bounds_min", "bounds_max"):
        head[name] = getattr(prior, name)
    head["shape"] = tuple(getattr(prior.shape, name) for name in SHAPE.names)
    head["anchors"], head["landmarks"] = len(prior.anchor_sigma), len(prior.landmarks)
    head["constant_format"], head["bases_format"] = FORMATS[constant], FORMATS[bases]
    parts = [part for layer in prior.constant for part in stored_layer(layer, constant)]
    parts += [part for layer in prior.shape_bases + prior.colour_bases for part in stored_layer(layer, bases)]
    parts += [stored(values, "float32") for values in (prior.template_points, prior.anchor_mean)]
    parts += [stored(prior.anchor_linear, "float16"), stored(prior.anchor_sigma, "float32")]
    parts += [part for name, point in prior.landmarks.items() for part in stored_landmark(name, point)]
    return signed(head, MAGIC, VERSION, b"".join(parts))


def write_prior(prior: Prior, path: Path, bases: str = "int8", constant: str = "float16") -> None:
    """The file appears atomically. Raises what prior_bytes() raises, OSError for what cannot be written."""
    write_whole(prior_bytes(prior, bases, constant), path)


def prior_from_bytes(data: bytes, name: str = "The prior in memory") -> Prior:
    """name: begins the sentence of errors. Raises PriorError for what is damaged or no prior."""
    head = checked_head(data, HEAD, MAGIC, VERSION, name, "a prior of heads (.maqp)", PriorError)
    shape = shape_of(head["shape"])
    formats = int(head["constant_format"]), int(head["bases_format"])
    counts = int(head["shape_codes"]), int(head["colour_codes"])
    if formats[0] not in FLOATS or formats[1] not in FORMATS.values() or head["zero"].any() or head["more_zeros"].any():
        raise PriorError(f"{name} stores its numbers in a way that version {VERSION} does not have.")
    if max(counts) > MAX_CODES or head["anchors"] > MAX_ANCHORS or head["landmarks"] > MAX_LANDMARKS:
        raise PriorError(f"{name} claims more codes, anchors or landmarks than can be used.")
    read = NumberReader(data, HEAD.itemsize, name)
    constant = [read.layer(shape, index, (), formats[0]) for index in range(shape.layers)]
    bases = [
        [read.layer(shape, index, (codes,), formats[1]) for index in indices]
        for indices, codes in zip(shape.personal, counts, strict=True)
    ]
    anchors = int(head["anchors"])
    points, mean = (read.numbers((anchors, 3), FLOATS[0]) for _ in range(2))
    linear, sigma = read.numbers((anchors, 3, counts[0]), FLOATS[1]), read.numbers((anchors,), FLOATS[0])
    landmarks = dict(read.landmark() for _ in range(int(head["landmarks"])))
    read.end()
    planes = [head[key].copy() for key in ("cut_point", "cut_normal", "bounds_min", "bounds_max")]
    prior = Prior(shape, constant, *bases, float(head["sharpness"]), *planes, points, mean, linear, sigma, landmarks)
    check_prior(prior)
    return prior


def read_prior(path: Path) -> Prior:
    """Raises PriorError for what is damaged or no prior, OSError for what cannot be read."""
    return prior_from_bytes(path.read_bytes(), str(path))


def bases_errors(prior: Prior, bases: str = "int8") -> list[BasisError]:
    """Error of each personal layer from this storage."""
    kept_prior = prior_from_bytes(prior_bytes(prior, bases))
    found = []
    geometry, surface = prior.shape.personal
    before, after = prior.shape_bases + prior.colour_bases, kept_prior.shape_bases + kept_prior.colour_bases
    for index, layer, kept in zip(geometry + surface, before, after, strict=True):
        true = np.concatenate([layer.weights.ravel(), layer.bias.ravel()]).astype(np.float64)
        error = np.concatenate([kept.weights.ravel(), kept.bias.ravel()]) - true
        scale = np.sqrt(np.square(true).sum())
        relative = float(np.sqrt(np.square(error).sum()) / scale) if scale > 0 else 0.0
        found.append(BasisError(index, relative, float(np.abs(error).max(initial=0))))
    return found
