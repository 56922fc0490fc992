"""Cuts polygons into triangles: fans where that is right, else ear by ear (Meisters 1975)."""

from __future__ import annotations

import numpy as np


def triangles_of(corners: np.ndarray) -> list[tuple[int, int, int]]:
    """Numbers of the corners [n, 3] of a nearly flat polygon that make its n - 2 triangles.

    What crosses itself, or has no area, becomes a fan.
    """
    count = len(corners)
    fan = [(0, k, k + 1) for k in range(1, count - 1)]
    if count == 3:
        return fan
    edge = corners[1:] - corners[0]
    normals = np.cross(edge[:-1], edge[1:])
    normal = normals.sum(0)  # of the whole polygon, by Newell
    length = float(np.linalg.norm(normal))
    if length == 0 or (normals @ normal).min() >= -1e-6 * length**2:
        return fan
    normal /= length
    side = np.cross(normal, [1.0, 0, 0] if abs(normal[0]) < 0.9 else [0, 1.0, 0])
    side /= np.linalg.norm(side)
    flat = np.stack([corners @ side, corners @ np.cross(normal, side)], 1)
    left, triangles = list(range(count)), []
    while len(left) > 3:
        ear = next((k for k in range(len(left)) if _is_ear(flat, left, k)), None)
        if ear is None:
            return fan
        triangles.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        del left[ear]
    return [*triangles, (left[0], left[1], left[2])]


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Twice the area of a, b, c: above 0 where they run to the left."""
    return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])


def _is_ear(flat: np.ndarray, left: list[int], k: int) -> bool:
    a, b, c = flat[left[k - 1]], flat[left[k]], flat[left[(k + 1) % len(left)]]
    if _turn(a, b, c) < 0:
        return False
    others = flat[[v for j, v in enumerate(left) if j not in ((k - 1) % len(left), k, (k + 1) % len(left))]]
    # Polygons with a hole have a bridge to it, whose corners are there twice: those do not lie inside.
    same = (np.abs(others - a).max(1) == 0) | (np.abs(others - b).max(1) == 0) | (np.abs(others - c).max(1) == 0)
    inside = (_turn(a, b, others) >= 0) & (_turn(b, c, others) >= 0) & (_turn(c, a, others) >= 0)
    return not (inside & ~same).any()
