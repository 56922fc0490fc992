"""Images and clips: cut, damaged, with sizes that they do not have, and of kinds that are not read."""

import struct
import zlib
from pathlib import Path
from random import Random

from tests.hostile.damage import cut, damaged
from tests.hostile.samples import DENSEPOSE, Samples
from tests.hostile.trial import EITHER, REFUSED, Trial

SIDES = (0, 1, 63, 65, 4096, 16384, 65535, 1 << 24, (1 << 31) - 1, 1 << 31, (1 << 32) - 1)
# Beginnings of image kinds that may be unsupported: the program reads the image, or its message names the kind.
OTHER_KINDS = {
    "a.gif": b"GIF89a\x10\0\x10\0\xf0\0\0\0\0\0\xff\xff\xff,\0\0\0\0\x10\0\x10\0\0\x02\x0e\x8c\x8f\xa9\xcb\xed\x0f;",
    "a.heic": struct.pack(">I", 24) + b"ftypheic\0\0\0\0mif1heic" + bytes(200),
    "a.avif": struct.pack(">I", 24) + b"ftypavif\0\0\0\0mif1avif" + bytes(200),
    "a.tga": b"\0\0\x02" + bytes(9) + struct.pack("<HH", 16, 16) + b"\x18\0" + bytes(768),
    "a.svg": b'<?xml version="1.0"?><svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>',
    "a.pdf": b"%PDF-1.7\n1 0 obj\n<<>>\nendobj\n",
    "a.jxl": b"\0\0\0\x0cJXL \r\n\x87\n" + bytes(100),
    "a.psd": b"8BPS\0\1" + bytes(100),
    "a.ico": b"\0\0\1\0\1\0\x10\x10\0\0\1\0 \0" + bytes(100),
    "a.txt": b"A letter, and no picture.\n",
    "a.json": b"{}\n",
    "a.html": b"<!doctype html><title>404</title>\n",
    "a.jpg": b"\xff\xd8\xff\xe0",
    "a.png": b"\x89PNG\r\n\x1a\n",
    "a.webp": b"RIFF\xff\xff\xff\xffWEBPVP8X" + bytes(64),
    "animated.webp": b"RIFF\x40\0\0\0WEBPVP8X\x0a\0\0\0\x02" + bytes(9) + b"ANIM\6\0\0\0" + bytes(30),
    "empty.jpg": b"",
    "zeros.png": bytes(100_000),
}


def _run(index: int, name: str) -> tuple[str, ...]:
    return (("play", name, "--no-image", "--seconds", "1") if index % 4 == 3 else
            ("record", name, "a.maqrec", "--frames", "1") if index % 4 == 2 else (*DENSEPOSE, name))  # fmt: skip


def _trial(kind: str, index: int, name: str, how: str, data: bytes, expects: str) -> Trial:
    return Trial(kind, f"{name}: {how}", _run(index, name), lambda folder: (folder / name).write_bytes(data), expects)


def images(samples: Samples, rng: Random, index: int) -> Trial:
    name = rng.choice(sorted(samples.images))
    how, data = (cut if index % 3 == 0 else damaged)(samples.images[name], rng)
    return _trial("images", index, name, how, data, REFUSED if index % 3 == 0 else EITHER)


def other_kinds(samples: Samples, rng: Random, index: int) -> Trial:
    name = sorted(OTHER_KINDS)[index % len(OTHER_KINDS)]
    return _trial("images", index, name, "another kind", OTHER_KINDS[name], REFUSED)


def sizes(samples: Samples, rng: Random, index: int) -> Trial:
    """Claims another size than its pixels fill."""
    name = rng.choice(sorted(set(samples.images) - {"lossy.webp", "lossless.webp"}))
    width, height = rng.choice(SIDES), rng.choice(SIDES)
    data = with_size(name, samples.images[name], width, height)
    expects = REFUSED if width * height > 64 * 48 else EITHER  # the pixels of a smaller one are there
    return _trial("images", index, name, f"claims {width} x {height}", data, expects)


def with_size(name: str, data: bytes, width: int, height: int) -> bytes:
    """The file of 64 x 48 pixels with another size in its head, and a checksum that fits."""
    kind = Path(name).suffix
    if kind == ".png":
        head = b"IHDR" + struct.pack(">II", width & 0xFFFFFFFF, height & 0xFFFFFFFF) + data[24:29]
        return data[:12] + head + struct.pack(">I", zlib.crc32(head)) + data[33:]
    if kind == ".jpg":
        place = min(at for at in (data.find(b"\xff\xc0\0"), data.find(b"\xff\xc2\0")) if at >= 0) + 5
        return data[:place] + struct.pack(">HH", height & 0xFFFF, width & 0xFFFF) + data[place + 4 :]
    if kind == ".bmp":
        return data[:18] + struct.pack("<II", width & 0xFFFFFFFF, height & 0xFFFFFFFF) + data[26:]
    if kind == ".ppm":
        return data.replace(b"64 48", f"{width} {height}".encode(), 1)
    if kind == ".tif":
        changed = bytearray(data)
        begin = struct.unpack_from("<I", data, 4)[0]
        for entry in range(struct.unpack_from("<H", data, begin)[0]):
            place = begin + 2 + 12 * entry
            tag = struct.unpack_from("<H", data, place)[0]
            if tag in (256, 257):  # ImageWidth, ImageLength
                struct.pack_into("<HII", changed, place + 2, 4, 1, (width if tag == 256 else height) & 0xFFFFFFFF)
        return bytes(changed)
    raise ValueError(f"no size is known in {name}")


def clips(samples: Samples, rng: Random, index: int) -> Trial:
    name = rng.choice(sorted(samples.clips))
    way = (cut, damaged, damaged)[index % 3]
    data = samples.clips[name]
    if way is damaged and index % 2:  # boxes and lists stand at the ends
        how, head = damaged(data[:4000], rng)
        return _trial("clips", index, name, how, head + data[4000:], EITHER)
    how, data = way(data, rng)
    return _trial("clips", index, name, how, data, EITHER)
