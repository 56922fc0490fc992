"""A dense cloud of posed photos: depth of each, and the points that several depth maps agree on."""

from __future__ import annotations

import cv2
import numpy as np
from tqdm import tqdm

from export.camera import Camera
from export.captures.plane_sweep import GreyView, depth_of
from export.captures.structure import CaptureError
from export.point_cloud import evenly_spread

POINTS = 200_000  # this and the witnesses by the table in docs/research/scenes.md
NEIGHBOURS = 4
_BEST_ANGLE, _ANGLE_WIDTH = 10.0, 8.0  # degrees between two cameras and a point
_AGREEMENT = 0.01  # of depth
WITNESSES = 2  # other depth maps that must agree


def neighbours_of(k: int, cameras: list[Camera], seen: list[set[int]], places: dict[int, np.ndarray]) -> list[int]:
    """The views that see most of what view k sees, from about 10 degrees aside, the best first."""
    scores = {}
    for j, other in enumerate(cameras):
        shared = seen[k] & seen[j]
        if j == k or len(shared) < 12:
            continue
        points = np.array([places[p] for p in shared])
        here, there = (c.centre - points for c in (cameras[k], other))
        cosine = (here * there).sum(1) / np.linalg.norm(here, axis=1) / np.linalg.norm(there, axis=1)
        angle = np.degrees(np.arccos(np.clip(np.median(cosine), -1, 1)))
        scores[j] = len(shared) * float(np.exp(-(((angle - _BEST_ANGLE) / _ANGLE_WIDTH) ** 2)))
    return sorted(scores, key=scores.get, reverse=True)[:NEIGHBOURS]


def depth_maps(
    cameras: list[Camera],
    images: list[np.ndarray],
    masks: list[np.ndarray],
    seen: list[set[int]],
    places: dict[int, np.ndarray],
) -> list[np.ndarray]:
    """Depth of each photo, float32 [H, W], along the optical axis; 0: unknown.

    images: uint8 [H, W, 3], blue first; masks: bool [H, W]; seen: numbers of the sparse points in each photo;
    places: of those, [3].
    """
    greys = [cv2.cvtColor(image, cv2.COLOR_BGR2GRAY).astype(np.float32) for image in images]
    views = [GreyView(*three) for three in zip(cameras, greys, masks, strict=True)]
    depths = []
    for k, view in enumerate(tqdm(views, unit="depth map")):
        others = [views[j] for j in neighbours_of(k, cameras, seen, places)]
        sparse = np.array([places[p] for p in seen[k]]).reshape(-1, 3)
        if len(others) < 2 or len(sparse) < 12:
            depths.append(np.zeros(view.grey.shape, np.float32))
            continue
        along = (sparse - view.camera.centre) @ view.camera.rotation[2]
        near, far = np.quantile(along, (0.01, 0.99)) * (0.9, 1.1)
        depths.append(depth_of(view, others, float(near), float(far)))
    return depths


def fused(
    cameras: list[Camera],
    images: list[np.ndarray],
    depths: list[np.ndarray],
    max_points: int = POINTS,
    min_witnesses: int = WITNESSES,
) -> tuple[np.ndarray, np.ndarray]:
    """The points that a photo and at least so many others have at one depth: float32 [P, 3] and colours uint8 [P, 3],
    red first.

    Raises CaptureError where hardly a point is found.
    """
    xyz, rgb = [], []
    for k, camera in enumerate(cameras):
        y, x = np.nonzero(depths[k])
        points = _lifted(camera, x, y, depths[k][y, x])
        witnesses = sum(_agrees(points, cameras[j], depths[j]) for j in range(len(cameras)) if j != k)
        agreed = np.broadcast_to(witnesses >= min_witnesses, len(points))
        xyz.append(points[agreed])
        rgb.append(images[k][y[agreed], x[agreed]][:, ::-1])
    xyz, rgb = np.concatenate(xyz), np.concatenate(rgb)
    if len(xyz) < 1000:
        raise CaptureError(f"Only {len(xyz)} points were found that several photos agree on.")
    xyz, rgb = evenly_spread(xyz, rgb, max_points, np.random.default_rng(0))
    return xyz.astype(np.float32), np.ascontiguousarray(rgb)


def _lifted(camera: Camera, x: np.ndarray, y: np.ndarray, depth: np.ndarray) -> np.ndarray:
    rays = np.stack([(x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px, np.ones(len(x))], 1)
    return (rays * depth[:, None]) @ camera.rotation + camera.centre


def _agrees(points: np.ndarray, camera: Camera, depth: np.ndarray) -> np.ndarray:
    """Whether another depth map has a surface where each point is: bool [P]."""
    seen = (points - camera.centre) @ camera.rotation.T
    z = np.maximum(seen[:, 2], 1e-9)
    x = np.round(seen[:, 0] / z * camera.fx_px + camera.cx_px)
    y = np.round(seen[:, 1] / z * camera.fy_px + camera.cy_px)
    inside = (seen[:, 2] > 0) & (x >= 0) & (y >= 0) & (x < camera.width_px) & (y < camera.height_px)
    found = np.zeros(len(points), np.float32)
    found[inside] = depth[y[inside].astype(int), x[inside].astype(int)]
    return (found > 0) & (np.abs(found - z) < _AGREEMENT * z)
