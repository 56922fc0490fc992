"""From (split, seed) to a solid in its surroundings, and the cameras that look at it.

Splits share no recipe family. Whatever cannot be made is drawn again from the next random numbers of that seed; so it
is where OpenCascade crashes or uses up its time (`guarded.py`): a seed always means the same solid, and none is lost.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from OCP.TopoDS import TopoDS_Shape
from scipy.spatial.transform import Rotation

from export.camera import Camera
from export.solids import families, held_out
from export.solids import shapes as s
from export.solids.brep import Solid, solid_of
from export.solids.draw import Rng, Scale, spread, standing, tilt, turn
from export.solids.subprocess_guard import LostError, called

Value = TypeVar("Value")
SPLITS = {"train": 1, "val": 2, "test": 3}
FAMILIES = {"train": families.TRAIN, "val": held_out.VAL, "test": held_out.TEST}
DEVIATION_R = 0.02  # of the mesh from the surface, at most
ATTEMPTS = 20
CPU_S = 12  # of a seed, which takes half a second
MAX_AGAIN = 5
FRAME_PX = 320, 240
SIZE_M = 0.02, 5.0  # of the thing
RANGE_M = 0.15, 8.0  # of the cameras from it, about: that of depth cameras
_USUAL_FOCAL_PX = 330.0
_STAGES = {"alone": 0.3, "ground": 0.3, "corner": 0.25, "group": 0.15}
_MIN_FACES, _MAX_FACES = 3, 400


class RecipeError(RuntimeError):
    """No attempt of a seed gave a solid."""


def generator(split: str, seed: int, what: int) -> Rng:
    """Random numbers of one seed; `what` keeps shapes, cameras and crops from disturbing each other."""
    return np.random.default_rng([SPLITS[split], 24, seed, what])


@dataclass(eq=False)
class Made:
    """family: of the (first) thing; stage: what stands around it; cameras: of FRAME_PX, looking at it."""

    solid: Solid
    family: str
    stage: str
    cameras: list[Camera]


def make(split: str, seed: int, views: int, again: int = 0, magnified: float = 1.0) -> Made:
    """again: how often before this seed took its process down; magnified: the largest frame to come by FRAME_PX. Raises
    RecipeError."""
    for attempt in range(ATTEMPTS):
        rng = generator(split, seed, 10 + attempt + ATTEMPTS * again)
        try:
            return _make(split, rng, views, magnified)
        except s.ShapeError:
            continue
        except Exception as error:  # OpenCascade's own errors share no base class in Python
            if not type(error).__module__.startswith("OCP"):
                raise
    raise RecipeError(f"{ATTEMPTS} attempts of {split} {seed} gave no solid")


def without_crashes(function: Callable[[int], Value]) -> Value:
    """function(again) in a child process, for again = 0, 1, .. until one comes back. Raises RecipeError."""
    for again in range(MAX_AGAIN):
        try:
            return called(function, again, cpu_s=CPU_S)
        except LostError as error:
            lost = error
    raise RecipeError(f"{MAX_AGAIN} times the process was lost, at last by {lost}")


def _make(split: str, rng: Rng, views: int, magnified: float) -> Made:
    pixels = spread(rng, 60, 450)  # that the thing spans in a view
    stage = str(rng.choice(list(_STAGES), p=list(_STAGES.values())))
    size = size_spanning(rng, pixels)
    scale = Scale(size, size / pixels)
    family, shape = _thing(split, rng, scale)
    if stage == "group":
        shape = _group(split, rng, scale, shape)
    elif rng.random() < (0.7 if stage == "alone" else 0.12):
        shape = s.moved(shape, Rotation.random(random_state=int(rng.integers(2**31))).as_matrix())
    return placed(rng, family, shape, stage, pixels, views, magnified)


def placed(
    rng: Rng, family: str, shape: TopoDS_Shape, stage: str, pixels: float, views: int, magnified: float = 1.0
) -> Made:
    """A shape set down where the stage says, with cameras in which it spans about so many pixels of FRAME_PX; meshed
    for frames `magnified` times as large. Raises ShapeError."""
    shape = standing(shape)
    bounds = s.bounds(shape)
    if stage in ("ground", "group"):
        shape = _on_ground(rng, shape, bounds)
    elif stage == "corner":
        shape = _in_corner(rng, shape, bounds)
    count = len(s.faces(shape))
    if not _MIN_FACES <= count <= _MAX_FACES:
        raise s.ShapeError(f"{count} faces")
    cameras = [_camera(rng, stage, bounds, pixels) for _ in range(views)]
    solid = solid_of(shape, DEVIATION_R * _min_footprint(cameras, bounds) / magnified)
    return Made(solid, family, stage, cameras)


def size_spanning(rng: Rng, pixels: float) -> float:
    """How large, in metres, a thing is that spans so many pixels in a view of a depth camera."""
    near, far = (distance * pixels / _USUAL_FOCAL_PX for distance in RANGE_M)
    return spread(rng, max(SIZE_M[0], near), min(SIZE_M[1], far))


def _thing(split: str, rng: Rng, scale: Scale) -> tuple[str, TopoDS_Shape]:
    known = FAMILIES[split]
    weights = np.array([families.WEIGHTS.get(name, 1.0) for name in known])
    name = str(rng.choice(list(known), p=weights / weights.sum()))
    return name, known[name](rng, scale)


def _group(split: str, rng: Rng, scale: Scale, first: TopoDS_Shape) -> TopoDS_Shape:
    """Two or three things beside, or into, each other."""
    parts = [standing(first)]
    for _ in range(rng.integers(1, 3)):
        smaller = Scale(scale.size * rng.uniform(0.25, 0.8), scale.r)
        _, other = _thing(split, rng, smaller)
        angle, away = rng.uniform(0, 2 * np.pi), scale.size * rng.uniform(0.4, 0.9)
        shift = (away * np.cos(angle), away * np.sin(angle), 0)
        parts.append(s.moved(standing(other), turn(rng), shift))
    return s.fused(parts)


def _on_ground(rng: Rng, shape: TopoDS_Shape, bounds: np.ndarray) -> TopoDS_Shape:
    extent = float(np.ptp(bounds, axis=0).max())
    w, d = extent * np.exp(rng.uniform(np.log(1.3), np.log(12), 2))
    thickness = extent * spread(rng, 0.02, 0.3)
    top = s.box((w, d, thickness), (*(rng.uniform(-0.15, 0.15, 2) * extent), -thickness))
    return s.fused([s.moved(top, turn(rng)), shape])


def _in_corner(rng: Rng, shape: TopoDS_Shape, bounds: np.ndarray) -> TopoDS_Shape:
    """Floor and two walls, which need not meet at a right angle; the camera looks from x, y > 0."""
    low, high = bounds
    extent = float((high - low).max())
    gap = extent * np.where(rng.random(2) < 0.35, 0.0, rng.uniform(0.02, 0.8, 2))
    t, far = 0.3 * extent, 7 * extent
    floor = s.box((far, far, t), (low[0] - gap[0] - t + far / 2, low[1] - gap[1] - t + far / 2, -t))
    height = extent * rng.uniform(0.8, 4)
    wall_x = s.box((t, far, height), (low[0] - gap[0] - t / 2, low[1] - gap[1] - t + far / 2, 0))
    wall_y = s.box((far, t, height), (low[0] - gap[0] - t + far / 2, low[1] - gap[1] - t / 2, 0))
    if rng.random() < 0.3:
        lean = Rotation.from_euler("z", rng.uniform(-0.5, 0.1)).as_matrix()
        foot = np.array([low[0] - gap[0], low[1] - gap[1], 0])
        wall_y = s.moved(wall_y, lean, foot - lean @ foot)
    if rng.random() < 0.7:
        shape = s.fused([floor, wall_x, wall_y, shape])
    else:
        shape = s.fused([floor, wall_x, shape])
    return shape


def _camera(rng: Rng, stage: str, bounds: np.ndarray, pixels: float) -> Camera:
    low, high = bounds
    extent = float((high - low).max())
    focal = spread(rng, 180, 600)
    distance = max(focal * extent / (pixels * spread(rng, 0.6, 1.6)), 0.75 * extent)
    target = rng.uniform(low, high) * 0.6 + (low + high) / 2 * 0.4
    if stage == "alone":
        way = rng.normal(size=3)
    else:
        azimuth = rng.uniform(0.1, np.pi / 2 - 0.1) if stage == "corner" else rng.uniform(0, 2 * np.pi)
        elevation = np.radians(rng.uniform(6, 78))
        way = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    way /= np.linalg.norm(way)
    centre = target + way * distance
    if stage != "alone":
        centre[2] = max(centre[2], 0.05 * extent)
    rotation = looking(target - centre)
    roll = rng.normal(0, 0.1) if rng.random() < 0.8 else rng.uniform(-np.pi, np.pi)
    rotation = tilt(rng, 0.05) @ Rotation.from_euler("z", roll).as_matrix() @ rotation
    return Camera.centred(*FRAME_PX, focal, rotation, centre)


def looking(way: np.ndarray) -> np.ndarray:
    """World to camera, [3, 3], of a camera that looks that way with its image upright."""
    z = way / np.linalg.norm(way)
    up = np.array([0, 0, 1.0]) if abs(z[2]) < 0.999 else np.array([0, 1.0, 0])
    x = np.cross(z, up)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def _min_footprint(cameras: list[Camera], bounds: np.ndarray) -> float:
    """r of the nearest thing in any view, metres; bent surfaces are within the bounds."""
    out = np.inf
    for camera in cameras:
        away = np.linalg.norm(np.clip(camera.centre, *bounds) - camera.centre)
        out = min(out, max(away, 0.05 * np.linalg.norm(np.ptp(bounds, axis=0))) / camera.fx_px)
    return float(out)
