"""A dense cloud of posed photos, by the SDK: depth of each, and the points that the depth maps agree on."""

from __future__ import annotations

import cv2
import maquette
import numpy as np

from export.camera import Camera
from export.captures.structure import CaptureError

POINTS = 200_000
_MIN_POINTS = 1000


def dense_cloud(
    cameras: list[Camera],
    images: list[np.ndarray],
    masks: list[np.ndarray],
    points: np.ndarray,
    max_points: int = POINTS,
) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
    """Depth of each photo, float32 [H, W], along the optical axis, 0: unknown; and of all a cloud, float32 [P, 3] with
    colours uint8 [P, 3], red first.

    images: uint8 [H, W, 3], blue first; masks: bool [H, W], where points are wanted; points: [N, 3], a sparse cloud.
    Raises CaptureError where hardly a point is found.
    """
    photos = [cv2.cvtColor(image, cv2.COLOR_BGR2RGB) for image in images]
    grey = [mask.astype(np.uint8) * 255 for mask in masks]
    try:
        dense = maquette.DenseCloud(photos, [_pinhole(c) for c in cameras], points, grey, max_points=max_points)
    except maquette.MaquetteError as error:
        raise CaptureError(error.text) from error
    if len(dense.points) < _MIN_POINTS:
        raise CaptureError(f"Only {len(dense.points)} points were found that several photos agree on.")
    return [dense.depth(k)[0].depth() for k in range(len(photos))], dense.points, dense.rgb


def _pinhole(camera: Camera) -> maquette.PinholeCamera:
    intrinsics = maquette.Intrinsics(
        camera.width_px, camera.height_px, camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px
    )
    return maquette.PinholeCamera(intrinsics, camera.rotation, camera.centre)
