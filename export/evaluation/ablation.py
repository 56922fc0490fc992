"""What decides: short trainings of the surface alone that differ in one thing, judged on real photographs.

    python -m export.people.dataset --images 3000 --bare --out .data/people-bare
    python -m export.evaluation.ablation --prepare      half of the photographs to train on, half to judge by
    python -m export.evaluation.ablation                all variations; resumes; takes hours
    python -m export.evaluation.ablation --show         docs/ablation.json and docs/pictures/ablation.png from them

Each variation changes one thing of the reference and is trained with several seeds, one process a core, on the loss of
the surface stage (`export.densepose.losses.surface_loss`). Judged are photographs that none of them trained on, with
boxes, masks and landmarks of the teachers: the labels of the last layer of the trunk (PixelHead) inside each box.
Trainings that are done are not repeated.
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
import matplotlib

matplotlib.use("Agg")
import numpy as np
import torch
from matplotlib import pyplot
from torch import nn
from tqdm import tqdm

from export.densepose import data
from export.densepose.config import NetworkConfig
from export.densepose.losses import PixelHead, surface_loss
from export.densepose.network import MobileParsingRCNN
from export.densepose.train import optimiser_of
from export.densepose.validation import validate_surface
from export.evaluation.backends import Prediction
from export.evaluation.photos import PhotoSet, Tally, read_photo
from export.photos.backgrounds import load_photographs
from export.shards import Record, load_records
from export.teachers import shards
from export.teachers.label import PhotoLabels
from export.training import Ema, bf16_pays, rate_at

SIZE = 128
BATCH = 8
FIGURES = {  # of photographs, the last one of rendered people
    "mask_iou": "mask IoU",
    "part_at_landmark": "part at landmark",
    "left_right": "left/right",
    "pixel_part": "part, rendered",
}
MARGIN = 1.15  # of the box judged
PHOTO_FRACTION = 0.33


@dataclass(frozen=True)
class Variation:
    """One training. `says`: what is different, for the table."""

    says: str
    rendered: str = "people"
    count: int | None = None  # of the rendered images
    size: int = SIZE
    cropping: data.Cropping = data.CLOSE_CROPPING
    photos: str = ""  # shards of photographs in place of a third of the images
    width: int = 64
    backbone: str = "mobilenet_v2"
    pretrained: bool = True
    keep: Callable[[np.ndarray], bool] | None = None  # of the label; images that are left in
    plain: bool = False


VARIATIONS = {
    "reference": Variation("close crops of 128 pixels, pretrained MobileNetV2"),
    "scratch": Variation("MobileNetV2 from random weights", pretrained=False),
    "v3": Variation("MobileNetV3-Large from random weights", pretrained=False, backbone="mobilenet_v3_large"),
    "photos": Variation("a third of the images photographs: masks, regions, fitted bodies", photos="ablation"),
    "photos-unfitted": Variation("a third photographs: masks and regions alone", photos="ablation-unfitted"),
    "usual": Variation(
        "renderings as photographs show people, a third photographs, hands by wrist and knuckles",
        rendered="people-usual",
        photos="ablation",
    ),
    "usual-hands": Variation("the same with outlines of hands", rendered="people-usual", photos="ablation-hands"),
    "usual-consistent": Variation(
        "the same and labels by consistency", rendered="people-usual", photos="ablation-consistent"
    ),
    "few": Variation("3,000 rendered images", count=3000),
    "fewer": Variation("1,000 rendered images", count=1000),
    "bare": Variation("3,000 rendered images without clothes", rendered="people-bare", count=3000),
    "plain": Variation("one colour in place of the background", plain=True),
    "alone": Variation("only images of at most one person", keep=lambda label: label[..., 3].max() < 2),
    "any-cropping": Variation("people of a third to 1.3 times the crop", cropping=data.ANY_CROPPING),
    "small-crops": Variation("crops of 96 pixels", size=96),
    "wide": Variation("neck and heads 112 channels wide", width=112),
}


class PlainRecord(Record):
    """A record with one colour, its own, around the people."""

    def decoded(self) -> tuple[np.ndarray, np.ndarray]:
        image, label = super().decoded()
        rng = np.random.default_rng(zlib.crc32(self.image))
        image[label[..., 3] == 0] = rng.integers(0, 256, 3)
        return image, label


def records_of(variation: Variation, folder: Path) -> list[Record]:
    records = load_records(folder / variation.rendered / "train", variation.count)
    if variation.keep:
        records = [r for r in records if variation.keep(r.decoded()[1])]
    return [PlainRecord(r.image, r.label) for r in records] if variation.plain else records


def crop_around(image: np.ndarray, box: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
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
            crop, into = crop_around(image, labels.box[k], size)
            tensor = torch.from_numpy(data.normalised(crop))[None]
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
    """One training of `options.images` crops, and its figures."""
    variation = VARIATIONS[name]
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    net = MobileParsingRCNN(NetworkConfig(variation.width, variation.backbone)).to(memory_format=torch.channels_last)
    pixel_head = PixelHead(net.config)
    if variation.pretrained:
        net.backbone.load_state_dict(torch.load(options.pretrained))
        net.backbone.freeze()
    trained = nn.ModuleList([net, pixel_head])
    ema, optimiser = Ema(trained, 0.997), optimiser_of(net, pixel_head, 2e-3, 0.02)
    photos = load_records(options.data / "photos" / "shards" / variation.photos) if variation.photos else []
    records = records_of(variation, options.data)
    batches = data.Batches(records, BATCH, seed, 0, photos, PHOTO_FRACTION, ahead=0)
    steps = options.images // BATCH
    net.train()
    autocast = torch.autocast("cpu", torch.bfloat16, enabled=options.bf16)
    for step in tqdm(range(steps), desc=f"{name} {seed}", unit="step", disable=not shown):
        for group in optimiser.param_groups:
            group["lr"] = group["rate"] * rate_at(step, step / steps, 2e-3)
        image, truths = batches.next((variation.size,), variation.cropping)
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
    rendered = validate_surface(
        averaged, averaged_head, load_records(options.data / "people" / "val", 100), 128, data.CLOSE_CROPPING
    )
    return judge(averaged, averaged_head, dev) | rendered | {"rendered": len(records)}


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
    fits, nothing = str(folder / "teachers" / "fits"), str(folder / "nothing")
    weights = ["export/weights/densepose-b.pt", "export/weights/densepose-b-crops.pt"]
    for name, differing in (
        ("ablation", ["--no-hands", "--fits", fits]),
        ("ablation-unfitted", ["--no-hands", "--fits", nothing]),
        ("ablation-hands", ["--fits", fits]),
        ("ablation-consistent", ["--fits", fits, "--consistent", *weights]),
    ):
        wanted = {"photos": photos / "ablation" / "train", "labels": folder / "teachers" / "labels",
                  "empty": folder / "backgrounds" / "train", "out": photos / "shards" / name}  # fmt: skip
        if shards.main([*(text for key, value in wanted.items() for text in (f"--{key}", str(value))), *differing]):
            raise SystemExit(1)


def _work(job: tuple[str, int, argparse.Namespace, int]) -> tuple[str, int]:
    name, seed, options, number = job
    path = options.out / f"{name}-{seed}.json"
    figures = train(name, seed, options, shown=number == 0)
    path.write_text(json.dumps({"variation": name, "seed": seed, "images": options.images, **figures}))
    return name, seed


def gathered(folder: Path) -> list[dict]:
    """The trainings done, in the order of `VARIATIONS`."""
    rows = [json.loads(path.read_text()) for path in folder.glob("*-*.json")]
    return sorted(rows, key=lambda row: (list(VARIATIONS).index(row["variation"]), row["seed"]))


def table(rows: list[dict]) -> str:
    """Markdown: mean and half the range over the seeds of each figure."""
    lines = ["| what is different | " + " | ".join(FIGURES.values()) + " |", "| --- |" + " --- |" * len(FIGURES)]
    for name, variation in VARIATIONS.items():
        own = [row for row in rows if row["variation"] == name]
        if own:
            cells = [f"{statistics.mean(x := [r[f] for r in own]):.3f} ± {np.ptp(x) / 2:.3f}" for f in FIGURES]
            lines.append(f"| {variation.says} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw(rows: list[dict], path: Path) -> None:
    """Left: every seed's distance from the mean of `reference`, in points. Right: the figures against the number of
    rendered images, where only that is different."""
    done = [name for name in VARIATIONS if any(row["variation"] == name for row in rows)]
    figure, (left, right) = pyplot.subplots(
        1, 2, figsize=(13, 1.6 + 0.45 * len(done)), width_ratios=(3, 1.2), layout="constrained"
    )
    mean = {f: statistics.mean(row[f] for row in rows if row["variation"] == "reference") for f in FIGURES}
    for k, (field, label) in enumerate(FIGURES.items()):
        y = [done.index(row["variation"]) + 0.17 * (k - (len(FIGURES) - 1) / 2) for row in rows]
        left.plot([100 * (row[field] - mean[field]) for row in rows], y, "o", color=f"C{k}", label=label, alpha=0.8)
        amounts = sorted(
            (row["rendered"], row[field]) for row in rows if row["variation"] in ("fewer", "few", "reference")
        )
        right.plot(*zip(*amounts, strict=True), "o", color=f"C{k}", alpha=0.8)
        counts = sorted({count for count, _ in amounts})
        right.plot(counts, [statistics.mean(v for n, v in amounts if n == count) for count in counts], color=f"C{k}")
    left.axvline(0, color="0.6", linewidth=1)
    for k in range(1, len(done)):
        left.axhline(k - 0.5, color="0.9", linewidth=1)
    left.set_yticks(range(len(done)), [VARIATIONS[name].says for name in done])
    left.invert_yaxis()
    left.set_xscale("symlog", linthresh=5)  # one variation differs ten times as much as the others
    left.set_xticks([-20, -10, -5, -2, 0, 2, 5, 10, 20], ["-20", "-10", "-5", "-2", "0", "2", "5", "10", "20"])
    left.set(xlabel="points from the reference (a dot a seed)")
    left.legend(fontsize=8, loc="best")
    right.set(xlabel="rendered images", ylim=(0, 1), xlim=(0, None))
    for axis in (left, right):
        axis.grid(alpha=0.3, axis="x" if axis is left else "both")
    figure.savefig(path, dpi=90)
    pyplot.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(".data/ablation"))
    parser.add_argument("--data", type=Path, default=Path(".data"), help="people, people-bare, photos, teachers")
    parser.add_argument("--pretrained", type=Path, default=Path(".data/teachers/backbone.pt"))
    parser.add_argument("--images", type=int, default=30_000, help="crops a training (default %(default)s)")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--only", nargs="+", choices=VARIATIONS, default=list(VARIATIONS), metavar="NAME")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--prepare", action="store_true", help="share the photographs out, once, and stop")
    parser.add_argument("--show", action="store_true", help="write docs/ablation.json, its picture and its table")
    parser.add_argument("--docs", type=Path, default=Path("docs"))
    options = parser.parse_args()
    if options.prepare:
        prepare(options.data)
        return
    if not options.show:
        options.bf16 = bf16_pays()
        options.out.mkdir(parents=True, exist_ok=True)
        jobs = [(name, seed) for name in options.only for seed in range(options.seeds)]
        jobs = [(*job, options) for job in jobs if not (options.out / f"{job[0]}-{job[1]}.json").exists()]
        with multiprocessing.get_context("spawn").Pool(options.processes, maxtasksperchild=1) as pool:
            numbered = [(*job, k % options.processes) for k, job in enumerate(jobs)]
            for name, seed in pool.imap_unordered(_work, numbered):
                tqdm.write(f"{name}, seed {seed}: done")
    rows = gathered(options.out)
    print(table(rows))
    if options.show:
        (options.docs / "ablation.json").write_text(json.dumps(rows, indent=1) + "\n")
        draw(rows, options.docs / "pictures" / "ablation.png")


if __name__ == "__main__":
    main()
