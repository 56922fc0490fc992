"""Captures: transforms.json, clouds, photos and COLMAP models with damage in them."""

import json
import re
import shutil
from pathlib import Path
from random import Random

from tests.hostile.damage import cut, damaged, damaged_json
from tests.hostile.samples import CAPTURE, SCENE_BUNDLE, Samples
from tests.hostile.trial import EITHER, REFUSED, Trial

BUILD = ("scene", "build", "capture", "--bundle", str(SCENE_BUNDLE), "--out", "a.maqs", "--threads", "1")
EXTREME = ("0", "-1", "1e400", "-1e400", "nan", "inf", "1e308", "1e-320", "4294967296", "18446744073709551616", "x", "",
           "0x10", "9" * 5000, "../../etc/passwd", "\x1b[2J", "\0")  # fmt: skip


def _copied(changes: dict[str, bytes]):
    def prepare(folder: Path) -> None:
        shutil.copytree(CAPTURE, folder / "capture")
        for name, data in changes.items():
            (folder / "capture" / name).write_bytes(data)

    return prepare


def transforms(samples: Samples, rng: Random, index: int) -> Trial:
    how, text = damaged_json(json.loads((CAPTURE / "transforms.json").read_text()), rng)
    data = {"transforms.json": text.encode("utf-8", "surrogatepass")}
    return Trial("captures", f"transforms.json: {how}", BUILD, _copied(data))


def clouds(samples: Samples, rng: Random, index: int) -> Trial:
    """Headers with other words, bytes that are damaged anywhere, and files that are cut."""
    data = (CAPTURE / "cloud.ply").read_bytes()
    head, mark, rows = data.partition(b"end_header\n")
    expects = EITHER
    if index % 3 == 0:
        words = re.split(rb"(\s+)", head)
        place = 2 * rng.randrange(len(words) // 2)
        value = rng.choice(EXTREME)
        how, words[place] = f"header: {words[place].decode()} is {value[:20]}", value.encode()
        data = b"".join(words) + mark + rows
    elif index % 3 == 1:
        how, data = damaged(data, rng)
    else:
        how, data = cut(data, rng)
        expects = REFUSED
    return Trial("captures", f"cloud.ply: {how}", BUILD, _copied({"cloud.ply": data}), expects)


def photos(samples: Samples, rng: Random, index: int) -> Trial:
    """A damaged photo is left out and counted; images of other kinds and sizes stand in for one."""
    name = rng.choice(sorted(path.name for path in (CAPTURE / "images").iterdir()))
    how, data = cut((CAPTURE / "images" / name).read_bytes(), rng)
    if index % 2:
        other = rng.choice(sorted(samples.images))
        how, data = f"{other}", samples.images[other]
    return Trial(
        "captures", f"{name}: {how}", BUILD, _copied({f"images/{name}": data}), EITHER if index % 2 else REFUSED
    )


def colmap(samples: Samples, rng: Random, index: int) -> Trial:
    """A model in text with one word that is another."""
    texts = dict(samples.colmap)
    name = rng.choice(sorted(texts))
    words = re.split(r"(\s+)", texts[name])
    place = 2 * rng.randrange(len(words) // 2)
    value = rng.choice(EXTREME)
    how, words[place] = f"{words[place]} is {value[:20]!r}", value
    texts[name] = "".join(words)

    def prepare(folder: Path) -> None:
        (folder / "capture/sparse/0").mkdir(parents=True)
        shutil.copytree(CAPTURE / "images", folder / "capture/images")
        for file, text in texts.items():
            (folder / "capture/sparse/0" / file).write_text(text)

    return Trial("captures", f"{name}: {how}", BUILD, prepare)
