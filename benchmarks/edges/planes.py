"""Creases and boxes without a network: planes that OpenCV finds in a depth frame, intersected where they touch."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np

from benchmarks.edges.curve_scores import view_score
from benchmarks.edges.edges_api import LINE, Curves, Pinhole
from benchmarks.edges.rivals import normals_of
from benchmarks.edges.views import View, camera_points

THRESHOLDS_R = (0.5, 1.0, 2.0, 4.0)  # of a point from its plane, tried on validation views; r of the median depth
BLOCK_PX, MIN_BLOCKS = 10, 4  # of the blocks that planes grow from
NO_PLANE = 255
TOUCHING_PX = 5
MIN_CREASE_PX = 10
NEAR_LINE_R = 4.0
MIN_ANGLE_DEG, SQUARE_DEG = 10.0, 8.0
ENDS = (0.02, 0.98)  # quantiles that a crease or a side runs between
MAX_PLANES = 24


@dataclass(frozen=True)
class Planes:
    """threshold_r: the setting that suits validation views."""

    threshold_r: float

    def find(self, depth: np.ndarray, camera: Pinhole) -> Curves:
        start = time.perf_counter()
        known = depth > 0
        if known.sum() < BLOCK_PX**2 * MIN_BLOCKS:
            return Curves([], [], [], [], 0.0, 0.0)
        r = float(np.median(depth[known])) / camera.focal_px
        points = camera_points(depth, camera)
        labels, equations = find_planes(points, depth, camera, self.threshold_r * r)
        creases, touching = [], []
        for i, j in combinations(range(min(len(equations), MAX_PLANES)), 2):
            line = crease_of(points, labels, equations, (i, j), camera)
            if line is not None:
                creases.append(line)
                touching.append((i, j))
        middle = time.perf_counter()
        boxes = boxes_of(points, labels, equations, touching)
        now = time.perf_counter()
        times = 1000 * (middle - start), 1000 * (now - middle)
        return Curves([LINE] * len(creases), [1] * len(creases), creases, boxes, *times)


def find_planes(
    points: np.ndarray, depth: np.ndarray, camera: Pinhole, threshold_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Number of each pixel's plane [H, W], NO_PLANE where there is none; planes [n, 4], a x + b y + c z + d = 0, whose
    normals point to the camera."""
    given = np.where((depth > 0)[..., None], points, np.float32(np.nan))
    given = np.ascontiguousarray(np.dstack([given, np.ones_like(depth)]), np.float32)
    normals = normals_of(depth, camera.focal_px, "FALS")
    normals = np.ascontiguousarray(np.dstack([normals, np.zeros_like(depth)]), np.float32)
    size = BLOCK_PX**2 * MIN_BLOCKS
    labels, equations = cv2.findPlanes(given, normals, None, None, BLOCK_PX, size, threshold_m)
    if equations is None or np.size(equations) < 4:
        return np.full(depth.shape, NO_PLANE, np.uint8), np.zeros((0, 4))
    return labels, np.asarray(equations, np.float64).reshape(-1, 4)


def crease_of(
    points: np.ndarray, labels: np.ndarray, equations: np.ndarray, pair: tuple[int, int], camera: Pinhole
) -> np.ndarray | None:
    """Where two planes meet, as its two ends, if their pixels touch there."""
    kernel = np.ones((TOUCHING_PX, TOUCHING_PX), np.uint8)
    both = np.ones(labels.shape, bool)
    for k in pair:
        both &= cv2.dilate((labels == k).astype(np.uint8), kernel) > 0
    both &= points[..., 2] > 0
    normals, offsets = equations[list(pair), :3], equations[list(pair), 3]
    along = np.cross(*normals)
    sine = np.linalg.norm(along)
    if both.sum() < MIN_CREASE_PX or sine < np.sin(np.radians(MIN_ANGLE_DEG)):
        return None
    along /= sine
    origin = np.linalg.solve(np.vstack([normals, along]), [*-offsets, 0.0])
    t = (points[both] - origin) @ along
    off = np.linalg.norm(points[both] - origin - t[:, None] * along, axis=1)
    t = t[off < NEAR_LINE_R * points[both][:, 2] / camera.focal_px]
    if len(t) < MIN_CREASE_PX:
        return None
    return origin + np.quantile(t, ENDS)[:, None] * along


def boxes_of(
    points: np.ndarray, labels: np.ndarray, equations: np.ndarray, touching: Sequence[tuple[int, int]]
) -> list[tuple[float, float, float]]:
    """Sides of each convex corner of three planes at right angles, the longest first, the largest box first."""
    found, pairs = [], set(touching)
    for three in combinations(range(len(equations)), 3):
        normals, offsets = equations[list(three), :3], equations[list(three), 3]
        cosines = [abs(normals[a] @ normals[b]) for a, b in combinations(range(3), 2)]
        if not pairs.issuperset(combinations(three, 2)) or max(cosines) > np.sin(np.radians(SQUARE_DEG)):
            continue
        corner = np.linalg.solve(normals, -offsets)
        faces = [points[labels == k] for k in three]
        inwards = [normals[a] @ (faces[b].mean(0) - corner) for a in range(3) for b in range(3) if a != b]
        if max(inwards) >= 0:  # a corner of a room
            continue
        sides = []
        for axis in range(3):  # along the normal of one face run the two others
            runs = [np.ptp(np.quantile(faces[b] @ normals[axis], ENDS)) for b in range(3) if b != axis]
            sides.append(float(np.mean(runs)))
        found.append(tuple(sorted(sides, reverse=True)))
    return sorted(found, key=np.prod, reverse=True)


def tuned(views: Sequence[View], seen: Sequence[np.ndarray]) -> Planes:
    """With the threshold of the best F-score of creases and boundaries on these views."""
    scores = []
    for threshold in THRESHOLDS_R:
        planes = Planes(threshold)
        each = [view_score(planes.find(depth, view.camera), view) for view, depth in zip(views, seen, strict=True)]
        scores.append(np.mean([figures["f_score"] for figures in each]))
    return Planes(THRESHOLDS_R[int(np.argmax(scores))])


def missing() -> str:
    needed = [name for name in ("findPlanes", "RgbdNormals") if not hasattr(cv2, name)]
    return f"this OpenCV ({cv2.__version__}) has no {', '.join(needed)}" if needed else ""
