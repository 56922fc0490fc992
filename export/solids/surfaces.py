"""Cylinders, cones, spheres and tori as equations, so that depth on them is exact and not that of triangles.

Triangles within the deviation of a bent surface still turn by some degrees from one to the next, every few pixels; in
depth without noise a network would learn bent surfaces by that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.GeomAbs import GeomAbs_Cone, GeomAbs_Cylinder, GeomAbs_Sphere, GeomAbs_Torus

CYLINDER, CONE, SPHERE, TORUS = range(4)
_STEPS = 4  # of Newton's method; the triangle is near, so that it doubles its digits each time
_CONVERGED = 1e-9  # of the surface's radius


@dataclass(frozen=True, eq=False)
class Bent:
    """origin: [3], axes: [3, 3], rows x, y and z, the axis of turning. radius: of the cylinder, the sphere, the torus'
    ring, the cone at the origin; other: radius of the torus' tube, half the cone's angle."""

    kind: int
    origin: np.ndarray
    axes: np.ndarray
    radius: float
    other: float = 0.0

    def off(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance [n] from the surface (the cone's: from its side) of points [n, 3] in its axes, and its gradient."""
        out = np.maximum(np.hypot(p[:, 0], p[:, 1]), 1e-300)
        radial = np.stack([p[:, 0] / out, p[:, 1] / out, np.zeros(len(p))], 1)
        up = np.array([0, 0, 1.0])
        if self.kind == CYLINDER:
            return out - self.radius, radial
        if self.kind == SPHERE:
            away = np.maximum(np.linalg.norm(p, axis=1), 1e-300)
            return away - self.radius, p / away[:, None]
        if self.kind == CONE:
            c, s = np.cos(self.other), np.sin(self.other)
            return (out - self.radius) * c - p[:, 2] * s, radial * c - up * s
        ring = out - self.radius
        away = np.maximum(np.hypot(ring, p[:, 2]), 1e-300)
        return away - self.other, (radial * ring[:, None] + up * p[:, 2:]) / away[:, None]

    def settled(self, centre: np.ndarray, ray: np.ndarray, depth: np.ndarray, reach: np.ndarray) -> np.ndarray:
        """Depths [n] at which rays centre + depth * ray meet the surface, from those that are near; what does not come
        to rest within reach [n] stays."""
        start = self.axes @ (centre - self.origin)
        way = ray @ self.axes.T
        now = depth.copy()
        for _ in range(_STEPS):
            off, gradient = self.off(start + way * now[:, None])
            slope = (gradient * way).sum(1)
            now = now - off / np.where(np.abs(slope) > 1e-9, slope, np.inf)
        off, _ = self.off(start + way * now[:, None])
        good = (np.abs(now - depth) <= reach) & (np.abs(off) <= _CONVERGED * self.radius)
        return np.where(good, now, depth)


def bent_of(surface: BRepAdaptor_Surface) -> Bent | None:
    """None for planes, and for surfaces without an equation of this kind."""
    kind = surface.GetType()
    if kind == GeomAbs_Cylinder:
        own, code, sizes = surface.Cylinder(), CYLINDER, ("Radius",)
    elif kind == GeomAbs_Sphere:
        own, code, sizes = surface.Sphere(), SPHERE, ("Radius",)
    elif kind == GeomAbs_Cone:
        own, code, sizes = surface.Cone(), CONE, ("RefRadius", "SemiAngle")
    elif kind == GeomAbs_Torus:
        own, code, sizes = surface.Torus(), TORUS, ("MajorRadius", "MinorRadius")
    else:
        return None
    frame = own.Position()
    origin, *axes = (
        np.array([p.X(), p.Y(), p.Z()])
        for p in (frame.Location(), frame.XDirection(), frame.YDirection(), frame.Direction())
    )
    return Bent(code, origin, np.array(axes), *(float(getattr(own, size)()) for size in sizes))
