"""Labelled photographs as shards for training: people as far as the teachers know them, photographs without people, and
people cut out and set before other places.

    python -m export.teachers.shards --photos .data/photos/train --out .data/photos/shards/train

The format is that of rendered people (docs/reference/formats.md), with the weaker labels of `export.shards`.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from export import keypoints
from export.people.augmentation import USUAL
from export.shards import BOX_ALONE, PART_ALONE, PERSON, REGION, UNCERTAIN, UNSURE, ShardWriter, visible_boxes
from export.surface import PART_COUNT, PART_TO_COARSE
from export.teachers.coarse import SOMEWHERE, coarse_labels
from export.teachers.consistency import KeptConsensus
from export.teachers.facing import CHEST, PhotoFacing, trunk_part
from export.teachers.fit import PhotoFits
from export.teachers.hands import SIDES, Hand, HandNetwork, hands_of
from export.teachers.label import PhotoLabels

LONG_SIDE = 800  # people are then as sharp in training as in a camera's image at the size of the networks' input
MIN_SCORE = 0.5  # of the detector; less sure boxes are regions that training leaves out
_BORDER = 0.012  # of the person's height: this close to the mask's edge a pixel may be the person or not
MIN_CROP_PX = 60  # height of people worth cutting out
PER_SHARD = 100
JPEG_QUALITY = 92
_SIZES_APART = (0.5, 0.3, 0.15, 0.05, 0.0, 0.0)  # of 1, 2, ... 6 people
_GROUP_SIZES = (0.0, 0.4, 0.25, 0.15, 0.1, 0.1)
_UNKNOWN = np.full((keypoints.COUNT, 3), np.nan, np.float32)
# Image uint8 [H, W, 3], label uint8 [H, W, 4], keypoints [people, 33, 3] by instance number - 1 where there are any.
Picture = tuple[np.ndarray, np.ndarray, np.ndarray | None]


def weak_label(
    labels: PhotoLabels, shape: tuple[int, int], fits: PhotoFits | None = None,
    hands: dict[tuple[int, str], Hand] | None = None, facing: PhotoFacing | None = None,
) -> np.ndarray:  # fmt: skip
    """uint8 [H, W, 4] = (I, U, V, instance) of a photo of `shape` pixels, with I as in `export.shards`.

    People with a good fit of the body have its labels, others the coarse regions of their landmarks; over both lie the
    hands that were seen, by person and side. Trunks of people who face the camera, or look away from it, are chests or
    backs.

    Boxes without a mask are filled with UNSURE; masks lie over them. Instances: 1.. with a mask, BOX_ALONE.. with a
    box alone, UNCERTAIN.. where the detector itself is not sure.
    """
    out = np.zeros((*shape, 4), np.uint8)
    outlined = np.flatnonzero(labels.outlined)
    dense = {} if fits is None else dict(zip(fits.person[fits.accepted], fits.label[fits.accepted], strict=True))
    for k in sorted(np.flatnonzero(~labels.outlined), key=lambda k: labels.score[k]):
        x0, y0, x1, y1 = np.round(labels.box[k]).astype(int)
        first = BOX_ALONE if labels.score[k] >= MIN_SCORE else UNCERTAIN
        out[max(y0, 0) : y1, max(x0, 0) : x1] = (UNSURE, 0, 0, first + k % (UNCERTAIN - BOX_ALONE))
    for k in sorted(outlined, key=lambda k: -labels.mask[k].sum()):
        mask = labels.mask[k]
        border = max(1, round(_BORDER * float(labels.box[k, 3] - labels.box[k, 1])))
        ring = cv2.dilate(mask.astype(np.uint8), np.ones((2 * border + 1, 2 * border + 1), np.uint8)) > 0
        out[(ring | labels.doubt[k]) & ~mask & (out[..., 3] == 0), 0] = UNSURE
        value = np.full(shape, PERSON, np.uint8)
        if labels.sure[k]:
            region = coarse_labels(labels.point[k], labels.visible[k], mask)
            value = np.where(region == SOMEWHERE, PERSON, REGION + region)
            value[(region == SOMEWHERE) & labels.doubt[k]] = UNSURE
            if facing is not None and (part := trunk_part(facing.degrees[k])):
                value[region == PART_TO_COARSE[CHEST]] = PART_ALONE + part
        out[mask, 0] = value[mask]
        out[mask, 1:3] = 0
        if k in dense:
            fitted = cv2.resize(dense[k], shape[::-1], interpolation=cv2.INTER_NEAREST)
            known = mask & (fitted[..., 0] > 0) & (fitted[..., 0] <= PART_COUNT)
            out[mask & ~known, 0] = PERSON
            out[known, :3] = fitted[known]
        out[mask, 3] = k + 1
        for side in SIDES:
            if hands and (k, side) in hands:
                shown = hands[k, side].mask(shape) & np.isin(out[..., 3], (0, k + 1))
                # A fitted body knows more of its hand than that it is one.
                shown &= ~np.isin(out[..., 0], np.flatnonzero(SIDES[side] == PART_TO_COARSE))
                out[shown] = (REGION + SIDES[side], 0, 0, k + 1)
    return out


@dataclass(frozen=True)
class CutOut:
    """One person out of a photo. image: uint8 [h, w, 3]; label: uint8 [h, w, 4] with instance 1, 0 and UNSURE around
    it; opacity: float32 [h, w]; cut: the person is cut by the photo's left, upper, right, lower border; keypoint:
    [33, 3], NaN where nobody knows them."""

    image: np.ndarray
    label: np.ndarray
    opacity: np.ndarray
    cut: tuple[bool, bool, bool, bool]
    keypoint: np.ndarray


def keypoints_of(labels: PhotoLabels) -> np.ndarray:
    """Keypoints float32 [N, 33, 3] of the N people as in `export.shards.Record`; NaN where landmarks are not sure."""
    keypoint = np.concatenate([labels.point, labels.visible[..., None]], -1).astype(np.float32)
    return np.where(labels.sure[:, None, None], keypoint, np.nan)


def cut_outs(image: np.ndarray, label: np.ndarray, keypoint: np.ndarray | None = None) -> list[CutOut]:
    """People with a mask that no other label touches; people truncated on opposite sides cannot be put elsewhere."""
    out = []
    height, width = label.shape[:2]
    others = label[..., 3]
    for number in np.unique(others[(others > 0) & (others < BOX_ALONE)]):
        own = others == number
        near = cv2.dilate(own.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
        if np.isin(others[near], (0, number)).all():
            y, x = np.nonzero(own)
            x0, y0, x1, y1 = x.min(), y.min(), x.max() + 1, y.max() + 1
            cut = (x0 < 3, y0 < 3, x1 > width - 3, y1 > height - 3)
            if y1 - y0 >= MIN_CROP_PX and not (cut[0] and cut[2]) and not (cut[1] and cut[3]):
                place = np.s_[y0:y1, x0:x1]
                this = label[place].copy()
                this[~own[place]] = 0
                this[..., 3] = own[place]
                # The photo's own background shows through at hair and edges: two pixels less, and soft.
                inner = cv2.erode(own.astype(np.float32), np.ones((3, 3)), borderType=cv2.BORDER_REPLICATE)
                opacity = cv2.GaussianBlur(inner, (0, 0), 1.0)[place]
                known = _UNKNOWN if keypoint is None else keypoint[number - 1] - np.float32([x0, y0, 0])
                out.append(CutOut(image[place], this, opacity, cut, known))
    return out


def composed(background: np.ndarray, people: list[CutOut], size: tuple[int, int], rng: np.random.Generator) -> Picture:
    """One to six people, the later ones in front, on a piece of a photo without people.

    Half of the images show a group: people of about one size side by side, each occluding a part of the one before.
    size: width, height of the result. Borders that cut a person in the photo cut them here too.
    """
    width, height = size
    scale = max(width / background.shape[1], height / background.shape[0]) * rng.uniform(1.0, 1.6)
    shape = (max(width, round(background.shape[1] * scale)), max(height, round(background.shape[0] * scale)))
    large = cv2.resize(background, shape, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    x, y = int(rng.integers(shape[0] - width + 1)), int(rng.integers(shape[1] - height + 1))
    image = large[y : y + height, x : x + width].astype(np.float32)
    label = np.zeros((height, width, 4), np.uint8)
    group = rng.random() < 0.5
    before = None  # left, top, width, height of the person before
    keypoint = []
    for number in range(1, int(rng.choice(6, p=_GROUP_SIZES if group else _SIZES_APART)) + 2):
        person = people[rng.integers(len(people))]
        tall = height * np.exp(rng.uniform(np.log(0.3), np.log(1.2)))
        if group and before:
            tall = before[3] * rng.uniform(0.8, 1.25)
        scale = min(tall / person.image.shape[0], 1.5 * width / person.image.shape[1], 1.5)
        shape = (max(8, round(person.image.shape[1] * scale)), max(8, round(person.image.shape[0] * scale)))
        interpolation = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
        pixels = cv2.resize(person.image, shape, interpolation=interpolation).astype(np.float32)
        pixels = pixels * rng.uniform(0.7, 1.2) * (1 + rng.normal(0, 0.05, 3)) + rng.normal(0, 6)
        opacity = cv2.resize(person.opacity, shape, interpolation=cv2.INTER_LINEAR)[..., None]
        own = cv2.resize(person.label, shape, interpolation=cv2.INTER_NEAREST)
        left = _place(shape[0], width, person.cut[0], person.cut[2], rng)
        top = _place(shape[1], height, person.cut[1], person.cut[3], rng)
        if group and before:
            step = rng.choice((-1, 1)) * rng.uniform(0.25, 0.8) * (before[2] + shape[0]) / 2
            if not (person.cut[0] or person.cut[2]):
                left = round(before[0] + (before[2] - shape[0]) / 2 + step)
            if not (person.cut[1] or person.cut[3]):
                top = round(before[1] + before[3] - shape[1] + rng.normal(0, 0.05) * before[3])
        before = (left, top, *shape)
        stretch = np.array(shape) / person.label.shape[1::-1]
        keypoint.append(keypoints.mapped(person.keypoint, np.array([[stretch[0], 0, left], [0, stretch[1], top]])))
        into = np.s_[max(top, 0) : max(top + shape[1], 0), max(left, 0) : max(left + shape[0], 0)]
        rows, columns = image[into].shape[:2]
        part = np.s_[max(-top, 0) : max(-top, 0) + rows, max(-left, 0) : max(-left, 0) + columns]
        image[into] += opacity[part] * (pixels[part] - image[into])
        seen = own[part][..., 3] > 0
        own[..., 3] *= number
        label[into][seen] = own[part][seen]
        edge = cv2.morphologyEx(np.pad(seen, 1).astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))[
            1:-1, 1:-1
        ]
        label[into][(edge > 0) & ~seen & (label[into][..., 3] == 0), 0] = UNSURE
    return np.clip(image, 0, 255).astype(np.uint8), label, np.stack(keypoint)


def _place(length: int, room: int, cut_low: bool, cut_high: bool, rng: np.random.Generator) -> int:
    beyond = int(rng.integers(0, max(1, length // 8)))
    if cut_low or cut_high:
        return -beyond if cut_low else room - length + beyond
    low = -length // 4
    return int(rng.integers(low, max(room - 3 * length // 4, low) + 1))


def shrunk(image: np.ndarray, label: np.ndarray, keypoint: np.ndarray | None = None) -> Picture:
    """image: uint8 [H, W, 3] BGR, its label and keypoints, with a long side of at most LONG_SIDE."""
    scale = LONG_SIDE / max(image.shape[:2])
    if scale >= 1:
        return image, label, keypoint
    size = (round(image.shape[1] * scale), round(image.shape[0] * scale))
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    if keypoint is not None:
        keypoint = keypoint * np.append(np.array(size) / image.shape[1::-1], 1).astype(np.float32)
    return small, cv2.resize(label, size, interpolation=cv2.INTER_NEAREST), keypoint


def write_shards(pictures: Iterator[Picture], count: int, out: Path) -> None:
    """Writes `count` images and labels to out/shard-00000.npz and so on."""
    out.mkdir(parents=True, exist_ok=True)
    with tqdm(total=count, desc=str(out), unit="image", disable=None) as bar:
        for number in range(-(-count // PER_SHARD)):
            shard = ShardWriter(boxes=False)
            for image, label, keypoint in itertools.islice(pictures, PER_SHARD):
                shard.add(image, label, JPEG_QUALITY, keypoint=keypoint)
                bar.update()
            shard.write(out / f"shard-{number:05d}.npz", {"split": out.name, "shard": number, "generator": "photos"})


def rounds_of(names: list[str], repeat: int, caps: dict[str, int]) -> list[list[int]]:
    """`repeat` rounds of indices of photographs. caps: how many with a name "PREFIX-..." are in a round, by prefix; the
    rounds take them one after the other, so that each of them is seen."""
    group = [name.partition("-")[0] for name in names]
    free = [k for k, prefix in enumerate(group) if prefix not in caps]
    out = []
    for number in range(repeat):
        chosen = list(free)
        for prefix, cap in caps.items():
            members = [k for k, own in enumerate(group) if own == prefix]
            chosen += np.roll(members, -number * cap).tolist()[:cap]
        out.append(chosen)
    return out


def write_training_set(
    pictures: list[Picture], empty: list[Picture], rounds: list[list[int]], composed_images: int, out: Path
) -> tuple[int, int]:
    """Shards of images with people and without, and of images composed of both. rounds: indices of the images with
    people; each round has all images without. Returns how many people were cut out of the first round's images and how
    many images composed."""
    people = [person for k in rounds[0] for person in cut_outs(*pictures[k])]
    every = [picture for chosen in rounds for picture in ([pictures[k] for k in chosen] + empty)]
    rng = np.random.default_rng(0)
    rng.shuffle(every)  # so that every shard holds both kinds
    count = composed_images if people and empty else 0
    more = (
        composed(empty[rng.integers(len(empty))][0], people, USUAL.sizes[rng.integers(len(USUAL.sizes))], rng)
        for _ in range(count)
    )  # fmt: skip
    write_shards(itertools.chain(every, more), len(every) + count, out)
    return len(people), count


def read(path: Path) -> np.ndarray:
    image = cv2.imread(str(path))
    if image is None:
        raise ValueError(f"{path} is not an image that can be read")
    return image


def _cap(text: str) -> tuple[str, int]:
    prefix, _, count = text.partition("=")
    if not prefix or not count.isdigit() or int(count) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not PREFIX=N with N of at least 1, such as gm=40")
    return prefix, int(count)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.teachers.shards", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--photos", type=Path, nargs="+", default=[Path(".data/photos/train")], metavar="DIR")
    parser.add_argument("--labels", type=Path, default=Path(".data/teachers/labels"), metavar="DIR")
    parser.add_argument(
        "--fits", type=Path, default=Path(".data/teachers/fits"), metavar="DIR", help="if there are any"
    )
    parser.add_argument(
        "--facing", type=Path, default=Path(".data/teachers/facing"), metavar="DIR",
        help="directions of people (export.teachers.facing), if there are any",
    )  # fmt: skip
    parser.add_argument(
        "--consistent", type=Path, nargs="+", default=[], metavar="WEIGHTS",
        help="weights.pt of trainings: what they agree on about people seen large completes the labels",
    )  # fmt: skip
    parser.add_argument(
        "--hands", action=argparse.BooleanOptionalAction, default=True,
        help="outlines of hands by a network of their own (default), or by wrists and knuckles alone",
    )  # fmt: skip
    parser.add_argument(
        "--empty", type=Path, nargs="+", default=[Path(".data/backgrounds/train")], metavar="DIR",
        help="photographs without people",
    )  # fmt: skip
    parser.add_argument(
        "--composed", type=int, default=2400, metavar="N",
        help="images with people cut out of photos in front of other places (default %(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--repeat", type=int, default=4, metavar="N",
        help="how often each photograph is among them, so that it is seen as often as before many composed ones "
             "(default %(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--cap", type=_cap, nargs="+", default=[], metavar="PREFIX=N",
        help="at most N photographs named PREFIX-... in each repeat, such as those of a few people seen often",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, default=Path(".data/photos/shards/train"), metavar="DIR")
    arguments = parser.parse_args(argv)
    paths = [path for folder in arguments.photos for path in sorted(folder.glob("*.jpg"))]
    photos = [(path, arguments.labels / f"{path.stem}.npz") for path in paths]
    missing = sum(not labels.exists() for _, labels in photos)
    if missing or not photos:
        folders = " ".join(map(str, arguments.photos))
        print(f"No labels for {missing} of {len(photos)} photos in {folders}: run "
              f"`python -m export.teachers --photos {folders}` first.", file=sys.stderr)  # fmt: skip
        return 1
    pictures, names, fitted, turned, seen_hands = [], [], 0, 0, 0
    hand_network = HandNetwork() if arguments.hands else None
    kept_answers = arguments.out / "labels"
    consensus = KeptConsensus(arguments.consistent, kept_answers) if arguments.consistent else None
    for path, labels in tqdm(photos, desc="labels", unit="photo", disable=None):
        told = PhotoLabels.load(labels)
        if not told.sure.any():  # nobody's mask is confirmed, and people may have no box at all
            continue
        names.append(path.stem)
        image = read(path)
        fits = PhotoFits.load(kept) if (kept := arguments.fits / labels.name).exists() else None
        fitted += 0 if fits is None else int(fits.accepted.sum())
        facing = PhotoFacing.load(kept) if (kept := arguments.facing / labels.name).exists() else None
        turned += 0 if facing is None else int(np.isfinite(facing.degrees).sum())
        hands = hands_of(hand_network, image, told) if hand_network else {}
        seen_hands += len(hands)
        label = weak_label(told, image.shape[:2], fits, hands, facing)
        if consensus:
            label = consensus.complete(image, label)
        pictures.append(shrunk(image, label, keypoints_of(told)))
    if not pictures:
        print(f"None of the {len(photos)} photos has a person with landmarks and mask.", file=sys.stderr)
        return 1
    known = np.concatenate([instance[~ignore] for _, instance, ignore in (visible_boxes(p[1]) for p in pictures)])
    empty = []
    for path in sorted(p for folder in arguments.empty for p in folder.glob("*.jpg")):
        image = read(path)
        empty.append(shrunk(image, np.zeros((*image.shape[:2], 4), np.uint8)))
    rounds = rounds_of(names, arguments.repeat, dict(arguments.cap))
    people, count = write_training_set(pictures, empty, rounds, arguments.composed, arguments.out)
    print(f"{arguments.out}: {len(names)} photographs of people, {len(empty)} without; "
          f"{len(photos) - len(names)} left out, with landmarks of nobody; "
          f"{int((known < BOX_ALONE).sum())} people with a mask ({fitted} of them with a fitted body, "
          f"{turned} with a direction, {seen_hands} hands), {int((known >= BOX_ALONE).sum())} with a box alone; "
          f"each {arguments.repeat} times; {count} images composed of {people} people cut out")  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
