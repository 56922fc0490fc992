"""What decides: short trainings of the surface alone that differ in one thing, judged on real photographs.

    python -m export.people.dataset --images 3000 --bare --out .data/people-bare
    python -m export.evaluation.ablation --prepare      half of the photographs to train on, half to judge by
    python -m export.evaluation.ablation                all variations; resumes; takes hours

Each variation changes one thing of the reference and is trained with several seeds, one process a core, on the loss of
the surface stage (`export.densepose.losses.surface_loss`). Judged are photographs that none of them trained on, with
boxes, masks and landmarks of the teachers: the labels of the last layer of the trunk (PixelHead) inside each box.
Trainings that are done are not repeated; `--table` writes the table of those that are.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import statistics
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import nn
from tqdm import tqdm

from export.densepose import data
from export.densepose.config import NetworkConfig
from export.densepose.losses import PixelHead, surface_loss
from export.densepose.network import MobileParsingRCNN
from export.densepose.train import CLOSE, Ema, bf16_pays, optimiser_of, rate_at, validate_surface
from export.evaluation.backends import Prediction
from export.evaluation.photos import PhotoSet, Tally, read_photo
from export.photos.backgrounds import load_photographs
from export.teachers import shards
from export.teachers.label import PhotoLabels

SIZE = 128
BATCH = 8
FIGURES = ("part_at_landmark", "left_right", "mask_iou", "pixel_part")
MARGIN = 1.15  # of the box judged
PHOTO_SHARE = 0.33


@dataclass(frozen=True)
class Variation:
    """One training. `says`: what is different, for the table."""

    says: str
    rendered: str = "people"
    count: int | None = None  # of the rendered images
    size: int = SIZE
    framing: data.Framing = CLOSE
    photos: str = ""  # shards of photographs in place of a third of the images
    backbone: str = "mobilenet_v2"
    pretrained: bool = True
    keep: Callable[[np.ndarray], bool] | None = None  # of the label; images that are left in
    plain: bool = False


VARIATIONS = {
    "reference": Variation("close cuts of 128 pixels, pretrained MobileNetV2"),
    "scratch": Variation("MobileNetV2 from random weights", pretrained=False),
    "v3": Variation("MobileNetV3-Large from random weights", pretrained=False, backbone="mobilenet_v3_large"),
    "photos": Variation("a third of the images photographs: masks, regions, fitted bodies", photos="ablation"),
    "photos-unfitted": Variation("a third photographs: masks and regions alone", photos="ablation-unfitted"),
    "few": Variation("3,000 rendered images", count=3000),
    "bare": Variation("3,000 rendered images without clothes", rendered="people-bare", count=3000),
    "plain": Variation("one colour in place of the background", plain=True),
    "alone": Variation("only images of one person or nobody", keep=lambda label: label[..., 3].max() < 2),
    "any-framing": Variation("people of a third to 1.3 times the cut", framing=data.ANY_FRAMING),
    "small-cuts": Variation("cuts of 96 pixels", size=96),
}


class PlainRecord(data.Record):
    """A record with one colour, its own, around the people."""

    def decoded(self) -> tuple[np.ndarray, np.ndarray]:
        image, label = super().decoded()
        rng = np.random.default_rng(zlib.crc32(self.image))
        image[label[..., 3] == 0] = rng.integers(0, 256, 3)
        return image, label


def records_of(variation: Variation, folder: Path) -> list[data.Record]:
    records = data.load_records(folder / variation.rendered / "train", variation.count)
    if variation.keep:
        records = [r for r in records if variation.keep(r.decoded()[1])]
    return [PlainRecord(r.image, r.label) for r in records] if variation.plain else records


def cut_around(image: np.ndarray, box: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """The square around `box`, `MARGIN` times as large, as uint8 [size, size, 3], and the 2 x 3 map into it."""
    x0, y0, x1, y1 = box
    scale = size / (MARGIN * max(x1 - x0, y1 - y0))
    shift = size / 2 - scale * np.array([(x0 + x1) / 2, (y0 + y1) / 2])
    into = np.array([[scale, 0, shift[0]], [0, scale, shift[1]]])
    step = into
    if scale < 1:  # warpAffine alone would skip pixels
        image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        step = np.array([[1.0, 0, shift[0]], [0, 1.0, shift[1]]])
    fill = tuple(float(x) for x in data.MEAN[::-1])
    return cv2.warpAffine(image, step, (size, size), flags=cv2.INTER_LINEAR, borderValue=fill), into


@torch.no_grad()
def judge(net: MobileParsingRCNN, pixel_head: PixelHead, photos: PhotoSet, size: int = SIZE) -> dict[str, float]:
    """Figures of `export.evaluation.photos` where the boxes are given and PixelHead paints them."""
    tally = Tally(0.5)
    for path in photos.photos:
        labels = PhotoLabels.load(photos.labels / f"{path.stem}.npz")
        image = np.ascontiguousarray(read_photo(path)[..., ::-1])
        height, width = image.shape[:2]
        part, person = np.zeros((2, height, width), np.uint8)
        for k in np.argsort(-labels.score):
            cut, into = cut_around(image, labels.box[k], size)
            tensor = torch.from_numpy(data.normalised(cut))[None]
            found = pixel_head.index(net.detector(tensor)[0][0])[0].argmax(0).byte().numpy()
            # A cell of P2 is judged at its middle, four pixels from the next (PixelHead.cells).
            found = cv2.resize(found, (size, size), interpolation=cv2.INTER_NEAREST)
            back = cv2.warpAffine(
                found, into, (width, height), flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP, borderValue=0
            )
            x0, y0, x1, y1 = np.clip(np.round(labels.box[k]).astype(int), 0, [width, height] * 2)
            mine = np.zeros((height, width), bool)
            mine[y0:y1, x0:x1] = (back[y0:y1, x0:x1] > 0) & (person[y0:y1, x0:x1] == 0)
            part[mine], person[mine] = back[mine], k + 1
        iuv = np.stack([part, np.zeros_like(part), np.zeros_like(part)], -1)
        tally.add(path.name, Prediction(labels.box, np.ones(len(labels.box), np.float32), iuv, person), labels)
    figures = tally.figures()
    return {name: getattr(figures, name) for name in FIGURES if hasattr(figures, name)}


def train(name: str, seed: int, options: argparse.Namespace, shown: bool) -> dict[str, float]:
    """One training of `options.images` cuts, and its figures."""
    variation = VARIATIONS[name]
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    net = MobileParsingRCNN(NetworkConfig(backbone=variation.backbone)).to(memory_format=torch.channels_last)
    pixel_head = PixelHead(net.config)
    if variation.pretrained:
        net.backbone.load_state_dict(torch.load(options.pretrained))
        net.backbone.freeze()
    trained = nn.ModuleList([net, pixel_head])
    ema, optimiser = Ema(trained, 0.997), optimiser_of(net, pixel_head, 2e-3, 0.02)
    photos = data.load_records(options.data / "photos" / "shards" / variation.photos) if variation.photos else []
    batches = data.Batches(records_of(variation, options.data), BATCH, seed, 0, photos, PHOTO_SHARE, ahead=0)
    steps = options.images // BATCH
    net.train()
    autocast = torch.autocast("cpu", torch.bfloat16, enabled=options.bf16)
    for step in tqdm(range(steps), desc=f"{name} {seed}", unit="step", disable=not shown):
        for group in optimiser.param_groups:
            group["lr"] = group["rate"] * rate_at(step, step / steps, 2e-3)
        image, truths = batches.next(variation.size, variation.framing)
        image = image.contiguous(memory_format=torch.channels_last)
        optimiser.zero_grad(set_to_none=True)
        sum(surface_loss(net, image, truths, autocast, pixel_head).values()).backward()
        if torch.isfinite(nn.utils.clip_grad_norm_(trained.parameters(), 10.0)):
            optimiser.step()
            ema.update(trained, step)
    batches.close()
    averaged, averaged_head = ema.net
    dev = [options.data / "photos" / "val", options.data / "photos" / "ablation" / "dev"]
    dev = PhotoSet.find(dev, options.data / "teachers" / "labels", [])
    return judge(averaged, averaged_head, dev) | validate_surface(
        averaged, averaged_head, data.load_records(options.data / "people" / "val", 100)
    )


def prepare(folder: Path) -> None:
    """Of the photographs to train on, by package, half into `photos/ablation/train` with shards, half into `dev`."""
    photos = folder / "photos"
    for photo in load_photographs():
        if photo.split == "train":
            half = photos / "ablation" / ("train", "dev")[zlib.crc32(photo.package.encode()) % 2]
            half.mkdir(parents=True, exist_ok=True)
            link = half / f"{photo.name}.jpg"
            if not link.exists():
                link.symlink_to((photos / "train" / link.name).resolve())
    for name, fits in (("ablation", folder / "teachers" / "fits"), ("ablation-unfitted", folder / "nothing")):
        wanted = {"photos": photos / "ablation" / "train", "labels": folder / "teachers" / "labels", "fits": fits,
                  "empty": folder / "backgrounds" / "train", "out": photos / "shards" / name}  # fmt: skip
        if shards.main([text for key, value in wanted.items() for text in (f"--{key}", str(value))]):
            raise SystemExit(1)


def _work(job: tuple[str, int, argparse.Namespace, int]) -> tuple[str, int]:
    name, seed, options, number = job
    path = options.out / f"{name}-{seed}.json"
    figures = train(name, seed, options, shown=number == 0)
    path.write_text(json.dumps({"variation": name, "seed": seed, "images": options.images, **figures}))
    return name, seed


def table(folder: Path) -> str:
    """Markdown: mean and half the range over the seeds of each figure."""
    rows = [json.loads(path.read_text()) for path in sorted(folder.glob("*-*.json"))]
    lines = ["| what is different | seeds | " + " | ".join(FIGURES) + " |", "| --- | --- |" + " --- |" * len(FIGURES)]
    for name, variation in VARIATIONS.items():
        own = [row for row in rows if row["variation"] == name]
        if own:
            cells = [f"{statistics.mean(x := [r[f] for r in own]):.3f} ± {np.ptp(x) / 2:.3f}" for f in FIGURES]
            lines.append(f"| {variation.says} | {len(own)} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(".data/ablation"))
    parser.add_argument("--data", type=Path, default=Path(".data"), help="people, people-bare, photos, teachers")
    parser.add_argument("--pretrained", type=Path, default=Path(".data/teachers/backbone.pt"))
    parser.add_argument("--images", type=int, default=30_000, help="cuts a training (default %(default)s)")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--only", nargs="+", choices=VARIATIONS, default=list(VARIATIONS), metavar="NAME")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--prepare", action="store_true", help="share the photographs out, once, and stop")
    parser.add_argument("--table", action="store_true", help="print the table of the trainings that are done")
    options = parser.parse_args()
    if options.prepare:
        prepare(options.data)
        return
    if not options.table:
        options.bf16 = bf16_pays()
        options.out.mkdir(parents=True, exist_ok=True)
        jobs = [(name, seed) for name in options.only for seed in range(options.seeds)]
        jobs = [(*job, options) for job in jobs if not (options.out / f"{job[0]}-{job[1]}.json").exists()]
        with multiprocessing.get_context("spawn").Pool(options.processes, maxtasksperchild=1) as pool:
            numbered = [(*job, k % options.processes) for k, job in enumerate(jobs)]
            for name, seed in pool.imap_unordered(_work, numbered):
                tqdm.write(f"{name}, seed {seed}: done")
    print(table(options.out))


if __name__ == "__main__":
    main()
