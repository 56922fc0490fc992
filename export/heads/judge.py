"""How far a fitted head lies from the true one, in mm: one-sided, from true points to the fitted surface.

As in the paper of Multi-NeuS the fitted head is first moved, turned and scaled to where it fits best (ICP, on the
distances of the field itself), on the face for the face's figure and on the whole head for the head's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from export.heads.field import geometry
from export.heads.prior import FieldShape

NOSE_TIP = np.array([0.0, -1.24, -0.35])  # of the template, dm
FACE_RADIUS_DM = 0.95


@dataclass(frozen=True)
class Distances:
    """Mean distances in mm after alignment; scale: by which true points were multiplied for the whole head."""

    head_mm: float
    face_mm: float
    unaligned_mm: float
    scale: float


def _distances(shape: FieldShape, weights: list[Tensor], points: Tensor) -> tuple[Tensor, Tensor]:
    """Signed distances [N], dm, to first order of the field's slope; and unit slopes [N, 3]."""
    at = points.detach().requires_grad_(True)
    with torch.enable_grad():
        value = geometry(shape, weights, at)[:, 0]
        (slope,) = torch.autograd.grad(value.sum(), at)
    length = slope.norm(dim=1).clamp(min=0.3)
    return value.detach() / length, slope / length[:, None]


def _aligned(shape: FieldShape, weights: list[Tensor], points: Tensor, steps: int = 12) -> tuple[Tensor, float]:
    """Points moved, turned and scaled to lie on the surface (Gauss-Newton), and the scale."""
    middle = points.mean(0)
    p, total = points.clone(), 1.0
    for _ in range(steps):
        distance, slope = _distances(shape, weights, p)
        arm = p - middle
        j = torch.cat([slope, torch.linalg.cross(arm, slope), (arm * slope).sum(1, keepdim=True)], 1).double()
        # Huber: hair that is not there must not pull the face away.
        weight = (0.03 / distance.abs().clamp(min=0.03)).double()
        normal = j.T @ (j * weight[:, None]) + 1e-6 * torch.eye(7, dtype=torch.float64)
        step = -torch.linalg.solve(normal, j.T @ (distance.double() * weight)).float()
        turn = torch.linalg.matrix_exp(
            torch.tensor([[0, -step[5], step[4]], [step[5], 0, -step[3]], [-step[4], step[3], 0]])
        )
        scale = float(torch.exp(step[6].clamp(-0.1, 0.1)))
        p = middle + scale * (arm @ turn.T) + step[:3]
        total *= scale
    return p, total


def is_face(template: np.ndarray) -> np.ndarray:
    """Which points belong to the face, by their template points [..., 3]."""
    return np.linalg.norm(template - NOSE_TIP, axis=-1) < FACE_RADIUS_DM


def judge(shape: FieldShape, weights: list[Tensor], surface: np.ndarray, is_face: np.ndarray) -> Distances:
    """weights: of one head, [outputs, inputs + 1] each. surface [N, 3]: true points above the cut, dm; is_face [N]."""
    points, face = torch.from_numpy(np.asarray(surface, np.float32)), torch.from_numpy(is_face)
    before, _ = _distances(shape, weights, points)
    whole, scale = _aligned(shape, weights, points)
    near, _ = _aligned(shape, weights, points[face])

    def mm(distance: Tensor) -> float:
        return float(distance.abs().mean()) * 100

    return Distances(
        mm(_distances(shape, weights, whole)[0]), mm(_distances(shape, weights, near)[0]), mm(before), scale
    )
