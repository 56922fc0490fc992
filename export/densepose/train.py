"""Trains the network on rendered people.

    python -m export.densepose.train --out .data/runs/b --minutes 120

One loop for CPU, one GPU, and several processes: `torchrun --nproc-per-node N -m export.densepose.train …`
for N GPUs. On a CPU one process a core with `--batch 8` is about four times as fast as one process with all
cores. It resumes from `--out` by itself, saves every few minutes and on Ctrl-C, and draws the curves to
`curves.png`.

`--recipe both` trains on whole images and on person crops: each step has `--batch` images and `--crops` crops of
one person, upright and at one size, as a second pass over each person sees them. With `--decay` the rate stands until
the last part of the run; the state before it is kept in `steady.pt`, and the same command with more `--minutes` or
`--steps` goes on from there.
"""

from __future__ import annotations

import argparse
import json
import os
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import nn
from tqdm import tqdm

from export import keypoints as person_keypoints
from export.densepose import data
from export.densepose.config import NetworkConfig
from export.densepose.losses import PixelHead, batch_loss, crop_loss, surface_loss
from export.densepose.network import MobileParsingRCNN
from export.densepose.validation import validate, validate_crops, validate_surface
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
    steady_rate_at,
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
    backbone_rate: float = 0.1
    pretrained: Path | None = None
    recipe: str = "scratch"
    crops: int = 12
    crop_size: int = 192
    boxes_every: int = 1
    decay: float | None = None
    save_minutes: float = SAVE_EVERY_S / 60
    validate_minutes: float = 10
    bf16: bool = False


@dataclass(frozen=True)
class Stage:
    """From `start` (fraction of the run) on: square crops of images, each batch at one of `sizes` pixels (none: no
    images). `surface_only`: PixelHead's terms alone; `crops`: also person crops."""

    start: float
    sizes: tuple[int, ...]
    cropping: data.Cropping = data.ANY_CROPPING
    surface_only: bool = False
    crops: bool = False


# From scratch the trunk learns the surface first, on every pixel of small crops: almost three times as fast as the
# whole network. The others go on from weights (`--init`).
RECIPES = {
    "scratch": (
        Stage(0.0, (128,), data.CLOSE_CROPPING, surface_only=True), Stage(0.08, (192,)), Stage(0.55, (256,)),
    ),
    "crops": (Stage(0.0, (), crops=True),),
    "both": (Stage(0.0, (320, 384, 448), data.WIDE_CROPPING, crops=True),),
    "usual": (Stage(0.0, (288, 320, 384), data.USUAL_CROPPING, crops=True),),
}  # fmt: skip
HELD_OUT_IMAGES = 100
CROP_SEED = 500_000  # apart from the images' seed
SURFACE_SIZE = 128  # of the crops that PixelHead is validated on
MAX_GRADIENT_NORM = 10.0
FIGURES = (
    "recall", "precision", "part", "mask_iou", "pixel_part", "pixel_mask_iou",
    "crop_part", "crop_mask_iou", "crop_side",
)  # fmt: skip


def optimiser_of(
    net: MobileParsingRCNN, pixel_head: PixelHead, rate: float, weight_decay: float, backbone_rate: float = 0.1
) -> torch.optim.AdamW:
    """Each of its groups has a "rate": a factor of the learning rate, `backbone_rate` for a frozen backbone."""
    # Without BN to undo it, a full rate would wipe out what a pretrained backbone knows.
    backbone_rate = backbone_rate if getattr(net.backbone, "frozen", False) else 1.0
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
        self.config, self.checkpoint, self.steady = config, config.out / "checkpoint.pt", config.out / "steady.pt"
        config.out.mkdir(parents=True, exist_ok=True)
        resumes = self.checkpoint.exists()
        saved, self.frozen = {}, config.pretrained is not None
        if resumes or config.init:
            saved = torch.load(self.checkpoint if resumes else config.init, map_location=device, weights_only=False)
            if resumes and self.steady.exists() and not self.decays(saved["step"], saved["spent"]):
                saved = torch.load(self.steady, map_location=device, weights_only=False)
            # Another backbone's weights are not taken over, so there is nothing in it to keep.
            self.frozen |= saved.get("frozen", False) and config.backbone == "mobilenet_v2"
        axis = config.recipe != "scratch" or saved.get("axis", False)
        keypoints = person_keypoints.COUNT if config.recipe == "usual" else saved.get("keypoints", 0)
        net = MobileParsingRCNN(
            NetworkConfig(width=config.width, backbone=config.backbone, axis=axis, keypoints=keypoints)
        )
        self.net = net.to(device, memory_format=torch.channels_last)
        self.pixel_head = PixelHead(net.config).to(device)
        if self.frozen:
            net.backbone.freeze()
        self.trained = nn.ModuleList([self.net, self.pixel_head])
        self.ema = Ema(self.trained, config.ema)
        self.averaged, self.averaged_pixel_head = self.ema.net
        self.optimiser = optimiser_of(self.net, self.pixel_head, config.lr, config.weight_decay, config.backbone_rate)
        self.step, self.images, self.spent_s, self.log = 0, 0, 0.0, []
        if resumes:
            self._resume(saved)
        else:
            self._start(saved, device)

    def decays(self, step: int, spent_s: float) -> bool:
        """Whether the rate falls by then."""
        done = Schedule(self.config.minutes, self.config.steps).fraction(step, spent_s)
        return self.config.decay is not None and done > 1 - self.config.decay

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
        """Objects with a state, by name in the checkpoint."""
        return {
            "net": self.net,
            "pixel_head": self.pixel_head,
            "ema": self.averaged,
            "pixel_ema": self.averaged_pixel_head,
            "optimiser": self.optimiser,
        }

    def parameters_of(self, stage: Stage, boxes: bool) -> list[nn.Parameter]:
        """Parameters that a step of the stage trains. Other parameters must have no gradient, or weight decay would
        change them."""
        if stage.surface_only:
            used = nn.ModuleList([self.net.backbone, self.net.neck, self.pixel_head]).parameters()
            left_out = set()
        else:
            used = self.trained.parameters()
            left_out = set() if boxes and stage.sizes else set(self.net.box_parameters())
        return [p for p in used if p.requires_grad and p not in left_out]

    def save(self, keep: bool = False) -> None:
        """keep: also as the state before the rate falls."""
        state = {name: part.state_dict() for name, part in self._parts().items()}
        progress = {"step": self.step, "images": self.images, "spent": self.spent_s, "log": self.log}
        network = self.net.config
        kind = {"width": network.width, "backbone": network.backbone, "axis": network.axis, "frozen": self.frozen}
        kind["keypoints"] = network.keypoints
        for path in (self.checkpoint, self.steady) if keep else (self.checkpoint,):
            save_atomically({**state, **progress, **kind}, path)
        # The averaged weights in half precision are shipped, and another run may start from them.
        half = {k: v.half() if v.is_floating_point() else v for k, v in state["ema"].items()}
        torch.save({"ema": half, **kind}, self.config.out / "weights.pt")
        write_log(self.log, self.config.out, FIGURES, against="images", label="validation")

    def check(self, held_out: list[Record], stage: Stage) -> None:
        """Adds metrics on validation images to the log; boxes only where the stage has trained them."""
        cropping = data.CLOSE_CROPPING
        figures = validate_surface(self.averaged, self.averaged_pixel_head, held_out, SURFACE_SIZE, cropping)
        if stage.sizes and not stage.surface_only:
            figures |= validate(self.averaged, held_out)
        if stage.crops:
            figures |= validate_crops(self.averaged, held_out, self.config.crop_size)
        self.log.append({"step": self.step, "images": self.images, "spent": self.spent_s, **figures})
        tqdm.write(json.dumps(self.log[-1]))


def on_device(batch: tuple[torch.Tensor, list], device: torch.device) -> tuple[torch.Tensor, list]:
    image, truths = batch
    image = image.to(device).contiguous(memory_format=torch.channels_last)
    return image, [truth.to(device) for truth in truths]


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
    workers = max(1, (os.cpu_count() or 1) // world - 1) if device.type == "cuda" else 1
    drawn = {"first": run.step, "photos": photos, "photo_fraction": config.photo_fraction}
    drawn |= {"ahead": ahead * workers, "workers": workers}
    batches = data.Batches(records, config.batch, own_seed, **drawn)
    crops = data.Batches(records, config.crops, own_seed + CROP_SEED, **drawn)
    autocast = torch.autocast(device.type, torch.bfloat16, enabled=config.bf16)
    watch = Stopwatch(run.spent_s)
    save_due, check_due = Interval(config.save_minutes * 60), Interval(config.validate_minutes * 60)
    bar = schedule.bar(run.step, run.spent_s, disable=rank > 0)
    run.net.train()
    stage, finished = None, False
    while not finished:
        seed_step(own_seed, run.step)
        fraction = schedule.fraction(run.step, watch.spent_s)
        before, stage = stage, [s for s in RECIPES[config.recipe] if fraction >= s.start][-1]
        if stage is not before:
            smoothed = SmoothedTerms()
        if config.decay:
            rate = steady_rate_at(run.step, fraction, config.lr, config.decay)
        else:
            rate = rate_at(run.step, fraction, config.lr)
        for group in run.optimiser.param_groups:
            group["lr"] = rate * group["rate"]

        terms, seen, boxes = {}, 0, run.step % config.boxes_every == 0
        if stage.sizes:
            image, truths = on_device(batches.next(stage.sizes, stage.cropping), device)
            if stage.surface_only:
                terms |= surface_loss(run.net, image, truths, autocast, run.pixel_head)
            else:
                terms |= batch_loss(run.net, image, truths, autocast, run.pixel_head, boxes)
            seen += len(image)
        if stage.crops:
            image, truths = on_device(crops.next((config.crop_size,), data.PERSON_CROPPING), device)
            terms |= crop_loss(run.net, image, truths, autocast, run.pixel_head)
            seen += len(image)
        run.optimiser.zero_grad(set_to_none=True)
        sum(terms.values()).backward()
        stop_now = bool(stopped)
        if world > 1:
            used = run.parameters_of(stage, boxes)
            watch.spent_s, stop_now = average_gradients(used, watch.spent_s, stop_now, world)
        finished = stop_now or schedule.finished(run.step + 1, watch.spent_s)
        if torch.isfinite(nn.utils.clip_grad_norm_(run.trained.parameters(), MAX_GRADIENT_NORM)):
            run.optimiser.step()
            run.ema.update(run.trained, run.step)

        decayed = run.decays(run.step, watch.spent_s)
        run.step, run.images = run.step + 1, run.images + seen * world
        smoothed.update(terms)
        watch.lap()
        run.spent_s = watch.spent_s
        schedule.advance(bar, run.step, run.spent_s)
        if run.step % 20 == 0:
            row = {"step": run.step, "images": run.images, "loss": smoothed.loss, "terms": smoothed.values}
            run.log.append({**row, "rate": rate, "sizes": stage.sizes})
            bar.set_postfix(step=run.step, images=run.images, loss=f"{smoothed.loss:.3f}", refresh=False)
        if rank == 0 and check_due.due() and not finished:
            run.check(held_out, stage)
            check_due.restart()
            watch.skip()
        begins_to_decay = run.decays(run.step, watch.spent_s) and not decayed
        if rank == 0 and (save_due.due() or begins_to_decay):
            run.save(keep=begins_to_decay)
            save_due.restart()
            watch.skip()
    bar.close()
    batches.close()
    crops.close()
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
        "--backbone-rate", type=float, default=default.backbone_rate,
        help="learning rate of a pretrained backbone, of the others' (default %(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--pretrained", type=Path, help="weights of the backbone (export.teachers.backbone); BN, first blocks freeze"
    )
    parser.add_argument(
        "--recipe", choices=RECIPES, default=default.recipe,
        help="scratch: surface, then the whole network; crops: person crops alone; both: them and whole "
             "images of 320 to 448 pixels; usual: the same at 288 to 384 pixels, with people as photographs show "
             "them (default %(default)s)",
    )  # fmt: skip
    parser.add_argument("--crops", type=int, default=default.crops, help="person crops a step and process")
    parser.add_argument("--crop-size", type=int, default=default.crop_size, help="their side, pixels")
    parser.add_argument(
        "--boxes-every", type=int, default=default.boxes_every, metavar="N",
        help="RPN, proposals and box head in every Nth step alone (default %(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--decay", type=float, help="one rate, falling in this last fraction of the run (default: a cosine)"
    )
    parser.add_argument("--save-minutes", type=float, default=default.save_minutes)
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
