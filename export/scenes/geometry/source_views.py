"""Which photos an image is made of while training: NPBG++ draws them by how well they see the same from aside."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from export.camera import Camera

# The angle between two views of a point that suits best, and how fast it gets worse below and above it, in degrees
# (after MVSNet, arXiv 1804.02505).
BEST_DEG, BELOW_DEG, ABOVE_DEG = 15.0, 5.0, 15.0


def in_frame(positions: np.ndarray, camera: Camera) -> np.ndarray:
    """Whether points [P, 3] are ahead of a camera and within its frame, bool [P]; whatever may hide them."""
    seen = (positions - camera.centre) @ camera.rotation.T
    with np.errstate(divide="ignore", invalid="ignore"):
        x = camera.fx_px * seen[:, 0] / seen[:, 2] + camera.cx_px
        y = camera.fy_px * seen[:, 1] / seen[:, 2] + camera.cy_px
        inside = (x >= -0.5) & (x < camera.width_px - 0.5) & (y >= -0.5) & (y < camera.height_px - 0.5)
    return inside & (seen[:, 2] > 0)


def scores(target: Camera, others: Sequence[Camera], positions: np.ndarray) -> np.ndarray:
    """How well each of the others suits, [N]: the sum over points [P, 3] that both have in their frame.

    The target's own position (angle 0) scores nearly nothing, a camera that points elsewhere nothing.
    """
    both = positions[in_frame(positions, target)]
    found = np.zeros(len(others))
    for k, other in enumerate(others):
        common = both[in_frame(both, other)]
        a, b = (common - camera.centre for camera in (target, other))
        cosine = (a * b).sum(1) / np.maximum(np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1), 1e-12)
        off = np.degrees(np.arccos(np.clip(cosine, -1, 1))) - BEST_DEG
        found[k] = np.exp(-0.5 * (off / np.where(off < 0, BELOW_DEG, ABOVE_DEG)) ** 2).sum()
    return found


def drawn(
    target: int,
    cameras: Sequence[Camera],
    allowed: Sequence[int],
    positions: np.ndarray,
    count: int,
    rng: np.random.Generator,
) -> list[int]:
    """`count` of the allowed indices but the target's (fewer where there are fewer), drawn by scores, no repetition."""
    others = [k for k in allowed if k != target]
    weight = scores(cameras[target], [cameras[k] for k in others], positions) + 1e-9
    picked = rng.choice(len(others), min(count, len(others)), replace=False, p=weight / weight.sum())
    return [others[k] for k in picked]
