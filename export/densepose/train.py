"""Trains the network on rendered people.

    python -m export.densepose.train --out .data/runs/b --minutes 120

One loop for CPU, one GPU, and several processes: `torchrun --nproc-per-node N -m export.densepose.train …`
for N GPUs. On a CPU one process a core with `--batch 8` is about four times as fast as one process with all
cores. It resumes from `--out` by itself, saves every few minutes and on Ctrl-C, and draws the curves to
`curves.png`.
"""

from __future__ import annotations

import argparse
import copy
import json
import math
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import torch
from torch import nn
from torchvision.ops import box_iou
from tqdm import tqdm

from export.densepose import data
from export.densepose.config import DecodeConfig, NetworkConfig
from export.densepose.decode import Graphs, infer
from export.densepose.losses import PixelHead, batch_loss, surface_loss
from export.densepose.network import MobileParsingRCNN
from export.shards import Record, load_records


@dataclass(frozen=True)
class Stage:
    """From `start` (share of the run) on: square cuts of `size` pixels; `surface_only`: PixelHead's terms alone."""

    start: float
    size: int
    framing: data.Framing = data.ANY_FRAMING
    surface_only: bool = False


# The trunk learns the surface first, on every pixel of small cuts, at almost three times the rate of the whole network.
CLOSE = data.Framing(towards_person=0.95, share=(0.6, 1.3))
STAGES = (Stage(0.0, 128, CLOSE, surface_only=True), Stage(0.08, 192), Stage(0.55, 256))
FROZEN_BACKBONE_RATE = 0.1  # of the learning rate


class Ema:
    """Exponential mean of weights and BN statistics; what is evaluated and shipped."""

    def __init__(self, net: nn.Module, decay: float) -> None:
        self.net, self.decay = copy.deepcopy(net).eval().requires_grad_(False), decay

    @torch.no_grad()
    def update(self, net: nn.Module, step: int) -> None:
        decay = min(self.decay, (1 + step) / (10 + step))
        for mean, now in zip(self.net.state_dict().values(), net.state_dict().values(), strict=True):
            if mean.dtype.is_floating_point:
                mean.lerp_(now, 1 - decay)
            else:
                mean.copy_(now)


@torch.no_grad()
def validate(net: MobileParsingRCNN, records: list[Record]) -> dict[str, float]:
    """Quick figures on validation images: box recall and precision at IoU 0.5, part accuracy, mask IoU."""
    device = next(net.parameters()).device
    net = copy.deepcopy(net).cpu().eval() if device.type != "cpu" else net.eval()
    people = found = boxes = pixels = right = both = either = 0
    for record in records:
        image, label = record.decoded()
        result = infer(
            Graphs.of_network(net),
            np.ascontiguousarray(image[..., ::-1]),
            net.config,
            DecodeConfig(score_threshold=0.3, max_people=6),
        )
        truth = data.truth_of(label)
        wanted = truth.box[~truth.ignore]
        people += len(wanted)
        boxes += len(result.boxes)
        if len(wanted) and len(result.boxes):
            found += int((box_iou(wanted, torch.from_numpy(result.boxes)).max(1).values > 0.5).sum())
        body, seen = label[..., 0] > 0, result.iuv[..., 0] > 0
        pixels += body.sum()
        right += (body & (result.iuv[..., 0] == label[..., 0])).sum()
        both += (body & seen).sum()
        either += (body | seen).sum()
    return {
        "recall": found / max(people, 1),
        "precision": found / max(boxes, 1),
        "part": float(right / max(pixels, 1)),
        "mask_iou": float(both / max(either, 1)),
    }


@torch.no_grad()
def validate_surface(net: MobileParsingRCNN, pixel_head: PixelHead, records: list[Record]) -> dict[str, float]:
    """Part accuracy and mask IoU of PixelHead, on cuts drawn as in training (the same at each call)."""
    device = next(net.parameters()).device
    rng, stage = np.random.default_rng(0), STAGES[0]
    right = body = both = either = 0
    for record in records:
        image, label = data.augmented(record, stage.size, rng, stage.framing)
        tensor = torch.from_numpy(data.normalised(image))[None].to(device)
        found = pixel_head.index(net.detector(tensor)[0][0])[0].argmax(0).cpu().numpy()
        part = PixelHead.cells(label[None])[0, ..., 0]
        right += (found == part)[part > 0].sum()
        body += (part > 0).sum()
        both += ((part > 0) & (found > 0)).sum()
        either += ((part > 0) | (found > 0)).sum()
    return {"pixel_part": float(right / max(body, 1)), "pixel_mask_iou": float(both / max(either, 1))}


def average_gradients(parameters: list[nn.Parameter], spent: float, stopped: bool, world: int) -> tuple[float, bool]:
    """Means of the gradients over the processes, and one common clock and stop flag, in a single exchange.

    What all processes must decide alike (when to stop) may only depend on what is returned here.
    """
    gradients = [torch.zeros_like(p) if p.grad is None else p.grad for p in parameters]
    flat = torch.cat([*(g.flatten() for g in gradients), gradients[0].new_tensor([spent, float(stopped)])])
    torch.distributed.all_reduce(flat)
    flat /= world
    at = 0
    for parameter, gradient in zip(parameters, gradients, strict=True):
        # In the gradient's own memory: the fused optimiser takes for granted that it is laid out as the parameter.
        parameter.grad = gradient.copy_(flat[at : at + gradient.numel()].view_as(gradient))
        at += gradient.numel()
    return float(flat[-2]), bool(flat[-1] > 0)


def optimiser_of(net: MobileParsingRCNN, pixel_head: PixelHead, rate: float, weight_decay: float) -> torch.optim.AdamW:
    """Each of its groups has a "rate": its share of the learning rate."""
    # Without BN to undo it, a full rate would wipe out what a pretrained backbone knows.
    backbone_rate = FROZEN_BACKBONE_RATE if getattr(net.backbone, "frozen", False) else 1.0
    others = nn.ModuleList([m for m in net.children() if m is not net.backbone] + [pixel_head])
    groups = [
        {
            "params": [p for p in part.parameters() if p.requires_grad and (p.dim() > 1) == decayed],
            "weight_decay": weight_decay if decayed else 0.0,
            "rate": share,
        }
        for part, share in ((net.backbone, backbone_rate), (others, 1.0))
        for decayed in (True, False)
    ]
    return torch.optim.AdamW(groups, lr=rate, fused=True)


def rate_at(step: int, share: float, rate: float) -> float:
    """Learning rate after `step` steps and that share of the run: a short rise, then a cosine down to a fiftieth."""
    return rate * min(1.0, (step + 1) / 200) * (0.02 + 0.98 * 0.5 * (1 + math.cos(math.pi * min(share, 1))))


_BF16_PROBE = """
import time, torch
torch.set_num_threads(1)
def seconds(kind):
    x, w = torch.ones(4, 64, 32, 32, dtype=kind), torch.ones(64, 64, 3, 3, dtype=kind)
    x @ x
    times = []
    for _ in range(9):
        start = time.perf_counter()
        torch.conv2d(x, w)
        times.append(time.perf_counter() - start)
    return sorted(times)[4]
raise SystemExit(seconds(torch.float32) < 2 * seconds(torch.bfloat16))
"""


def bf16_pays() -> bool:
    """Whether this processor convolves twice as fast in bfloat16 (it does with AMX, not with AVX-512 alone).

    Asked in a process of its own, since oneDNN dies of an illegal instruction where a virtual machine announces AMX
    but not its tiles; `scripts/with-amx.sh` helps there.
    """
    return subprocess.run([sys.executable, "-c", _BF16_PROBE], capture_output=True).returncode == 0


def start_from(net: nn.Module, weights: dict[str, torch.Tensor], name: Path) -> None:
    """Takes over what fits; says which modules keep their random weights because of another shape or name."""
    own = net.state_dict()
    fitting = {k: v for k, v in weights.items() if k in own and own[k].shape == v.shape}
    net.load_state_dict(fitting, strict=False)
    fresh = sorted({".".join(k.split(".")[:2]) for k in own.keys() - fitting.keys()})
    if fresh:
        print(f"not in {name}, so untrained: {', '.join(fresh)}")


def draw_curves(log: list[dict], path: Path) -> None:
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 4.5))
    steps = [row for row in log if "loss" in row]
    for name in steps[-1]["terms"] if steps else ():
        rows = [r for r in steps if name in r["terms"]]
        left.plot([r["step"] for r in rows], [r["terms"][name] for r in rows], label=name, lw=1)
    left.plot([r["step"] for r in steps], [r["loss"] for r in steps], "k", label="sum", lw=1.5)
    left.set(xlabel="step", ylabel="weighted loss", yscale="log")
    for name in ("recall", "precision", "part", "mask_iou", "pixel_part", "pixel_mask_iou"):
        checks = [row for row in log if name in row]
        right.plot([r["images"] for r in checks], [r[name] for r in checks], "o-", ms=3, label=name)
    right.set(xlabel="images seen", ylabel="validation", ylim=(0, 1))
    for axis in (left, right):
        axis.grid(alpha=0.3)
        axis.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    plt.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(".data/people"))
    parser.add_argument("--photos", type=Path, help="also shards of labelled photographs (export.teachers.shards)")
    parser.add_argument("--photo-share", type=float, default=0.3, help="of the images, where there are --photos")
    parser.add_argument("--out", type=Path, default=Path(".data/runs/b"))
    parser.add_argument("--width", type=int, default=64, help="channels of neck and heads: 64 (variant B), 88, 112")
    parser.add_argument("--minutes", type=float, default=120, help="length of the whole schedule, resumes counted in")
    parser.add_argument("--steps", type=int, help="length of the schedule in steps instead of minutes")
    parser.add_argument("--batch", type=int, default=16, help="images a step and process")
    parser.add_argument("--lr", type=float, default=2e-3)
    parser.add_argument("--weight-decay", type=float, default=0.02)
    parser.add_argument("--ema", type=float, default=0.997)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, help="a process; default: the cores shared out")
    parser.add_argument(
        "--init", type=Path, help="start from these weights: weights.pt or checkpoint.pt of another run"
    )
    parser.add_argument("--backbone", choices=NetworkConfig.BACKBONES, default=NetworkConfig.backbone)
    parser.add_argument(
        "--pretrained", type=Path, help="weights of the backbone (export.teachers.backbone); BN, first blocks freeze"
    )
    parser.add_argument("--validate-minutes", type=float, default=10)
    parser.add_argument("--bf16", action=argparse.BooleanOptionalAction, help="default: where it is faster")
    options = parser.parse_args()
    if options.bf16 is None:
        options.bf16 = torch.cuda.is_available() or bf16_pays()
    if options.pretrained and options.backbone != "mobilenet_v2":
        parser.error("--pretrained is for --backbone mobilenet_v2")

    rank, world = int(os.environ.get("RANK", 0)), int(os.environ.get("WORLD_SIZE", 1))
    device = (
        torch.device("cuda", int(os.environ.get("LOCAL_RANK", 0))) if torch.cuda.is_available() else torch.device("cpu")
    )
    if world > 1:
        torch.distributed.init_process_group("nccl" if device.type == "cuda" else "gloo")
    if world > 1 and device.type == "cpu" and hasattr(os, "sched_setaffinity"):
        # Left to the scheduler, two processes spend a fifth of their time on one core.
        local, beside = int(os.environ["LOCAL_RANK"]), int(os.environ["LOCAL_WORLD_SIZE"])
        cores = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, cores[local % len(cores) :: beside])
    torch.set_num_threads(options.threads or max(1, (os.cpu_count() or 1) // world))
    torch.manual_seed(options.seed)  # every process starts from the same weights
    options.out.mkdir(parents=True, exist_ok=True)

    checkpoint = options.out / "checkpoint.pt"
    saved, frozen = None, options.pretrained is not None
    if checkpoint.exists() or options.init:
        saved = torch.load(checkpoint if checkpoint.exists() else options.init, map_location=device, weights_only=False)
        # Another backbone's weights are not taken over, so there is nothing in it to keep.
        frozen |= saved.get("frozen", False) and options.backbone == "mobilenet_v2"
    net = MobileParsingRCNN(NetworkConfig(width=options.width, backbone=options.backbone))
    net = net.to(device, memory_format=torch.channels_last)
    pixel_head = PixelHead(net.config).to(device)
    if frozen:
        net.backbone.freeze()
    trained = nn.ModuleList([net, pixel_head])
    ema = Ema(trained, options.ema)
    averaged, averaged_pixel_head = ema.net
    optimiser = optimiser_of(net, pixel_head, options.lr, options.weight_decay)
    step, images, spent, log = 0, 0, 0.0, []
    if checkpoint.exists():
        net.load_state_dict(saved["net"])
        pixel_head.load_state_dict(saved["pixel_head"])
        averaged.load_state_dict(saved["ema"])
        averaged_pixel_head.load_state_dict(saved["pixel_ema"])
        optimiser.load_state_dict(saved["optimiser"])
        step, images, spent, log = saved["step"], saved["images"], saved["spent"], saved["log"]
        print(f"resumed at step {step}, {spent / 60:.1f} of {options.minutes:g} minutes")
    else:
        if options.init:
            start_from(net, saved["ema"], options.init)
            if "pixel_ema" in saved:
                pixel_head.load_state_dict(saved["pixel_ema"])
        if options.pretrained:
            net.backbone.load_state_dict(torch.load(options.pretrained, map_location=device))
        ema.net.load_state_dict(trained.state_dict())

    def save() -> None:
        if rank == 0:
            state = {
                "net": net.state_dict(),
                "pixel_head": pixel_head.state_dict(),
                "ema": averaged.state_dict(),
                "pixel_ema": averaged_pixel_head.state_dict(),
                "optimiser": optimiser.state_dict(),
                "step": step,
                "images": images,
                "spent": spent,
                "log": log,
                "width": options.width,
                "backbone": options.backbone,
                "frozen": frozen,
            }
            torch.save(state, checkpoint.with_suffix(".tmp"))
            checkpoint.with_suffix(".tmp").rename(checkpoint)
            # What is shipped, and what another run may start from: the averaged weights, in half precision.
            half = {k: v.half() if v.is_floating_point() else v for k, v in averaged.state_dict().items()}
            kept = {name: state[name] for name in ("width", "backbone", "frozen")}
            torch.save({"ema": half, **kept}, options.out / "weights.pt")
            (options.out / "log.json").write_text(json.dumps(log))
            draw_curves(log, options.out / "curves.png")

    def checked() -> dict[str, float]:
        figures = validate_surface(averaged, averaged_pixel_head, held_out)
        return figures if stage.surface_only else figures | validate(averaged, held_out)

    stopped = False

    def stop(*_: object) -> None:
        nonlocal stopped
        stopped = True

    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGINT, stop)
    train = load_records(options.data / "train")[rank::world]
    held_out = load_records(options.data / "val", 100)
    photos = load_records(options.photos)[rank::world] if options.photos else []
    # On the one core of this process a second thread would only take turns with it, a fifth slower than one alone.
    ahead = 0 if device.type == "cpu" and torch.get_num_threads() == 1 else 4
    batches = data.Batches(train, options.batch, options.seed * 1000 + rank, step, photos, options.photo_share, ahead)
    autocast = torch.autocast(device.type, torch.bfloat16, enabled=options.bf16)
    net.train()
    smooth: dict[str, float] = {}
    length = options.minutes * 60
    stage = STAGES[-1]  # of a run that is already finished
    clock = saved_at = checked_at = time.monotonic()
    bar = tqdm(total=round(length), initial=round(spent), unit="s", disable=rank > 0, smoothing=0)
    finished = step >= options.steps if options.steps else spent >= length
    while not finished:
        torch.manual_seed(((options.seed * 1000 + rank) << 32) + step)  # as in a run that never stopped
        share = step / options.steps if options.steps else spent / length
        stage = [s for s in STAGES if share >= s.start][-1]
        rate = rate_at(step, share, options.lr)
        for group in optimiser.param_groups:
            group["lr"] = rate * group["rate"]
        image, truths = batches.next(stage.size, stage.framing)
        image = image.to(device).contiguous(memory_format=torch.channels_last)
        truths = [truth.to(device) for truth in truths]
        terms = (
            surface_loss(net, image, truths, autocast, pixel_head)
            if stage.surface_only
            else batch_loss(net, image, truths, autocast, pixel_head)
        )
        loss = sum(terms.values())
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        stop_now = stopped
        if world > 1:
            # What a stage leaves alone must keep no gradient, else weight decay would wear it down.
            used = nn.ModuleList([net.backbone, net.neck, pixel_head]) if stage.surface_only else trained
            used = [p for p in used.parameters() if p.requires_grad]
            spent, stop_now = average_gradients(used, spent, stopped, world)
        finished = stop_now or (step + 1 >= options.steps if options.steps else spent >= length)
        norm = nn.utils.clip_grad_norm_(trained.parameters(), 10.0)
        if torch.isfinite(norm):
            optimiser.step()
            ema.update(trained, step)
        step, images = step + 1, images + len(image) * world
        smooth = {name: value for name, value in smooth.items() if name in terms}
        for name, value in terms.items():
            smooth[name] = 0.95 * smooth.get(name, value.item()) + 0.05 * value.item()
        now = time.monotonic()
        bar.update(round(spent + now - clock) - bar.n)
        spent, clock = spent + now - clock, now
        if step % 20 == 0:
            log.append(
                {
                    "step": step,
                    "images": images,
                    "loss": sum(smooth.values()),
                    "terms": dict(smooth),
                    "rate": rate,
                    "size": stage.size,
                }
            )
            bar.set_postfix(step=step, images=images, loss=f"{log[-1]['loss']:.3f}", size=stage.size)
        if rank == 0 and now - checked_at > options.validate_minutes * 60:
            log.append({"step": step, "images": images, "spent": spent, **checked()})
            tqdm.write(json.dumps(log[-1]))
            checked_at = clock = time.monotonic()
        if now - saved_at > 180:
            save()
            saved_at = time.monotonic()
    bar.close()
    batches.close()
    if rank == 0:
        log.append({"step": step, "images": images, "spent": spent, **checked()})
        print(json.dumps(log[-1]))
    save()


if __name__ == "__main__":
    main()
