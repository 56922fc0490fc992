"""Trains extractor, basis and refiner on captured or rendered places.

    python -m export.scenes.train --data .data/places --out .data/runs/scenes --minutes 120 \\
        --pretrained .data/teachers/backbone.pt

`--data` holds folders `train` and `val` of captures (export.scenes.captures). `--pretrained` is the file of
export.teachers.backbone: the extractor's trunk starts from it, and images are compared by its features; without it
the trunk starts from random weights and images are compared by their pixels alone. `--start` begins with the weights of
another run instead. It resumes from `--out` by itself, saves every few minutes and on Ctrl-C: checkpoint.pt, weights.pt
(for export.scenes.export_onnx), log.json, curves.png, and sample.png: photo, ours, the plain points.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor, nn
from tqdm import tqdm

from export.point_cloud import PointCloudError
from export.scenes.captures import Capture, CaptureError, read_captures
from export.scenes.config import SIZES
from export.scenes.fitting import Options, fitted_to_features, fitted_to_views, painted, render
from export.scenes.geometry.source_views import scores
from export.scenes.image_quality import psnr_db
from export.scenes.losses import LossWeights, image_terms, own_rasters
from export.scenes.networks.extractor import STRIDE
from export.scenes.networks.system import Networks, load_networks, save_networks
from export.scenes.perceptual import Perceptual, load_perceptual
from export.scenes.samples import Sample, Sampling, draw_sample
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

WARM_UP_STEPS = 100
MAX_GRADIENT_NORM = 1.0
FROZEN_BLOCKS = 3  # of a pretrained trunk, to stride 4, that are not trained
FIGURES = ("psnr_db", "plain_psnr_db")
PRECISIONS = {"float32": torch.float32, "bfloat16": torch.bfloat16}


def batch_terms(
    networks: Networks,
    samples: Sequence[Sample],
    weights: LossWeights,
    perceptual: Perceptual | None,
    precision: torch.dtype = torch.float32,
) -> dict[str, Tensor]:
    """The loss's terms over a batch of crops of one size. Extractor, basis and refiner get gradients. precision: of
    convolutions; the regression is always float64."""
    device = next(networks.parameters()).device
    images = torch.cat([torch.stack(sample.sources.images) for sample in samples]).to(device)
    half = torch.autocast(device.type, precision, enabled=precision != torch.float32)
    with half:
        features = iter(networks.extractor(images.contiguous(memory_format=torch.channels_last)).float())
    rasters: list[list[Tensor]] = []
    for sample in samples:
        model = fitted_to_features(
            sample.sources, islice(features, len(sample.sources.images)), networks, sample.options
        )
        rasters.append(model.rasters(sample.camera, networks, sample.options))
    target = torch.stack([sample.target for sample in samples]).to(device)
    mask = torch.stack([sample.mask for sample in samples]).to(device)
    with half:
        picture = networks.refiner([torch.stack(level) for level in zip(*rasters, strict=True)])
        terms = image_terms(picture.float(), target, mask, weights, perceptual)
    if weights.own:
        # The refiner alone: what it makes of an image's own features should be the image.
        with torch.no_grad():
            features = networks.extractor(target)
        own = networks.refiner(own_rasters(features))
        terms["own"] = weights.own * ((own - target) * mask).abs().mean() / mask.mean().clamp_min(1e-6)
    return terms


@torch.no_grad()
def validate(
    networks: Networks, captures: Sequence[Capture], long_side_px: int, sources: int = 8, targets: int = 2
) -> tuple[dict[str, float], np.ndarray]:
    """Mean PSNR of whole held-out photos made from the best others, and of the plain points; and a sheet of them,
    uint8 [H, W, 3], RGB: photo, ours, plain points, one place a row."""
    device, rows, figures = next(networks.parameters()).device, [], []
    networks.eval()
    for capture in captures:
        points = torch.from_numpy(capture.cloud.positions).to(device)
        colours = torch.from_numpy(capture.cloud.colours).to(device)
        options = Options(up=capture.up)
        candidates = sorted(capture.held_out) or range(len(capture.cameras))
        for at in np.linspace(0, len(candidates) - 1, targets + 2).round().astype(int)[1:-1]:
            target = candidates[at]
            others = [k for k in capture.sources() if k != target]
            score = scores(capture.cameras[target], [capture.cameras[k] for k in others], capture.cloud.positions[::37])
            best = [others[k] for k in np.argsort(-score, kind="stable")[:sources]]
            photo = capture.view(target, long_side_px)
            model = fitted_to_views(points, [capture.view(k, long_side_px) for k in best], networks, options)
            made = render(model, photo.camera, networks, options)
            plain = painted(points, colours, photo.camera)
            figures.append((psnr_db(made, photo.image), psnr_db(plain, photo.image)))
        rows.append(np.hstack([photo.image, made, plain]))
    networks.train()
    width = min(row.shape[1] for row in rows)
    rows = [cv2.resize(row, (width, round(row.shape[0] * width / row.shape[1]))) for row in rows]
    ours, plain = np.mean(figures, 0)
    sheet = np.rint(np.vstack(rows) * 255).astype(np.uint8)
    return {"psnr_db": float(ours), "plain_psnr_db": float(plain)}, sheet


@dataclass(frozen=True)
class TrainingConfig:
    """One training; the options of the command have the same names and say what they mean."""

    data: Path = Path(".data/places")
    out: Path = Path(".data/runs/scenes")
    size: str = "small"
    minutes: float = 120
    steps: int | None = None
    batch: int = 4
    crop: int = 256
    sources: tuple[int, int] = (2, 5)
    margin: int = 64
    long_side: int = 640
    lr: float = 5e-4
    seed: int = 0
    threads: int | None = None
    precision: str = "float32"
    pretrained: Path | None = None
    start: Path | None = None
    validate_minutes: float = 10


class Run:
    """One training: networks, optimiser, how far it is; saved to and resumed from a folder."""

    def __init__(self, config: TrainingConfig, device: torch.device) -> None:
        self.config, self.checkpoint = config, config.out / "checkpoint.pt"
        config.out.mkdir(parents=True, exist_ok=True)
        self.networks = Networks(SIZES[config.size]).to(device)
        self.perceptual = load_perceptual(config.pretrained).to(device) if config.pretrained else None
        self.step, self.spent_s, self.log = 0, 0.0, []
        saved = None
        if self.checkpoint.exists():
            saved = torch.load(self.checkpoint, map_location=device, weights_only=True)
            if saved["size"] != config.size:
                raise SystemExit(
                    f"{config.out} holds a run of --size {saved['size']}, not {config.size}: give another --out."
                )
        if config.start and not saved:
            self.networks.load_state_dict(load_networks(config.start).state_dict())
        elif self.perceptual and not saved:
            self.networks.extractor.trunk.load_state_dict(self.perceptual.trunk.state_dict())
        if self.perceptual:
            # Layers that found edges in photographs need no training, and theirs would be the most expensive: half of
            # the way back through the extractor is at the largest sizes.
            trunk = self.networks.extractor.trunk
            for module in (trunk.stem, *trunk.blocks[:FROZEN_BLOCKS]):
                module.requires_grad_(False)
        learning = [p for p in self.networks.parameters() if p.requires_grad]
        self.optimiser = torch.optim.Adam(learning, lr=config.lr)
        if saved:
            self.networks.load_state_dict(saved["networks"])
            self.optimiser.load_state_dict(saved["optimiser"])
            self.step, self.spent_s, self.log = saved["step"], saved["spent"], saved["log"]
            print(f"resumed at step {self.step}, {self.spent_s / 60:.1f} minutes")

    def save(self) -> None:
        parts = {"networks": self.networks.state_dict(), "optimiser": self.optimiser.state_dict()}
        progress = {"step": self.step, "spent": self.spent_s, "log": self.log, "size": self.config.size}
        save_atomically({**parts, **progress}, self.checkpoint)
        save_networks(self.networks, self.config.out / "weights.pt")
        write_log(self.log, self.config.out, FIGURES, against="step", label="validation, dB")

    def check(self, captures: Sequence[Capture]) -> None:
        """Adds metrics on held-out photos to the log and writes sample.png."""
        figures, sheet = validate(self.networks, captures, self.config.long_side)
        self.log.append({"step": self.step, "spent": self.spent_s, **figures})
        cv2.imwrite(str(self.config.out / "sample.png"), sheet[..., ::-1])
        tqdm.write(json.dumps(self.log[-1]))


def train(config: TrainingConfig) -> None:
    """Trains as the head of this file says. Raises SystemExit where captures cannot be read."""
    if config.threads:
        torch.set_num_threads(config.threads)
    torch.manual_seed(config.seed)
    run = Run(config, torch.device("cuda" if torch.cuda.is_available() else "cpu"))
    try:
        captures, held_out = (read_captures(config.data / split) for split in ("train", "val"))
    except (CaptureError, PointCloudError) as error:
        raise SystemExit(str(error)) from None
    sampling = Sampling(config.crop, tuple(config.sources), config.margin, config.long_side)
    schedule, stopped = Schedule(config.minutes, config.steps), StopSignal()
    if schedule.finished(run.step, run.spent_s):
        print(f"{config.out} is finished: {run.step} steps.")
        return
    smoothed, watch = SmoothedTerms(), Stopwatch(run.spent_s)
    save_due, check_due = Interval(SAVE_EVERY_S), Interval(config.validate_minutes * 60)
    bar = schedule.bar(run.step, run.spent_s)
    run.networks.train()
    finished = False
    while not finished:
        seed_step(config.seed, run.step)
        rate = rate_at(run.step, schedule.fraction(run.step, run.spent_s), config.lr, WARM_UP_STEPS)
        for group in run.optimiser.param_groups:
            group["lr"] = rate

        rng = np.random.default_rng([config.seed, run.step])
        samples = [draw_sample(captures, sampling, rng) for _ in range(config.batch)]
        terms = batch_terms(run.networks, samples, LossWeights(), run.perceptual, PRECISIONS[config.precision])
        run.optimiser.zero_grad(set_to_none=True)
        sum(terms.values()).backward()
        if torch.isfinite(nn.utils.clip_grad_norm_(run.networks.parameters(), MAX_GRADIENT_NORM)):
            run.optimiser.step()

        run.step += 1
        smoothed.update(terms)
        watch.lap()
        run.spent_s = watch.spent_s
        finished = bool(stopped) or schedule.finished(run.step, run.spent_s)
        schedule.advance(bar, run.step, run.spent_s)
        if run.step % 10 == 0 or finished:
            run.log.append({"step": run.step, "loss": smoothed.loss, "terms": smoothed.values, "rate": rate})
            bar.set_postfix(step=run.step, loss=f"{smoothed.loss:.3f}")
        if check_due.due() and not finished:
            run.check(held_out)
            check_due.restart()
            watch.skip()
        if save_due.due():
            run.save()
            save_due.restart()
            watch.skip()
    bar.close()
    run.check(held_out)
    run.save()


def parsed() -> TrainingConfig:
    default = TrainingConfig
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=default.data)
    parser.add_argument("--out", type=Path, default=default.out)
    parser.add_argument("--size", choices=SIZES, default=default.size, help="of the networks")
    parser.add_argument(
        "--minutes", type=float, default=default.minutes, help="length of the whole schedule, resumes counted in"
    )
    parser.add_argument("--steps", type=int, help="length of the schedule in steps instead of minutes")
    parser.add_argument("--batch", type=int, default=default.batch, help="crops a step")
    parser.add_argument("--crop", type=int, default=default.crop, help="side of the crops, pixels; a multiple of 32")
    parser.add_argument(
        "--sources", type=int, nargs=2, default=default.sources, help="photos that a crop is made from, from .. to"
    )
    parser.add_argument(
        "--margin", type=int, default=default.margin, help="the extractor sees so much more than a crop, pixels"
    )
    parser.add_argument(
        "--long-side", type=int, default=default.long_side, help="larger photos are made smaller, pixels"
    )
    parser.add_argument("--lr", type=float, default=default.lr)
    parser.add_argument("--seed", type=int, default=default.seed)
    parser.add_argument("--threads", type=int, help="default: one a core")
    parser.add_argument(
        "--precision",
        choices=PRECISIONS,
        default=default.precision,
        help="of convolutions; processors with AVX512_BF16 or AMX train about twice as fast with bfloat16",
    )
    parser.add_argument("--pretrained", type=Path, help="weights of the trunk (export.teachers.backbone)")
    parser.add_argument("--start", type=Path, help="weights to begin with, such as export/weights/scenes.pt")
    parser.add_argument("--validate-minutes", type=float, default=default.validate_minutes)
    options = parser.parse_args()
    for name, value, smallest in (("crop", options.crop, STRIDE), ("margin", options.margin, 0)):
        if value < smallest or value % STRIDE:
            parser.error(f"--{name} {value}: must be a multiple of {STRIDE}")
    if min(options.batch, options.sources[0]) < 1 or options.sources[1] < options.sources[0]:
        parser.error("--batch and --sources must be at least 1, and --sources rise")
    return TrainingConfig(**{**vars(options), "sources": tuple(options.sources)})


def main() -> None:
    train(parsed())


if __name__ == "__main__":
    main()
