"""Head files (.maqh) in numpy: written and read, of version 1 read alone. The layout is that of
sdk/src/head/files/file_format.h, version 2 (docs/reference/formats.md)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from export.checked_file import START, checked_head, signed, write_whole
from export.heads.prior import MAX_ANCHORS, MAX_CODES, MAX_PLACES, FieldShape, Layer, PriorError
from export.heads.stored_numbers import FLOATS, SHAPE, NumberReader, shape_of, stored, stored_layer, stored_place

MAGIC, FIRST_VERSION, VERSION, MAX_CAMERAS = b"MAQHED\r\n", 1, 2, 256
SCALE_SOURCES = ("prior", "given", "depth")
HEAD = np.dtype(
    [
        *START,
        ("shape", SHAPE),
        ("shape_codes", "<u4"),
        ("colour_codes", "<u4"),
        ("cameras", "<u4"),
        ("anchors", "<u4"),
        ("places", "<u4"),
        ("sharpness", "<f4"),
        ("scale_source", "u1"),
        ("has_texture", "u1"),
        ("has_code_factor", "u1"),  # 0 in version 1
        ("zero", "u1"),
        ("metres_per_unit", "<f8"),
        ("metres_sigma", "<f8"),
        ("cut_point", "<f8", 3),
        ("cut_normal", "<f8", 3),
        ("bounds_min", "<f4", 3),
        ("bounds_max", "<f4", 3),
        ("prior_sha256", "u1", 32),
    ]
)
# x right, y down, z forward; in the camera = rotation p + translation; pixel = focal_px * (x, y) / z + (cx_px, cy_px).
CAMERA = np.dtype(
    [
        ("width_px", "<i4"),
        ("height_px", "<i4"),
        ("focal_px", "<f8"),
        ("cx_px", "<f8"),
        ("cy_px", "<f8"),
        ("rotation", "<f8", (3, 3)),
        ("translation", "<f8", 3),
    ]
)


class HeadFileError(PriorError):
    """A file is not a head that can be read; the sentence says why."""


@dataclass(frozen=True, eq=False)
class StoredHead:
    """One fitted head. Lengths in dm but for the scale; M anchors; arrays are float32 where nothing else is said."""

    shape: FieldShape
    layers: list[Layer]  # of the field, combined
    shape_codes: np.ndarray
    colour_codes: np.ndarray
    cameras: np.ndarray  # CAMERA [photos]
    metres_per_unit: float
    metres_sigma: float
    scale_source: str  # of SCALE_SOURCES
    sharpness: float  # s of the opacity along rays, 1/dm
    cut_point: np.ndarray  # float64 [3]
    cut_normal: np.ndarray  # float64 [3], out of the head
    bounds_min: np.ndarray
    bounds_max: np.ndarray
    template_points: np.ndarray  # [M, 3]
    anchor_points: np.ndarray  # [M, 3]: where they lie on this head
    anchor_sigma: np.ndarray  # [M]
    places: dict[str, np.ndarray]  # name -> [3] on the template head
    prior_sha256: str  # of the prior's file, which the codes belong to; zeros: not known
    texture_px: int = 0  # a side; 0: there is no texture
    texture: bytes = b""  # a JPEG file
    # [K (K + 1) / 2] of K shape codes: the Cholesky factor of their covariance, lower triangle, row by row; None: not
    # known, and no photo can be added.
    code_factor: np.ndarray | None = None


def head_bytes(head: StoredHead) -> bytes:
    """The bytes of a file. Raises HeadFileError for numbers that it cannot hold."""
    stored_head = np.zeros((), HEAD)
    for name in ("metres_per_unit", "metres_sigma", "sharpness", "cut_point", "cut_normal", "bounds_min", "bounds_max"):
        stored_head[name] = getattr(head, name)
    stored_head["shape"] = tuple(getattr(head.shape, name) for name in SHAPE.names)
    stored_head["shape_codes"], stored_head["colour_codes"] = len(head.shape_codes), len(head.colour_codes)
    stored_head["cameras"], stored_head["anchors"] = len(head.cameras), len(head.anchor_sigma)
    stored_head["places"] = len(head.places)
    stored_head["scale_source"] = SCALE_SOURCES.index(head.scale_source)
    stored_head["has_texture"] = head.texture_px > 0
    stored_head["has_code_factor"] = head.code_factor is not None
    stored_head["prior_sha256"] = np.frombuffer(bytes.fromhex(head.prior_sha256), np.uint8)
    try:
        parts = [part for layer in head.layers for part in stored_layer(layer, "float16")]
        parts += [stored(codes, "float32") for codes in (head.shape_codes, head.colour_codes)]
        if head.code_factor is not None:
            parts.append(stored(head.code_factor, "float16"))
        parts.append(np.ascontiguousarray(head.cameras, CAMERA).tobytes())
        parts += [stored(a, "float16") for a in (head.template_points, head.anchor_points, head.anchor_sigma)]
        parts += [part for name, point in head.places.items() for part in stored_place(name, point)]
        if head.texture_px > 0:
            parts += [np.array([head.texture_px, len(head.texture)], "<u4").tobytes(), head.texture]
    except PriorError as error:
        raise HeadFileError(f"The head cannot be stored: {error}") from None
    return signed(stored_head, MAGIC, VERSION, b"".join(parts))


def write_head(head: StoredHead, path: Path) -> None:
    """The file appears atomically. Raises what head_bytes() raises, OSError for what cannot be written."""
    write_whole(head_bytes(head), path)


def head_from_bytes(data: bytes, name: str = "The head in memory") -> StoredHead:
    """name: begins the sentence of errors. Raises HeadFileError for what is damaged or no head."""
    try:
        return _read(data, name)
    except PriorError as error:
        raise HeadFileError(str(error)) from None


def read_head(path: Path) -> StoredHead:
    """Raises HeadFileError for what is damaged or no head, OSError for what cannot be read."""
    return head_from_bytes(path.read_bytes(), str(path))


def _read(data: bytes, name: str) -> StoredHead:
    version = FIRST_VERSION if data[8:12] == np.uint32(FIRST_VERSION).tobytes() else VERSION
    head = checked_head(data, HEAD, MAGIC, version, name, "a head (.maqh)", PriorError)
    shape = shape_of(head["shape"])
    counts = [int(head[key]) for key in ("shape_codes", "colour_codes", "cameras", "anchors", "places")]
    if any(
        n > limit for n, limit in zip(counts, (MAX_CODES, MAX_CODES, MAX_CAMERAS, MAX_ANCHORS, MAX_PLACES), strict=True)
    ):
        raise HeadFileError(f"{name} claims more codes, cameras, anchors or places than a head may have.")
    has_other = head["zero"] > 0 or head["has_texture"] > 1 or head["has_code_factor"] > version - FIRST_VERSION
    if has_other or head["scale_source"] >= len(SCALE_SOURCES):
        raise HeadFileError(f"{name} stores its numbers in a way that version {version} does not have.")
    single, half = FLOATS[0], FLOATS[1]
    read = NumberReader(data, HEAD.itemsize, name)
    layers = [read.layer(shape, index, (), 1) for index in range(shape.layers)]
    codes = [read.numbers((count,), single) for count in counts[:2]]
    factor = read.numbers((counts[0] * (counts[0] + 1) // 2,), half) if head["has_code_factor"] else None
    cameras = read.records(counts[2], CAMERA)
    points, on_head = (read.numbers((counts[3], 3), half) for _ in range(2))
    sigma = read.numbers((counts[3],), half)
    places = dict(read.place() for _ in range(counts[4]))
    texture_px, texture = 0, b""
    if head["has_texture"]:
        texture_px, size = (int(number) for number in read.records(2, np.dtype("<u4")))
        texture = read.records(size, np.dtype("u1")).tobytes()
    read.end()
    return StoredHead(
        shape,
        layers,
        *codes,
        cameras,
        float(head["metres_per_unit"]),
        float(head["metres_sigma"]),
        SCALE_SOURCES[head["scale_source"]],
        float(head["sharpness"]),
        *(head[key].copy() for key in ("cut_point", "cut_normal", "bounds_min", "bounds_max")),
        points,
        on_head,
        sigma,
        places,
        head["prior_sha256"].tobytes().hex(),
        texture_px,
        texture,
        factor,
    )
