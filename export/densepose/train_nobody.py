"""Teaches neck and box head what is no person, animals above all, and keeps what the network says of people.

    python -m export.densepose.train_nobody --out .data/runs/nobody --kind .3 photos .data/photos/train \
        --kind .2 shards .data/people-usual/train --kind .1 background .data/backgrounds/train \
        --kind .4 background .data/photos/train-animals

What tells an animal from a person is in the backbone, which began as a detector of 80 kinds of things, and hardly
in what the neck passes on. So the neck learns too, and the backbone stays: its maps of each of `--views` augmented
pictures are kept in half precision, and a step costs the neck and the boxes alone. Of pictures that may show people,
maps, scores and boxes are to stay as they are at the start (distillation): labels of people are not needed, and the
surface stays the same but for what the maps differ by. Of pictures without people, every box is nobody.
"""

from __future__ import annotations

import argparse
import copy
import json
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F
from tqdm import trange

from export.densepose import targets as tg
from export.densepose.config import NetworkConfig
from export.densepose.network import MobileParsingRCNN
from export.densepose.train_boxes import Picture, add_picture_arguments, drawn_views, proposed_boxes, read_kinds

KEPT, NOBODY = 3, 3  # views in a step
MAPS_WEIGHTS, BOXES_WEIGHT = (15.0, 2.0, 2.0, 2.0, 2.0), 0.2  # P2, of which the surface is read, to P6
LIKELY = 0.05  # a box of a picture without people that is at least that likely a person is always learnt from


@dataclass(frozen=True)
class View:
    """taps: the backbone's maps, float16. boxes: float32 [R, 4], the RPN's proposals and where the first pass of the
    box head moves them. likely: float32 [R], how likely each shows a person at the start. keeps: whether people may be
    in it."""

    taps: list[Tensor]
    boxes: Tensor
    likely: Tensor
    keeps: bool


@torch.no_grad()
def view(net: MobileParsingRCNN, image: Tensor, keeps: bool) -> View:
    """image: normalised [1, 3, h, w]."""
    config, size = net.config, tuple(image.shape[-2:])
    taps = net.backbone(image)
    features = net.neck(taps)
    boxes = proposed_boxes(net, features, *net.rpn(features), size)
    boxes = boxes[((boxes[:, 2:] - boxes[:, :2]) > 4).all(1)]
    likely = net.box_head(tg.pooled(features, [boxes], config, config.box_pool))[0].softmax(1)[:, 0]
    return View([tap.half() for tap in taps], boxes, likely, keeps)


def views(net: MobileParsingRCNN, kinds: list[tuple[list[Picture], float]], count: int, seed: int) -> list[View]:
    """Of `count` augmented pictures. kinds: pictures and how often they are drawn (fractions of 1)."""
    return [
        view(net, image, keeps=len(picture.box) > 0 or not picture.complete)
        for picture, image, _ in drawn_views(kinds, count, seed)
    ]


def step_loss(net: MobileParsingRCNN, before: MobileParsingRCNN, of: View) -> dict[str, Tensor]:
    """Terms of one view, by name. before: the network at the start."""
    config, taps = net.config, [tap.float() for tap in of.taps]
    features = net.neck(taps)
    terms = {}
    if of.keeps:
        with torch.no_grad():
            kept = before.neck(taps)
        changes = [F.mse_loss(f, k) / k.var() for f, k in zip(features, kept, strict=True)]
        terms["maps"] = sum(weight * change for weight, change in zip(MAPS_WEIGHTS, changes, strict=True)) / len(kept)
    if not len(of.boxes):
        return terms
    logits, deltas = net.box_head(tg.pooled(features, [of.boxes], config, config.box_pool))
    if of.keeps:
        with torch.no_grad():
            said, moved = before.box_head(tg.pooled(kept, [of.boxes], config, config.box_pool))
        terms["kept"] = F.cross_entropy(logits, said.softmax(1)) - F.cross_entropy(said, said.softmax(1))
        person = of.likely > 0.5
        if person.any():
            terms["boxes"] = F.l1_loss(deltas[person], moved[person])
    else:
        # Most boxes show nobody anyway: those that do not say so yet count as much as all the others.
        weight = torch.where(of.likely >= LIKELY, 1.0, 0.1)
        each = F.cross_entropy(logits, torch.ones(len(logits), dtype=torch.long), reduction="none")
        terms["nobody"] = (each * weight).sum() / weight.sum()
    return terms


def fit(net: MobileParsingRCNN, seen: list[View], steps: int, rate: float, seed: int) -> MobileParsingRCNN:
    """The network after `steps` steps at a falling rate, neck and box head as the mean of their weights over the last
    ones. `net` itself is left alone."""
    rng = np.random.default_rng(seed)
    before = copy.deepcopy(net).eval().requires_grad_(False)
    net = copy.deepcopy(before)
    learning = nn.ModuleList([net.neck, net.box_head]).requires_grad_(True)
    averaged = copy.deepcopy(learning).requires_grad_(False)
    optimiser = torch.optim.AdamW(learning.parameters(), lr=rate, weight_decay=0.0)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    kept, nobody = [v for v in seen if v.keeps], [v for v in seen if not v.keeps]
    # The likelier a view shows somebody to the network, the oftener it is drawn.
    mistaken = np.array([float(v.likely.max()) if len(v.likely) else 0.0 for v in nobody]) + 0.05
    bar, means = trange(steps, unit="step", disable=None), {}
    for step in bar:
        drawn = [kept[k] for k in rng.integers(len(kept), size=KEPT)]
        drawn += [nobody[k] for k in rng.choice(len(nobody), size=NOBODY, p=mistaken / mistaken.sum())]
        optimiser.zero_grad()
        for of in drawn:
            terms = step_loss(net, before, of)
            if terms:
                sum(BOXES_WEIGHT * term if name == "boxes" else term for name, term in terms.items()).backward()
            means |= {name: 0.98 * means.get(name, term.item()) + 0.02 * term.item() for name, term in terms.items()}
        nn.utils.clip_grad_norm_(learning.parameters(), 10.0)
        optimiser.step()
        schedule.step()
        keep = min(0.99, (step + 1) / (step + 10))
        with torch.no_grad():
            for mean, value in zip(averaged.parameters(), learning.parameters(), strict=True):
                mean.lerp_(value, 1 - keep)
        bar.set_postfix({k: f"{v:.3f}" for k, v in means.items()}, refresh=False)
        if (step + 1) % 50 == 0:
            bar.write(json.dumps({"step": step + 1, **{k: round(v, 4) for k, v in means.items()}}))
    learning.load_state_dict(averaged.state_dict())
    return net


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_picture_arguments(parser)
    parser.add_argument("--views", type=int, default=1200)
    parser.add_argument("--steps", type=int, default=400)
    parser.add_argument("--lr", type=float, default=5e-4)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path(".data/runs/nobody"))
    options = parser.parse_args()
    saved = torch.load(options.init, weights_only=False)
    net = MobileParsingRCNN(NetworkConfig.of(saved))
    net.load_state_dict(saved["ema"])
    net.float().eval()
    try:
        kinds = read_kinds(options)
    except (OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    seen = views(net, kinds, options.views, options.seed)
    print(f"{sum(v.keeps for v in seen)} views that may show people, {sum(not v.keeps for v in seen)} without")
    trained = fit(net, seen, options.steps, options.lr, options.seed)
    learnt = {name: value.half() for name, value in trained.state_dict().items() if value.is_floating_point()}
    learnt = {name: value for name, value in learnt.items() if name.startswith(("neck.", "box_head."))}
    options.out.mkdir(parents=True, exist_ok=True)
    torch.save({**saved, "ema": saved["ema"] | learnt}, options.out / "weights.pt")
    return 0


if __name__ == "__main__":
    sys.exit(main())
