"""Exact depth and face numbers of a solid from a pinhole camera, and what hides a point, by Embree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from export.camera import Camera
from export.solids.brep import Solid


@dataclass(eq=False)
class View:
    """depth: float64 [H, W] metres along the optical axis at each pixel's centre, 0 where nothing is. face: int32
    [H, W], -1 where nothing is. ray: float64 [H, W, 3], camera coordinates at depth 1."""

    camera: Camera
    depth: np.ndarray
    face: np.ndarray
    ray: np.ndarray

    @property
    def footprint(self) -> np.ndarray:
        """float64 [H, W] metres between neighbouring pixels at that depth: r."""
        return self.depth / self.camera.fx_px

    @property
    def point(self) -> np.ndarray:
        """float64 [H, W, 3] in the camera's coordinates."""
        return self.ray * self.depth[..., None]


class Seen:
    """A solid in the coordinates of a camera at `centre`; cameras of other frames but one centre and rotation share it.

    Vertices are moved in float64 before Embree, which computes in float32, sees them.
    """

    def __init__(self, solid: Solid, camera: Camera) -> None:
        self.solid, self.camera = solid, camera
        self.vertex = (solid.vertex - camera.centre) @ camera.rotation.T
        self._scene = EmbreeScene(robust=True)
        TriangleMesh(self._scene, self.vertex.astype(np.float32), solid.triangle.astype(np.int32))
        a, b, c = (self.vertex[solid.triangle[:, k]] for k in range(3))
        self._normal = np.cross(b - a, c - a)
        self._offset = (self._normal * a).sum(1)
        self._nearest, self._farthest = (f(f(a[:, 2], b[:, 2]), c[:, 2]) for f in (np.minimum, np.maximum))

    def rendered(self, camera: Camera) -> View:
        """The view of `camera`, which may frame other pixels than this one."""
        x = (np.arange(camera.width_px) - camera.cx_px) / camera.fx_px
        y = (np.arange(camera.height_px) - camera.cy_px) / camera.fy_px
        ray = np.ones((camera.height_px, camera.width_px, 3))
        ray[..., 0], ray[..., 1] = x[None, :], y[:, None]
        flat = ray.reshape(-1, 3)
        hit = self._scene.run(np.zeros_like(flat, np.float32), flat.astype(np.float32))
        seen = hit >= 0
        face = np.full(len(flat), -1, np.int32)
        depth = np.zeros(len(flat))
        number = hit[seen]
        face[seen] = self.solid.triangle_face[number]
        # On the triangle's own plane in float64: Embree's float32 would lose the digits that slopes need.
        along = (self._normal[number] * flat[seen]).sum(1)
        z = self._offset[number] / np.where(along == 0, np.inf, along)
        depth[seen] = np.clip(z, self._nearest[number], self._farthest[number])  # a triangle seen along its plane
        self._settle(camera, flat, face, depth)
        shape = camera.height_px, camera.width_px
        return View(camera, depth.reshape(shape), face.reshape(shape), ray)

    def _settle(self, camera: Camera, ray: np.ndarray, face: np.ndarray, depth: np.ndarray) -> None:
        """Moves depth from the triangles of bent surfaces onto the surfaces, by less than r."""
        order = np.argsort(face, kind="stable")
        numbers, starts = np.unique(face[order], return_index=True)
        for number, own in zip(numbers, np.split(order, starts[1:]), strict=True):
            bent = self.solid.bent.get(int(number))
            if bent is not None:
                way = ray[own] @ camera.rotation
                depth[own] = bent.settled(camera.centre, way, depth[own], depth[own] / camera.fx_px)

    def hidden(self, point: np.ndarray, slack: np.ndarray) -> np.ndarray:
        """Whether something lies between the camera and points [n, 3] of its coordinates, more than slack [n] metres in
        front of them: bool [n]."""
        if not len(point):
            return np.zeros(0, bool)
        reach = 1 - slack / np.maximum(np.linalg.norm(point, axis=1), 1e-12)
        tfar = np.clip(reach, 0, None).astype(np.float32)
        ray = point.astype(np.float32)
        hit = self._scene.run(np.zeros_like(ray), ray, dists=tfar)
        return hit >= 0
