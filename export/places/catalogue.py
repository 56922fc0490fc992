"""Stock of environments: models by kind and split, tiles, photographs, panoramas, each with its licence."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np

from export.people import assets
from export.photos.backgrounds import load_backgrounds
from export.photos.packages import load_packages
from export.photos.panoramas import PACKAGE as PANORAMAS
from export.places.assets import FURNITURE, TILES, family_of, furniture_folder, split_of, tiles_folder
from export.places.mesh import Part, read_obj, smooth_normals

_CM = 0.01
# The front of a model looks to +z, its up is +y; in the world the front looks to -y, up is +z.
_STAND = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], np.float64)
# Models of one make, which a split must not share with another.
_SERIES = {
    "kitchen": r"cabinet|island|uppershelves",
    "playground": r"childhut|childswing|seesaw|motorbike|bench$",
    "winchester": r"winchester",
    "oak": r"^oak",
}
_CEILING = ("ceilingFan", "lamp2", "outdoorLamp")
_WALL_WITHOUT_HEIGHT = {"knifeStandSwap": 1.3, "radiator1": 0.1, "shower": 1.1, "rangeHood": 1.6}  # metres above ground
_NOT_INDOORS = re.compile(
    r"fence|railing|shipping|peterbilt|forkLift|childHut|childSwing|spiral|mailbox|umbrella$", re.IGNORECASE
)


@dataclass(frozen=True)
class Asset:
    """Where something comes from: name, package, version, licence, and a note on where the licence is written."""

    name: str
    package: str
    version: str
    licence: str
    notice: str = ""


@dataclass(frozen=True, eq=False)
class Model:
    """A model of the furniture list. size: width, depth, height in metres. kind: floor, small, wall, ceiling or large
    (not for a room). elevation: of its lowest point, metres."""

    name: str
    file: Path
    size: tuple[float, float, float]
    kind: str
    category: str
    elevation: float
    turn: np.ndarray
    asset: Asset


def family_of_model(name: str) -> str:
    for series, pattern in _SERIES.items():
        if re.search(pattern, name.lower()):
            return series
    return family_of(name)


def released_freely(folder: Path) -> bool | None:
    """Whether the licence file in a model's folder says CC0; None without one (then the list's own licence counts)."""
    files = [f for f in sorted(folder.iterdir()) if "licen" in f.name.lower()]
    if not files:
        return None
    return all(re.search(r"creative commons zero|public domain", f.read_text("latin-1"), re.IGNORECASE) for f in files)


def load_models() -> list[Model]:
    """The models of the list that are CC0, by name. Two of the list are not: their licence files say CC-BY-3.0."""
    root = furniture_folder()
    if not root.exists():
        raise FileNotFoundError(f"{root} is missing: run `python -m export.places.assets furniture` first")
    entries: dict[int, dict[str, str]] = {}
    for line in (root / "PluginFurnitureCatalog.properties").read_text("latin-1").splitlines():
        found = re.match(r"(\w+)#(\d+)=(.*)", line.strip())
        if found:
            entries.setdefault(int(found[2]), {})[found[1]] = found[3]
    models = []
    for entry in entries.values():
        file = root / entry["model"].lstrip("/")
        free = released_freely(file.parent)
        if free is not False:
            models.append(_model(entry, file, free is None))
    return sorted(models, key=lambda m: m.name)


def _model(entry: dict[str, str], file: Path, by_list: bool) -> Model:
    name = file.parent.name
    size = tuple(float(entry[k]) * _CM for k in ("width", "depth", "height"))
    elevation = float(entry.get("elevation", 0)) * _CM or _WALL_WITHOUT_HEIGHT.get(name, 0.0)
    if name in _CEILING:
        kind = "ceiling"
    elif elevation > 0:
        kind = "wall"
    elif max(size[:2]) > 2.7 or size[2] > 2.4 or _NOT_INDOORS.search(name):
        kind = "large"
    elif max(size) < 0.6:
        kind = "small"
    else:
        kind = "floor"
    turn = np.array([float(v) for v in entry.get("modelRotation", "1 0 0 0 1 0 0 0 1").split()]).reshape(3, 3)
    notice = "LICENSE.TXT of the list" if by_list else "licence file beside the model"
    asset = Asset(
        f"model {name}", FURNITURE.name, FURNITURE.version, "CC0-1.0", f"{notice}; author: {entry['creator']}"
    )
    return Model(name, file, size, kind, entry["category"], elevation, turn, asset)


@lru_cache(maxsize=60)
def parts_of(model: Model) -> tuple[Part, ...]:
    """The model at the origin, standing on z = 0, in the size that the list gives."""
    read = read_obj(model.file)
    turn = _STAND @ model.turn
    everything = np.concatenate([c for c, _, _ in read]) @ turn.T
    low, high = everything.reshape(-1, 3).min(0), everything.reshape(-1, 3).max(0)
    scale = np.array(model.size) / np.maximum(high - low, 1e-9)
    everything = (everything - [*(low + high)[:2] / 2, low[2]]) * scale
    normals = smooth_normals(everything)
    parts, start = [], 0
    for corners, uv, material in read:
        own = slice(start, start + len(corners))
        start += len(corners)
        parts.append(Part(everything[own].astype(np.float32), normals[own], uv.astype(np.float32), material))
    return tuple(parts)


class Stock:
    """All that a split may use. tiles, photos: uint8 [h, w, 3] RGB with their asset; panoramas: linear RGB radiance.

    people: draws dressed people (`export.places.crowd`), or None.
    """

    def __init__(self, split: str, data: Path = Path(".data"), people: bool = True) -> None:
        self.split = split
        self.models = [m for m in load_models() if split_of(family_of_model(m.name)) == split]
        self.tile_files = [f for f in sorted(tiles_folder().glob("*.jpg")) if split_of(family_of(f.name)) == split]
        if not self.tile_files:
            raise FileNotFoundError(f"{tiles_folder()} is missing: run `python -m export.places.assets tiles` first")
        self.photo_files = sorted((data / "backgrounds" / split).glob("*.jpg"))
        self.panorama_files = sorted((data / "panoramas" / split).glob("*.npy"))
        if not self.photo_files or not self.panorama_files:
            raise FileNotFoundError(f"no photos or panoramas in {data}: run `python -m export.photos fetch` first")
        packages = load_packages()
        self._photo_assets = {
            p.name: Asset(f"photograph {p.name}", packages[p.package].package, packages[p.package].version,
                          packages[p.package].licence, packages[p.package].notice)
            for p in load_backgrounds()
        }  # fmt: skip
        self._panorama_package = packages[PANORAMAS]
        self.people = None
        if people:
            from export.places.crowd import Crowd  # the body takes seconds to load

            self.people = Crowd(split, [_photo(f) for f in self.photo_files])

    def of_kind(self, *kinds: str) -> list[Model]:
        return [m for m in self.models if m.kind in kinds]

    def parts(self, model: Model) -> tuple[Part, ...]:
        return parts_of(model)

    def tile(self, rng: np.random.Generator, wanted: str) -> tuple[np.ndarray, Asset]:
        """A ground texture whose name has one of `wanted` (a pattern); any where there is none."""
        files = [f for f in self.tile_files if re.search(wanted, f.name)] or self.tile_files
        file = files[rng.integers(len(files))]
        return _photo(file), Asset(f"tile {file.stem}", TILES.name, TILES.version, TILES.licence)

    def photo(self, rng: np.random.Generator) -> tuple[np.ndarray, Asset]:
        file = self.photo_files[rng.integers(len(self.photo_files))]
        return _photo(file), self._photo_assets[file.stem]

    def panorama(self, rng: np.random.Generator) -> tuple[np.ndarray, Asset]:
        """Radiance float32 [H, W, 3]; rows from straight up to straight down."""
        file = self.panorama_files[rng.integers(len(self.panorama_files))]
        package = self._panorama_package
        asset = Asset(f"panorama {file.stem}", package.package, package.version, package.licence, package.notice)
        return np.load(file).astype(np.float32), asset


@lru_cache(maxsize=256)
def _photo(file: Path) -> np.ndarray:
    return np.ascontiguousarray(cv2.imread(str(file))[..., ::-1])


def people_assets() -> list[Asset]:
    """Packages of dressed people."""
    return [Asset(f"people: {p.used_for}", p.name, p.version, p.licence) for p in assets.PACKAGES]
