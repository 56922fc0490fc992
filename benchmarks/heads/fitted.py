"""Converts a fitted head for reports: its mesh in mm or dm, and the cameras of its photos, in the frame of the heads
of training (x to the person's left, y to the back, z up)."""

from __future__ import annotations

import numpy as np
from maquette import Head, HeadMesh

from benchmarks.heads.distances import Triangles
from export.camera import Camera

MM_PER_M, DM_PER_M = 1000, 10


def z_up(points: np.ndarray) -> np.ndarray:
    """Converts points or directions [N, 3] of a mesh, float64."""
    return points.astype(np.float64)[:, [0, 2, 1]] * [1, -1, 1]


def triangles_of(mesh: HeadMesh) -> Triangles:
    """Returns the mesh in mm."""
    return Triangles(z_up(mesh.positions_m) * MM_PER_M, mesh.triangles.astype(np.int64))


def cameras_of(head: Head) -> list[Camera]:
    """Returns the cameras of the fitted photos in dm, in the order in which the photos were added."""
    found = [head.camera(k) for k in range(head.info.photo_count)]
    return [
        Camera(
            c.intrinsics.width_px, c.intrinsics.height_px, c.intrinsics.fx_px, c.intrinsics.fy_px, c.intrinsics.cx_px,
            c.intrinsics.cy_px, z_up(c.rotation), DM_PER_M * z_up(c.centre[None])[0],
        )
        for c in found
    ]  # fmt: skip


def angle_deg(a: np.ndarray, b: np.ndarray) -> float:
    """Returns the angle between two rotations [3, 3]."""
    return float(np.degrees(np.arccos(np.clip((np.trace(a.T @ b) - 1) / 2, -1, 1))))
