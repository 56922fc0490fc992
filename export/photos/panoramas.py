"""HDRI panoramas of a package -> `.data/panoramas/{train,val,test}/NAME.npy`.

float16 [256, 512, 3], linear RGB radiance; rows run from straight up to straight down, columns once around.
"""

from __future__ import annotations

import base64
import tempfile
from pathlib import Path

import numpy as np

from export.photos.packages import PackageError, PackageReader, fetch, load_packages

PACKAGE = "pmndrs-assets"
NAMES = {
    "train": ("apartment", "bridge", "city", "dawn", "esplanade", "forest", "hall", "night", "park", "sky", "studio",
              "sunrise", "venice", "workshop"),
    "val": ("lab", "sunset"),
    "test": ("lobby", "warehouse"),
}  # fmt: skip


def build(folder: Path, force: bool = False) -> dict[str, int]:
    """Writes the panoramas, keeping those already there. Returns each split's count."""
    wanted = [(split, name) for split, names in NAMES.items() for name in names]
    missing = [(s, n) for s, n in wanted if force or not (folder / s / f"{n}.npy").exists()]
    if missing:
        with PackageReader(fetch(load_packages()[PACKAGE])) as reader:
            for split, name in missing:
                radiance = decoded(reader.read(f"package/hdri/{name}.exr.js"))
                (folder / split).mkdir(parents=True, exist_ok=True)
                partial = folder / split / f"{name}.partial.npy"
                np.save(partial, radiance)
                partial.replace(folder / split / f"{name}.npy")
    return {split: len(names) for split, names in NAMES.items()}


def decoded(script: bytes) -> np.ndarray:
    """The image that a JavaScript file holds as a data address of base64: float16 [H, W, 3].

    Their lossy compression rings around lamps, down to negative light; that is cut off.
    """
    import OpenEXR  # of the extra `train`

    start, end = script.find(b"base64,") + len(b"base64,"), script.rfind(b"'")
    if start < len(b"base64,") or end < start:
        raise PackageError(f"{PACKAGE}: a panorama is not a script with a data address.")
    with tempfile.NamedTemporaryFile(suffix=".exr") as file:
        file.write(base64.b64decode(script[start:end]))
        file.flush()
        with OpenEXR.File(file.name) as picture:
            radiance = np.asarray(picture.channels()["RGB"].pixels, np.float32)
    return np.clip(radiance, 0, 20_000).astype(np.float16)
