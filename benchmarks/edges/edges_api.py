"""Runs edges through the Python package (`python/maquette`), with square pixels and curves as plain lists."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import maquette
import numpy as np

LINE, ARC, SPLINE = range(3)
TYPES = ("line", "arc", "spline")
KINDS = ("none", "crease", "boundary")


@dataclass(frozen=True, eq=False)
class Curves:
    """types: LINE, ARC or SPLINE of each curve; kinds: 1 crease, 2 boundary; points: its polyline, float64 [n, 3] in
    metres. boxes_m: the three sides of each box, the longest first. Times in milliseconds."""

    types: list[int]
    kinds: list[int]
    points: list[np.ndarray]
    boxes_m: list[tuple[float, float, float]]
    curves_ms: float
    boxes_ms: float

    @staticmethod
    def of(found: maquette.Curves) -> Curves:
        types, kinds = ([names.index(name) for name in given] for names, given in (
            (TYPES, [c.type for c in found.curves]), (KINDS, [c.kind for c in found.curves]),
        ))  # fmt: skip
        boxes = [tuple(box.size_m.tolist()) for box in found.boxes]
        return Curves(types, kinds, [c.points_m for c in found.curves], boxes, found.curves_ms, found.boxes_ms)


@dataclass(frozen=True, eq=False)
class EdgesResult:
    """Planes [H, W]: distance and spread float32 in r, kind uint8 (0 none, 1 crease, 2 boundary). stats: the fields of
    maq_edges_stats. curves: None unless requested."""

    distance: np.ndarray
    spread: np.ndarray
    kind: np.ndarray
    stats: Any
    curves: Curves | None = None

    @staticmethod
    def of(found: maquette.EdgesResult) -> EdgesResult:
        curves = Curves.of(found.curves) if hasattr(found, "curves") else None
        return EdgesResult(found.distance_r, found.expected_error_r, found.kind, SimpleNamespace(**found.stats), curves)


@dataclass(frozen=True)
class Pinhole:
    """Focal length and principal point in pixels; pixels are square."""

    focal_px: float
    cx_px: float
    cy_px: float

    @staticmethod
    def centred(shape: tuple[int, int], focal_px: float) -> Pinhole:
        """Returns the camera of a frame [H, W] whose principal point is its middle."""
        return Pinhole(focal_px, (shape[1] - 1) / 2, (shape[0] - 1) / 2)

    def intrinsics(self, shape: tuple[int, int]) -> maquette.Intrinsics:
        """Returns the intrinsics for a frame [H, W]."""
        return maquette.Intrinsics(shape[1], shape[0], self.focal_px, self.focal_px, self.cx_px, self.cy_px)


class Edges:
    """One bundle, for a `with` statement.

    bundle: folder with manifest.json. threads: 0 lets the library choose. settings: further fields of maq_edges_config
    by their names. model: the package's. Raises MaquetteError.
    """

    def __init__(self, bundle: Path, threads: int = 0, **settings: int) -> None:
        self.model = maquette.Edges(bundle, threads=threads, **settings)

    def __enter__(self) -> Edges:
        return self

    def __exit__(self, *_: object) -> None:
        self.model.close()

    def run(self, depth: np.ndarray, camera: Pinhole, curves: bool = False) -> EdgesResult:
        """depth: float32 [H, W] in metres, 0 if unknown. curves: also finds curves and boxes. Raises MaquetteError."""
        return EdgesResult.of(self.model.run(depth, camera.intrinsics(depth.shape), curves))


def depth_frames(uri: str, count: int) -> Iterator[tuple[np.ndarray, Pinhole]]:
    """Yields the first frames of a depth source, such as stub:solids: depth float32 [H, W] in metres, 0 if unknown, and
    the camera. Raises MaquetteError."""
    with maquette.Source(uri) as source:
        intrinsics = source.intrinsics
        camera = Pinhole(intrinsics.fx_px, intrinsics.cx_px, intrinsics.cy_px)
        for _ in range(count):
            yield source.read().depth(), camera
