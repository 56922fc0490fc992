"""Writes data/edge_fusion/views.json: three views of a box with their fields, and their fusion in float64.

Fields are the true distances to the box's edges with errors, so that views disagree. The points are those of
export.edges.fusion, which the C++ is compared with. Run from the project's root:

    python -m tests.native.generate.make_edge_fusion
"""

import json
from pathlib import Path

import numpy as np

from export.camera import Camera
from export.edges.config import EPS_R
from export.edges.fusion import FieldView, Targets, fused, grid_targets, values_of

FILE = Path(__file__).parents[1] / "data" / "edge_fusion" / "views.json"
SIZE = np.array([0.4, 0.3, 0.25])
EYES = ((0.9, -0.7, 0.8), (0.3, -1.0, 0.9), (1.3, 0.4, 0.6))
FRAME_PX, FOCAL_PX = (32, 24), 36.0


def looking_at_origin(eye: np.ndarray) -> np.ndarray:
    """World to camera, [3, 3], upright, of a camera that looks at the box."""
    z = -eye / np.linalg.norm(eye)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def view_of_box(eye: np.ndarray, rng: np.random.Generator) -> FieldView:
    camera = Camera.centred(*FRAME_PX, FOCAL_PX, looking_at_origin(eye), eye)
    y, x = np.mgrid[: camera.height_px, : camera.width_px]
    ray = np.stack([(x - camera.cx_px) / FOCAL_PX, (y - camera.cy_px) / FOCAL_PX, np.ones_like(x, float)], -1)
    way = ray @ camera.rotation
    near, far = ((side * SIZE / 2 - eye) / way for side in (-np.sign(way), np.sign(way)))
    enter = near.max(-1)
    depth = np.where(enter < far.min(-1), enter, 0).astype(np.float32).astype(np.float64)
    point = eye + way * depth[..., None]
    gap = np.abs(SIZE / 2 - np.abs(point))  # from each pair of faces: 0 for that of the point
    distance_m = np.sort(gap, -1)[..., 1]
    r = np.where(depth > 0, depth, 1) / FOCAL_PX
    field = np.where(depth > 0, np.clip(distance_m / r + rng.normal(0, 0.4, depth.shape), 0, EPS_R), EPS_R)
    return FieldView(camera, depth, field.astype(np.float32).astype(np.float64), np.zeros_like(field))


def made() -> dict:
    rng = np.random.default_rng(24)
    views = [view_of_box(np.array(eye), rng) for eye in EYES]
    targets, origin, cell_m = grid_targets(views)
    values = values_of(views, Targets(targets.point + origin, targets.normal, targets.r_m))
    return {
        "eps_r": EPS_R,
        "views": [
            {
                "size": [v.camera.width_px, v.camera.height_px],
                "intrinsics": [v.camera.fx_px, v.camera.fy_px, v.camera.cx_px, v.camera.cy_px],
                "rotation": v.camera.rotation.ravel().tolist(),
                "centre": v.camera.centre.tolist(),
                "depth": np.round(v.depth, 9).ravel().tolist(),
                "distance": np.round(v.distance, 6).ravel().tolist(),
            }
            for v in views
        ],
        "origin": origin.tolist(),
        "cell_m": cell_m,
        "points": np.round(targets.point, 7).tolist(),
        "normals": np.round(targets.normal, 4).tolist(),
        "distance_m": np.round(fused(values), 7).tolist(),
        "views_of_point": (~np.isnan(values.distance)).sum(0).tolist(),
    }


if __name__ == "__main__":
    FILE.parent.mkdir(parents=True, exist_ok=True)
    FILE.write_text(json.dumps(made(), separators=(",", ":")) + "\n")
    print(f"Wrote {FILE}")
