"""The one call that turns posed photos into a dense cloud."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from maquette.dense_clouds import DenseCloud
from maquette.scenes import Capture


def dense_cloud(
    capture: Capture, sparse: np.ndarray, threads: int, progress: Callable[[float], None]
) -> tuple[np.ndarray, np.ndarray]:
    """Points that the photos of a capture agree on: float32 [P, 3] in its world, and colours uint8 [P, 3], red first.
    Held-out photos are not used. sparse: float32 [N, 3], points that COLMAP found. Raises MaquetteError, and the errors
    of `progress`."""
    used = [k for k, view in enumerate(capture.views) if not view.held_out]
    photos = [capture.photo(k) for k in used]
    cameras = [capture.views[k].camera for k in used]

    def told(done: float, _: str) -> None:
        progress(done)

    with DenseCloud(photos, cameras, sparse, progress=told, threads=min(threads, 64)) as dense:
        return dense.points, dense.rgb
