"""Baseline: NeuS from a sphere. A head from photos alone, without a prior: the field of `export.heads.field` of the
same size, which begins as a ball, learnt by volume rendering in torch. Beside it, of the same photos in the same run,
what the library fits, and the mean head.

    python -m benchmarks.heads.alone.neus --heads 2 --photos 1 3 8 --seconds 60

It is given more than the library: the true cameras, the head's mask without background. How bright each photo's light
is (gain and offset by channel) it learns along. It takes `--seconds` of one processor for each head and number of
photos.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean

import numpy as np
import torch
from maquette import HeadBuilder
from torch import Tensor, nn

from benchmarks.heads.distances import Triangles, measure
from benchmarks.heads.fitted import triangles_of
from benchmarks.heads.mean_head import CHUNK, mesh_of_distances, read_mean_head
from benchmarks.heads.photos import HEAD, PhotoBackgrounds, TrueHead, camera_of, read_made_heads
from benchmarks.heads.quality import BACKGROUNDS, BUNDLE, DATA, add_photos, make_maker, photos_of
from benchmarks.heads.tables import table
from export.heads.field import FieldBases, geometry, surface
from export.heads.prior_file import read_prior
from export.heads.surface import cut_distance

RADIUS_DM = 1.1  # of the ball that it begins with
REACH_DM = 2.0  # of the ball within which rays are looked at
RAYS, SAMPLES = 192, 48
POINTS = 512  # of the eikonal term
BALL_STEPS = 400
RATE, LAST_RATE = 2e-3, 2e-4
SHARPNESS = 15.0  # at the beginning, 1/dm
MASK_WEIGHT, EIKONAL_WEIGHT = 0.5, 0.1
NAMES = ("mean head", "the library", "NeuS from a sphere")
AROUND_HEAD_PX = 12  # of a mask, where rays miss


class Rays:
    """Of the pixels of the photos in and around the head: centre and direction [N, 3] in dm, colour [N, 3] and mask [N]
    of 0..1, and the photo's number [N]."""

    def __init__(self, head: TrueHead, numbers: Sequence[int]) -> None:
        parts = [self._of(head, number, index) for index, number in enumerate(numbers)]
        self.centre, self.direction, self.rgb, self.mask, self.photo = (
            torch.from_numpy(np.concatenate(column)) for column in zip(*parts, strict=True)
        )

    @staticmethod
    def _of(head: TrueHead, number: int, index: int) -> tuple[np.ndarray, ...]:
        camera, mask = camera_of(head.pictures, number), head.pictures.masks[number]
        # Where the bust is, nothing is known of the head.
        own = mask == HEAD
        y, x = np.nonzero(own)
        around = np.zeros_like(own)
        around[max(y.min() - AROUND_HEAD_PX, 0) : y.max() + AROUND_HEAD_PX,
               max(x.min() - AROUND_HEAD_PX, 0) : x.max() + AROUND_HEAD_PX] = True  # fmt: skip
        y, x = np.nonzero(around & (own | (mask == 0)))
        seen = np.stack([(x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px, np.ones(len(x))], 1)
        direction = (seen / np.linalg.norm(seen, axis=1, keepdims=True)) @ camera.rotation
        return (
            np.broadcast_to(camera.centre, direction.shape).astype(np.float32),
            direction.astype(np.float32),
            (head.pictures.rgb[number][y, x] / 255).astype(np.float32),
            own[y, x].astype(np.float32),
            np.full(len(x), index),
        )


class Ball(nn.Module):
    """The field of a prior's shape without codes, at first the distance of a ball; and the light of each photo."""

    def __init__(self, bases: FieldBases, photos: int, generator: torch.Generator) -> None:
        super().__init__()
        self.shape = bases.shape
        self.weights = nn.ParameterList([nn.Parameter(weights.detach().clone()) for weights in bases.constant])
        self.log_sharpness = nn.Parameter(torch.tensor(SHARPNESS).log())
        self.gain, self.offset = nn.Parameter(torch.ones(photos, 3)), nn.Parameter(torch.zeros(photos, 3))
        optimiser = torch.optim.Adam(self.weights, 5e-3)
        for _ in range(BALL_STEPS):
            points = (torch.rand(2048, 3, generator=generator) * 2 - 1) * REACH_DM
            loss = (self.distance(points) - (points.norm(dim=1) - RADIUS_DM)).abs().mean()
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()

    def distance(self, points: Tensor) -> Tensor:
        return geometry(self.shape, self.weights, points)[:, 0]

    def render(self, centre: Tensor, direction: Tensor, photo: Tensor, jitter: Tensor) -> tuple[Tensor, Tensor]:
        """Colours [N, 3] and opacity [N] of rays; jitter: [N, SAMPLES + 1] of 0..1."""
        nearest = -(centre * direction).sum(1)
        beside = (centre.square().sum(1) - nearest.square()).clamp(0, REACH_DM**2)
        half = (REACH_DM**2 - beside).clamp_min(1e-6).sqrt()
        steps = (torch.arange(SAMPLES + 1) + jitter) / (SAMPLES + 1)
        depth = (nearest - half)[:, None] + 2 * half[:, None] * steps
        points = (centre[:, None] + depth[..., None] * direction[:, None]).reshape(-1, 3)
        out = geometry(self.shape, self.weights, points)
        logits, _ = surface(self.shape, self.weights, points, out)
        inside = out[:, 0].reshape(len(centre), -1) * self.log_sharpness.exp()
        # 1 - alpha = min(1, Phi(f1) / Phi(f0)), in logs.
        log_kept = (nn.functional.logsigmoid(inside[:, 1:]) - nn.functional.logsigmoid(inside[:, :-1])).clamp_max(0)
        before = torch.cumsum(log_kept, 1) - log_kept
        weight = before.exp() * -torch.expm1(log_kept)
        rgb = logits.sigmoid().reshape(len(centre), -1, 3)
        colour = (weight[..., None] * (rgb[:, 1:] + rgb[:, :-1]) / 2).sum(1)
        opacity = weight.sum(1)
        return self.gain[photo] * colour + self.offset[photo] * opacity[:, None], opacity

    def slope_error(self, points: Tensor) -> Tensor:
        points = points.requires_grad_(True)
        (slope,) = torch.autograd.grad(self.distance(points).sum(), points, create_graph=True)
        return (slope.norm(dim=1) - 1).square().mean()


def learn(ball: Ball, rays: Rays, seconds: float, generator: torch.Generator) -> int:
    """Adam, for so long of the processor's time; returns the number of steps."""
    optimiser = torch.optim.Adam(ball.parameters(), RATE)
    begin, steps = time.process_time(), 0
    while (done := (time.process_time() - begin) / seconds) < 1:
        for group in optimiser.param_groups:
            group["lr"] = RATE * (LAST_RATE / RATE) ** done
        own = torch.randint(len(rays.mask), (RAYS,), generator=generator)
        mask = rays.mask[own]
        rgb, opacity = ball.render(
            rays.centre[own], rays.direction[own], rays.photo[own], torch.rand(RAYS, SAMPLES + 1, generator=generator)
        )
        colour = ((rgb - rays.rgb[own]).abs().mean(1) * mask).sum() / mask.sum().clamp_min(1)
        matte = nn.functional.binary_cross_entropy(opacity.clamp(1e-3, 1 - 1e-3), mask)
        slope = ball.slope_error((torch.rand(POINTS, 3, generator=generator) * 2 - 1) * REACH_DM)
        loss = colour + MASK_WEIGHT * matte + EIKONAL_WEIGHT * slope
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        steps += 1
    return steps


@torch.no_grad()
def mesh_of(ball: Ball) -> Triangles:
    """Its largest piece, closed at the cut, in mm."""

    def distances(points: np.ndarray) -> np.ndarray:
        parts = torch.from_numpy(points.astype(np.float32)).split(CHUNK)
        own = torch.cat([ball.distance(part) for part in parts]).numpy()
        beyond = np.linalg.norm(points, axis=1) - REACH_DM  # no ray was there
        return np.maximum(np.maximum(own, cut_distance(points)), beyond)

    return mesh_of_distances(distances, np.full(3, -REACH_DM), np.full(3, REACH_DM))


def neus(head: TrueHead, numbers: Sequence[int], bundle: Path, seconds: float) -> tuple[Triangles, int]:
    """The mesh of a head out of these of its pictures, in mm, and the steps that it took."""
    torch.manual_seed(0)
    generator = torch.Generator().manual_seed(0)
    ball = Ball(FieldBases(read_prior(bundle / "prior.maqp").shape), len(numbers), generator)
    steps = learn(ball, Rays(head, numbers), seconds, generator)
    return mesh_of(ball), steps


def pictures_of(head: TrueHead, count: int) -> Sequence[int] | None:
    if count == 1:
        front = head.front()
        return None if front is None else [front]
    return head.front_and_sides() if count == 3 else head.all_around(count)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=DATA, help=f"views and points; default: {DATA}")
    parser.add_argument("--backgrounds", type=Path, default=BACKGROUNDS, help=f"default: {BACKGROUNDS}")
    parser.add_argument("--bundle", type=Path, default=BUNDLE, help=f"default: {BUNDLE}")
    parser.add_argument("--heads", type=int, default=3, help="test heads")
    parser.add_argument("--photos", type=int, nargs="+", default=(1, 3, 8), help="of each head")
    parser.add_argument("--seconds", type=float, default=120, help="of one processor, each time")
    parser.add_argument("--fit-seconds", type=float, default=3, help="of the library")
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    mean, backgrounds = read_mean_head(options.bundle), PhotoBackgrounds(options.backgrounds)
    heads = read_made_heads(options.data, options.heads, make_maker())
    lines = []
    with HeadBuilder(options.bundle) as builder:
        for count in options.photos:
            rows = []
            for head in heads:
                numbers = pictures_of(head, count)
                if numbers is None:
                    continue
                add_photos(builder, photos_of(head, numbers, backgrounds), known_focal=True)
                with builder.fit(options.fit_seconds) as found:
                    own = triangles_of(found.mesh("all"))
                ball, steps = neus(head, numbers, options.bundle, options.seconds)
                rows.append([measure(mesh, head.true) for mesh in (mean, own, ball)])
                print(head.name, count, *(f"{of.face_mm:.2f} {of.head_mm:.2f}" for of in rows[-1]), steps, flush=True)
            for name, column in zip(NAMES, zip(*rows, strict=True), strict=True):
                figures = (fmean(getattr(of, key) for of in column) for key in ("face_mm", "head_mm"))
                lines.append([str(count), name, str(len(rows)), *(f"{figure:.2f}" for figure in figures)])
    print(table(("photos", "", "heads", "face, mm", "head, mm"), lines))


if __name__ == "__main__":
    main()
