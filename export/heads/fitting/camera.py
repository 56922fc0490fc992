"""A camera in parameters that stay well conditioned without perspective (sdk/src/head/camera/scaled_pose.h)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from scipy.spatial.transform import Rotation
from torch import Tensor

UNKNOWNS = 7  # rotation (3), u, v, log scale, log focal
MIN_DEPTH_RATIO = 1e-3  # of the depth at the origin: what is nearer is not seen


@dataclass(frozen=True)
class Camera:
    """The head's point p is at R p + t, x right, y down, z forward (dm). rotation [3, 3], shift [3], float64."""

    rotation: np.ndarray
    shift: np.ndarray
    focal_px: float


@dataclass(frozen=True)
class ScaledPose:
    """rotation [3, 3]; uv [2]: the origin's pixel from the principal point; log_scale: of s, pixels a dm there;
    log_focal. All float64. With q = R p, a point's pixel is (uv + s q_xy) / (1 + q_z s / f)."""

    rotation: Tensor
    uv: Tensor
    log_scale: Tensor
    log_focal: Tensor

    def project(self, points: Tensor) -> tuple[Tensor, Tensor]:
        """[N, 3] -> pixels from the principal point [N, 2], depths by that of the origin [N]."""
        q = points @ self.rotation.T
        ratio = 1 + q[:, 2] * (self.log_scale - self.log_focal).exp()
        return (self.uv + self.log_scale.exp() * q[:, :2]) / ratio[:, None], ratio

    def displaced(self, step: Tensor) -> ScaledPose:
        """After a step [7], to first order: right in its derivatives at 0."""
        w, none = step[:3], step.new_zeros(())
        turn = torch.stack([none, -w[2], w[1], w[2], none, -w[0], -w[1], w[0], none]).view(3, 3)
        return ScaledPose(
            self.rotation + turn @ self.rotation,
            self.uv + step[3:5],
            self.log_scale + step[5],
            self.log_focal + step[6],
        )

    def moved(self, step: np.ndarray) -> ScaledPose:
        """After a step [7]."""
        turn = torch.from_numpy(Rotation.from_rotvec(step[:3]).as_matrix())
        step = torch.from_numpy(np.asarray(step, np.float64))
        return ScaledPose(turn @ self.rotation, self.uv + step[3:5], self.log_scale + step[5], self.log_focal + step[6])

    def camera(self) -> Camera:
        scale = float(self.log_scale.exp())
        shift = np.array([*(self.uv.numpy() / scale), float((self.log_focal - self.log_scale).exp())])
        return Camera(self.rotation.numpy().copy(), shift, float(self.log_focal.exp()))


def scaled_pose(camera: Camera) -> ScaledPose:
    scale = camera.focal_px / camera.shift[2]

    def tensor(values) -> Tensor:
        return torch.as_tensor(np.asarray(values, np.float64))

    return ScaledPose(
        tensor(camera.rotation),
        tensor(scale * camera.shift[:2]),
        tensor(np.log(scale)),
        tensor(np.log(camera.focal_px)),
    )


def is_small_step(step: np.ndarray) -> bool:
    """A turn of more than a radian, or a scale of more than e^2, leaves what the equations know of. False for NaN."""
    return bool(np.linalg.norm(step[:3]) < 1 and (np.abs(step[5:7]) < 2).all())
