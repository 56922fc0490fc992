"""Trains the prior of heads: bases of the field network, the codes of the heads to train on, and linear anchors.

    python -m export.heads.points train --count 600
    python -m export.heads.train_prior --data .data/heads/points --out .data/runs/heads-prior --minutes 30

Codes begin as principal components of the skin's vertices, so they stay nearly linear in where places of the skin lie:
anchors. At the end codes are whitened (each N(0, 1) over the heads to train on). It resumes from `--out` by itself.
With `--start` it goes on from a trained prior, with further codes for heads of another source, and keeps those codes
that move heads most:

    python -m export.heads.train_prior --data .data/heads/points .data/heads/scan-points \
        --start export/weights/heads-prior.pt --minutes 45
Writes checkpoint.pt, weights.pt, log.json, curves.png.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from export.heads.field import FieldBases, geometry, surface
from export.heads.head_shards import HeadPoints, is_face, read_points
from export.heads.prior import FieldShape
from export.heads.prior_start import linear_slopes, principal_codes, start_codes
from export.training import (
    SAVE_EVERY_S,
    Interval,
    Schedule,
    SmoothedTerms,
    StopSignal,
    Stopwatch,
    rate_at,
    save_atomically,
    seed_step,
    write_log,
)

PRINCIPAL = 0.625  # fraction of the shape codes that begin as principal components of the skin
HEADS, ON, NEAR, FAR, SLOPES = 8, 384, 448, 96, 128  # a step: heads, and points of each


class HeadTensors:
    """The points of heads as arrays of all heads."""

    def __init__(self, heads: list[HeadPoints], first_source: int | None = None) -> None:
        """first_source: how many of the heads, the first ones, are of the first source; default: all."""
        self.first_source = len(heads) if first_source is None else first_source

        def stacked(name: str) -> Tensor:
            return torch.from_numpy(np.stack([getattr(h, name) for h in heads]))

        self.surface, self.normal, self.template = stacked("surface"), stacked("normal"), stacked("template")
        self.colour = stacked("colour")
        self.near, self.near_distance = stacked("near"), stacked("near_distance")
        self.far, self.far_distance = stacked("far"), stacked("far_distance")
        self.vertices, self.visible = stacked("vertices"), stacked("visible")
        self.is_face = torch.from_numpy(is_face(self.template.numpy()))  # of the surface's points

    def __len__(self) -> int:
        return len(self.surface)


def losses(bases: FieldBases, data: HeadTensors, heads: Tensor, z: Tensor, c: Tensor) -> dict[str, Tensor]:
    """Terms of a step: mean absolute errors in dm (surface, near, far, template), colour in 0..1, slopes without unit.

    heads: [H] numbers in `data`; z [H, K] and c [H, C]: their codes.
    """
    shape, weights = bases.shape, bases.combine(z, c)

    def draw(count: int, total: int) -> tuple[Tensor, Tensor]:
        return heads[:, None], torch.randint(total, (len(heads), count))

    on = draw(ON, data.surface.shape[1])
    near = draw(NEAR, data.near.shape[1])
    far = draw(FAR, data.far.shape[1])
    points = torch.cat([data.surface[on], data.near[near], data.far[far]], 1)
    out = geometry(shape, weights, points)
    distance = out[..., 0]
    # Colours and template points are learnt near the surface too, where a fit evaluates them.
    shift = torch.randn(len(heads), ON, 1) * 0.03
    moved = data.surface[on] + data.normal[on] * shift
    logits, template = surface(shape, weights, moved, geometry(shape, weights, moved))
    # Slopes: those of the true surface point along its normal.
    some = (on[0], on[1][:, :SLOPES])
    at = data.surface[some].clone().requires_grad_(True)
    value = geometry(shape, weights, at)[..., 0]
    (slope,) = torch.autograd.grad(value.sum(), at, create_graph=True)
    anywhere = data.near[near][:, :SLOPES].clone().requires_grad_(True)
    (free,) = torch.autograd.grad(geometry(shape, weights, anywhere)[..., 0].sum(), anywhere, create_graph=True)
    return {
        "surface": distance[:, :ON].abs().mean(),
        "near": (distance[:, ON : ON + NEAR] - data.near_distance[near]).abs().mean(),
        "far": (distance[:, ON + NEAR :] - data.far_distance[far]).abs().mean(),
        "normal": (slope - data.normal[some]).square().sum(-1).mean(),
        "eikonal": (free.square().sum(-1).add(1e-9).sqrt() - 1).square().mean(),
        "colour": (logits.sigmoid() - data.colour[on].float() / 255).abs().mean(),
        "template": (template - data.template[on]).abs().mean(),
    }


SCALES = {"surface": 1.0, "near": 1.0, "far": 0.3, "normal": 0.1, "eikonal": 0.05, "colour": 0.08, "template": 0.3}


class Anchors(nn.Module):
    """Places of the skin as linear functions of the shape code."""

    def __init__(self, mean: Tensor, slopes: Tensor) -> None:
        super().__init__()
        self.mean, self.slopes = nn.Parameter(mean), nn.Parameter(slopes)  # [M, 3], [M, 3, K]


@dataclass(frozen=True)
class FitMetrics:
    """Mean distance of true points to the fitted surface, mm, of heads whose codes were fitted to their true points."""

    head_mm: float
    face_mm: float
    mean_head_mm: float
    mean_face_mm: float
    colour: float
    template_mm: float


def fitted_codes(bases: FieldBases, data: HeadTensors, steps: int = 250) -> tuple[Tensor, Tensor]:
    """Shape codes [H, K] and colour codes [H, C] of heads by their true distances and colours; a priori N(0, 1)."""
    heads = torch.arange(len(data))
    z = torch.zeros(len(data), bases.shape_codes, requires_grad=True)
    c = torch.zeros(len(data), bases.colour_codes, requires_grad=True)
    optimizer = torch.optim.Adam([z, c], 0.05)
    for step in range(steps):
        for group in optimizer.param_groups:
            group["lr"] = 0.05 * min(1, 2 * (1 - step / steps))
        weights = bases.combine(z, c)
        chosen = (heads[:, None], torch.randint(data.near.shape[1], (len(data), 256)))
        on = (heads[:, None], torch.randint(data.surface.shape[1], (len(data), 256)))
        points = torch.cat([data.surface[on], data.near[chosen]], 1)
        out = geometry(bases.shape, weights, points)
        true = torch.cat([torch.zeros(len(data), 256), data.near_distance[chosen]], 1)
        logits, template = surface(bases.shape, weights, data.surface[on], out[:, :256])
        loss = (out[..., 0] - true).abs().mean() + 0.1 * (template - data.template[on]).abs().mean()
        loss = loss + 0.08 * (logits.sigmoid() - data.colour[on].float() / 255).abs().mean()
        loss = loss + 2e-5 * (z.square().sum(1).mean() + c.square().sum(1).mean())
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    return z.detach(), c.detach()


@torch.no_grad()
def fit_metrics(bases: FieldBases, data: HeadTensors, z: Tensor, c: Tensor) -> FitMetrics:
    """Errors of heads with these codes, beside the error of the mean head."""
    before = _distance_mm(bases, data, torch.zeros_like(z), torch.zeros_like(c))
    after = _distance_mm(bases, data, z, c)
    weights = bases.combine(z, c)
    logits, template = surface(bases.shape, weights, data.surface, geometry(bases.shape, weights, data.surface))
    colour = (logits.sigmoid() - data.colour.float() / 255).abs().mean()
    away = (template - data.template).norm(dim=-1).mean() * 100
    return FitMetrics(*after, *before, float(colour), float(away))


def _distance_mm(bases: FieldBases, data: HeadTensors, z: Tensor, c: Tensor) -> tuple[float, float]:
    distance = geometry(bases.shape, bases.combine(z, c), data.surface)[..., 0].abs() * 100
    return float(distance.mean()), float(distance[data.is_face].mean())


class Training:
    """Everything of a run that its checkpoint holds."""

    def __init__(self, shape: FieldShape, data: HeadTensors, rate: float, shape_codes: int = 64) -> None:
        self.bases = FieldBases(shape, shape_codes)
        principal = round(PRINCIPAL * shape_codes)
        codes, mean, slopes = principal_codes(data.vertices, principal)
        z = 0.3 * torch.randn(len(data), shape_codes)
        z[:, :principal] = codes
        self.z = nn.Parameter(z)
        self.c = nn.Parameter(0.3 * torch.randn(len(data), self.bases.colour_codes))
        padded = torch.cat([slopes, torch.zeros(*slopes.shape[:2], shape_codes - principal)], 2)
        self.anchors = Anchors(mean, padded)
        self.optimizer = torch.optim.Adam(
            [
                {"params": self.bases.constant.parameters(), "scale": 1.0},
                # A step moves all bases of a layer, which add up over the codes: about the root of their number.
                {"params": self.bases.bases.parameters(), "scale": 1 / 8},
                {"params": [self.z, self.c], "scale": 1.0},
                {"params": self.anchors.parameters(), "scale": 0.1},
            ],
            rate,
        )
        self.step, self.spent_s = 0, 0.0
        self.log: list[dict] = []

    @torch.no_grad()
    def start(self, saved: dict, data: HeadTensors) -> None:
        """Takes the weights of `train`, whose heads are the first ones of `data`, as many as are there, and the start
        of further codes, which change nothing yet."""
        known = saved["z"].float()
        count = min(len(known), data.first_source)
        old = FieldBases(self.bases.shape, known.shape[1], saved["c"].shape[1])
        old.load_state_dict(saved["bases"])
        for own, other in zip(self.bases.constant, old.constant, strict=True):
            own.copy_(other)
        for name, other in old.bases.items():
            self.bases.bases[name].zero_()
            self.bases.bases[name][: len(other)] = other
        further = self.bases.shape_codes - known.shape[1]
        self.z.copy_(start_codes(data.vertices, data.visible, known[:count], further))
        self.c[:count] = saved["c"][:count].float()
        mean, slopes = linear_slopes(self.z, data.vertices)
        self.anchors.mean.copy_(mean)
        self.anchors.slopes.copy_(slopes)

    def state(self) -> dict:
        return {
            "shape": asdict(self.bases.shape), "bases": self.bases.state_dict(), "z": self.z.data, "c": self.c.data,
            "anchors": self.anchors.state_dict(), "optimizer": self.optimizer.state_dict(), "step": self.step,
            "spent_s": self.spent_s, "log": self.log,
        }  # fmt: skip

    def load(self, state: dict) -> None:
        self.bases.load_state_dict(state["bases"])
        self.z.data, self.c.data = state["z"], state["c"]
        self.anchors.load_state_dict(state["anchors"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.step, self.spent_s, self.log = state["step"], state["spent_s"], state["log"]

    def advance(self, data: HeadTensors, rate: float) -> dict[str, Tensor]:
        """One step at that learning rate."""
        for group in self.optimizer.param_groups:
            group["lr"] = rate * group["scale"]
        heads = torch.randperm(len(data))[:HEADS]
        terms = losses(self.bases, data, heads, self.z[heads], self.c[heads])
        some = torch.randint(data.vertices.shape[1], (256,))
        anchors = self.anchors.mean[some] + torch.tensordot(self.z[heads], self.anchors.slopes[some], ([1], [2]))
        linear = (anchors - data.vertices[heads][:, some]).square().sum(-1).mean()
        loss = sum(SCALES[name] * value for name, value in terms.items()) + 3 * linear
        loss = loss + 2e-5 * (self.z[heads].square().sum(1).mean() + self.c[heads].square().sum(1).mean())
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_([*self.bases.parameters(), self.z, self.c], 1.0)
        self.optimizer.step()
        self.step += 1
        return terms | {"anchors": linear.sqrt()}


@torch.no_grad()
def whitened(training: Training, data: HeadTensors, shape_codes: int) -> tuple[FieldBases, Tensor, Tensor]:
    """Bases for whitened codes, of the shape those `shape_codes` that move what is seen of heads most, and the heads'
    codes z [H, K] and c [H, C]."""
    bases = FieldBases(training.bases.shape, training.bases.shape_codes, training.bases.colour_codes)
    bases.load_state_dict(training.bases.state_dict())
    surface_layer, layers = bases.shape.first_surface_layer, len(bases.constant)
    codes = []
    for code, first, last in ((training.z, 0, surface_layer), (training.c, surface_layer, layers)):
        code = code.double()
        mean = code.mean(0)
        values, vectors = torch.linalg.eigh((code - mean).T @ (code - mean) / len(code))
        deviation = values.clamp(min=1e-12).sqrt()
        root, white = vectors * deviation, ((code - mean) @ vectors) / deviation
        if first == 0 and shape_codes < code.shape[1]:
            response = white.T.float() @ data.visible.flatten(1)
            turned = torch.linalg.eigh((response @ response.T).double())[1].flip(1)[:, :shape_codes]
            root, white = root @ turned, white @ turned
        bases.whiten(mean.float(), root.float(), first, last)
        codes.append(white.float())
    bases.shape_codes = codes[0].shape[1]
    return bases, codes[0], codes[1]


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, nargs="+", default=[Path(".data/heads/points")], help="one a source")
    parser.add_argument("--start", type=Path, help="weights.pt of a prior to go on from, trained on the first source")
    parser.add_argument("--further-codes", type=int, default=32, help="with --start: more codes while it trains")
    parser.add_argument("--out", type=Path, default=Path(".data/runs/heads-prior"))
    parser.add_argument("--width", type=int, default=64, help="of geometry and surface layers")
    parser.add_argument("--codes", type=int, default=64, help="shape codes of a head")
    parser.add_argument("--octaves", type=int, default=6)
    parser.add_argument("--minutes", type=float, default=30, help="of the whole schedule, over resumes")
    parser.add_argument("--steps", type=int, help="length of the schedule in steps instead of minutes")
    parser.add_argument("--rate", type=float, default=2e-3)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, help="default: one a core")
    parser.add_argument("--validate-minutes", type=float, default=10)
    return parser.parse_args()


def train(arguments: argparse.Namespace) -> None:
    """Runs or resumes a training."""
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    torch.manual_seed(arguments.seed)
    sources = [read_points(folder, "train") for folder in arguments.data]
    data = HeadTensors([head for source in sources for head in source], len(sources[0]))
    held_out = HeadTensors([head for folder in arguments.data for head in read_points(folder, "val")])
    print(f"{len(data)} heads to train on, {len(held_out)} held out", flush=True)
    shape = FieldShape(octaves=arguments.octaves, width=arguments.width, surface_width=arguments.width)
    further = arguments.further_codes if arguments.start else 0
    training = Training(shape, data, arguments.rate, arguments.codes + further)
    path = arguments.out / "checkpoint.pt"
    arguments.out.mkdir(parents=True, exist_ok=True)
    if path.exists():
        training.load(torch.load(path, weights_only=True))
    elif arguments.start:
        training.start(torch.load(arguments.start, weights_only=True), data)
    schedule, stop = Schedule(arguments.minutes, arguments.steps), StopSignal()
    clock, smoothed = Stopwatch(training.spent_s), SmoothedTerms()
    save, validate = Interval(SAVE_EVERY_S), Interval(arguments.validate_minutes * 60)
    bar = schedule.bar(training.step, training.spent_s)

    def validated() -> None:
        begun = time.monotonic()
        bases, *_ = whitened(training, data, arguments.codes)
        metrics = asdict(fit_metrics(bases, held_out, *fitted_codes(bases, held_out)))
        row = {"step": training.step, "spent": training.spent_s} | metrics
        training.log.append(row)
        write_log(training.log, arguments.out, list(metrics), "spent", "held-out heads, mm")
        bar.write(" ".join(f"{k}={v:.4g}" for k, v in row.items()) + f" ({time.monotonic() - begun:.0f} s)")

    while not schedule.finished(training.step, training.spent_s) and not stop:
        seed_step(arguments.seed, training.step)
        rate = rate_at(training.step, schedule.fraction(training.step, training.spent_s), arguments.rate)
        smoothed.update(training.advance(data, rate))
        clock.lap()
        training.spent_s = clock.spent_s
        schedule.advance(bar, training.step, training.spent_s)
        if training.step % 50 == 0:
            terms = dict(smoothed.values)
            training.log.append({"step": training.step, "loss": smoothed.loss, "terms": terms})
            bar.set_postfix(step=training.step, surface_mm=f"{100 * terms['surface']:.2f}", refresh=False)
        if save.due():
            save_atomically(training.state(), path)
            save.restart()
        if validate.due():
            validated()
            validate.restart()
            clock.skip()
    save_atomically(training.state(), path)
    validated()
    bases, z, c = whitened(training, data, arguments.codes)
    held_out_z, _ = fitted_codes(bases, held_out)
    save_atomically(
        {"shape": asdict(shape), "bases": bases.state_dict(), "z": z, "c": c, "held_out_z": held_out_z},
        arguments.out / "weights.pt",
    )


def main() -> None:
    train(parsed())


if __name__ == "__main__":
    main()
