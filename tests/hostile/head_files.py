"""Head files (.maqh): damage that the check finds, and extreme numbers whose check fits."""

from random import Random

import numpy as np

from export.checked_file import CHECKED, START
from export.heads.stored_numbers import SHAPE
from export.xxh3 import xxh3
from tests.hostile.damage import FLOATS, INTEGERS, cut, flip
from tests.hostile.samples import Samples
from tests.hostile.trial import EITHER, REFUSED, Trial

HEAD = np.dtype(
    [
        *START,
        ("shape", SHAPE),
        *((name, "<u4") for name in ("shape_codes", "colour_codes", "cameras", "anchors", "landmarks")),
        ("sharpness", "<f4"),
        *((name, "u1") for name in ("scale_source", "has_texture", "has_code_factor", "zero")),
        *((name, "<f8") for name in ("metres_per_unit", "metres_sigma")),
        *((name, "<f8", 3) for name in ("cut_point", "cut_normal")),
        *((name, "<f4", 3) for name in ("bounds_min", "bounds_max")),
        ("prior_sha256", "u1", 32),
    ]
)  # sdk/src/head/files/file_format.h, version 2
INFO = ("head", "info", "a.maqh")
UNCHECKED = ("magic", "check")


def _trial(how: str, data: bytes, expects: str) -> Trial:
    return Trial("head files", how, INFO, lambda folder: (folder / "a.maqh").write_bytes(data), expects)


def unchecked(samples: Samples, rng: Random, index: int) -> Trial:
    name = rng.choice(sorted(samples.heads))
    how, data = (cut, flip)[index % 2](samples.heads[name], rng)
    return _trial(f"{name}: {how}", data, EITHER if data == samples.heads[name] else REFUSED)


def checked(samples: Samples, rng: Random, index: int) -> Trial:
    """An extreme number in the head or behind it, or a cut, with a check that fits."""
    name = rng.choice(sorted(samples.heads))
    data = bytearray(samples.heads[name])
    where = ("head", "behind", "cut")[index % 3]
    if where == "cut":
        del data[rng.randrange(HEAD.itemsize, len(data)) :]
        how = f"cut to {len(data)} bytes"
    elif where == "head":
        head = np.frombuffer(data, HEAD, 1)[0].copy()
        field = rng.choice([field for field in HEAD.names if field not in UNCHECKED])
        how = _set_extreme(head, field, rng)
        data[: HEAD.itemsize] = head.tobytes()
    else:
        place, number = rng.randrange(HEAD.itemsize, len(data) - 4), rng.choice(FLOATS[:6] + FLOATS[7:])
        data[place : place + 4] = np.float32(number).tobytes()
        how = f"{number} at {place}"
    _sign(data, with_length=where == "cut")
    return _trial(f"{name}: {how}", bytes(data), EITHER)


def _set_extreme(record: np.ndarray, field: str, rng: Random) -> str:
    """One number of the field, which may be a struct or an array."""
    part, kind = record, HEAD.fields[field][0]
    name = field
    while kind.names:
        part, name = part[name], rng.choice(kind.names)
        kind = kind.fields[name][0]
    if kind.base.kind == "f":
        value = rng.choice([x for x in FLOATS if kind.base.itemsize == 8 or abs(x) != 1e300])
    else:
        value = rng.choice(INTEGERS) & ((1 << 8 * kind.base.itemsize) - 1)
    if kind.shape:
        part[name][tuple(rng.randrange(length) for length in kind.shape)] = value
    else:
        part[name] = value
    return f"{field} {name} = {value}"


def _sign(data: bytearray, with_length: bool) -> None:
    head = np.frombuffer(data, HEAD, 1)[0].copy()
    if with_length:
        head["file_bytes"] = len(data)
    data[: HEAD.itemsize] = head.tobytes()
    head["check"] = xxh3(bytes(data[CHECKED:]))
    data[: HEAD.itemsize] = head.tobytes()
