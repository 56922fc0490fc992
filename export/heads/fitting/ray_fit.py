"""Stage 1 of a fit: Adam over codes and camera with what the pixels say along rays (sdk/src/head/fit/head_fit).

What is minimised is a negative log posterior: the priors of the codes and of the focal length, ANCHOR_WEIGHT times the
terms of `anchor_fit`, and those of `ray_terms`, of which RAY_WEIGHT a cell of the encoder count. Rays, their order,
rates, checks and ends are those of the SDK, so that both go the same way step by step.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from export.heads.field import bases_of
from export.heads.fitting.anchor_fit import (
    AnchorFit,
    AnchorPoints,
    AnchorTerms,
    observations_of,
)
from export.heads.fitting.camera import UNKNOWNS, ScaledPose, is_small_step
from export.heads.fitting.photo import HeadPhoto
from export.heads.fitting.ray_terms import RayTerms
from export.heads.fitting.rays import RayLevel, Rays, Shuffle, rays_of
from export.heads.prior import Prior

GRID_DRIFT, GRID_STEPS = 0.2, 20  # how far codes move, and for how many steps, before the grid is made anew
RAY_WEIGHT = 0.03  # of a cell of the encoder: light and shadow are in no term
MAX_REFUSALS = 10
MIN_RATE = 0.2  # of the rates, at which a fit without a gain ends
WARM_UP = 5  # steps over which the rates rise
FAR_STEP, FAR_CHECK = 2.0, 1.3  # a loss so many times the usual one is refused; of the pixels held out
PIXEL_RATE = slice(3, 5)  # of a pose's step: u and v, in pixels


@dataclass(frozen=True)
class FitOptions:
    """As in HeadFitOptions of sdk/src/head/fit/head_fit.h."""

    max_steps: int = 300
    seconds: float = math.inf
    rays_per_step: int = 256
    first_side_px: int = 64
    last_side_px: int = 128
    first_fraction: float = 0.5  # of the steps, with the first side
    anchor_weight: float = 0.5
    shape_rate: float = 0.03
    colour_rate: float = 0.05
    camera_rate: float = 0.003
    held_out_fraction: float = 0.05
    check_steps: int = 10
    patience: int = 3
    min_gain: float = 1e-3
    seed: int = 1


@dataclass(frozen=True, eq=False)
class HeadState:
    """shape [K] and colour [C]: codes, float32; the camera."""

    shape: Tensor
    colour: Tensor
    pose: ScaledPose


@dataclass(frozen=True, eq=False)
class HeadFit:
    """The best head; its loss by the pixels held out, and that of the start; how many steps, and why there are no more:
    "steps", "seconds", "no gain" or "refused"."""

    state: HeadState
    first_loss: float
    loss: float
    steps: int
    end: str


class RayFit:
    """A fit under way."""

    def __init__(self, prior: Prior, photo: HeadPhoto, start: AnchorFit, options: FitOptions) -> None:
        self.photo, self.options = photo, options
        self.bases, self.ray_terms = bases_of(prior), RayTerms(prior)
        shape = torch.from_numpy(start.codes.astype(np.float32))
        self.now = HeadState(shape, torch.zeros(prior.colour_codes), start.pose)
        self.best, self.best_loss = self.now, math.inf
        seen = observations_of(photo)
        self.anchor_terms = AnchorTerms(seen, AnchorPoints(prior))
        self.anchor_terms.set_noise(start.pose, shape.double(), 0)
        # A step of all unknowns: Adam's variables, which begin at 0 each time.
        self.change = [
            torch.zeros(count, dtype=torch.float64, requires_grad=True)
            for count in (prior.shape_codes, prior.colour_codes, UNKNOWNS)
        ]
        self.adam = torch.optim.Adam([{"params": [p]} for p in self.change], betas=(0.9, 0.99), eps=1e-12)
        self.rate, self.usual_loss = 1.0, 0.0
        self.steps = self.refused = self.since_refusal = self.without_gain = 0
        self.is_unchecked = False
        self.grid, self.grid_shape, self.grid_age = None, shape, 0
        self.shuffle = Shuffle(options.seed)
        self.last = self._level(options.last_side_px)
        self.held_out = self.last.held_out if len(self.last.held_out) else self.last.fitted[::20]
        self.level, self.order, self.next = self.last, np.arange(0), 0

    def _level(self, side: int) -> RayLevel:
        return rays_of(self.photo, side, self.options.held_out_fraction, self.options.seed)

    def run(self, progress: Callable[[int, float], None] = lambda steps, loss: None) -> HeadFit:
        """progress: called before each step with the steps that are done and the best loss."""
        self._check()
        first_loss = self.usual_loss = self.best_loss
        end = self._loop(progress) if math.isfinite(first_loss) else "refused"
        if self.is_unchecked:
            self._check()
        return HeadFit(self.best, first_loss, self.best_loss, self.steps, end)

    def _loop(self, progress: Callable[[int, float], None]) -> str:
        o, begin, took = self.options, time.monotonic(), 0.0
        first_steps = int(o.first_fraction * o.max_steps)
        while self.steps < o.max_steps:
            progress(self.steps, self.best_loss)
            seconds = time.monotonic() - begin
            if seconds + took > o.seconds:
                return "seconds"
            if self.steps in (0, first_steps):
                self.level = self._level(o.first_side_px) if self.steps < first_steps else self.last
                self.order = np.arange(len(self.level.fitted))
                self.next = len(self.order)
            if not self._step():
                self.refused += 1
                if self.refused >= MAX_REFUSALS:
                    return "refused"
                self._go_back()
            self.steps += 1
            if self.steps % o.check_steps == 0:
                self._check()
                if self.refused >= MAX_REFUSALS:
                    return "refused"
                if self.without_gain >= o.patience:
                    if self.rate <= MIN_RATE:
                        return "no gain"
                    self._go_back()
                    self.without_gain = 0
            took = time.monotonic() - begin - seconds
        return "steps"

    def _chosen(self) -> Rays:
        count, chosen = min(self.options.rays_per_step, len(self.order)), []
        while len(chosen) < count:
            if self.next >= len(self.order):
                self.shuffle.run(self.order)
                self.next = 0
            taken = self.order[self.next : self.next + count - len(chosen)]
            chosen.extend(taken)
            self.next += len(taken)
        return self.level.fitted[np.array(chosen)]

    @staticmethod
    def _ray_weight(level: RayLevel, count: int) -> float:
        """Weight of a ray's loss where `count` rays represent all pixels."""
        return RAY_WEIGHT * level.cells_per_ray * (len(level.fitted) + len(level.held_out)) / count if count else 0.0

    def _loss(self, rays: Rays, level: RayLevel, is_exact: bool) -> Tensor:
        """Loss of the state, with a gradient by `change`."""
        by_shape, by_colour, by_pose = self.change
        shape, colour = self.now.shape.double() + by_shape, self.now.colour.double() + by_colour
        pose = self.now.pose.displaced(by_pose)
        weights = self.bases.combine(shape.float(), colour.float())
        drift = float((self.now.shape - self.grid_shape).double().norm())
        self.grid_age += 1
        is_old = self.grid is None or self.grid_age > GRID_STEPS or drift > GRID_DRIFT
        if is_old or (is_exact and drift > 0):
            self.grid, self.grid_shape, self.grid_age = self.ray_terms.grid(weights), self.now.shape, 1
        seen = self.ray_terms.losses(weights, pose, self.grid, rays).total()
        priors = 0.5 * (shape.square().sum() + colour.square().sum())
        if self.photo.log_focal_sigma > 0:
            off = (pose.log_focal - math.log(self.photo.focal_px)) / self.photo.log_focal_sigma
            priors = priors + 0.5 * off.square()
        anchors = 0.5 * self.options.anchor_weight * self.anchor_terms.cost(pose, shape)
        return priors + anchors + self._ray_weight(level, len(rays)) * seen

    def _check(self) -> None:
        """By the pixels held out: the state becomes the best where its loss is less."""
        is_first, self.is_unchecked = self.best_loss == math.inf, False
        loss = float(self._loss(self.held_out, self.last, True).detach())
        if is_first or loss < self.best_loss:
            is_gain = is_first or self.best_loss - loss > self.options.min_gain * abs(self.best_loss)
            self.without_gain = 0 if is_gain else self.without_gain + 1
            self.best, self.best_loss = self.now, loss
            return
        self.without_gain += 1
        if not loss < FAR_CHECK * self.best_loss + 1:
            self.refused += 1
            self._go_back()

    def _step(self) -> bool:
        """False where the state, which the step before made, cannot stay."""
        loss = self._loss(self._chosen(), self.level, False)
        value = float(loss.detach())
        if not value <= FAR_STEP * self.usual_loss + 1:
            return False
        self.usual_loss += 0.1 * (value - self.usual_loss)
        self.adam.zero_grad()
        loss.backward()
        if self.photo.log_focal_sigma <= 0:
            self.change[2].grad[UNKNOWNS - 1] = 0
        if not all(p.grad.isfinite().all() for p in self.change):
            return False
        done = self.steps / self.options.max_steps
        schedule = min(1, (self.since_refusal + 1) / WARM_UP) * (0.55 + 0.45 * math.cos(math.pi * done))
        rates = self.options.shape_rate, self.options.colour_rate, self.options.camera_rate
        for group, rate in zip(self.adam.param_groups, rates, strict=True):
            group["lr"] = self.rate * schedule * rate
        self.adam.step()
        shape, colour, pose = (p.detach().clone() for p in self.change)
        pose[PIXEL_RATE] *= self.now.pose.log_scale.exp()  # a change of the camera, in pixels
        with torch.no_grad():
            for p in self.change:
                p.zero_()
        self.since_refusal += 1
        self.is_unchecked = True
        step = pose.numpy()
        if not (is_small_step(step) and shape.isfinite().all() and colour.isfinite().all()):
            return False
        self.now = replace(
            self.now, shape=self.now.shape + shape.float(), colour=self.now.colour + colour.float(),
            pose=self.now.pose.moved(step),
        )  # fmt: skip
        return True

    def _go_back(self) -> None:
        """Takes up the best state again, with half the rates."""
        self.now, self.rate = self.best, self.rate / 2
        self.since_refusal, self.is_unchecked = 0, False
        self.usual_loss = max(self.usual_loss, self.best_loss)
        self.adam.state.clear()
