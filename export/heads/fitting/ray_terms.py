"""Losses of the rays of a photo, with gradients (sdk/src/head/fit/ray_terms, ray_losses, opacity).

The matte is compared with the opacity (NeuS, arXiv 2106.10689, in its log form) of sections around where a ray goes in,
or passes nearest. Template point and colour are those of the point where it goes in, which moves along the ray as the
surface does (implicit differentiation, IDR, arXiv 2003.09852). Colours move the colour codes alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from export.heads.field import Weights, geometry, surface
from export.heads.fitting.camera import ScaledPose
from export.heads.fitting.distance_grid import DistanceGrid
from export.heads.fitting.rays import Rays
from export.heads.prior import Prior

SECTIONS = 12
CLEAR = 40.0  # s times a distance from which on nothing of a ray is taken away
ENOUGH = 10.0  # the same of one inside, from which on nothing is left
MIN_FACING = 0.1  # cosine: surfaces seen flatter than this say nothing of themselves
MIN_PULL = 1e-9  # of a distance on the loss, below which its point is not gone back through
REFINEMENTS = 3
COLOUR_SIGMA = 0.12  # of 0..1, each channel: mostly light that the prior does not know
MATTE_ERROR_RATE = 0.05  # the fraction of mattes that say nothing
POINT_SIGMA_DM = 0.03  # of the field's template points, beside the encoder's own
LIMIT = 9.0  # in squared sigmas: the limit of a robust error


def log_clear(distances: Tensor, sharpness: float) -> Tensor:
    """log(1 - alpha) of each section [R, N] from the distances at their ends [R, N + 1]."""
    soft = F.softplus(-sharpness * distances)
    return torch.minimum(distances.new_zeros(()), soft[:, :-1] - soft[:, 1:])


def matte_loss(log_transmittance: Tensor, matte: Tensor) -> Tensor:
    """Cross entropy of the opacity with a matte, of which a part is wrong whatever it says; 0 where it is NaN."""
    right = 1 - 2 * MATTE_ERROR_RATE
    filled = MATTE_ERROR_RATE - right * torch.expm1(log_transmittance)
    empty = MATTE_ERROR_RATE + right * log_transmittance.exp()
    known = ~matte.isnan()
    m = torch.where(known, matte.clamp(0, 1), 0.5)
    return torch.where(known, -m * filled.log() - (1 - m) * empty.log(), 0.0)


def robust(square: Tensor) -> Tensor:
    """Robust loss of squared sigmas (Geman-McClure)."""
    return 0.5 * square / (1 + square / LIMIT)


@dataclass(frozen=True)
class RayLosses:
    """Sums over rays, each with its gradient by codes and pose."""

    colour: Tensor
    matte: Tensor
    point: Tensor

    def total(self) -> Tensor:
        return self.colour + self.matte + self.point


class RayTerms:
    """Distances and losses in float32, as the SDK's engine has them; cameras and opacities in float64."""

    def __init__(self, prior: Prior) -> None:
        self.shape, self.sharpness = prior.shape, float(prior.sharpness)
        self.bounds = prior.bounds_min, prior.bounds_max
        self.cut_point, self.cut_normal = (
            torch.from_numpy(a.astype(np.float64)) for a in (prior.cut_point, prior.cut_normal)
        )

    def to_cut(self, points: Tensor) -> Tensor:
        """Signed distances of float64 points to where heads end."""
        return (points - self.cut_point) @ self.cut_normal

    def field(self, weights: Weights, points: Tensor) -> Tensor:
        """Signed distances of float64 points, float64; cut or not they are the network's."""
        return geometry(self.shape, weights, points.float())[..., 0].double()

    @torch.no_grad()
    def grid(self, weights: Weights) -> DistanceGrid:
        def distance(points: np.ndarray) -> np.ndarray:
            at = torch.from_numpy(points)
            return torch.maximum(self.field(weights, at), self.to_cut(at)).numpy()

        return DistanceGrid(*self.bounds, distance)

    def losses(self, weights: Weights, pose: ScaledPose, grid: DistanceGrid, rays: Rays) -> RayLosses:
        """Losses of these rays, with gradients by the weights and the pose where these require them."""
        pixels = torch.from_numpy(rays.pixels.astype(np.float64))
        base, direction = pose.rays(pixels)
        first = 0.95 * pose.eye_depth()
        passage = grid.passage(base.detach().numpy(), direction.detach().numpy(), first, ENOUGH / self.sharpness)
        passes = passage.is_in_domain & (self.sharpness * (passage.distance - grid.cell_dm) <= CLEAR)
        matte = torch.from_numpy(rays.matte.astype(np.float64))
        missed = matte_loss(matte.new_zeros(()), matte[~torch.from_numpy(passes)]).sum()
        rows = np.nonzero(passes)[0]
        nothing = matte.new_zeros(())
        if len(rows) == 0:
            return RayLosses(nothing, missed, nothing)
        base, direction, rays = base[rows], direction[rows], rays[rows]
        spare = 0.5 * grid.cell_dm / direction.detach().norm(dim=1)
        begin = torch.from_numpy(passage.begin[rows]) - spare
        begin, end = begin.clamp(min=first), torch.from_numpy(passage.end[rows]) + spare
        depth = begin[:, None] + (end - begin)[:, None] * torch.arange(SECTIONS + 1) / SECTIONS
        points = base[:, None] + depth[..., None] * direction[:, None]
        with torch.no_grad():
            field, to_cut = self.field(weights, points), self.to_cut(points)
            distances, at_cut = torch.maximum(field, to_cut), to_cut > field
        seen = missed + self._matte(weights, points, distances, at_cut, matte[rows])
        hits, near = self._hits(weights, base, direction, depth, distances, at_cut)
        if len(hits) == 0:
            return RayLosses(nothing, seen, nothing)
        colour, point = self._surface(weights, base[hits], direction[hits], near, rays[hits.numpy()])
        return RayLosses(colour, seen, point)

    def _matte(self, weights: Weights, points: Tensor, distances: Tensor, at_cut: Tensor, matte: Tensor) -> Tensor:
        leaf = distances.clone().requires_grad_(True)
        loss = matte_loss(log_clear(leaf, self.sharpness).sum(1), matte).sum()
        (pull,) = torch.autograd.grad(loss, leaf)
        # The network runs with gradients only where a distance matters.
        pulled = pull.abs() > MIN_PULL
        inner, outer = pulled & ~at_cut, pulled & at_cut
        moves = (pull[inner] * self.field(weights, points[inner])).sum()
        moves = moves + (pull[outer] * self.to_cut(points[outer])).sum()
        return loss.detach() + moves - moves.detach()

    @torch.no_grad()
    def _hits(
        self, weights: Weights, base: Tensor, direction: Tensor, depth: Tensor, distances: Tensor, at_cut: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Which rays go in through the surface, and at which depths (regula falsi, Illinois)."""
        enters = (distances[:, :-1] > 0) & (distances[:, 1:] <= 0)
        k = enters.int().argmax(1)
        row = torch.arange(len(k))
        # Nothing is known of the region behind the clip plane.
        hits = torch.nonzero(enters.any(1) & ~at_cut[row, k] & ~at_cut[row, k + 1])[:, 0]
        k, base, direction = k[hits], base[hits], direction[hits]
        outside, inside = depth[hits, k], depth[hits, k + 1]
        f_outside, f_inside = distances[hits, k], distances[hits, k + 1]
        side = torch.zeros(len(hits))

        def between() -> Tensor:
            return outside + (inside - outside) * f_outside / (f_outside - f_inside)

        at = between()
        for _ in range(REFINEMENTS):
            f = self.field(weights, base + at[:, None] * direction)
            is_out, is_in = f > 0, f < 0
            f_inside = torch.where(is_out & (side == 1), f_inside / 2, f_inside)
            f_outside = torch.where(is_in & (side == -1), f_outside / 2, f_outside)
            outside, f_outside = torch.where(is_out, at, outside), torch.where(is_out, f, f_outside)
            inside, f_inside = torch.where(is_in, at, inside), torch.where(is_in, f, f_inside)
            side = torch.where(is_out, 1.0, torch.where(is_in, -1.0, side))
            at = torch.where(is_out | is_in, between(), at)
        return hits, at

    def _surface(
        self, weights: Weights, base: Tensor, direction: Tensor, depth: Tensor, rays: Rays
    ) -> tuple[Tensor, Tensor]:
        """Colour and template point of the surface."""
        at = (base + depth[:, None] * direction).detach().requires_grad_(True)
        with torch.enable_grad():
            (normal,) = torch.autograd.grad(self.field([w.detach() for w in weights], at).sum(), at)
        ahead = direction.detach()
        facing = -(normal * ahead).sum(1) / (normal.norm(dim=1) * ahead.norm(dim=1))
        keep = facing > MIN_FACING
        rows = keep.numpy()
        rays, base, direction, ahead, depth = rays[rows], base[keep], direction[keep], ahead[keep], depth[keep]
        slope = (normal[keep] * ahead).sum(1)
        point = base + depth[:, None] * direction
        out = geometry(self.shape, weights, point.float())
        # The surface's point stays on the surface.
        moved = point - ((out[:, 0].double() - out[:, 0].detach()) / slope)[:, None] * ahead
        shape_only = self._detached(weights, first=self.shape.first_surface_layer)
        out = geometry(self.shape, weights, moved.float())
        _, template = surface(self.shape, shape_only, moved.float(), out)
        logits, _ = surface(self.shape, weights, moved.detach().float(), out.detach())
        seen, coloured = rays.has_point, rays.has_colour
        sigma = np.hypot(POINT_SIGMA_DM, rays.point_sigma[seen].astype(np.float64))
        away = (template.double()[seen] - torch.from_numpy(rays.point[seen])) / torch.from_numpy(sigma)[:, None]
        point_loss = robust(away.square().sum(1)).sum()
        away = (logits.double()[coloured].sigmoid() - torch.from_numpy(rays.rgb[coloured])) / COLOUR_SIGMA
        return robust(away.square().sum(1)).sum(), point_loss

    @staticmethod
    def _detached(weights: Weights, first: int) -> list[Tensor]:
        """Without gradients from layer `first` on."""
        return [w.detach() if layer >= first else w for layer, w in enumerate(weights)]
