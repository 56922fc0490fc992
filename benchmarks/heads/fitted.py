"""What a report needs of a fitted head: its mesh in mm or dm, and the cameras of its photos."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.heads.distances import Triangles
from export.camera import Camera
from export.evaluation.heads_api import FittedHead, HeadMesh
from export.heads.head_file import StoredHead, read_head

MM_PER_M = 1000


def triangles_of(mesh: HeadMesh) -> Triangles:
    """In mm."""
    return Triangles(mesh.positions_m.astype(np.float64) * MM_PER_M, mesh.triangles.astype(np.int64))


def stored(head: FittedHead) -> StoredHead:
    """What the library writes of it: the C API does not give cameras."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "head.maqh"
        head.save(path)
        return read_head(path)


def cameras_of(head: StoredHead) -> list[Camera]:
    """Of the photos that it was fitted to, in the order they were added; in units of the head's frame (dm)."""
    return [
        Camera(
            int(c["width_px"]), int(c["height_px"]), *(float(c[k]) for k in ("focal_px", "focal_px", "cx_px", "cy_px")),
            c["rotation"].copy(), -c["rotation"].T @ c["translation"],
        )
        for c in head.cameras
    ]  # fmt: skip


def angle_deg(a: np.ndarray, b: np.ndarray) -> float:
    """Of the rotation from one rotation [3, 3] to another."""
    return float(np.degrees(np.arccos(np.clip((np.trace(a.T @ b) - 1) / 2, -1, 1))))
