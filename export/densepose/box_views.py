"""Images with and without people, random views of them, and the boxes that the network proposes there: what
`export.densepose.train_evidence` learns from."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor
from torchvision.ops import box_iou
from tqdm import trange

from export.densepose import boxes as bx
from export.densepose import data
from export.densepose import targets as tg
from export.densepose.network import MobileParsingRCNN
from export.shards import load_records, visible_boxes

SIZES = (256, 288, 320, 384)
TOWARDS_PERSON, PERSON_SCALE = 0.6, (0.2, 1.2)  # as in export.densepose.data.Cropping
SHOWN = (0.55, 1.1)  # of other views: their side in long sides of the image
MIN_SHOWN, MIN_SIDE_PX = 0.3, 12  # of a person's box; who has less in a view counts neither way
SURE_SCORE = 0.5  # of the teacher's detector
PROPOSALS = 50  # of a view, as many as at inference; each once more as the first pass moves it
POSITIVE_IOU = 0.5
IGNORED = 0.5  # fraction of a background box that may lie on a person whom no label is sure of


@dataclass(frozen=True)
class Picture:
    """image: an encoded image; box: float32 [n, 4] of its people, pixels; ignore: bool [n], unsure ones.
    complete: whether there are no other people; the teachers overlook some."""

    image: bytes
    box: np.ndarray
    ignore: np.ndarray
    complete: bool = True


@dataclass(frozen=True)
class People:
    """People of a view: box float32 [n, 4], pixels; ignore bool [n]: uncertain people."""

    box: Tensor
    ignore: Tensor


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
    """Raises ValueError where the folder has none, or a file is no image."""
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
    """A random square of the image, mirrored half of the time, with other colours: BGR [size, size, 3]."""
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
    return data.recoloured(image, rng), People(*shown)


@torch.no_grad()
def proposed_boxes(
    net: MobileParsingRCNN, features: list[Tensor], objectness: list[Tensor], deltas: list[Tensor],
    size: tuple[int, int],
) -> Tensor:  # fmt: skip
    """The RPN's proposals in an image of `size` (height, width), and where the first pass of the box head moves them:
    [R, 4], pixels."""
    config = net.config
    flat = [bx.flat_outputs(o, d) for o, d in zip(objectness, deltas, strict=True)]
    anchors = bx.anchors(config, [tuple(o.shape[-2:]) for o in objectness])
    proposed = tg.proposals([f[0][0] for f in flat], [f[1][0] for f in flat], anchors, size, 1000, PROPOSALS)
    if not len(proposed):
        return proposed
    moved = net.box_head(tg.pooled(features, [proposed], config, config.box_pool))[1]
    return torch.cat([proposed, bx.clip(bx.decode(moved, proposed, config.delta_weights), *size)])


def matched(candidates: Tensor, truth: People) -> tuple[Tensor, Tensor, Tensor]:
    """For each box: whether it shows a person, the index of that person, and whether both are known (bool, index, bool,
    [K])."""
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
    """`count` images, each with a view of it, normalised [1, 3, h, w], and the people there. kinds: images and how
    often they are drawn (fractions of 1)."""
    rng = np.random.default_rng(seed)
    fractions = np.array([fraction if pictures else 0.0 for pictures, fraction in kinds])
    for _ in trange(count, desc="features", unit="picture", disable=None):
        pictures = kinds[rng.choice(len(kinds), p=fractions / fractions.sum())][0]
        picture = pictures[rng.integers(len(pictures))]
        image, people = view_of(picture, int(rng.choice(SIZES)), rng)
        yield picture, torch.from_numpy(data.normalised(image))[None], people


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
    """The images of --kind and how often they are drawn. Raises OSError or ValueError, a sentence, for what cannot be
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
