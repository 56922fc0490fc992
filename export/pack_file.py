"""Packs: one archive with all that a machine without a network needs for a training, small enough to be carried."""

from __future__ import annotations

import io
import tarfile

import cv2
import numpy as np

LONG_SIDE = 512  # of photographs
QUALITY = 88


class PackWriter:
    """Adds files to a tar archive, and counts their bytes before compression by first folder."""

    def __init__(self, tar: tarfile.TarFile) -> None:
        self._tar = tar
        self.bytes: dict[str, int] = {}

    def add(self, name: str, content: bytes) -> None:
        entry = tarfile.TarInfo(name)
        entry.size = len(content)
        self._tar.addfile(entry, io.BytesIO(content))
        key = name.split("/")[0]
        self.bytes[key] = self.bytes.get(key, 0) + len(content)

    def add_arrays(self, name: str, **arrays: np.ndarray) -> None:
        buffer = io.BytesIO()
        np.savez(buffer, **arrays)
        self.add(name, buffer.getvalue())


def jpeg(image: np.ndarray) -> bytes:
    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].tobytes()


def shrunk(image: np.ndarray, long_side: int = LONG_SIDE) -> np.ndarray:
    scale = long_side / max(image.shape[:2])
    return image if scale >= 1 else cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
