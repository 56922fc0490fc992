"""Trains the edge network on rendered solids, seen through models of depth cameras.

    python -m export.solids.dataset train --count 64000 --out .data/solids/train
    python -m export.edges.train --data .data/solids --out .data/runs/edges-s --minutes 120

With a GPU, crops lie in its memory and sensors run on it in batches (`device_batches.py`): with other random numbers,
so that a run is not the same with and without. It resumes from `--out` by itself, saves every few minutes and on
Ctrl-C: checkpoint.pt, weights.pt (for export.edges.export_onnx), log.json, curves.png, and sample.png: what the camera
sees, true field, ours.
"""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import torch
from torch import Tensor, nn
from tqdm import tqdm

from export.edges.config import SIZES, NetworkConfig
from export.edges.data import Batches, RecordError, read_frames
from export.edges.depth_input import folded, slopes
from export.edges.device_batches import DeviceBatches
from export.edges.losses import LOSSES, FieldTarget, LossWeights, field_terms
from export.edges.network import EdgeNetwork
from export.edges.validation import sheet, validate
from export.edges.weights import save_network, start_from
from export.training import (
    SAVE_EVERY_S,
    Ema,
    Interval,
    Schedule,
    SmoothedTerms,
    StopSignal,
    Stopwatch,
    save_atomically,
    seed_step,
    steady_rate_at,
    write_log,
)

FIGURES = ("rmse_r/clean", "rmse_r/stereo", "rmse_r/tof")
MAX_GRADIENT_NORM = 1.0
EMA_DECAY = 0.998
VALIDATION_FRAMES = 150
VALIDATED = ("clean", "stereo", "tof")  # levels


@dataclass(frozen=True)
class TrainingConfig:
    """One training; the options of the command have the same names and say what they mean."""

    data: Path = Path(".data/solids")
    pack: Path | None = None
    out: Path = Path(".data/runs/edges")
    init: Path | None = None
    size: str = "s"
    loss: str = "mixed"
    bins: int = 16
    near: float = 8.0
    minutes: float = 120
    steps: int | None = None
    batch: int = 16
    crop: int = 112
    lr: float = 2e-3
    decay: float = 0.4
    crops: int | None = None
    seed: int = 0
    threads: int | None = None
    precision: str = "float32"
    batched_sensors: bool | None = None
    made_fraction: float = 0.0
    validate_minutes: float = 15
    save_minutes: float = SAVE_EVERY_S / 60

    @property
    def network(self) -> NetworkConfig:
        return replace(SIZES[self.size], bins=self.bins if self.loss == "histogram" else 0)


class Run:
    """One training: network, its mean, optimiser, how far it is; saved to and resumed from a folder."""

    def __init__(self, config: TrainingConfig, device: torch.device) -> None:
        self.config, self.checkpoint = config, config.out / "checkpoint.pt"
        config.out.mkdir(parents=True, exist_ok=True)
        self.network = EdgeNetwork(config.network)
        if config.init and not self.checkpoint.exists():
            start_from(config.init, self.network)
        self.network = self.network.to(device, memory_format=torch.channels_last)
        self.mean = Ema(self.network, EMA_DECAY)
        fused = device.type == "cuda"  # one kernel instead of hundreds
        self.optimiser = torch.optim.AdamW(self.network.parameters(), lr=config.lr, weight_decay=1e-4, fused=fused)
        self.step, self.spent_s, self.log = 0, 0.0, []
        if not self.checkpoint.exists():
            return
        saved = torch.load(self.checkpoint, map_location=device, weights_only=True)
        if (saved["size"], saved["loss"]) != (config.size, config.loss):
            raise SystemExit(
                f"{config.out} holds a run of --size {saved['size']} --loss {saved['loss']}: give another --out."
            )
        self.network.load_state_dict(saved["network"])
        self.mean.net.load_state_dict(saved["mean"])
        self.optimiser.load_state_dict(saved["optimiser"])
        self.step, self.spent_s, self.log = saved["step"], saved["spent"], saved["log"]
        print(f"resumed at step {self.step}, {self.spent_s / 60:.1f} minutes")

    def save(self) -> None:
        parts = {"network": self.network.state_dict(), "mean": self.mean.net.state_dict()}
        parts["optimiser"] = self.optimiser.state_dict()
        about = {"size": self.config.size, "loss": self.config.loss}
        save_atomically({**parts, **about, "step": self.step, "spent": self.spent_s, "log": self.log}, self.checkpoint)
        save_network(self.mean.net, self.config.network, self.config.out / "weights.pt")
        write_log(self.log, self.config.out, FIGURES, against="step", label="validation, r")

    def check(self, frames: list) -> None:
        """Adds metrics on held-out frames, where there are some, to the log and writes sample.png."""
        if not frames:
            return
        metrics = validate(self.mean.net, self.config.network.bins, frames, VALIDATED)
        flat = {f"{name}/{level}": value for level, row in metrics.items() for name, value in row.items()}
        self.log.append({"step": self.step, "spent": self.spent_s, **flat})
        picture = sheet(self.mean.net, self.config.network.bins, frames[:4], VALIDATED)
        cv2.imwrite(str(self.config.out / "sample.png"), picture[..., ::-1])
        tqdm.write(json.dumps({name: round(value, 4) for name, value in self.log[-1].items()}))


def _batches(config: TrainingConfig, device: torch.device) -> Batches:
    on_gpu = device.type == "cuda"
    kind = DeviceBatches if config.batched_sensors or (on_gpu and config.batched_sensors is None) else Batches
    source = config.pack or config.data / "train"
    batches = kind(source, config.crop, config.batch, config.seed, config.crops)
    return batches.moved(device, config.made_fraction) if isinstance(batches, DeviceBatches) else batches


def _drawn(batches: Batches, seed: int, step: int, device: torch.device) -> tuple[Tensor, Tensor, FieldTarget]:
    seed_step(seed, step)
    return batches.draw(step, device)


def train(config: TrainingConfig) -> None:
    """Trains as the head of this file says. Raises SystemExit where crops cannot be read."""
    if config.threads:
        torch.set_num_threads(config.threads)
    torch.manual_seed(config.seed)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    torch.backends.cudnn.benchmark = True  # all batches have one size
    try:
        run = Run(config, device)
        batches = _batches(config, device)
        frames = read_frames(config.data / "val", limit=VALIDATION_FRAMES) if config.validate_minutes else []
    except (RecordError, FileNotFoundError, ValueError) as error:
        raise SystemExit(str(error)) from None
    schedule, stopped = Schedule(config.minutes, config.steps), StopSignal()
    if schedule.finished(run.step, run.spent_s):
        print(f"{config.out} is finished: {run.step} steps.")
        return
    weights, bins, half = LossWeights(near=config.near), config.network.bins, config.precision == "bfloat16"
    smoothed, watch = SmoothedTerms(), Stopwatch(run.spent_s)
    save_due, check_due = Interval(config.save_minutes * 60), Interval(config.validate_minutes * 60 or math.inf)
    bar = schedule.bar(run.step, run.spent_s)
    run.network.train()
    finished, batch = False, _drawn(batches, config.seed, run.step, device)
    while not finished:
        fraction = schedule.fraction(run.step, run.spent_s)
        for group in run.optimiser.param_groups:
            group["lr"] = steady_rate_at(run.step, fraction, config.lr, config.decay)

        depth, focal_px, target = batch
        planes = folded(slopes(depth, focal_px), 2).contiguous(memory_format=torch.channels_last)
        with torch.autocast(device.type, torch.bfloat16, enabled=half):
            output = run.network(planes)
        terms = field_terms(output.float(), target, bins, config.loss, weights)
        run.optimiser.zero_grad(set_to_none=True)
        sum(terms.values()).backward()
        # Before anything waits for the GPU: it makes the next batch while this process prepares what follows.
        batch = _drawn(batches, config.seed, run.step + 1, device)
        if torch.isfinite(nn.utils.clip_grad_norm_(run.network.parameters(), MAX_GRADIENT_NORM)):
            run.optimiser.step()
        run.mean.update(run.network, run.step)

        run.step += 1
        smoothed.update(terms)
        watch.lap()
        run.spent_s = watch.spent_s
        finished = bool(stopped) or schedule.finished(run.step, run.spent_s)
        schedule.advance(bar, run.step, run.spent_s)
        if run.step % 20 == 0 or finished:
            made = {"made_crops": batches.made_crops} if config.made_fraction else {}
            run.log.append({"step": run.step, "loss": smoothed.loss, "terms": smoothed.values, **made})
            bar.set_postfix(step=run.step, loss=f"{smoothed.loss:.4f}", refresh=False)
        if check_due.due() and not finished:
            run.check(frames)
            check_due.restart()
            watch.skip()
        if save_due.due():
            run.save()
            save_due.restart()
            watch.skip()
    bar.close()
    run.check(frames)
    run.save()


def parsed() -> TrainingConfig:
    default = TrainingConfig
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=default.data, help="holds train and val of export.solids.dataset")
    parser.add_argument("--pack", type=Path, help="train on this file of export.solids.compact instead")
    parser.add_argument("--out", type=Path, default=default.out)
    parser.add_argument("--init", type=Path, help="weights.pt of a network as wide or narrower, to start from")
    parser.add_argument("--size", choices=SIZES, default=default.size)
    parser.add_argument("--loss", choices=LOSSES, default=default.loss)
    parser.add_argument("--bins", type=int, default=default.bins, help="of the histogram loss")
    parser.add_argument("--near", type=float, default=default.near, help="pixels by edges count so many times more")
    parser.add_argument("--minutes", type=float, default=default.minutes, help="of the whole schedule, over resumes")
    parser.add_argument("--steps", type=int, help="length of the schedule in steps instead of minutes")
    parser.add_argument("--batch", type=int, default=default.batch, help="crops a step")
    parser.add_argument("--crop", type=int, default=default.crop, help="side of what is cut out of a crop, pixels")
    parser.add_argument("--lr", type=float, default=default.lr)
    parser.add_argument("--decay", type=float, default=default.decay, help="last share of the run with falling rate")
    parser.add_argument("--crops", type=int, help="use only so many crops: error against amount of data")
    parser.add_argument("--seed", type=int, default=default.seed)
    parser.add_argument("--threads", type=int, help="default: one a core")
    parser.add_argument("--precision", choices=("float32", "bfloat16"), default=default.precision)
    parser.add_argument(
        "--batched-sensors", action=argparse.BooleanOptionalAction, help="sensors in torch; default: with a GPU"
    )
    parser.add_argument(
        "--made-fraction", type=float, default=default.made_fraction,
        help="of a batch, with sensors in torch: crops of scenes that are made meanwhile (export.solids.ray_scenes)",
    )  # fmt: skip
    parser.add_argument(
        "--validate-minutes", type=float, default=default.validate_minutes, help="0: never, and no val is needed"
    )
    parser.add_argument("--save-minutes", type=float, default=default.save_minutes)
    return TrainingConfig(**vars(parser.parse_args()))


def main() -> None:
    train(parsed())


if __name__ == "__main__":
    main()
