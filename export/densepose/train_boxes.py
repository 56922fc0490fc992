"""Trains the box head alone: who is a person, and where the box lies.

    python -m export.densepose.train_boxes --out .data/runs/boxes --kind .3 shards .data/people-wide/train \
        --kind .3 photos .data/photos/train --kind .2 background .data/backgrounds/train \
        --kind .2 shards .data/people-animals/train

Everything else stays as `--init` has it, so that the surface of a person in a given box stays the same to the bit. What
the box head sees of a picture then depends on the picture alone: each of `--views` augmented pictures goes through
backbone, neck and RPN once, the features of its boxes are kept in half precision, and the training proper takes only
the two convolutions and two linear layers of the head: minutes of one core.

Boxes of a view are the RPN's proposals, where the first pass of the box head moves them (the second pass sees those),
and true boxes shaken. Boxes of background are drawn more often the likelier the head takes them for a person.
"""

from __future__ import annotations

import argparse
import copy
import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F
from torchvision.ops import box_iou
from tqdm import trange

from export.densepose import boxes as bx
from export.densepose import data
from export.densepose import targets as tg
from export.densepose.config import NetworkConfig
from export.densepose.network import BoxHead, MobileParsingRCNN
from export.shards import load_records, visible_boxes

SIZES = (256, 288, 320, 384)
TOWARDS_PERSON, PERSON_SCALE = 0.6, (0.2, 1.2)  # as in export.densepose.data.Cropping
SHOWN = (0.55, 1.1)  # of other views: their side in long sides of the picture
MIN_SHOWN, MIN_SIDE_PX = 0.3, 12  # of a person's box; who has less in a view counts neither way
SURE_SCORE = 0.5  # of the teacher's detector
OVERLOOKED_SCORE = 0.7  # of `--init`, where the detector has no box
PROPOSALS = 50  # of a view, as many as at inference; each once more as the first pass moves it
SHAKEN = 6  # of each person
SHAKES = 0.25  # how far a shaken box is off at most, in fractions of its size
POSITIVE_IOU = 0.5
IGNORED = 0.5  # fraction of a background box that may lie on a person whom no label is sure of
OVERLAP_IOU, OVERLAP_WEIGHT = 0.3, 2.0  # people whose boxes overlap by more are drawn the oftener
PEOPLE, BACKGROUND = 64, 144  # boxes in a step
MINE_EVERY = 200  # steps after which background boxes are scored again


@dataclass(frozen=True)
class Boxes:
    """Boxes to learn from. roi: float16 [R, C, 7, 7]; person: bool [R]; target: float32 [R, 4], deltas to the true box
    (0 for background); weight: float32 [R], how often a box is drawn."""

    roi: Tensor
    person: Tensor
    target: Tensor
    weight: Tensor

    @staticmethod
    def joined(parts: list[Boxes]) -> Boxes:
        return Boxes(*(torch.cat([getattr(p, name) for p in parts]) for name in ("roi", "person", "target", "weight")))


@dataclass(frozen=True)
class Picture:
    """image: an encoded picture; box: float32 [n, 4] of its people, pixels; ignore: bool [n], somebody or not.
    complete: whether there are no other people; the teachers overlook some."""

    image: bytes
    box: np.ndarray
    ignore: np.ndarray
    complete: bool = True


@dataclass(frozen=True)
class People:
    """Those of a view: box float32 [n, 4], pixels; ignore bool [n]; complete: as in `Picture`."""

    box: Tensor
    ignore: Tensor
    complete: bool


def from_shards(folder: Path) -> list[Picture]:
    pictures = []
    for record in load_records(folder):
        box, _, ignore = visible_boxes(record.decoded()[1])
        pictures.append(Picture(record.image, box, ignore))
    return pictures


def from_photos(photos: Path, labels: Path) -> list[Picture]:
    """Photographs and the boxes that the teachers' detector gives (`export.teachers`)."""
    pictures = []
    for path, encoded in _photos(photos):
        with np.load(labels / f"{path.stem}.npz") as found:
            pictures.append(Picture(encoded, found["box"], found["score"] < SURE_SCORE, False))
    return pictures


def _photos(folder: Path) -> Iterator[tuple[Path, bytes]]:
    """Raises ValueError where the folder has none, or a file is no picture."""
    paths = sorted(folder.glob("*.jpg"))
    if not paths:
        raise ValueError(f"no photographs (*.jpg) in {folder}")
    for path in paths:
        encoded = path.read_bytes()
        if cv2.imdecode(np.frombuffer(encoded, np.uint8), cv2.IMREAD_REDUCED_GRAYSCALE_8) is None:
            raise ValueError(f"{path} is not an image that can be read")
        yield path, encoded


def without_people(folder: Path) -> list[Picture]:
    """The photographs of a folder."""
    no_people = np.zeros((0, 4), np.float32), np.zeros(0, bool)
    return [Picture(encoded, *no_people) for _, encoded in _photos(folder)]


def view_of(picture: Picture, size: int, rng: np.random.Generator) -> tuple[np.ndarray, People]:
    """A random square of the picture, mirrored half of the time, with other colours: BGR [size, size, 3]."""
    image = cv2.imdecode(np.frombuffer(picture.image, np.uint8), cv2.IMREAD_COLOR)
    box, middle = picture.box.astype(np.float64), None
    if len(box) and rng.random() < TOWARDS_PERSON:
        x0, y0, x1, y1 = box[rng.integers(len(box))]
        scale = size / max(x1 - x0, y1 - y0) * np.exp(rng.uniform(*np.log(PERSON_SCALE)))
        scale = max(scale, 0.7 * size / max(image.shape[:2]))
        middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2])
    else:
        scale = size / max(image.shape[:2]) / np.exp(rng.uniform(*np.log(SHOWN)))
    scale = float(np.clip(scale, *data.SCALES))
    corner = []
    for axis, length in enumerate(image.shape[1::-1]):
        low, high = sorted((0.0, length * scale - size))
        if middle is not None:
            low, high = max(low, middle[axis] * scale - 0.8 * size), min(high, middle[axis] * scale - 0.2 * size)
        corner.append(rng.uniform(min(low, high), high))
    matrix = np.array([[scale, 0, -corner[0]], [0, scale, -corner[1]]])
    if scale < 1:  # the warp takes single pixels
        image = cv2.GaussianBlur(image, (0, 0), 0.4 / scale)
    image = cv2.warpAffine(image, matrix, (size, size), flags=cv2.INTER_LINEAR, borderValue=data.MEAN[::-1].tolist())
    moved = box * scale - np.tile(corner, 2)
    inside = moved.clip(0, size)
    side, whole = inside[:, 2:] - inside[:, :2], moved[:, 2:] - moved[:, :2]
    visible = side.prod(1) / whole.prod(1).clip(1e-6)
    ignore = picture.ignore | (visible < MIN_SHOWN) | (side.max(1, initial=0) < MIN_SIDE_PX)
    there = visible > 0
    if rng.random() < 0.5:
        image = np.ascontiguousarray(image[:, ::-1])
        inside = np.stack([size - inside[:, 2], inside[:, 1], size - inside[:, 0], inside[:, 3]], 1)
    shown = torch.from_numpy(inside[there].astype(np.float32)), torch.from_numpy(ignore[there])
    return data.recoloured(image, rng), People(*shown, picture.complete)


@torch.no_grad()
def proposed_boxes(
    net: MobileParsingRCNN, features: list[Tensor], objectness: list[Tensor], deltas: list[Tensor],
    size: tuple[int, int],
) -> Tensor:  # fmt: skip
    """The RPN's proposals in a picture of `size` (height, width), and where the first pass of the box head moves them:
    [R, 4], pixels."""
    config = net.config
    flat = [bx.flat_outputs(o, d) for o, d in zip(objectness, deltas, strict=True)]
    anchors = bx.anchors(config, [tuple(o.shape[-2:]) for o in objectness])
    proposed = tg.proposals([f[0][0] for f in flat], [f[1][0] for f in flat], anchors, size, 1000, PROPOSALS)
    if not len(proposed):
        return proposed
    moved = net.box_head(tg.pooled(features, [proposed], config, config.box_pool))[1]
    return torch.cat([proposed, bx.clip(bx.decode(moved, proposed, config.delta_weights), *size)])


@torch.no_grad()
def boxes_of(net: MobileParsingRCNN, image: Tensor, truth: People) -> Boxes:
    """image: normalised [1, 3, h, w]."""
    config, size = net.config, tuple(image.shape[-2:])
    features, objectness, deltas = net.detector(image)
    candidates = torch.cat([proposed_boxes(net, features, objectness, deltas, size), shaken(truth.box, size)])
    candidates = candidates[((candidates[:, 2:] - candidates[:, :2]) > 4).all(1)]
    person, match, known = matched(candidates, truth)
    candidates, person, match = candidates[known], person[known], match[known]
    roi = tg.pooled(features, [candidates], config, config.box_pool)
    if not truth.complete:  # who looks like a person may be one whom the teachers overlooked
        sure = person | (scores_of(net.box_head, roi) < OVERLOOKED_SCORE)
        roi, candidates, person, match = roi[sure], candidates[sure], person[sure], match[sure]
    target = torch.zeros(len(candidates), 4)
    weight = torch.ones(len(candidates))
    if person.any():
        true = truth.box[match[person]]
        target[person] = bx.encode(true, candidates[person], config.delta_weights)
        crowded = (box_iou(truth.box, truth.box) - torch.eye(len(truth.box))).max(1).values > OVERLAP_IOU
        # Everybody equally often, however many proposals lie on them.
        count = torch.bincount(match[person], minlength=len(truth.box))[match[person]]
        weight[person] = torch.where(crowded[match[person]], OVERLAP_WEIGHT, 1.0) / count
    return Boxes(roi.half(), person, target, weight)


def shaken(boxes: Tensor, size: tuple[int, int]) -> Tensor:
    """SHAKEN boxes near each true one, [K * SHAKEN, 4]."""
    many = boxes.repeat_interleave(SHAKEN, 0)
    amount = torch.empty_like(many).uniform_(-SHAKES, SHAKES) * torch.rand(len(many), 1)
    return bx.clip(many + amount * (many[:, 2:] - many[:, :2]).repeat(1, 2), *size)


def matched(candidates: Tensor, truth: People) -> tuple[Tensor, Tensor, Tensor]:
    """Of each box: whether it shows a person, whom, and whether both are known (bool, index, bool, [K])."""
    if not len(truth.box):
        no_person = torch.zeros(len(candidates), dtype=torch.bool)
        return no_person, no_person.long(), ~no_person
    best, match = box_iou(candidates, truth.box).max(1)
    person = best >= POSITIVE_IOU
    known = ~(person & truth.ignore[match])
    if truth.ignore.any():
        unsure = truth.box[truth.ignore]
        common = torch.minimum(candidates[:, None, 2:], unsure[None, :, 2:]) - torch.maximum(
            candidates[:, None, :2], unsure[None, :, :2]
        )
        area = (candidates[:, 2:] - candidates[:, :2]).prod(1)
        known &= person | (common.clamp(min=0).prod(2).max(1).values < IGNORED * area)
    return person, match, known


def drawn_views(
    kinds: list[tuple[list[Picture], float]], count: int, seed: int
) -> Iterator[tuple[Picture, Tensor, People]]:
    """`count` pictures, each with a view of it, normalised [1, 3, h, w], and the people there. kinds: pictures and how
    often they are drawn (fractions of 1)."""
    rng = np.random.default_rng(seed)
    fractions = np.array([fraction if pictures else 0.0 for pictures, fraction in kinds])
    for _ in trange(count, desc="features", unit="picture", disable=None):
        pictures = kinds[rng.choice(len(kinds), p=fractions / fractions.sum())][0]
        picture = pictures[rng.integers(len(pictures))]
        image, people = view_of(picture, int(rng.choice(SIZES)), rng)
        yield picture, torch.from_numpy(data.normalised(image))[None], people


def views(net: MobileParsingRCNN, kinds: list[tuple[list[Picture], float]], count: int, seed: int) -> Boxes:
    """The boxes of `count` augmented pictures."""
    torch.manual_seed(seed)
    return Boxes.joined([boxes_of(net, image, people) for _, image, people in drawn_views(kinds, count, seed)])


@torch.no_grad()
def scores_of(head: BoxHead, roi: Tensor) -> Tensor:
    return torch.cat([head(part.float())[0].softmax(1)[:, 0] for part in roi.split(512)])


def fit(net: MobileParsingRCNN, boxes: Boxes, steps: int, rate: float, seed: int) -> BoxHead:
    """The box head after `steps` steps at a falling rate: the mean of its weights over the last ones."""
    torch.manual_seed(seed)
    head, averaged = net.box_head, copy.deepcopy(net.box_head).requires_grad_(False)
    optimiser = torch.optim.AdamW(head.parameters(), lr=rate, weight_decay=0.01)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    people, background = boxes.person.nonzero()[:, 0], (~boxes.person).nonzero()[:, 0]
    bar, means = trange(steps, unit="step", disable=None), {}
    for step in bar:
        if step % MINE_EVERY == 0:
            likely = scores_of(averaged, boxes.roi[background]) + 0.02
        drawn = torch.cat([
            people[torch.multinomial(boxes.weight[people], PEOPLE, replacement=True)],
            background[torch.multinomial(likely, BACKGROUND // 2, replacement=True)],
            background[torch.randint(len(background), (BACKGROUND // 2,))],
        ])  # fmt: skip
        logits, deltas = head(boxes.roi[drawn].float())
        person = boxes.person[drawn]
        terms = {
            "class": F.cross_entropy(logits, (~person).long()),
            "box": F.l1_loss(deltas[person], boxes.target[drawn][person]),
        }
        optimiser.zero_grad()
        sum(terms.values()).backward()
        nn.utils.clip_grad_norm_(head.parameters(), 10.0)
        optimiser.step()
        schedule.step()
        keep = min(0.995, (step + 1) / (step + 10))
        with torch.no_grad():
            for mean, value in zip(averaged.parameters(), head.parameters(), strict=True):
                mean.lerp_(value, 1 - keep)
        values = {name: term.item() for name, term in terms.items()}
        means = {name: 0.98 * means.get(name, value) + 0.02 * value for name, value in values.items()}
        bar.set_postfix({k: f"{v:.3f}" for k, v in means.items()}, refresh=False)
        if (step + 1) % MINE_EVERY == 0:
            bar.write(json.dumps({"step": step + 1, **{k: round(v, 4) for k, v in means.items()}}))
    return averaged


def add_picture_arguments(parser: argparse.ArgumentParser) -> None:
    """--init, and what `read_kinds` needs."""
    parser.add_argument("--init", type=Path, default=Path("export/weights/densepose-b.pt"))
    parser.add_argument(
        "--kind", action="append", nargs=3, required=True, metavar=("FRACTION", "WHAT", "DIR"),
        help="how often, what and where: `shards` (rendered or composed people), `photos` (of people; their labels in "
             "--labels), `background` (photographs without people)",
    )  # fmt: skip
    parser.add_argument("--labels", type=Path, default=Path(".data/teachers/labels"))


def read_kinds(options: argparse.Namespace) -> list[tuple[list[Picture], float]]:
    """The pictures of --kind and how often they are drawn. Raises OSError or ValueError, a sentence, for what cannot be
    read."""
    readers = {
        "shards": from_shards,
        "background": without_people,
        "photos": lambda folder: from_photos(folder, options.labels),
    }
    unknown = {what for _, what, _ in options.kind} - readers.keys()
    if unknown:
        raise ValueError(f"--kind is one of {', '.join(readers)}, not {', '.join(sorted(unknown))}")
    return [(readers[what](Path(folder)), float(fraction)) for fraction, what, folder in options.kind]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_picture_arguments(parser)
    parser.add_argument("--views", type=int, default=500)
    parser.add_argument("--steps", type=int, default=500)
    parser.add_argument("--lr", type=float, default=5e-4)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--features", type=Path, help="file that keeps the boxes' features between runs")
    parser.add_argument("--out", type=Path, default=Path(".data/runs/boxes"))
    options = parser.parse_args()
    saved = torch.load(options.init, weights_only=False)
    net = MobileParsingRCNN(NetworkConfig.of(saved))
    net.load_state_dict(saved["ema"])
    net.float().eval()
    if options.features and options.features.exists():
        boxes = Boxes(**torch.load(options.features))
    else:
        try:
            kinds = read_kinds(options)
        except (OSError, ValueError) as error:
            print(error, file=sys.stderr)
            return 1
        boxes = views(net, kinds, options.views, options.seed)
        if options.features:
            torch.save(vars(boxes), options.features)
    print(f"{int(boxes.person.sum())} boxes of people, {int((~boxes.person).sum())} of background")
    head = fit(net, boxes, options.steps, options.lr, options.seed)
    trained = {f"box_head.{name}": value.half() for name, value in head.state_dict().items()}
    options.out.mkdir(parents=True, exist_ok=True)
    torch.save({**saved, "ema": saved["ema"] | trained}, options.out / "weights.pt")
    return 0


if __name__ == "__main__":
    sys.exit(main())
