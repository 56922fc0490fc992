"""Random choices that recipes share: outlines, sizes, edges to round, patterns, and positions of objects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from OCP.TopoDS import TopoDS_Shape
from scipy.spatial.transform import Rotation

from export.solids import shapes as s

Rng = np.random.Generator
ROUNDING_R = (0.2, 40.0)  # radii of fillets, in footprints of the recipe


@dataclass(frozen=True)
class Scale:
    """size: of the thing, metres; r: metres between pixels where it stands, in the views to come."""

    size: float
    r: float


def spread(rng: Rng, low: float, high: float) -> float:
    """Evenly in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def dims(rng: Rng, scale: Scale, low: float = 0.25) -> np.ndarray:
    """Width, depth and height, the largest `size`."""
    d = np.exp(rng.uniform(np.log(low), 0, 3))
    return scale.size * d / d.max()


def turn(rng: Rng) -> np.ndarray:
    """A rotation about the vertical."""
    return Rotation.from_euler("z", rng.uniform(0, 2 * np.pi)).as_matrix()


def tilt(rng: Rng, most: float) -> np.ndarray:
    """A rotation by up to `most` radians about a random axis."""
    axis = rng.normal(size=3)
    return Rotation.from_rotvec(axis / np.linalg.norm(axis) * rng.uniform(0, most)).as_matrix()


def outline(rng: Rng, count: int, radius: float, rough: float = 0.45) -> np.ndarray:
    """A star-shaped polygon about the origin, [count, 2], counter-clockwise."""
    angle = (np.arange(count) + rng.uniform(-0.3, 0.3, count)) * 2 * np.pi / count + rng.uniform(0, 2 * np.pi)
    length = radius * rng.uniform(1 - rough, 1, count)
    return np.stack([np.cos(angle), np.sin(angle)], 1) * length[:, None]


def rounded(rng: Rng, shape: TopoDS_Shape, scale: Scale, probability: float = 0.65) -> TopoDS_Shape:
    """With that probability fillets or chamfers on all or some edges; smaller ones, or none, where they do not fit."""
    if rng.random() > probability:
        return shape
    edges = s.plain_edges(shape)
    if not edges:
        return shape
    extent = np.ptp(s.bounds(shape), axis=0)
    most = 0.22 * float(extent.min())
    radius = min(spread(rng, ROUNDING_R[0] * scale.r, ROUNDING_R[1] * scale.r), most)
    part = 1.0 if rng.random() < 0.3 else rng.uniform(0.1, 0.7)
    chosen = [e for e in edges if rng.random() < part][:24] or edges[:1]
    operation = s.chamfered if rng.random() < 0.3 else s.filleted
    for _ in range(3):
        try:
            return operation(shape, chosen, radius)
        except s.ShapeError:
            radius /= 3
            chosen = chosen[::2]
    return shape


def attempted(shape: TopoDS_Shape, operation, *arguments) -> TopoDS_Shape:
    """operation(shape, ...), or the shape as it is where that fails."""
    try:
        return operation(shape, *arguments)
    except s.ShapeError:
        return shape


def standing(shape: TopoDS_Shape, z: float = 0.0) -> TopoDS_Shape:
    """Moved so that its bounds stand on z, above the origin."""
    low, high = s.bounds(shape)
    middle = (low + high) / 2
    return s.moved(shape, None, (-middle[0], -middle[1], z - low[2]))


def row(count: int, pitch: float) -> np.ndarray:
    """Places along a line, about 0."""
    return (np.arange(count) - (count - 1) / 2) * pitch


def ring(count: int, radius: float, start: float = 0.0) -> np.ndarray:
    """Places on a circle, [count, 2]."""
    a = start + np.arange(count) * 2 * np.pi / count
    return np.stack([np.cos(a), np.sin(a)], 1) * radius
