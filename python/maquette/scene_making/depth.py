"""The one call that turns posed photos into a dense cloud."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from maquette.native import MaquetteError
from maquette.scene_making.capture import SparsePoints
from maquette.scenes import Capture


def dense_cloud(
    capture: Capture, sparse: SparsePoints, threads: int, progress: Callable[[float], None]
) -> tuple[np.ndarray, np.ndarray]:
    """Points that the photos of a capture agree on: float32 [P, 3] in its world, and colours uint8 [P, 3], red first.
    Held-out photos are not used. Raises MaquetteError where hardly a point is found."""
    try:
        from export.camera import Camera
        from export.captures.dense import depth_maps, fused
        from export.captures.structure import CaptureError
    except ImportError as error:
        text = f"Depth is not part of this package yet; run in a checkout, with its root on PYTHONPATH ({error})"
        raise MaquetteError(text, "MAQ_ERROR_UNSUPPORTED") from None
    used = [k for k, view in enumerate(capture.views) if not view.held_out]
    cameras, images, masks = [], [], []
    for k in used:
        camera = capture.views[k].camera
        i = camera.intrinsics
        size = i.width_px, i.height_px
        cameras.append(Camera(*size, i.fx_px, i.fy_px, i.cx_px, i.cy_px, camera.rotation, camera.centre))
        images.append(capture.photo(k).pixels("bgr8"))
        masks.append(np.ones(images[-1].shape[:2], bool))
    progress(0.0)
    places = dict(enumerate(sparse.xyz))
    depths = depth_maps(cameras, images, masks, [set(sparse.seen[k].tolist()) for k in used], places)
    try:
        return fused(cameras, images, depths)
    except CaptureError as error:
        raise MaquetteError(str(error), "MAQ_ERROR_UNREADABLE") from None
