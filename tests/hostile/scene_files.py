"""Scene files: damage that the checks find, and extreme numbers whose checks fit."""

from random import Random

import numpy as np

from export.scenes.scene_file import BLOCK, CHECKED, HEAD
from export.xxh3 import xxh3
from tests.hostile.damage import FLOATS, INTEGERS, cut, flip
from tests.hostile.samples import SCENE_BUNDLE, Samples
from tests.hostile.trial import EITHER, REFUSED, Trial

RENDER = ("scene", "render", "a.maqs", "--bundle", str(SCENE_BUNDLE), "--path", "orbit", "--seconds", "0.1", "--size",
          "48x32", "--out", "a.mp4", "--threads", "1")  # fmt: skip
INFO = ("scene", "info", "a.maqs")


def _trial(rng: Random, how: str, data: bytes, expects: str) -> Trial:
    words = rng.choice((RENDER, INFO))
    return Trial("scene files", how, words, lambda folder: (folder / "a.maqs").write_bytes(data), expects)


def unchecked(samples: Samples, rng: Random, index: int) -> Trial:
    name = rng.choice(sorted(samples.scenes))
    how, data = (cut, flip)[index % 2](samples.scenes[name], rng)
    return _trial(rng, f"{name}: {how}", data, EITHER if data == samples.scenes[name] else REFUSED)


def checked(samples: Samples, rng: Random, index: int) -> Trial:
    """An extreme number in the head, a block, or anywhere in a section, with checks that fit."""
    name = rng.choice(sorted(samples.scenes))
    data = bytearray(samples.scenes[name])
    head = np.frombuffer(data, HEAD, 1)[0].copy()
    where = rng.choice(("head", "block", "section"))
    if where == "head":
        fields = [field for field in HEAD.names if field not in ("magic", "head_check", "sections")]
        how = _set_extreme(head, HEAD, rng.choice(fields), rng)
    elif where == "block":
        blocks = np.frombuffer(data, BLOCK, int(head["blocks"]), int(head["sections"][0]["offset"])).copy()
        block = blocks[rng.randrange(len(blocks))]
        how = _set_extreme(block, BLOCK, rng.choice(BLOCK.names), rng)
        begin = int(head["sections"][0]["offset"])
        data[begin : begin + blocks.nbytes] = blocks.tobytes()
    else:
        section = head["sections"][rng.randrange(4)]
        number = rng.choice(FLOATS[:6] + FLOATS[7:])
        place = int(section["offset"]) + rng.randrange(max(1, int(section["bytes"]) // 4)) * 4
        data[place : place + 4] = np.float32(number).tobytes()
        how = f"{number} at {place}"
    _sign(data, head)
    return _trial(rng, f"{name}: {where}: {how}", bytes(data), EITHER)


def sections(samples: Samples, rng: Random, index: int) -> Trial:
    """The table of sections with an extreme number and a check that fits."""
    name = rng.choice(sorted(samples.scenes))
    data = bytearray(samples.scenes[name])
    head = np.frombuffer(data, HEAD, 1)[0].copy()
    section, field, value = rng.randrange(4), rng.choice(("offset", "bytes")), rng.choice(INTEGERS)
    head["sections"][section][field] = value
    head["head_check"] = xxh3(head.tobytes()[CHECKED:])
    data[: HEAD.itemsize] = head.tobytes()
    return _trial(rng, f"{name}: section {section}: {field} = {value}", bytes(data), REFUSED)


def _set_extreme(record: np.ndarray, form: np.dtype, field: str, rng: Random) -> str:
    kind = form.fields[field][0]
    place = tuple(rng.randrange(length) for length in kind.shape)
    if kind.base.kind == "f":
        value = rng.choice([x for x in FLOATS if kind.base.itemsize == 8 or x != 1e300])
    else:
        value = rng.choice(INTEGERS) & ((1 << 8 * kind.base.itemsize) - 1)
    if place:
        record[field][place] = value
    else:
        record[field] = value
    return f"{field}{list(place) or ''} = {value}"


def _sign(data: bytearray, head: np.ndarray) -> None:
    """Writes the head with checks of the sections that lie in the file, and its own."""
    for section in head["sections"]:
        begin, size = int(section["offset"]), int(section["bytes"])
        section["check"] = xxh3(bytes(data[begin : begin + -(-size // 64) * 64]))
    head["head_check"] = xxh3(head.tobytes()[CHECKED:])
    data[: HEAD.itemsize] = head.tobytes()
