"""Recordings: damage that the checks find, and extreme numbers whose checks fit."""

import json
import struct
from random import Random

from export.xxh3 import xxh3
from tests.hostile.damage import INTEGERS, cut, damaged_json, flip
from tests.hostile.samples import DENSEPOSE, Samples
from tests.hostile.trial import EITHER, REFUSED, Trial

HEAD = struct.Struct("<8sIIQ")
FRAME = struct.Struct("<IIqQIiiiiIQQ")
FIELDS = ("magic", "head_check", "timestamp_ns", "sequence", "encoding", "width_px", "height_px", "depth_width_px",
          "depth_height_px", "predicted_us", "picture_bytes", "payload_check")  # fmt: skip
PLAYS = (
    (*DENSEPOSE, "rec:a.maqrec"),
    ("play", "a.maqrec", "--no-image", "--seconds", "1", "--json", "a.json"),
    ("record", "a.maqrec", "b.maqrec", "--frames", "8"),
)


# Dense pose of two frames does not see the others.
WHOLE_PLAYS = PLAYS[1:]


def _trial(index: int, how: str, data: bytes, expects: str) -> Trial:
    plays = WHOLE_PLAYS if expects == REFUSED else PLAYS
    words = plays[index % len(plays)]
    return Trial("recordings", how, words, lambda folder: (folder / "a.maqrec").write_bytes(data), expects)


def _sample(samples: Samples, rng: Random) -> tuple[str, bytes]:
    name = rng.choice(sorted(samples.recordings))
    return name, samples.recordings[name]


def unchecked(samples: Samples, rng: Random, index: int) -> Trial:
    name, data = _sample(samples, rng)
    how, changed = (cut, flip)[rng.randrange(2)](data, rng)
    return _trial(index, f"{name}: {how}", changed, EITHER if changed == data else REFUSED)


def heads(samples: Samples, rng: Random, index: int) -> Trial:
    """Changes the recording's description, with a correct check."""
    name, data = _sample(samples, rng)
    magic, version, length, _ = HEAD.unpack_from(data)
    described = json.loads(data[HEAD.size : HEAD.size + length])
    described.setdefault("calibration", {"width_px": 32, "height_px": 24, "fx_px": 30.0, "fy_px": 30.0, "cx_px": 16.0,
                                         "cy_px": 12.0, "distortion": [0.0] * 8})  # fmt: skip
    how, text = damaged_json(described, rng)
    encoded = text.encode("utf-8", "surrogatepass")
    head = HEAD.pack(magic, version, len(encoded), xxh3(encoded))
    return _trial(index, f"{name}: {how}", head + encoded + data[HEAD.size + length :], EITHER)


def frames(samples: Samples, rng: Random, index: int) -> Trial:
    """A number of a frame's head, with a check that fits."""
    name, data = _sample(samples, rng)
    places = [place for place in range(len(data) - FRAME.size) if data[place : place + 4] == b"MAQF"]
    place = rng.choice(places)
    values = list(FRAME.unpack_from(data, place))
    field = rng.choice(("timestamp_ns", "sequence", "encoding", "width_px", "height_px", "depth_width_px",
                        "depth_height_px", "picture_bytes"))  # fmt: skip
    at = FIELDS.index(field)
    bits = 64 if field in ("timestamp_ns", "sequence", "picture_bytes") else 32
    value = rng.choice(INTEGERS) & ((1 << bits) - 1)
    if field not in ("sequence", "encoding", "picture_bytes") and value >> (bits - 1):
        value -= 1 << bits
    values[at] = value
    head = FRAME.pack(*values)
    head = head[:4] + struct.pack("<I", xxh3(head[8:]) & 0xFFFFFFFF) + head[8:]
    changed = data[:place] + head + data[place + FRAME.size :]
    return _trial(index, f"{name}: frame at {place}: {field} = {value}", changed, EITHER)


def indices(samples: Samples, rng: Random, index: int) -> Trial:
    """The index of the frames, with a check that fits."""
    name, data = _sample(samples, rng)
    begin, _ = struct.unpack("<QQ", data[-24:-8])
    entries = bytearray(data[begin:-24])
    place, value = rng.randrange(len(entries) // 8) * 8, rng.choice(INTEGERS)
    struct.pack_into("<Q", entries, place, value)
    tail = struct.pack("<QQ", begin, xxh3(bytes(entries))) + b"MAQEND\r\n"
    return _trial(index, f"{name}: index: {value} at {place}", data[:begin] + bytes(entries) + tail, EITHER)
