"""View-dependent descriptors: the ridge regression of NPBG++ (arXiv 2203.13318, section 3.3), for all points of a cloud
at once and differentiable.

This is the reference for the SDK's `DescriptorRegression` (sdk/src/scene/assembly/descriptor_regression.h). From K
views with features y and basis values h: (sum h^T h + alpha I) beta = sum h^T y - (sum h)^T beta0, beta0 = mean y. The
descriptor is y(h) = beta0 + h beta. Means and the scatter around them are kept instead of sums, so that the right side
of a point seen once, or always from the same side, is exactly 0. This module uses float64; the SDK uses float and keeps
the Cholesky factor of the scatter, which is more exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from export.scenes.config import BASIS, FEATURES


@dataclass(frozen=True)
class FittedDescriptors:
    """mean: beta0 [P, 8]. slope: beta [P, 6, 8]. views: K, [P]; a point without views has no descriptor.
    singular: [P], the directions do not determine beta at alpha = 0, so that it is 0."""

    mean: Tensor
    slope: Tensor
    views: Tensor
    singular: Tensor

    def seen_from(self, basis: Tensor) -> Tensor:
        """Basis values [P, 6] of the directions -> descriptors [P, 8]."""
        return self.mean + torch.einsum("pb,pbf->pf", basis, self.slope)


@dataclass(frozen=True)
class Moments:
    """State of all points after some views: K [P, 1], means [P, 8] and [P, 6], scatter [P, 6, 6] and [P, 6, 8]."""

    views: Tensor
    mean_y: Tensor
    mean_h: Tensor
    scatter_hh: Tensor
    scatter_hy: Tensor

    @staticmethod
    def zeros(points: int, like: Tensor) -> Moments:
        """Before the first view; type and device of `like`."""
        shapes = ((1,), (FEATURES,), (BASIS,), (BASIS, BASIS), (BASIS, FEATURES))
        return Moments(*(like.new_zeros(points, *shape) for shape in shapes))

    def with_view(self, y: Tensor, h: Tensor, seen: Tensor) -> Moments:
        """One more view: features [P, 8], basis values [P, 6], whether it sees the point [P]."""
        seen = seen.to(self.views)[:, None]
        y, h, views = y.to(self.views), h.to(self.views), self.views + seen
        fraction = seen / views.clamp_min(1)
        off_y, off_h = y - self.mean_y, h - self.mean_h
        grows = (fraction * self.views)[:, :, None] * off_h[:, :, None]  # (K - 1) / K where it is seen
        return Moments(
            views,
            self.mean_y + fraction * off_y,
            self.mean_h + fraction * off_h,
            self.scatter_hh + grows * off_h[:, None],
            self.scatter_hy + grows * off_y[:, None],
        )

    def solved(self, alpha: float, precision: torch.dtype = torch.float64) -> FittedDescriptors:
        """Solves all systems by Cholesky, in the given precision; the result has the type of the moments."""
        h = self.mean_h.to(precision)
        matrix = self.scatter_hh.to(precision) + self.views.to(precision)[:, :, None] * h[:, :, None] * h[:, None]
        one = torch.eye(BASIS, dtype=precision, device=h.device)
        matrix = matrix + alpha * one
        right = self.scatter_hy.to(precision)
        with torch.no_grad():
            factor, failed = torch.linalg.cholesky_ex(matrix)
            diagonal = factor.diagonal(dim1=1, dim2=2)
            # Below this the last figure of the matrix is all there is of the smallest direction.
            smallest = 4 * torch.finfo(precision).eps ** 0.5 * diagonal.amax(1)
            singular = (failed > 0) | ~(diagonal.amin(1) > smallest) if alpha == 0 else failed > 0
        matrix = torch.where(singular[:, None, None], one, matrix)
        right = torch.where(singular[:, None, None], 0, right)
        slope = torch.cholesky_solve(right, torch.linalg.cholesky(matrix)).to(self.mean_y)
        views = self.views[:, 0]
        return FittedDescriptors(self.mean_y, slope, views, singular & (views > 0))
