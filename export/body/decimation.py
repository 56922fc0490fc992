"""A mesh with fewer vertices, all of them vertices of the given mesh: skin weights and shapes carry over unchanged.

Edges are collapsed onto one of their two ends, in the order of the quadric error of Garland and Heckbert ("Surface
simplification using quadric error metrics", SIGGRAPH 1997).
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable

import numpy as np

# Quadric error of a collapse that only moves a vertex along its own plane, by its squared length: keeps triangles even.
_LENGTH_WEIGHT = 3e-3
_MIN_NORMAL_COSINE = 0.2  # between the normals of a triangle before and after


class _Collapser:
    def __init__(self, points: np.ndarray, faces: np.ndarray) -> None:
        self.points = points.astype(np.float64)
        self.faces = [tuple(int(v) for v in face) for face in faces]
        self.faces_at: dict[int, set[int]] = {}
        for k, face in enumerate(self.faces):
            for v in face:
                self.faces_at.setdefault(v, set()).add(k)
        self.stamp = dict.fromkeys(self.faces_at, 0)
        self.quadric = self._quadrics()
        self.heap: list[tuple[float, int, int, int, int]] = []

    def _quadrics(self) -> dict[int, np.ndarray]:
        corner = self.points[np.array(self.faces)]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        area = np.linalg.norm(normal, axis=1, keepdims=True)
        unit = normal / np.maximum(area, 1e-12)
        plane = np.concatenate([unit, -(unit * corner[:, 0]).sum(1, keepdims=True)], 1)
        each = plane[:, :, None] * plane[:, None] * area[:, :, None]
        return {v: each[list(at)].sum(0) for v, at in self.faces_at.items()}

    def neighbours(self, vertex: int) -> set[int]:
        return {v for k in self.faces_at[vertex] for v in self.faces[k]} - {vertex}

    def offer(self, edges: Iterable[tuple[int, int]]) -> None:
        """Puts the collapse of `gone` onto `kept` into the queue, for each (gone, kept)."""
        for gone, kept in edges:
            at = np.append(self.points[kept], 1.0)
            step = self.points[kept] - self.points[gone]
            area = np.trace(self.quadric[gone][:3, :3])
            cost = at @ (self.quadric[gone] + self.quadric[kept]) @ at + _LENGTH_WEIGHT * area * (step @ step)
            heapq.heappush(self.heap, (float(cost), gone, kept, self.stamp[gone], self.stamp[kept]))

    def is_allowed(self, gone: int, kept: int) -> bool:
        shared = self.faces_at[gone] & self.faces_at[kept]
        common = self.neighbours(gone) & self.neighbours(kept)
        # A vertex of the rim stays, and a collapse must not join two sheets.
        if len(shared) != 2 or len(common) != 2 or len(self.faces_at[gone]) != len(self.neighbours(gone)):
            return False
        for k in self.faces_at[gone] - shared:
            before = self.points[list(self.faces[k])]
            after = self.points[[kept if v == gone else v for v in self.faces[k]]]
            a, b = (np.cross(p[1] - p[0], p[2] - p[0]) for p in (before, after))
            if a @ b <= _MIN_NORMAL_COSINE * np.linalg.norm(a) * np.linalg.norm(b):
                return False
        return True

    def collapse(self, gone: int, kept: int) -> None:
        for k in list(self.faces_at[gone]):
            if kept in self.faces[k]:
                for v in self.faces[k]:
                    self.faces_at[v].discard(k)
            else:
                self.faces[k] = tuple(kept if v == gone else v for v in self.faces[k])
                self.faces_at[kept].add(k)
        self.quadric[kept] = self.quadric[kept] + self.quadric[gone]
        del self.faces_at[gone], self.quadric[gone], self.stamp[gone]
        self.stamp[kept] += 1
        self.offer((v, kept) for v in self.neighbours(kept))
        self.offer((kept, v) for v in self.neighbours(kept))


def decimated(points: np.ndarray, faces: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """points [V, 3], faces [F, 3]. Returns the indices of at least `count` kept vertices, rising, and the faces
    [G, 3], which index the kept vertices."""
    mesh = _Collapser(points, faces)
    mesh.offer((a, b) for a in mesh.faces_at for b in mesh.neighbours(a))
    while len(mesh.faces_at) > count and mesh.heap:
        _, gone, kept, gone_stamp, kept_stamp = heapq.heappop(mesh.heap)
        if mesh.stamp.get(gone) != gone_stamp or mesh.stamp.get(kept) != kept_stamp:
            continue  # an older offer
        if mesh.is_allowed(gone, kept):
            mesh.collapse(gone, kept)
    left = {k for at in mesh.faces_at.values() for k in at}
    index = np.array(sorted(v for v, at in mesh.faces_at.items() if at))
    place = {int(v): k for k, v in enumerate(index)}
    return index, np.array([[place[v] for v in mesh.faces[k]] for k in sorted(left)])
