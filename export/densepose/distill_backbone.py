"""Teaches another backbone what the neck makes of today's, on pictures alone: no label is used.

    python -m export.densepose.distill_backbone --out .data/runs/v3 --backbone mobilenet_v3_large --minutes 90

The new network has the heads of the old one (`--init`); backbone, neck and evidence of people learn to give P2 to P6
and the evidence that the old one gives for the same picture. Each map counts by the fraction of its variance that is
missed, so that the figures are 1 for a constant and 0 for a copy. `weights.pt` has what `export.densepose.train --init`
and the evaluation read.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor, nn

from export.densepose import data
from export.densepose.config import NetworkConfig
from export.densepose.network import MobileParsingRCNN
from export.densepose.train import start_from
from export.shards import load_records
from export.training import (
    Ema,
    Interval,
    Schedule,
    SmoothedTerms,
    StopSignal,
    Stopwatch,
    bf16_pays,
    rate_at,
    save_atomically,
    seed_step,
    write_log,
)

SIZES = (160, 192, 256)  # of a batch's pictures, pixels
MAPS = ("p2", "p3", "p4", "p5", "p6", "evidence")
HELD_OUT_BATCHES = 8
FIGURES = tuple(f"missed_{name}" for name in MAPS)


def read_network(path: Path) -> MobileParsingRCNN:
    """The network of a weights file, in float, for inference."""
    saved = torch.load(path, map_location="cpu", weights_only=False)
    net = MobileParsingRCNN(NetworkConfig.of(saved))
    net.load_state_dict(saved["ema"])
    return net.float().eval().requires_grad_(False)


def maps_of(net: MobileParsingRCNN, image: Tensor) -> dict[str, Tensor]:
    """What the heads see of a normalised picture [N, 3, H, W], by name."""
    features, evidence = net.trunk(image)
    maps = [*features, evidence] if evidence is not None else features
    return dict(zip(MAPS, maps, strict=False))


def missed(maps: dict[str, Tensor], wanted: dict[str, Tensor]) -> dict[str, Tensor]:
    """By map, the mean over channels of the squared difference as a fraction of the variance of what is wanted."""
    fractions = {}
    for name, of in wanted.items():
        error = (maps[name].float() - of).square().mean((0, 2, 3))
        variance = of.var((0, 2, 3), unbiased=False)
        fractions[name] = error.sum() / variance.sum().clamp(min=1e-6)
    return fractions


class Run:
    """One training: networks, optimiser and how far it is; saved to and resumed from a folder."""

    def __init__(self, out: Path, init: Path, backbone: str, start: Path | None, rate: float) -> None:
        out.mkdir(parents=True, exist_ok=True)
        self.out, self.checkpoint = out, out / "checkpoint.pt"
        self.teacher = read_network(init)
        config = replace(self.teacher.config, backbone=backbone)
        self.net = MobileParsingRCNN(config).to(memory_format=torch.channels_last)
        start_from(self.net, self.teacher.state_dict(), init)
        if start:
            self.net.backbone.load_state_dict(read_network(start).backbone.state_dict())
        taught = [self.net.backbone, self.net.neck, *([self.net.evidence] if self.net.evidence else [])]
        self.taught = nn.ModuleList(taught)
        self.ema = Ema(self.net, 0.998)
        self.optimiser = torch.optim.AdamW(self.taught.parameters(), lr=rate, weight_decay=0.02)
        self.step, self.spent_s, self.log = 0, 0.0, []
        if self.checkpoint.exists():
            saved = torch.load(self.checkpoint, weights_only=False)
            self.net.load_state_dict(saved["net"])
            self.ema.net.load_state_dict(saved["ema"])
            self.optimiser.load_state_dict(saved["optimiser"])
            self.step, self.spent_s, self.log = saved["step"], saved["spent"], saved["log"]

    def save(self) -> None:
        config = self.net.config
        kind = {"width": config.width, "backbone": config.backbone, "axis": config.axis, "evidence": config.evidence}
        parts = {"net": self.net.state_dict(), "ema": self.ema.net.state_dict()}
        progress = {"optimiser": self.optimiser.state_dict(), "step": self.step, "spent": self.spent_s, "log": self.log}
        save_atomically({**parts, **progress, **kind}, self.checkpoint)
        half = {k: v.half() if v.is_floating_point() else v for k, v in parts["ema"].items()}
        torch.save({"ema": half, "frozen": False, **kind}, self.out / "weights.pt")
        write_log(self.log, self.out, FIGURES, against="step", label="variance missed on held-out pictures")

    @torch.no_grad()
    def check(self, held_out: list[Tensor]) -> dict[str, float]:
        """Mean fraction missed of each map."""
        sums: dict[str, float] = {}
        for image in held_out:
            for name, value in missed(maps_of(self.ema.net, image), maps_of(self.teacher, image)).items():
                sums[f"missed_{name}"] = sums.get(f"missed_{name}", 0) + value.item() / len(held_out)
        return sums


def distill(options: argparse.Namespace) -> None:
    torch.set_num_threads(options.threads)
    schedule, stopped = Schedule(options.minutes, options.steps), StopSignal()
    torch.manual_seed(options.seed)
    run = Run(options.out, options.init, options.backbone, options.start, options.lr)
    records = [record for folder in options.data for record in load_records(folder / "train")]
    photos = load_records(options.photos) if options.photos else []
    drawn = {"photos": photos, "photo_fraction": options.photo_fraction, "ahead": 0}
    batches = data.Batches(records, options.batch, options.seed, run.step, **drawn)
    validation = data.Batches(load_records(options.data[0] / "val"), options.batch, 1, ahead=0)
    held_out = [validation.next(SIZES[-1:], data.USUAL_CROPPING)[0] for _ in range(HELD_OUT_BATCHES)]
    autocast = torch.autocast("cpu", torch.bfloat16, enabled=options.bf16)
    watch, smoothed, save_due = Stopwatch(run.spent_s), SmoothedTerms(), Interval(options.save_minutes * 60)
    bar = schedule.bar(run.step, run.spent_s)
    run.net.train()
    while not (stopped or schedule.finished(run.step, run.spent_s)):
        seed_step(options.seed, run.step)
        rate = rate_at(run.step, schedule.fraction(run.step, run.spent_s), options.lr)
        for group in run.optimiser.param_groups:
            group["lr"] = rate
        image = batches.next(SIZES, data.USUAL_CROPPING)[0].contiguous(memory_format=torch.channels_last)
        with autocast:
            with torch.no_grad():
                wanted = {name: of.float() for name, of in maps_of(run.teacher, image).items()}
            terms = missed(maps_of(run.net, image), wanted)
        run.optimiser.zero_grad(set_to_none=True)
        sum(terms.values()).backward()
        if torch.isfinite(nn.utils.clip_grad_norm_(run.taught.parameters(), 10.0)):
            run.optimiser.step()
            run.ema.update(run.net, run.step)
        smoothed.update(terms)
        watch.lap()
        run.step, run.spent_s = run.step + 1, watch.spent_s
        schedule.advance(bar, run.step, run.spent_s)
        if run.step % 20 == 0:
            run.log.append({"step": run.step, "loss": smoothed.loss, "terms": smoothed.values, "rate": rate})
            bar.set_postfix(step=run.step, loss=f"{smoothed.loss:.3f}", refresh=False)
        if save_due.due():
            run.log.append({"step": run.step, "spent": run.spent_s, **run.check(held_out)})
            bar.write(json.dumps(run.log[-1]))
            run.save()
            save_due.restart()
            watch.skip()
    bar.close()
    run.log.append({"step": run.step, "spent": run.spent_s, **run.check(held_out)})
    print(json.dumps(run.log[-1]))
    run.save()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--init", type=Path, default=Path("export/weights/densepose-b.pt"), help="the old network")
    parser.add_argument("--backbone", choices=NetworkConfig.BACKBONES, default="mobilenet_v3_large")
    parser.add_argument("--start", type=Path, help="weights whose backbone to start from (default: random)")
    parser.add_argument("--data", type=Path, nargs="+", default=[Path(".data/people")], help="folders of shards")
    parser.add_argument("--photos", type=Path, help="also shards of photographs (export.teachers.shards)")
    parser.add_argument("--photo-fraction", type=float, default=0.5, help="of the pictures, where there are --photos")
    parser.add_argument("--out", type=Path, default=Path(".data/runs/v3"))
    parser.add_argument("--minutes", type=float, default=90)
    parser.add_argument("--steps", type=int, help="length of the schedule in steps instead of minutes")
    parser.add_argument("--batch", type=int, default=16)
    parser.add_argument("--lr", type=float, default=3e-3)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--save-minutes", type=float, default=5)
    parser.add_argument("--bf16", action=argparse.BooleanOptionalAction, help="default: where it is faster")
    options = parser.parse_args()
    if options.bf16 is None:
        options.bf16 = bf16_pays()
    distill(options)


if __name__ == "__main__":
    main()
