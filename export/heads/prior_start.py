"""The codes that a training of the prior begins with: principal components, or those of a trained prior and more."""

from __future__ import annotations

import torch
from torch import Tensor

from export.heads.head_shards import is_face


def principal_codes(vertices: Tensor, count: int) -> tuple[Tensor, Tensor, Tensor]:
    """Whitened principal components of heads [H, V, 3]: codes [H, count], mean [V, 3], slopes [V, 3, count]."""
    flat = vertices.reshape(len(vertices), -1).double()
    mean = flat.mean(0)
    u, s, v = torch.linalg.svd(flat - mean, full_matrices=False)
    root = len(flat) ** 0.5
    codes, slopes = u[:, :count] * root, (s[:count, None] * v[:count] / root).T
    return codes.float(), mean.reshape(-1, 3).float(), slopes.reshape(-1, 3, count).float()


def linear_slopes(codes: Tensor, points: Tensor, ridge: float = 4.0) -> tuple[Tensor, Tensor]:
    """Mean [V, 3] and slopes [V, 3, K] of points [H, V, 3] as linear functions of codes [H, K]."""
    middle, mean = codes.mean(0).double(), points.mean(0)
    off, flat = codes.double() - middle, (points - mean).flatten(1).double()
    slopes = torch.linalg.solve(off.T @ off + ridge * torch.eye(off.shape[1], dtype=torch.float64), off.T @ flat)
    slopes = slopes.T.unflatten(0, (-1, 3))
    return (mean - slopes @ middle).float(), slopes.float()


def fitted_codes_of(visible: Tensor, mean: Tensor, slopes: Tensor, sigma: Tensor) -> Tensor:
    """Codes [H, K] of heads by their visible vertices [H, V, 3], which are mean [V, 3] + slopes [V, 3, K] codes up to
    sigma [V]; a priori N(0, 1). Neighbouring vertices say the same: 50 of them count as one."""
    weight = (1 / sigma.square() / 50).repeat_interleave(3).double()
    a = slopes.flatten(0, 1).double()
    off = (visible - mean).flatten(1).double()
    normal = a.T @ (a * weight[:, None]) + torch.eye(a.shape[1], dtype=torch.float64)
    return torch.linalg.solve(normal, a.T @ (off * weight).T).T.float()


def start_codes(vertices: Tensor, visible: Tensor, known: Tensor, further: int) -> Tensor:
    """Returns the codes that a training begins with, [H, K + further]. vertices, visible [H, V, 3]: skin, and skin or
    the hair above it. known [N, K]: codes of the first N heads. The other heads get the codes that explain their
    visible vertices best by a linear model. The further codes are principal components of what is left of the faces."""
    count, codes = known.shape
    mean, slopes = linear_slopes(known, visible[:count])
    left = visible[:count] - mean - torch.einsum("vck,hk->hvc", slopes, known)
    sigma = (left.square().sum((0, 2)) / 3 / max(count - codes, 1)).sqrt().clamp(min=0.01)
    z = torch.cat([known, fitted_codes_of(visible[count:], mean, slopes, sigma)])
    left = vertices - mean - torch.einsum("vck,hk->hvc", slopes, z)
    left = left[:, is_face(vertices.mean(0).numpy())]
    # About 0, not their mean: heads of the first source get further codes of nearly 0.
    more = principal_codes(torch.cat([left[count:], -left[count:]]), further)[2]
    projected = torch.einsum("hvc,vck->hk", left, more) / more.square().sum((0, 1))
    return torch.cat([z, projected], 1)
