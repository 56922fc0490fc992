"""Trains what tells people from animals: the evidence of people (`PersonEvidence`), and nothing else.

    python -m export.densepose.train_evidence --out .data/runs/evidence --kind .35 photos .data/photos/train \\
        --kind .2 shards .data/people-usual/train --kind .1 background .data/backgrounds/train \\
        --kind .35 background .data/photos/train-animals

It reads the backbone's maps, which stay as they are, as do boxes and surface: the only thing that changes is the score
of a box. So it comes last, after every training that changes the backbone. The maps and boxes of each of `--views`
augmented images are kept in half precision; a step then costs three 1x1 convolutions.

In images without people, every box is background. In all others scores are to stay as they are at the start
(distillation); only boxes on people whom labels are sure of are to have at least SURE.
"""

from __future__ import annotations

import argparse
import copy
import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F
from tqdm import trange

from export.densepose import targets as tg
from export.densepose.box_views import (
    People,
    Picture,
    add_picture_arguments,
    drawn_views,
    matched,
    proposed_boxes,
    read_kinds,
)
from export.densepose.config import NetworkConfig
from export.densepose.network import MobileParsingRCNN, PersonEvidence

CHANNELS = 24
VIEWS = 6  # of each kind, with people and without, in a step
LIKELY = 0.03  # min score of a box to learn from; lower ones are background already
SURE = 0.7  # min score of a box on a labelled person
KEPT_WEIGHT = 1.5  # of the term that keeps scores, against that of background
DECAY = 1e-2  # of weights


@dataclass(frozen=True)
class View:
    """An image: the backbone's maps of strides 16 and 32, float16; boxes [R, 4], pixels; logit [R]: the box head's
    logit of a person; person: bool [R], whether the box is on a person whose label is certain; keeps: whether the image
    may show people."""

    fine: Tensor
    coarse: Tensor
    boxes: Tensor
    logit: Tensor
    person: Tensor
    keeps: bool


@torch.no_grad()
def view(net: MobileParsingRCNN, image: Tensor, people: People, keeps: bool) -> View:
    """image: normalised [1, 3, h, w]. Boxes are the RPN's proposals, and where the first pass of the box head moves
    them, as the second pass has them."""
    taps = net.backbone(image)
    features = net.neck(taps)
    boxes = proposed_boxes(net, features, *net.rpn(features), tuple(image.shape[-2:]))
    boxes = boxes[((boxes[:, 2:] - boxes[:, :2]) > 4).all(1)]
    logits, _ = net.box_head(tg.pooled(features, [boxes], net.config, net.config.box_pool))
    logit = logits[:, 0] - logits[:, 1]
    person, _, known = matched(boxes, people)
    person &= known
    asked = (logit.sigmoid() > LIKELY) | person
    return View(taps[2].half(), taps[3].half(), boxes[asked], logit[asked], person[asked], keeps)


def views(net: MobileParsingRCNN, kinds: list[tuple[list[Picture], float]], count: int, seed: int) -> list[View]:
    """Augments `count` images and returns those with boxes. kinds: images and their share of samples (fractions of
    1)."""
    seen = (
        view(net, image, people, keeps=len(picture.box) > 0 or not picture.complete)
        for picture, image, people in drawn_views(kinds, count, seed)
    )
    return [v for v in seen if len(v.boxes)]


def view_loss(evidence: PersonEvidence, of: View) -> Tensor:
    """How far the scores of a view's boxes are from what they should be: cross entropy, less what it is at best."""
    logit = of.logit + tg.mean_evidence(evidence(of.fine.float(), of.coarse.float()), of.boxes)
    if not of.keeps:
        return F.binary_cross_entropy_with_logits(logit, torch.zeros_like(logit))
    wanted = of.logit.sigmoid()
    wanted = torch.where(of.person, wanted.clamp(min=SURE), wanted).clamp(1e-5, 1 - 1e-5)
    least = F.binary_cross_entropy(wanted, wanted)
    return KEPT_WEIGHT * (F.binary_cross_entropy_with_logits(logit, wanted) - least)


class _Scaled(nn.Module):
    """Evidence of maps whose channels are scaled to a deviation of 1, so that one rate suits both."""

    def __init__(self, evidence: PersonEvidence, seen: list[View]) -> None:
        super().__init__()
        self.evidence = evidence
        maps = ([v.fine for v in seen[::10]], [v.coarse for v in seen[::10]])
        self.deviation = [torch.cat([m[0].float().flatten(1) for m in of], 1).std(1).clamp(min=1e-2) for of in maps]

    def forward(self, *maps: Tensor) -> Tensor:
        return self.evidence(*(m / d[:, None, None] for m, d in zip(maps, self.deviation, strict=True)))

    def plain(self) -> PersonEvidence:
        """The same for maps that are not scaled."""
        plain = copy.deepcopy(self.evidence)
        with torch.no_grad():
            for conv, deviation in zip((plain.fine, plain.coarse), self.deviation, strict=True):
                conv.weight /= deviation[:, None, None]
        return plain


def fit(seen: list[View], steps: int, rate: float, seed: int) -> PersonEvidence:
    """The evidence after `steps` steps at a falling rate, the mean of its weights over the last ones."""
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    evidence = PersonEvidence((0, 0, seen[0].fine.shape[1], seen[0].coarse.shape[1]), CHANNELS)
    scaled = _Scaled(evidence, seen)
    averaged = copy.deepcopy(scaled).requires_grad_(False)
    optimiser = torch.optim.AdamW(scaled.parameters(), lr=rate, weight_decay=DECAY)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    kept, empty = [v for v in seen if v.keeps], [v for v in seen if not v.keeps]
    # The likelier the box head takes a view for one of a person, the oftener it is drawn.
    mistaken = np.array([float(v.logit.max().sigmoid()) for v in empty])
    bar, means = trange(steps, unit="step", disable=None), {}
    for step in bar:
        drawn = [kept[k] for k in rng.integers(len(kept), size=VIEWS)]
        drawn += [empty[k] for k in rng.choice(len(empty), size=VIEWS, p=mistaken / mistaken.sum())]
        losses = [view_loss(scaled, of) for of in drawn]
        optimiser.zero_grad()
        sum(losses).backward()
        optimiser.step()
        schedule.step()
        keep = min(0.995, (step + 1) / (step + 10))
        with torch.no_grad():
            for mean, value in zip(averaged.parameters(), scaled.parameters(), strict=True):
                mean.lerp_(value, 1 - keep)
        for name, part in (("kept", losses[:VIEWS]), ("background", losses[VIEWS:])):
            now = sum(part).item() / VIEWS
            means[name] = 0.99 * means.get(name, now) + 0.01 * now
        bar.set_postfix({k: f"{v:.3f}" for k, v in means.items()}, refresh=False)
        if (step + 1) % 200 == 0:
            bar.write(json.dumps({"step": step + 1, **{k: round(v, 4) for k, v in means.items()}}))
    return averaged.plain()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_picture_arguments(parser)
    parser.add_argument("--views", type=int, default=3000)
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--lr", type=float, default=2e-3)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--features", type=Path, metavar="FILE", help="keeps the views between runs")
    parser.add_argument("--out", type=Path, default=Path(".data/runs/evidence"))
    options = parser.parse_args()
    saved = torch.load(options.init, weights_only=False)
    weights = {name: value for name, value in saved["ema"].items() if not name.startswith("evidence.")}
    if options.features and options.features.exists():
        seen = [View(**v) for v in torch.load(options.features)]
    else:
        net = MobileParsingRCNN(replace(NetworkConfig.of(saved), evidence=0))
        net.load_state_dict(weights)
        net.float().eval()
        try:
            kinds = read_kinds(options)
        except (OSError, ValueError) as error:
            print(error, file=sys.stderr)
            return 1
        seen = views(net, kinds, options.views, options.seed)
        if options.features:
            torch.save([vars(v) for v in seen], options.features)
    print(f"{sum(v.keeps for v in seen)} views that may show people, {sum(not v.keeps for v in seen)} without")
    evidence = fit(seen, options.steps, options.lr, options.seed)
    learnt = {f"evidence.{name}": value.half() for name, value in evidence.state_dict().items()}
    options.out.mkdir(parents=True, exist_ok=True)
    torch.save({**saved, "evidence": CHANNELS, "ema": weights | learnt}, options.out / "weights.pt")
    return 0


if __name__ == "__main__":
    sys.exit(main())
