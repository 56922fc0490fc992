"""Fits a head to the encoder's cells and a photo's pixels in torch: the reference of sdk/src/head/fit.

Stage 0 is `export.heads.anchor_fit`. Stage 1 goes on from there: Adam over shape codes, colour codes and the camera.
Each step draws rays through pixels; a ray has 12 sections around the surface that a search along it finds, and NeuS
opacity in its log form. Terms, each the negative log of a probability: colours (robust), matte (cross entropy), normals
of the surface against the encoder's, the terms of stage 0 and its prior of the codes. Colours move colour codes alone:
one photo does not hold depth, and a shape that follows colours goes wrong while the picture gets better.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from export.heads.anchor_fit import AnchorFit, AnchorModel, Observations
from export.heads.field import geometry, surface
from export.heads.prior import FieldShape, Prior

BOUND_DM = 2.0  # rays are followed within this distance of the origin


@dataclass(frozen=True)
class Photo:
    """A crop that the encoder has seen: rgb [S, S, 3] 0..255, cells [G, G, 8]; the principal point in it."""

    rgb: np.ndarray
    cells: np.ndarray
    centre_px: tuple[float, float]


@dataclass(frozen=True)
class FitOptions:
    steps: int = 50
    rays: int = 384
    sections: int = 12
    reach_dm: float = 0.12  # sections lie within this distance of the surface found
    sharpness: float = 100.0  # 1/dm
    rate: float = 0.03  # of whitened codes
    # How much all pixels together count, in observations that are independent of each other.
    colour_weight: float = 60.0
    matte_weight: float = 200.0
    normal_weight: float = 0.0  # the encoder errs alike over whole cheeks
    anchor_weight: float = 0.1
    colour_sigma: float = 0.12
    colour_moves_shape: bool = False


@dataclass(frozen=True)
class FittedHead:
    """shape_codes [K], colour_codes [C], camera as in AnchorFit, losses of each step."""

    shape_codes: np.ndarray
    colour_codes: np.ndarray
    rotation: np.ndarray
    shift: np.ndarray
    focal_px: float
    losses: list[dict[str, float]]


class TorchPrior:
    """A prior's bases as tensors."""

    def __init__(self, prior: Prior) -> None:
        self.shape: FieldShape = prior.shape

        def joined(layer) -> Tensor:
            return torch.from_numpy(np.concatenate([layer.weights, layer.bias[..., None]], -1).astype(np.float32))

        self.constant = [joined(layer) for layer in prior.constant]
        self.bases = {}
        for indices, bases in zip(prior.shape.personal, (prior.shape_bases, prior.colour_bases), strict=True):
            self.bases |= {index: joined(basis) for index, basis in zip(indices, bases, strict=True)}

    def combine(self, z: Tensor, c: Tensor) -> list[Tensor]:
        """The weights of one head."""
        out = list(self.constant)
        for index, basis in self.bases.items():
            code = z if index < self.shape.first_surface_layer else c
            out[index] = out[index] + torch.tensordot(code, basis, 1)
        return out


def rotation_of(w: Tensor) -> Tensor:
    zero = torch.zeros(())
    return torch.matrix_exp(
        torch.stack(
            [torch.stack([zero, -w[2], w[1]]), torch.stack([w[2], zero, -w[0]]), torch.stack([-w[1], w[0], zero])]
        )
    )


def log_clear(distances: Tensor, sharpness: float) -> Tensor:
    """log(1 - alpha) of each section [R, N] from the distances at their ends [R, N + 1] (NeuS in its log form)."""
    soft = F.softplus(-sharpness * distances)
    return torch.minimum(torch.zeros(()), soft[:, :-1] - soft[:, 1:])


class Fit:
    """A fit under way; `step` may be called as often as one likes."""

    def __init__(self, prior: Prior, photo: Photo, begun: AnchorFit, seen: Observations, options: FitOptions) -> None:
        self.prior, self.options, self.photo = TorchPrior(prior), options, photo
        self.sharpness = options.sharpness
        self.cut_point = torch.from_numpy(prior.cut_point)
        self.cut_normal = torch.from_numpy(prior.cut_normal)
        self.z = torch.tensor(begun.codes, dtype=torch.float32, requires_grad=True)
        self.c = torch.zeros(prior.colour_codes, requires_grad=True)
        self.turn = torch.zeros(3, requires_grad=True)
        self.shift = torch.tensor(begun.shift, dtype=torch.float32, requires_grad=True)
        self.log_focal = torch.tensor(float(np.log(begun.focal_px)), requires_grad=True)
        self._start = torch.tensor(begun.rotation, dtype=torch.float32)
        rate = options.rate
        self.optimizer = torch.optim.Adam(
            [
                {"params": [self.z], "lr": rate},
                {"params": [self.c], "lr": 3 * rate},
                {"params": [self.turn], "lr": 0.1 * rate},
                {"params": [self.shift], "lr": 0.2 * rate},
                {"params": [self.log_focal], "lr": 0.1 * rate},
            ],
            betas=(0.9, 0.99),
        )
        self._rates = [group["lr"] for group in self.optimizer.param_groups]
        mean, linear, sigma = AnchorModel(prior).at(seen.template)
        keep = begun.weight > 0.05
        self._anchor = tuple(
            torch.tensor(a[keep], dtype=torch.float32) for a in (mean, linear, np.hypot(seen.sigma, sigma), seen.pixels)
        )
        codes = torch.tensor(seen.codes, dtype=torch.float32)
        self._expected, self._inverse = codes[:, 0], (-2 * codes[:, 1]).exp()
        self._pixels(photo)
        self.losses: list[dict[str, float]] = []

    def _pixels(self, photo: Photo) -> None:
        """One pixel a cell: colours by area, matte, template points and normals."""
        side = photo.cells.shape[0]
        step = photo.rgb.shape[0] // side
        rgb = photo.rgb.reshape(side, step, side, step, 3).mean((1, 3)) / 255
        y, x = np.meshgrid(*(np.arange(side) * step + (step - 1) / 2,) * 2, indexing="ij")
        matte = 1 / (1 + np.exp(-photo.cells[..., 4]))

        def tensor(a: np.ndarray) -> Tensor:
            return torch.tensor(a.reshape(side * side, -1), dtype=torch.float32)

        self.pixels, self.rgb, self.matte = tensor(np.stack([x, y], -1)), tensor(rgb), tensor(matte)[:, 0]
        self.seen_template, self.seen_sigma = tensor(photo.cells[..., :3]), tensor(np.exp(photo.cells[..., 3]))[:, 0]
        self.seen_normal = F.normalize(tensor(photo.cells[..., 5:8]), dim=1)
        # Rays are drawn where there is something to learn: in and around the head.
        near = F.max_pool2d(self.matte.reshape(1, 1, side, side), 7, 1, 3).reshape(-1)
        self.probability = 0.1 + near

    def rotation(self) -> Tensor:
        return rotation_of(self.turn) @ self._start

    def _rays(self, pixels: Tensor) -> tuple[Tensor, Tensor]:
        """Origin [3] and unit directions [R, 3] in the head's frame."""
        rotation = self.rotation()
        centre = torch.tensor(self.photo.centre_px, dtype=torch.float32)
        along = torch.cat([(pixels - centre) / self.log_focal.exp(), torch.ones(len(pixels), 1)], 1)
        return -self.shift @ rotation, F.normalize(along @ rotation, dim=1)

    def _distance(self, weights: list[Tensor], points: Tensor) -> Tensor:
        cut = (points - self.cut_point) @ self.cut_normal
        return torch.maximum(geometry(self.prior.shape, weights, points)[..., 0], cut)

    @torch.no_grad()
    def _found(self, weights: list[Tensor], origin: Tensor, rays: Tensor, samples: int = 40) -> tuple[Tensor, Tensor]:
        """How far along each ray the surface is first met, or else came nearest; and whether the ray meets the ball."""
        middle = -(rays @ origin)
        square = BOUND_DM**2 - (origin.square().sum() - middle**2)
        half = square.clamp(min=0).sqrt()
        far = middle[:, None] + half[:, None] * torch.linspace(-1, 1, samples)
        f = self._distance(weights, origin + far[..., None] * rays[:, None])
        crossed = (f[:, :-1] > 0) & (f[:, 1:] <= 0)
        at = torch.where(crossed.any(1), crossed.float().argmax(1), f[:, :-1].argmin(1))
        rows = torch.arange(len(rays))
        a, b = f[rows, at], f[rows, at + 1]
        share = torch.where(crossed.any(1), a / (a - b).clamp(min=1e-6), 0.5)
        return far[rows, at] + share * (far[rows, at + 1] - far[rows, at]), square > 0

    def step(self, fraction: float = 0.0) -> dict[str, float]:
        """One step of Adam; `fraction`: how much of the fit is done."""
        for group, rate in zip(self.optimizer.param_groups, self._rates, strict=True):
            group["lr"] = rate * (1 - 0.9 * fraction)
        terms = self._terms()
        self.optimizer.zero_grad()
        z = (self._inverse * (self.z - self._expected).square()).sum()
        loss = sum(terms.values()) + 0.5 * (z + self.c.square().sum())
        loss.backward()
        self.optimizer.step()
        row = {name: float(value) for name, value in terms.items()}
        self.losses.append(row)
        return row

    def _terms(self) -> dict[str, Tensor]:
        o = self.options
        chosen = torch.multinomial(self.probability, o.rays)
        # Rays are drawn more often near the head: each counts as often as a pixel drawn evenly would.
        even = (1 / self.probability[chosen]) / (1 / self.probability[chosen]).sum()
        weights = self.prior.combine(self.z, self.c)
        origin, rays = self._rays(self.pixels[chosen])
        far, meets = self._found([w.detach() for w in weights], origin.detach(), rays.detach())
        ends = far[:, None] + o.reach_dm * torch.linspace(-1, 1, o.sections + 1)
        f = self._distance(weights, origin + ends[..., None] * rays[:, None])
        clear = log_clear(f, self.sharpness) * meets[:, None]
        total = clear.sum(1)
        before = torch.cumsum(clear, 1) - clear
        share = before.exp() * -torch.expm1(clear)
        matte = self.matte[chosen]
        opacity_loss = -(matte * torch.log(-torch.expm1(total) + 1e-6) + (1 - matte) * total.clamp(min=-16))
        on = (matte > 0.5) & (total.detach() < -0.7)
        terms = {"matte": o.matte_weight * (even * opacity_loss).sum()}
        # The surface point, with a gradient along the ray: first order in the distance there.
        middle = (ends[:, :-1] + ends[:, 1:]) / 2
        depth = (share * middle).sum(1) / share.sum(1).clamp(min=1e-6)
        point = (origin + depth[:, None] * rays)[on]
        out = geometry(self.prior.shape, weights, point if o.colour_moves_shape else point.detach())
        if not o.colour_moves_shape:
            out = out.detach()
        logits, _ = surface(self.prior.shape, weights, point if o.colour_moves_shape else point.detach(), out)
        away = (logits.sigmoid() - self.rgb[chosen][on]) / o.colour_sigma
        square = away.square().sum(1)
        scale = even[on] / even[on].sum().clamp(min=1e-6)
        terms["colour"] = o.colour_weight * (scale * square / (1 + square / 9)).sum() / 2
        if o.normal_weight:
            at = point.detach().requires_grad_(True)
            value = geometry(self.prior.shape, weights, at)[:, 0]
            (slope,) = torch.autograd.grad(value.sum(), at, create_graph=True)
            shown = F.normalize(slope, dim=1) @ self.rotation().T
            cosine = (shown * self.seen_normal[chosen][on]).sum(1)
            terms["normal"] = o.normal_weight * (scale * (1 - cosine)).sum() / 0.06
        mean, linear, sigma, pixels = self._anchor
        points = (mean + linear @ self.z) @ self.rotation().T + self.shift
        focal, away_z = self.log_focal.exp(), points[:, 2:].clamp(min=0.1)
        centre = torch.tensor(self.photo.centre_px, dtype=torch.float32)
        px = (1 + (sigma * focal / away_z[:, 0]).square()).sqrt()
        square = ((focal * points[:, :2] / away_z + centre - pixels) / px[:, None]).square().sum(1)
        terms["anchors"] = o.anchor_weight * (16 * square / (16 + square)).sum() / 2
        return terms

    def run(self) -> FittedHead:
        for step in range(self.options.steps):
            self.step(step / self.options.steps)
        return self.result()

    @torch.no_grad()
    def result(self) -> FittedHead:
        return FittedHead(
            self.z.numpy().copy(), self.c.numpy().copy(), self.rotation().numpy().copy(), self.shift.numpy().copy(),
            float(self.log_focal.exp()), self.losses,
        )  # fmt: skip
