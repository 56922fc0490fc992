"""Trains extractor, basis and refiner on captured or rendered places.

    python -m export.scenes.train --data .data/places --out .data/runs/scenes --minutes 120 \\
        --pretrained .data/teachers/backbone.pt

`--data` holds folders `train` and `val` of captures (export.scenes.captures). `--pretrained` is the file of
export.teachers.backbone: the extractor's trunk starts from it, and pictures are compared by its features; without it
the trunk starts from random weights and pictures are compared by their pixels alone. It resumes from `--out` by itself,
saves every few minutes and on Ctrl-C: checkpoint.pt, weights.pt (for export.scenes.export_onnx), log.json, curves.png,
and sample.png: photo, ours, the plain points.
"""

from __future__ import annotations

import argparse
import json
import math
import signal
import time
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

import cv2
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import torch
from torch import Tensor, nn
from tqdm import tqdm

from export.point_cloud import PointCloudError
from export.scenes.captures import Capture, CaptureError, read_captures
from export.scenes.config import SIZES
from export.scenes.extractor import STRIDE
from export.scenes.losses import LossWeights, own_rasters, picture_terms
from export.scenes.modelling import Options, fitted, modelled, painted, render
from export.scenes.perceptual import Perceptual, load_perceptual
from export.scenes.picture_quality import psnr_db
from export.scenes.samples import Sample, Sampling, draw_sample
from export.scenes.source_views import scores
from export.scenes.system import Networks, save_networks

WARM_UP_STEPS = 100
LARGEST_GRADIENT = 1.0
STANDING_BLOCKS = 3  # of a pretrained trunk, to stride 4, that are not trained
PRECISIONS = {"float32": torch.float32, "bfloat16": torch.bfloat16}


def batch_terms(
    networks: Networks,
    samples: Sequence[Sample],
    weights: LossWeights,
    perceptual: Perceptual | None,
    precision: torch.dtype = torch.float32,
) -> dict[str, Tensor]:
    """The loss's terms over a batch of cuts of one size. Extractor, basis and refiner get gradients. precision: of
    convolutions; the regression is always float64."""
    device = next(networks.parameters()).device
    images = torch.cat([torch.stack(sample.sources.images) for sample in samples]).to(device)
    half = torch.autocast(device.type, precision, enabled=precision != torch.float32)
    with half:
        features = iter(networks.extractor(images.contiguous(memory_format=torch.channels_last)).float())
    rasters: list[list[Tensor]] = []
    for sample in samples:
        model = fitted(sample.sources, islice(features, len(sample.sources.images)), networks, sample.options)
        rasters.append(model.rasters(sample.camera, networks, sample.options))
    target = torch.stack([sample.target for sample in samples]).to(device)
    mask = torch.stack([sample.mask for sample in samples]).to(device)
    with half:
        picture = networks.refiner([torch.stack(level) for level in zip(*rasters, strict=True)])
        terms = picture_terms(picture.float(), target, mask, weights, perceptual)
    if weights.own:
        # The refiner alone: what it makes of a picture's own features should be the picture.
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
        points = torch.from_numpy(capture.cloud.places).to(device)
        colours = torch.from_numpy(capture.cloud.colours).to(device)
        options = Options(up=capture.up)
        candidates = sorted(capture.held_out) or range(len(capture.cameras))
        for at in np.linspace(0, len(candidates) - 1, targets + 2).round().astype(int)[1:-1]:
            target = candidates[at]
            others = [k for k in capture.sources() if k != target]
            score = scores(capture.cameras[target], [capture.cameras[k] for k in others], capture.cloud.places[::37])
            best = [others[k] for k in np.argsort(-score, kind="stable")[:sources]]
            photo = capture.view(target, long_side_px)
            model = modelled(points, [capture.view(k, long_side_px) for k in best], networks, options)
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


def rate_at(step: int, share: float, rate: float) -> float:
    """Learning rate after `step` steps and that share of the run: a short rise, then a cosine down to a fiftieth."""
    wave = 0.5 * (1 + math.cos(math.pi * min(share, 1)))
    return rate * min(1.0, (step + 1) / WARM_UP_STEPS) * (0.02 + 0.98 * wave)


def draw_curves(log: list[dict], path: Path) -> None:
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 4.5))
    steps = [row for row in log if "loss" in row]
    for name in steps[-1]["terms"] if steps else ():
        left.plot([r["step"] for r in steps], [r["terms"][name] for r in steps], label=name, lw=1)
    left.plot([r["step"] for r in steps], [r["loss"] for r in steps], "k", label="sum", lw=1.5)
    left.set(xlabel="step", ylabel="weighted loss", yscale="log")
    for name in ("psnr_db", "plain_psnr_db"):
        checks = [row for row in log if name in row]
        right.plot([r["step"] for r in checks], [r[name] for r in checks], "o-", ms=3, label=name)
    right.set(xlabel="step", ylabel="validation, dB")
    for axis in (left, right):
        axis.grid(alpha=0.3)
        axis.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    plt.close(figure)


class Run:
    """One training: networks, optimiser, how far it is; saved to and resumed from a folder."""

    def __init__(self, options: argparse.Namespace, device: torch.device) -> None:
        self.folder: Path = options.out
        self.folder.mkdir(parents=True, exist_ok=True)
        torch.manual_seed(options.seed)
        self.networks = Networks(SIZES[options.size]).to(device)
        self.perceptual = load_perceptual(options.pretrained).to(device) if options.pretrained else None
        self.step, self.spent, self.log = 0, 0.0, []
        saved = None
        if (self.folder / "checkpoint.pt").exists():
            saved = torch.load(self.folder / "checkpoint.pt", map_location=device, weights_only=True)
            if saved["size"] != options.size:
                raise SystemExit(
                    f"{self.folder} holds a run of --size {saved['size']}, not {options.size}: give another --out."
                )
        self.size = options.size
        if self.perceptual and not saved:
            self.networks.extractor.trunk.load_state_dict(self.perceptual.trunk.state_dict())
        if self.perceptual:
            # What has learnt edges from photographs needs no lesson, and would be the dearest to teach: half of the
            # way back through the extractor is at the largest sizes.
            trunk = self.networks.extractor.trunk
            for module in (trunk.stem, *trunk.blocks[:STANDING_BLOCKS]):
                module.requires_grad_(False)
        learning = [p for p in self.networks.parameters() if p.requires_grad]
        self.optimiser = torch.optim.Adam(learning, lr=options.lr)
        if saved:
            self.networks.load_state_dict(saved["networks"])
            self.optimiser.load_state_dict(saved["optimiser"])
            self.step, self.spent, self.log = saved["step"], saved["spent"], saved["log"]
            print(f"resumed at step {self.step}, {self.spent / 60:.1f} minutes")

    def save(self) -> None:
        state = {
            "networks": self.networks.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "step": self.step,
            "spent": self.spent,
            "log": self.log,
            "size": self.size,
        }
        path = self.folder / "checkpoint.pt"
        torch.save(state, path.with_suffix(".tmp"))
        path.with_suffix(".tmp").rename(path)
        save_networks(self.networks, self.folder / "weights.pt")
        (self.folder / "log.json").write_text(json.dumps(self.log))
        draw_curves(self.log, self.folder / "curves.png")

    def check(self, captures: Sequence[Capture], long_side_px: int) -> None:
        figures, sheet = validate(self.networks, captures, long_side_px)
        self.log.append({"step": self.step, "spent": self.spent, **figures})
        cv2.imwrite(str(self.folder / "sample.png"), sheet[..., ::-1])
        tqdm.write(json.dumps(self.log[-1]))


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(".data/places"))
    parser.add_argument("--out", type=Path, default=Path(".data/runs/scenes"))
    parser.add_argument("--size", choices=SIZES, default="small", help="of the networks; full is the paper's refiner")
    parser.add_argument("--minutes", type=float, default=120, help="length of the whole schedule, resumes counted in")
    parser.add_argument("--steps", type=int, help="length of the schedule in steps instead of minutes")
    parser.add_argument("--batch", type=int, default=4, help="cuts a step")
    parser.add_argument("--crop", type=int, default=256, help="side of the cuts, pixels; a multiple of 32")
    parser.add_argument(
        "--sources", type=int, nargs=2, default=(2, 5), help="photos that a cut is made from, from .. to"
    )
    parser.add_argument("--margin", type=int, default=64, help="the extractor sees so much more than a cut, pixels")
    parser.add_argument("--long-side", type=int, default=640, help="larger photos are made smaller, pixels")
    parser.add_argument("--lr", type=float, default=5e-4)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, help="default: one a core")
    parser.add_argument(
        "--precision",
        choices=PRECISIONS,
        default="float32",
        help="of convolutions; processors with AVX512_BF16 or AMX train about twice as fast with bfloat16",
    )
    parser.add_argument("--pretrained", type=Path, help="weights of the trunk (export.teachers.backbone)")
    parser.add_argument("--validate-minutes", type=float, default=10)
    options = parser.parse_args()
    for name, value, least in (("crop", options.crop, STRIDE), ("margin", options.margin, 0)):
        if value < least or value % STRIDE:
            parser.error(f"--{name} {value}: must be a multiple of {STRIDE}")
    if min(options.batch, options.sources[0]) < 1 or options.sources[1] < options.sources[0]:
        parser.error("--batch and --sources must be at least 1, and --sources rise")
    return options


def main() -> None:
    options = parsed()
    if options.threads:
        torch.set_num_threads(options.threads)
    run = Run(options, torch.device("cuda" if torch.cuda.is_available() else "cpu"))
    try:
        captures, held_out = (read_captures(options.data / split) for split in ("train", "val"))
    except (CaptureError, PointCloudError) as error:
        raise SystemExit(str(error)) from None
    sampling = Sampling(options.crop, tuple(options.sources), options.margin, options.long_side)
    stopped = False

    def stop(*_: object) -> None:
        nonlocal stopped
        stopped = True

    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGINT, stop)
    run.networks.train()
    smooth: dict[str, float] = {}
    length = options.minutes * 60
    clock = saved_at = checked_at = time.monotonic()
    finished = run.step >= options.steps if options.steps else run.spent >= length
    if finished:
        print(f"{run.folder} is finished: {run.step} steps.")
        return
    bar = tqdm(total=options.steps or round(length), initial=run.step if options.steps else round(run.spent))
    while not finished:
        torch.manual_seed((options.seed << 32) + run.step)  # as in a run that never stopped
        share = run.step / options.steps if options.steps else run.spent / length
        rate = rate_at(run.step, share, options.lr)
        for group in run.optimiser.param_groups:
            group["lr"] = rate
        rng = np.random.default_rng([options.seed, run.step])
        samples = [draw_sample(captures, sampling, rng) for _ in range(options.batch)]
        terms = batch_terms(run.networks, samples, LossWeights(), run.perceptual, PRECISIONS[options.precision])
        run.optimiser.zero_grad(set_to_none=True)
        sum(terms.values()).backward()
        if torch.isfinite(nn.utils.clip_grad_norm_(run.networks.parameters(), LARGEST_GRADIENT)):
            run.optimiser.step()
        run.step += 1
        for name, value in terms.items():
            smooth[name] = 0.95 * smooth.get(name, value.item()) + 0.05 * value.item()
        now = time.monotonic()
        run.spent, clock = run.spent + now - clock, now
        finished = stopped or (run.step >= options.steps if options.steps else run.spent >= length)
        bar.update((run.step if options.steps else round(run.spent)) - bar.n)
        if run.step % 10 == 0 or finished:
            run.log.append({"step": run.step, "loss": sum(smooth.values()), "terms": dict(smooth), "rate": rate})
            bar.set_postfix(step=run.step, loss=f"{run.log[-1]['loss']:.3f}")
        if now - checked_at > options.validate_minutes * 60 and not finished:
            run.check(held_out, options.long_side)
            checked_at = clock = time.monotonic()
        if now - saved_at > 180:
            run.save()
            saved_at = clock = time.monotonic()
    bar.close()
    run.check(held_out, options.long_side)
    run.save()


if __name__ == "__main__":
    main()
