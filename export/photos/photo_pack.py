"""A pack of photographs: a folder with `index.tsv` (docs/reference/formats.md) -> `.data/photos/pack/FOLDER/ID.jpg`.

A pack comes from elsewhere, so its index and every image are checked before anything is taken from it. Splits stay
apart: a photograph's folder follows from its split and licence, and photographs that have left the pack are deleted.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from export.photos.backgrounds import load_photographs
from export.photos.packages import PackageError

INDEX, CREDITS = "index.tsv", "credits.tsv"
COLUMNS = (
    "id", "split", "file", "licence", "author", "url", "source", "path", "width", "height", "credit_line",
)  # fmt: skip
SPLITS = ("train", "heldout")
TESTS_ALONE = "-by-sa"  # behind the split: share-alike photographs, which no shipped network learns from
MAX_SIDE_PX, MAX_BYTES = 4096, 2**24  # of an image; of the index and of an image file
_NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,63}")
_LICENCE = re.compile(
    r"CC0-1\.0|public-domain|no-known-copyright-restrictions|MIT|CC-BY(-SA)?(-(1\.0|2\.0|2\.5|3\.0|4\.0)(-[A-Z]{2})?)?"
)
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]")


class PhotoPackError(PackageError):
    """A pack of photographs is incomplete, or not what docs/reference/formats.md says."""


@dataclass(frozen=True)
class PackPhoto:
    """One line of the index. folder: "train", "heldout", or one of them with "-by-sa". size: width, height in pixels.
    source: where the photograph was published. credit: the text that names its author."""

    name: str
    folder: str
    licence: str
    source: str
    credit: str
    size: tuple[int, int]

    @property
    def file(self) -> str:
        return f"{self.folder}/{self.name}.jpg"


def read_index(pack: Path) -> list[PackPhoto]:
    """Every photograph of a pack. Raises PhotoPackError with file, line and value for an index that is not valid."""
    path = pack / INDEX
    if not path.is_file():
        raise PhotoPackError(f"{pack} is not a pack of photographs: it has no {INDEX}.")
    if (size := path.stat().st_size) > MAX_BYTES:
        raise PhotoPackError(f"{path} has {size} bytes; at most {MAX_BYTES} are read.")
    try:
        header, *lines = path.read_bytes().decode().split("\n")
    except UnicodeDecodeError as error:
        raise PhotoPackError(f"{path} is not UTF-8: byte {error.start} cannot be read.") from error
    names = header.split("\t")
    if missing := [name for name in COLUMNS if name not in names]:
        raise PhotoPackError(f"{path} has no column {', '.join(missing)}; columns are separated by tabs.")
    photos: dict[str, PackPhoto] = {}
    known = {photo.name for photo in load_photographs()}
    for number, line in enumerate(lines, 2):
        if not line and number == len(lines) + 1:
            break
        where, cells = f"{path}:{number}", line.split("\t")
        if len(cells) != len(names):
            raise PhotoPackError(f"{where}: {len(cells)} columns, the first line has {len(names)}.")
        photo = _photo(dict(zip(names, cells, strict=True)), where)
        if photo.name in photos or photo.name in known:
            owner = "an earlier line" if photo.name in photos else "export/photos/photographs.toml"
            raise PhotoPackError(f"{where}: the id {photo.name} is taken by {owner}.")
        photos[photo.name] = photo
    if not photos:
        raise PhotoPackError(f"{path} lists no photographs.")
    return list(photos.values())


def _photo(row: dict[str, str], where: str) -> PackPhoto:
    for name, value in row.items():
        if _CONTROL.search(value):
            raise PhotoPackError(f"{where}: {name} has a control character: {value!r}.")
    if not _NAME.fullmatch(row["id"]):
        raise PhotoPackError(f"{where}: the id {row['id']!r} is not 1 to 64 of a-z, 0-9 and -.")
    if row["split"] not in SPLITS:
        raise PhotoPackError(f"{where}: the split {row['split']!r} is not {' or '.join(SPLITS)}.")
    if not _LICENCE.fullmatch(row["licence"]):
        raise PhotoPackError(
            f"{where}: the licence {row['licence']!r} is not known. Known are CC0-1.0, public-domain, "
            "no-known-copyright-restrictions, MIT, CC-BY and CC-BY-SA with their versions."
        )
    size = []
    for name in ("width", "height"):
        if not re.fullmatch(r"[1-9][0-9]{0,4}", row[name]) or int(row[name]) > MAX_SIDE_PX:
            raise PhotoPackError(f"{where}: the {name} {row[name]!r} is not 1 to {MAX_SIDE_PX} pixels.")
        size.append(int(row[name]))
    if not row["source"] or not (row["author"] or row["credit_line"]):
        raise PhotoPackError(f"{where}: a photograph needs a source, and an author or a credit_line.")
    photo = PackPhoto(
        name=row["id"],
        folder=row["split"] + (TESTS_ALONE if "-SA" in row["licence"] else ""),
        licence=row["licence"],
        source=row["source"],
        credit=row["credit_line"] or f"{row['author']}, {row['url'] or row['source'] + ' ' + row['path']}",
        size=(size[0], size[1]),
    )
    if row["file"] != photo.file:
        raise PhotoPackError(
            f"{where}: the file is {row['file']!r}; with this id, split and licence it must be {photo.file}."
        )
    return photo


def build(pack: Path, out: Path) -> dict[str, int]:
    """Copies the photographs of a pack to out/FOLDER/ID.jpg and credits those of `train` in out/credits.tsv.

    Returns the count of each folder. Raises PhotoPackError at the first file that is not what the index says.
    """
    photos = read_index(pack)
    counts = {split + tests: 0 for split in SPLITS for tests in ("", TESTS_ALONE)}
    for folder in counts:
        (out / folder).mkdir(parents=True, exist_ok=True)
    listed = {out / photo.file for photo in photos}
    for path in (path for folder in counts for path in (out / folder).glob("*.jpg")):
        if path not in listed:
            path.unlink()
    for photo in tqdm(photos, desc=out.name, unit="photo", disable=None):
        data = _checked(pack, photo)
        partial = (out / photo.file).with_suffix(".partial")
        partial.write_bytes(data)
        partial.replace(out / photo.file)
        counts[photo.folder] += 1
    write_credits([photo for photo in photos if photo.folder == "train"], out / CREDITS)
    return counts


def _checked(pack: Path, photo: PackPhoto) -> bytes:
    """The JPEG file of a photograph."""
    path = pack / photo.file
    if not path.is_file() or not path.resolve().is_relative_to(pack.resolve()):
        raise PhotoPackError(f"{path} is not there, but {INDEX} lists it.")
    if (size := path.stat().st_size) > MAX_BYTES:
        raise PhotoPackError(f"{path} has {size} bytes; at most {MAX_BYTES} are read.")
    data = path.read_bytes()
    found = _size_of(data)
    if found is None:
        raise PhotoPackError(f"{path} is not a whole JPEG image.")
    if found != photo.size:
        sizes = [f"{width} x {height}" for width, height in (found, photo.size)]
        raise PhotoPackError(f"{path} has {sizes[0]} pixels; {INDEX} says {sizes[1]}.")
    return data


def _size_of(data: bytes) -> tuple[int, int] | None:
    """Width and height of a JPEG file. An eighth of the size is decoded first, since a header may promise any size."""
    if not data.startswith(b"\xff\xd8\xff") or not data.endswith(b"\xff\xd9"):
        return None
    encoded = np.frombuffer(data, np.uint8)
    try:
        small = cv2.imdecode(encoded, cv2.IMREAD_REDUCED_GRAYSCALE_8)
        if small is None:
            return None
        if 8 * max(small.shape) > MAX_SIDE_PX + 8:
            return 8 * small.shape[1], 8 * small.shape[0]
        image = cv2.imdecode(encoded, cv2.IMREAD_COLOR)
    except cv2.error:
        return None
    return None if image is None else (image.shape[1], image.shape[0])


def write_credits(photos: list[PackPhoto], path: Path) -> None:
    """One line a photograph: id, licence, source, credit. `export.densepose.export_onnx --credits` reads it."""
    rows = [("id", "licence", "source", "credit")]
    rows += [(photo.name, photo.licence, photo.source, photo.credit) for photo in photos]
    partial = path.with_suffix(".partial")
    partial.write_text("".join("\t".join(row) + "\n" for row in rows), encoding="utf-8")
    partial.replace(path)
