"""Where things may stand: free ground, tops of tables and shelves, and where a camera has room."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from export.people.props import Solid
from export.places.mesh import Material, Part

_CELL = 0.04  # metres
_FLAT = 0.012  # metres that a top may be uneven under what stands on it


def about_z(radians: float) -> np.ndarray:
    return Rotation.from_euler("z", radians).as_matrix()


def quad(centre, right, up, width: float, height: float) -> Solid:
    """A rectangle with an image's uv: `right` and `up` are unit vectors [3]."""
    right, up = np.asarray(right, float) * width / 2, np.asarray(up, float) * height / 2
    a, b, c, d = (np.asarray(centre, float) + x * right + y * up for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    uv = np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]], float)
    return Solid(np.array([[a, b, c], [a, c, d]]), uv)


def finished(parts: list[Part], rng: np.random.Generator, shiny_fraction: float = 0.35) -> list[Part]:
    """The same surfaces with drawn shine and, here and there, another colour, one draw a material.

    Most materials of the models have their modeller's default highlight, which would make everything plastic.
    """
    drawn: dict[int, Material] = {}
    recoloured = rng.random() < 0.35
    hue = 1 + rng.normal(0, 0.25, 3)
    for part in parts:
        own = part.material
        if id(own) in drawn:
            continue
        specular, shininess, mirror = own.specular * rng.uniform(0, 0.5), own.shininess, own.mirror
        if rng.random() < shiny_fraction:
            specular = rng.uniform(0.1, 0.7)
            shininess = float(np.exp(rng.uniform(np.log(12), np.log(250))))
            mirror = rng.uniform(0.02, 0.3) if rng.random() < 0.5 else 0.0
        if own.opacity < 1:
            specular, shininess, mirror = 0.6, 150.0, 0.05
        tint = rng.uniform(0.75, 1.08) * (hue if recoloured else np.ones(3))
        colour = tuple(map(float, np.clip(np.array(own.colour) * tint, 0.02, 1.5)))
        drawn[id(own)] = replace(own, colour=colour, specular=specular, shininess=shininess, mirror=mirror)
    return [replace(p, material=drawn[id(p.material)]) for p in parts]


def surface_points(parts: list[Part], spacing: float, rng: np.random.Generator) -> np.ndarray:
    """Points spread over the surfaces, about `spacing` apart: float32 [N, 3]; at most half a million."""
    corners = np.concatenate([p.corners for p in parts])
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    count = int(np.clip(area.sum() / spacing**2, 200, 500_000))
    face = rng.choice(len(area), count, p=area / area.sum())
    share = np.sort(rng.random((count, 2)), axis=1)
    weights = np.stack([share[:, 0], share[:, 1] - share[:, 0], 1 - share[:, 1]], 1)
    return (corners[face] * weights[..., None]).sum(1)


@dataclass
class Heights:
    """The highest surface over each cell of the ground: metres, -inf where nothing is; x0, y0: corner of the first."""

    x0: float
    y0: float
    top: np.ndarray
    taken: np.ndarray

    @classmethod
    def over(cls, low, high) -> Heights:
        shape = [max(int(np.ceil((b - a) / _CELL)), 1) for a, b in zip(low[:2], high[:2], strict=True)]
        shape = shape[1], shape[0]
        return cls(float(low[0]), float(low[1]), np.full(shape, -np.inf), np.zeros(shape, bool))

    def add(self, parts: list[Part], rng: np.random.Generator) -> None:
        points = surface_points(parts, _CELL / 2.5, rng)
        x, y = ((points[:, :2] - [self.x0, self.y0]) / _CELL).astype(int).T
        inside = (x >= 0) & (y >= 0) & (x < self.top.shape[1]) & (y < self.top.shape[0])
        np.maximum.at(self.top, (y[inside], x[inside]), points[inside, 2])

    def cells(self, centre, size, yaw: float) -> np.ndarray | None:
        """Mask of the cells under a rectangle; None where it reaches over the edge of what is known."""
        turn = about_z(yaw)[:2, :2]
        corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * np.asarray(size[:2]) / 2 @ turn.T + centre[:2]
        at = (corners - [self.x0, self.y0]) / _CELL
        if (at < 0).any() or (at > self.top.shape[::-1]).any():
            return None
        mask = np.zeros(self.top.shape, np.uint8)
        cv2.fillConvexPoly(mask, np.round(at - 0.5).astype(np.int32), 1)
        return mask > 0

    def level(self, mask: np.ndarray) -> float | None:
        """The height of a flat free top under `mask`, or None."""
        heights = self.top[mask]
        if not len(heights) or self.taken[mask].any() or not np.isfinite(heights).all() or np.ptp(heights) > _FLAT:
            return None
        return float(heights.max())

    def clear(self, eye: np.ndarray, radius: float = 0.2) -> float:
        """Metres between a place for a camera and the highest thing under it, within `radius`."""
        x, y = ((eye[:2] - [self.x0, self.y0]) / _CELL).astype(int)
        r = int(radius / _CELL)
        near = self.top[max(y - r, 0) : max(y + r + 1, 0), max(x - r, 0) : max(x + r + 1, 0)]
        return float(eye[2] - near.max()) if near.size and np.isfinite(near.max()) else np.inf


def placed(parts: tuple[Part, ...] | list[Part], at, yaw: float) -> list[Part]:
    """Turned about the vertical, then with its foot at `at` [3]."""
    return [p.moved(about_z(yaw), at) for p in parts]
