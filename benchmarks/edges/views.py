"""Reads sets of whole labelled views (export.solids.dataset --whole), and groups their pixels."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.edges.baselines import points_of
from benchmarks.edges.edges_api import Pinhole
from export.edges.config import SHARP_R
from export.edges.curve_metrics import STEP_R, places_on
from export.edges.data import Frame, RecordError, frame_of
from export.edges.validation import frame_through
from export.solids.records import read_records

ARC_STEP_RAD = np.radians(3.0)
SAME_CURVE_R = 1.0  # largest difference of a distance and its label; beyond it, the label is of another curve


@dataclass(frozen=True, eq=False)
class View:
    """curves: as in export.solids.curves; None if they were not stored."""

    name: str
    frame: Frame
    camera: Pinhole
    curves: Mapping | None

    def seen(self, level: str) -> np.ndarray:
        """Returns the sensor's report at a level: float32 [H, W] in metres, the same for each call."""
        return frame_through(level, self.frame)

    @cached_property
    def groups(self) -> dict[str, dict[str, np.ndarray]]:
        """Returns masks [H, W] by property, then by its range."""
        frame, camera = self.frame, self.camera
        found = {
            "kind": {"creases": frame.kind == 1, "boundaries": frame.kind == 2},
            "range": bins(frame.depth, (0.5, 1, 2, 4), "m", frame.depth > 0),
            "angle between ray and normal": bins(incidence_deg(frame.depth, camera), (30, 60, 75, 85), "deg"),
        }
        # A pixel without an edge has no kind; false positives of both kinds use all of them.
        far = frame.distance >= SHARP_R[-1]
        found["kind"] = {name: mask | far for name, mask in found["kind"].items()}
        angle, rounding = self._of_nearest_curve()
        if angle is not None:
            near = ~far
            found["angle between the surfaces"] = bins(angle, (30, 60, 85, 95, 135), "deg", near)
            found["rounding of the edge"] = {
                "none": near & (rounding == 0),
                **bins(rounding, (0.5,), "r", near & (rounding > 0)),
            }
        radius = bending_radius_r(frame.depth, camera.focal_px)
        smooth = frame.distance > 8
        found["radius of the surface, away from edges"] = bins(radius, (10, 20, 40, 160), "r", smooth)
        return found

    def _of_nearest_curve(self) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Returns for pixels within SHARP_R of an edge the angle in degrees between its surfaces and its rounding in r;
        NaN elsewhere. None if the curves of the view do not have them."""
        curves = [c for c in (self.curves or {}).get("curves", []) if "angle_deg" in c]
        if not curves:
            return None, None
        lines = [polyline(c) for c in curves]
        places = [places_on([line], self.camera.focal_px) for line in lines]
        of_place = np.repeat(np.arange(len(curves)), [len(p) for p in places])
        near = self.frame.distance < SHARP_R[-1]
        depth = self.frame.depth
        points = camera_points(depth, self.camera)[near].astype(np.float64)
        metres, nearest = cKDTree(np.concatenate(places)).query(points)
        footprint = depth[near] / self.camera.focal_px
        same = np.abs(metres / footprint - self.frame.distance[near]) < SAME_CURVE_R + STEP_R
        of_curve = of_place[nearest]
        angle, rounding = (np.full(depth.shape, np.nan) for _ in range(2))
        angle[near] = np.where(same, np.array([c["angle_deg"] for c in curves])[of_curve], np.nan)
        rounding[near] = np.where(same, np.array([c["rounding_m"] for c in curves])[of_curve] / footprint, np.nan)
        return angle, rounding


def read_views(folder: Path, width_px: int | None, limit: int | None) -> list[View]:
    """Reads views, of one width if given, at most `limit`, spread evenly. Raises RecordError if there are none."""
    records = [r for r in read_records(folder) if width_px in (None, r.width)]
    if not records:
        raise RecordError(f"{folder} has no views {width_px} px wide. Make some: export.solids.dataset --whole")
    chosen = np.linspace(0, len(records) - 1, min(limit or len(records), len(records))).astype(int)
    views = []
    for k in np.unique(chosen):
        r = records[k]
        camera = Pinhole(r.intrinsics[0], r.intrinsics[2], r.intrinsics[3])
        views.append(View(r.name, frame_of(r, int(k)), camera, json.loads(r.curves) if r.curves else None))
    return views


def camera_points(depth: np.ndarray, camera: Pinhole) -> np.ndarray:
    """Returns points [H, W, 3] in metres, camera coordinates."""
    height, width = depth.shape
    points = points_of(depth, camera.focal_px)
    moved = np.array([(width - 1) / 2 - camera.cx_px, (height - 1) / 2 - camera.cy_px])
    points[..., :2] += (moved * depth[..., None] / camera.focal_px).astype(np.float32)
    return points


def polyline(curve: Mapping) -> np.ndarray:
    """Returns points [n, 3] of a stored curve; an arc of three points becomes a polyline."""
    points = np.asarray(curve["points"], np.float64)
    if curve["type"] != "arc":
        return points
    centre, axis = np.asarray(curve["centre"]), np.asarray(curve["axis"])
    x = points[0] - centre
    y = np.cross(axis, x)
    middle, sweep = (np.arctan2((p - centre) @ y, (p - centre) @ x) % (2 * np.pi) for p in points[1:])
    sweep = sweep if sweep > 1e-9 else 2 * np.pi
    if middle > sweep:  # the opposite direction
        sweep -= 2 * np.pi
    angle = np.linspace(0, sweep, max(3, int(np.ceil(abs(sweep) / ARC_STEP_RAD)) + 1))
    return centre + np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * y


def bins(
    values: np.ndarray, edges: Sequence[float], unit: str, among: np.ndarray | None = None
) -> dict[str, np.ndarray]:
    """Returns masks by ranges of values; NaN is in none."""
    among = np.isfinite(values) if among is None else among & np.isfinite(values)
    found = {}
    for low, high in pairwise([-np.inf, *edges, np.inf]):
        name = f"{low:g} to {high:g} {unit}"
        if low == -np.inf:
            name = f"under {high:g} {unit}"
        elif high == np.inf:
            name = f"over {low:g} {unit}"
        found[name] = among & (values >= low) & (values < high)
    return found


def _slopes_of_inverse(depth: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns inverse depth [H, W] and its differences in x and y a pixel. The smaller of the differences to both sides
    is used, so that an edge does not tilt the surface next to it. NaN for unknown depth."""
    with np.errstate(divide="ignore"):
        inverse = np.where(depth > 0, 1 / depth.astype(np.float64), np.nan)
    slopes = []
    for axis in (1, 0):
        before, after = np.diff(inverse, axis=axis, prepend=np.nan), np.diff(inverse, axis=axis, append=np.nan)
        slopes.append(np.where(np.abs(before) < np.abs(after), before, np.where(np.isnan(after), before, after)))
    return inverse, slopes[0], slopes[1]


def normals(depth: np.ndarray, camera: Pinhole) -> tuple[np.ndarray, np.ndarray]:
    """Returns unit normals [H, W, 3] and unit rays from exact depth [H, W], camera coordinates; NaN if unknown."""
    inverse, sx, sy = _slopes_of_inverse(depth)
    height, width = depth.shape
    x, y = np.meshgrid(np.arange(width) - camera.cx_px, np.arange(height) - camera.cy_px)
    f = camera.focal_px
    normal = np.stack([sx * f, sy * f, inverse - x * sx - y * sy], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    ray = np.stack([x / f, y / f, np.ones_like(x)], -1)
    return normal, ray / np.linalg.norm(ray, axis=-1, keepdims=True)


def incidence_deg(depth: np.ndarray, camera: Pinhole) -> np.ndarray:
    """Returns degrees between the ray and the surface's normal, 0 for a frontal view; NaN if unknown: [H, W]."""
    normal, ray = normals(depth, camera)
    return np.degrees(np.arccos(np.clip(np.abs((normal * ray).sum(-1)), 0, 1)))


def bending_radius_r(depth: np.ndarray, focal_px: float) -> np.ndarray:
    """Returns the radius of the surface in r along its strongest curvature, from normals 2 px to either side of a
    pixel: infinite on planes, NaN if unknown: [H, W]. It needs exact depth."""
    camera = Pinhole.centred(depth.shape, focal_px)
    normal, _ = normals(depth, camera)
    points, bend = points_of(depth, focal_px).astype(np.float64), np.zeros(depth.shape)
    for axis in (0, 1):
        turned = np.linalg.norm(np.roll(normal, -2, axis) - np.roll(normal, 2, axis), axis=-1)
        apart = np.linalg.norm(np.roll(points, -2, axis) - np.roll(points, 2, axis), axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            bend = np.maximum(bend, turned / apart)
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = np.where(bend < 1e-4 * focal_px / depth, np.inf, 1 / bend) * focal_px / depth
    return np.where(np.isfinite(bend), radius, np.nan)
