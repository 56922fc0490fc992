"""Damages bytes, numbers and JSON. Each function draws from `rng` (random.Random) and says what it did."""

import json
import struct
from random import Random

INTEGERS = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 1 << 40, (1 << 63) - 1, 1 << 63,
            (1 << 64) - 1, (1 << 64) - 8)  # fmt: skip
FLOATS = (0.0, -0.0, 1e-320, 1e-38, 3e38, -3e38, 1e300, float("inf"), float("-inf"), float("nan"))
# Texts in place of a value of JSON; several are not JSON.
JSON_VALUES = (
    "0", "-0", "-1", "1", "0.1", "1e400", "-1e400", "1e308", "-1e308", "1e-320", "NaN", "Infinity", "2147483647",
    "2147483648", "-2147483649", "4294967296", "9223372036854775807", "9223372036854775808", "18446744073709551616",
    "1e19", "true", "null", '""', '"x"', '"../../../etc/passwd"', '"/dev/zero"', '"a\\u0000b"',
    '"\\ud800"', '"\x1b[2J"',
    '"%s%n"', "[]", "{}", "[[]]", '{"": 0}', "'x'", "nan", "01", "",
)  # fmt: skip


def cut(data: bytes, rng: Random) -> tuple[str, bytes]:
    """Between 5 and 95 % of it: what is lost is certainly missed."""
    length = rng.randint(len(data) // 20, len(data) * 19 // 20)
    return f"cut to {length} of {len(data)} bytes", data[:length]


def flip(data: bytes, rng: Random) -> tuple[str, bytes]:
    changed, places = bytearray(data), sorted(rng.randrange(len(data)) for _ in range(rng.choice((1, 1, 2, 8))))
    for place in places:
        changed[place] ^= 1 << rng.randrange(8)
    return f"bits flipped at {places}", bytes(changed)


def overwrite(data: bytes, rng: Random) -> tuple[str, bytes]:
    begin, value = rng.randrange(len(data)), rng.choice((0, 0xFF, None))
    length = min(rng.choice((1, 4, 16, 256, 4096)), len(data) - begin)
    filling = rng.randbytes(length) if value is None else bytes([value]) * length
    return f"{length} bytes from {begin} on are {value}", data[:begin] + filling + data[begin + length :]


def remove(data: bytes, rng: Random) -> tuple[str, bytes]:
    begin = rng.randrange(len(data))
    length = rng.choice((1, 4, 64, 1024))
    return f"{length} bytes removed at {begin}", data[:begin] + data[begin + length :]


def repeat(data: bytes, rng: Random) -> tuple[str, bytes]:
    begin = rng.randrange(len(data))
    length = rng.choice((1, 4, 64, 1024))
    return f"{length} bytes repeated at {begin}", data[: begin + length] + data[begin:]


def extreme_number(data: bytes, rng: Random) -> tuple[str, bytes]:
    """A number of 2, 4 or 8 bytes, of either byte order, in place of what is there."""
    form = rng.choice(("<H", ">H", "<I", ">I", "<Q", ">Q", "<f", "<d"))
    size = struct.calcsize(form)
    place = max(0, rng.randrange(max(1, len(data) - size)) // rng.choice((1, 4)) * 4)
    if form[1] in "fd":
        value = rng.choice(FLOATS[:6] + FLOATS[7:] if form == "<f" else FLOATS)
    else:
        value = rng.choice(INTEGERS) & ((1 << 8 * size) - 1)
    changed = data[:place] + struct.pack(form, value) + data[place + size :]
    return f"{form} {value} at {place}", changed


WAYS = (cut, flip, overwrite, remove, repeat, extreme_number)


def damaged(data: bytes, rng: Random) -> tuple[str, bytes]:
    """In one of all ways; may be valid still."""
    return rng.choice(WAYS)(data, rng)


def damaged_json(document: object, rng: Random) -> tuple[str, str]:
    """Text of a document in which one value is another, missing, there twice or nested without end."""
    places = list(_places(document))
    path = rng.choice(places)
    way = rng.choice(("replace", "replace", "replace", "remove", "nest", "lengthen"))
    if way == "remove" or not path:
        changed = _with(document, path, None, is_removed=True) if path else []
        return f"{_name(path)} removed", json.dumps(changed)
    if way == "nest":
        value = rng.choice(("[", '{"a":')) * 100_000
    elif way == "lengthen":
        value = rng.choice(("[" + "0," * 100_000 + "0]", '"' + "x" * 1_000_000 + '"', "9" * 5000))
    else:
        value = rng.choice(JSON_VALUES)
    text = json.dumps(_with(document, path, "@here@")).replace('"@here@"', value)
    return f"{_name(path)} = {value[:40]}", text


def _places(document: object, path: tuple = ()):
    yield path
    items = (
        document.items() if isinstance(document, dict) else enumerate(document) if isinstance(document, list) else ()
    )
    for key, value in items:
        yield from _places(value, (*path, key))


def _with(document: object, path: tuple, value: object, is_removed: bool = False) -> object:
    copied = json.loads(json.dumps(document))
    at = copied
    for key in path[:-1]:
        at = at[key]
    if is_removed:
        del at[path[-1]]
    else:
        at[path[-1]] = value
    return copied


def _name(path: tuple) -> str:
    return ".".join(map(str, path)) or "the document"
