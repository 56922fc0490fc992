"""Trains the network on rendered people.

    python -m export.densepose.train --out .data/runs/b --minutes 120

One loop for CPU, one GPU, and several processes: `torchrun --nproc-per-node N -m export.densepose.train …`
for N GPUs. On a CPU one process a core with `--batch 8` is about four times as fast as one process with all
cores. It resumes from `--out` by itself, saves every few minutes and on Ctrl-C, and draws the curves to
`curves.png`.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import nn
from tqdm import tqdm

from export.densepose import data
from export.densepose.config import NetworkConfig
from export.densepose.losses import PixelHead, batch_loss, surface_loss
from export.densepose.network import MobileParsingRCNN
from export.densepose.validation import validate, validate_surface
from export.shards import Record, load_records
from export.training import (
    SAVE_EVERY_S,
    Ema,
    Interval,
    Processes,
    Schedule,
    SmoothedTerms,
    StopSignal,
    Stopwatch,
    average_gradients,
    bf16_pays,
    rate_at,
    save_atomically,
    seed_step,
    write_log,
)


@dataclass(frozen=True)
class TrainingConfig:
    """One training; the options of the command have the same names and say what they mean."""

    data: Path = Path(".data/people")
    photos: Path | None = None
    photo_fraction: float = 0.3
    out: Path = Path(".data/runs/b")
    width: int = 64
    minutes: float = 120
    steps: int | None = None
    batch: int = 16
    lr: float = 2e-3
    weight_decay: float = 0.02
    ema: float = 0.997
    seed: int = 0
    threads: int | None = None
    init: Path | None = None
    backbone: str = NetworkConfig.backbone
    pretrained: Path | None = None
    validate_minutes: float = 10
    bf16: bool = False


@dataclass(frozen=True)
class Stage:
    """From `start` (fraction of the run) on: square crops of `size` pixels; `surface_only`: PixelHead's terms alone."""

    start: float
    size: int
    cropping: data.Cropping = data.ANY_CROPPING
    surface_only: bool = False


# The trunk learns the surface first, on every pixel of small crops: almost three times as fast as the whole network.
STAGES = (Stage(0.0, 128, data.CLOSE_CROPPING, surface_only=True), Stage(0.08, 192), Stage(0.55, 256))
FROZEN_BACKBONE_RATE = 0.1  # of the learning rate
HELD_OUT_IMAGES = 100
MAX_GRADIENT_NORM = 10.0
FIGURES = ("recall", "precision", "part", "mask_iou", "pixel_part", "pixel_mask_iou")


def optimiser_of(net: MobileParsingRCNN, pixel_head: PixelHead, rate: float, weight_decay: float) -> torch.optim.AdamW:
    """Each of its groups has a "rate": a factor of the learning rate."""
    # Without BN to undo it, a full rate would wipe out what a pretrained backbone knows.
    backbone_rate = FROZEN_BACKBONE_RATE if getattr(net.backbone, "frozen", False) else 1.0
    others = nn.ModuleList([m for m in net.children() if m is not net.backbone] + [pixel_head])
    groups = [
        {
            "params": [p for p in part.parameters() if p.requires_grad and (p.dim() > 1) == decayed],
            "weight_decay": weight_decay if decayed else 0.0,
            "rate": factor,
        }
        for part, factor in ((net.backbone, backbone_rate), (others, 1.0))
        for decayed in (True, False)
    ]
    return torch.optim.AdamW(groups, lr=rate, fused=True)


def start_from(net: nn.Module, weights: dict[str, torch.Tensor], name: Path) -> None:
    """Takes over what fits; says which modules keep their random weights because of another shape or name."""
    own = net.state_dict()
    fitting = {k: v for k, v in weights.items() if k in own and own[k].shape == v.shape}
    net.load_state_dict(fitting, strict=False)
    fresh = sorted({".".join(k.split(".")[:2]) for k in own.keys() - fitting.keys()})
    if fresh:
        print(f"not in {name}, so untrained: {', '.join(fresh)}")


class Run:
    """One training: networks and their averages, optimiser, and how far it is; saved to and resumed from a folder."""

    def __init__(self, config: TrainingConfig, device: torch.device) -> None:
        self.config, self.checkpoint = config, config.out / "checkpoint.pt"
        config.out.mkdir(parents=True, exist_ok=True)
        resumes = self.checkpoint.exists()
        saved, self.frozen = {}, config.pretrained is not None
        if resumes or config.init:
            saved = torch.load(self.checkpoint if resumes else config.init, map_location=device, weights_only=False)
            # Another backbone's weights are not taken over, so there is nothing in it to keep.
            self.frozen |= saved.get("frozen", False) and config.backbone == "mobilenet_v2"
        net = MobileParsingRCNN(NetworkConfig(width=config.width, backbone=config.backbone))
        self.net = net.to(device, memory_format=torch.channels_last)
        self.pixel_head = PixelHead(net.config).to(device)
        if self.frozen:
            net.backbone.freeze()
        self.trained = nn.ModuleList([self.net, self.pixel_head])
        self.ema = Ema(self.trained, config.ema)
        self.averaged, self.averaged_pixel_head = self.ema.net
        self.optimiser = optimiser_of(self.net, self.pixel_head, config.lr, config.weight_decay)
        self.step, self.images, self.spent_s, self.log = 0, 0, 0.0, []
        if resumes:
            self._resume(saved)
        else:
            self._start(saved, device)

    def _resume(self, saved: dict) -> None:
        for name, part in self._parts().items():
            part.load_state_dict(saved[name])
        self.step, self.images, self.spent_s, self.log = (saved[name] for name in ("step", "images", "spent", "log"))
        print(f"resumed at step {self.step}, {self.spent_s / 60:.1f} of {self.config.minutes:g} minutes")

    def _start(self, saved: dict, device: torch.device) -> None:
        """saved: weights of another run, or none."""
        if saved:
            start_from(self.net, saved["ema"], self.config.init)
            if "pixel_ema" in saved:
                self.pixel_head.load_state_dict(saved["pixel_ema"])
        if self.config.pretrained:
            self.net.backbone.load_state_dict(torch.load(self.config.pretrained, map_location=device))
        self.ema.net.load_state_dict(self.trained.state_dict())

    def _parts(self) -> dict[str, nn.Module | torch.optim.Optimizer]:
        """What has a state, by its name in the checkpoint."""
        return {
            "net": self.net,
            "pixel_head": self.pixel_head,
            "ema": self.averaged,
            "pixel_ema": self.averaged_pixel_head,
            "optimiser": self.optimiser,
        }

    def save(self) -> None:
        state = {name: part.state_dict() for name, part in self._parts().items()}
        progress = {"step": self.step, "images": self.images, "spent": self.spent_s, "log": self.log}
        kind = {"width": self.config.width, "backbone": self.config.backbone, "frozen": self.frozen}
        save_atomically({**state, **progress, **kind}, self.checkpoint)
        # What is shipped, and what another run may start from: the averaged weights, in half precision.
        half = {k: v.half() if v.is_floating_point() else v for k, v in state["ema"].items()}
        torch.save({"ema": half, **kind}, self.config.out / "weights.pt")
        write_log(self.log, self.config.out, FIGURES, against="images", label="validation")

    def check(self, held_out: list[Record], stage: Stage) -> None:
        """Adds figures on validation images to the log; boxes only where the stage has trained them."""
        first = STAGES[0]
        figures = validate_surface(self.averaged, self.averaged_pixel_head, held_out, first.size, first.cropping)
        if not stage.surface_only:
            figures |= validate(self.averaged, held_out)
        self.log.append({"step": self.step, "images": self.images, "spent": self.spent_s, **figures})
        tqdm.write(json.dumps(self.log[-1]))


def train(config: TrainingConfig) -> None:
    """Trains as the head of this file says, in this process and those that torchrun started beside it."""
    processes = Processes.join(config.threads)
    rank, world, device = processes.rank, processes.world, processes.device
    schedule, stopped = Schedule(config.minutes, config.steps), StopSignal()
    torch.manual_seed(config.seed)  # every process starts from the same weights
    run = Run(config, device)
    if schedule.finished(run.step, run.spent_s):
        print(f"{config.out} is finished: {run.step} steps.")
        return
    own_seed = config.seed * 1000 + rank
    records = load_records(config.data / "train")[rank::world]
    held_out = load_records(config.data / "val", HELD_OUT_IMAGES)
    photos = load_records(config.photos)[rank::world] if config.photos else []
    # On the one core of this process a second thread would only take turns with it, a fifth slower than one alone.
    ahead = 0 if device.type == "cpu" and torch.get_num_threads() == 1 else 4
    batches = data.Batches(records, config.batch, own_seed, run.step, photos, config.photo_fraction, ahead)
    autocast = torch.autocast(device.type, torch.bfloat16, enabled=config.bf16)
    smoothed, watch = SmoothedTerms(), Stopwatch(run.spent_s)
    save_due, check_due = Interval(SAVE_EVERY_S), Interval(config.validate_minutes * 60)
    bar = schedule.bar(run.step, run.spent_s, disable=rank > 0)
    run.net.train()
    finished = False
    while not finished:
        seed_step(own_seed, run.step)
        fraction = schedule.fraction(run.step, watch.spent_s)
        stage = [s for s in STAGES if fraction >= s.start][-1]
        rate = rate_at(run.step, fraction, config.lr)
        for group in run.optimiser.param_groups:
            group["lr"] = rate * group["rate"]

        image, truths = batches.next(stage.size, stage.cropping)
        image = image.to(device).contiguous(memory_format=torch.channels_last)
        truths = [truth.to(device) for truth in truths]
        loss_terms = surface_loss if stage.surface_only else batch_loss
        terms = loss_terms(run.net, image, truths, autocast, run.pixel_head)
        run.optimiser.zero_grad(set_to_none=True)
        sum(terms.values()).backward()
        stop_now = bool(stopped)
        if world > 1:
            # What a stage leaves alone must keep no gradient, else weight decay would wear it down.
            surface = nn.ModuleList([run.net.backbone, run.net.neck, run.pixel_head])
            used = [p for p in (surface if stage.surface_only else run.trained).parameters() if p.requires_grad]
            watch.spent_s, stop_now = average_gradients(used, watch.spent_s, stop_now, world)
        finished = stop_now or schedule.finished(run.step + 1, watch.spent_s)
        if torch.isfinite(nn.utils.clip_grad_norm_(run.trained.parameters(), MAX_GRADIENT_NORM)):
            run.optimiser.step()
            run.ema.update(run.trained, run.step)

        run.step, run.images = run.step + 1, run.images + len(image) * world
        smoothed.update(terms)
        watch.lap()
        run.spent_s = watch.spent_s
        schedule.advance(bar, run.step, run.spent_s)
        if run.step % 20 == 0:
            row = {"step": run.step, "images": run.images, "loss": smoothed.loss, "terms": smoothed.values}
            run.log.append({**row, "rate": rate, "size": stage.size})
            bar.set_postfix(step=run.step, images=run.images, loss=f"{smoothed.loss:.3f}", size=stage.size)
        if rank == 0 and check_due.due() and not finished:
            run.check(held_out, stage)
            check_due.restart()
            watch.skip()
        if rank == 0 and save_due.due():
            run.save()
            save_due.restart()
            watch.skip()
    bar.close()
    batches.close()
    if rank == 0:
        run.check(held_out, stage)
        run.save()


def parsed() -> TrainingConfig:
    default = TrainingConfig
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=default.data)
    parser.add_argument("--photos", type=Path, help="also shards of labelled photographs (export.teachers.shards)")
    parser.add_argument(
        "--photo-fraction", type=float, default=default.photo_fraction, help="of the images, where there are --photos"
    )
    parser.add_argument("--out", type=Path, default=default.out)
    parser.add_argument(
        "--width", type=int, default=default.width, help="channels of neck and heads: 64 (variant B), 88, 112"
    )
    parser.add_argument(
        "--minutes", type=float, default=default.minutes, help="length of the whole schedule, resumes counted in"
    )
    parser.add_argument("--steps", type=int, help="length of the schedule in steps instead of minutes")
    parser.add_argument("--batch", type=int, default=default.batch, help="images a step and process")
    parser.add_argument("--lr", type=float, default=default.lr)
    parser.add_argument("--weight-decay", type=float, default=default.weight_decay)
    parser.add_argument("--ema", type=float, default=default.ema)
    parser.add_argument("--seed", type=int, default=default.seed)
    parser.add_argument("--threads", type=int, help="a process; default: the cores divided among the processes")
    parser.add_argument(
        "--init", type=Path, help="start from these weights: weights.pt or checkpoint.pt of another run"
    )
    parser.add_argument("--backbone", choices=NetworkConfig.BACKBONES, default=default.backbone)
    parser.add_argument(
        "--pretrained", type=Path, help="weights of the backbone (export.teachers.backbone); BN, first blocks freeze"
    )
    parser.add_argument("--validate-minutes", type=float, default=default.validate_minutes)
    parser.add_argument("--bf16", action=argparse.BooleanOptionalAction, help="default: where it is faster")
    options = parser.parse_args()
    if options.bf16 is None:
        options.bf16 = torch.cuda.is_available() or bf16_pays()
    if options.pretrained and options.backbone != "mobilenet_v2":
        parser.error("--pretrained is for --backbone mobilenet_v2")
    return TrainingConfig(**vars(options))


def main() -> None:
    train(parsed())


if __name__ == "__main__":
    main()
