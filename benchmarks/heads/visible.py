"""Finds the points of a surface that can be seen, from outside at all or by certain cameras.

Synthetic heads have closed eyeballs, and skin under hair. No photo shows what lies inside, and no head surface should
go there.
"""

from __future__ import annotations

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

DIRECTIONS, MIN_FREE = 96, 2
MIN_COSINE = 0.1  # minimum cosine to the normal
START = 0.005  # offset above the surface; dm


def _scene(positions: np.ndarray, faces: np.ndarray) -> EmbreeScene:
    scene = EmbreeScene(robust=True)
    # Embree reads the mesh of the scene for as long as the scene exists.
    TriangleMesh(scene, positions.astype(np.float32), faces.astype(np.int32))
    return scene


def seen_from_outside(
    positions: np.ndarray, faces: np.ndarray, points: np.ndarray, normals: np.ndarray, directions: int = DIRECTIONS
) -> np.ndarray:
    """Returns whether each of the points [N, 3] (dm) of the mesh is free in at least MIN_FREE of evenly spread
    directions: bool [N]."""
    scene = _scene(positions, faces)
    free = np.zeros(len(points), int)
    # Fibonacci sphere.
    z = 1 - (2 * np.arange(directions) + 1) / directions
    angle = np.pi * (3 - np.sqrt(5)) * np.arange(directions)
    flat = np.sqrt(1 - z**2)
    for towards in np.stack([flat * np.cos(angle), flat * np.sin(angle), z], 1):
        facing = np.flatnonzero(normals @ towards > MIN_COSINE)
        start = (points[facing] + START * normals[facing]).astype(np.float32)
        hit = scene.run(start, np.repeat(towards[None].astype(np.float32), len(start), 0))
        free[facing] += hit < 0
    return free >= MIN_FREE


def seen_from(
    positions: np.ndarray, faces: np.ndarray, points: np.ndarray, normals: np.ndarray, centres: np.ndarray
) -> np.ndarray:
    """Returns whether each of the points [N, 3] (dm) of the mesh faces one of the cameras at `centres` [K, 3] with
    nothing between: bool [N]."""
    scene, seen = _scene(positions, faces), np.zeros(len(points), bool)
    for centre in centres:
        towards = centre - points
        towards /= np.linalg.norm(towards, axis=1, keepdims=True)
        facing = np.flatnonzero((normals * towards).sum(1) > MIN_COSINE)
        start = (points[facing] + START * normals[facing]).astype(np.float32)
        seen[facing] |= scene.run(start, towards[facing].astype(np.float32)) < 0
    return seen
