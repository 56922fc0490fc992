"""Measures the gain of the crop pass: part accuracy and masks, person by person.

    python -m export.evaluation.person_crops --data .data/people-wide/val --crop-weights .data/runs/crops/weights.pt

Each person found by the first pass (the whole image) is labelled four times: by the first pass; from a crop turned
upright by the axis read off the first pass's surface; by the axis of the box head, where the weights have one; and by
the true axis and outline, which is what better ones would give. Each is judged alone: which of two people is in front
is left out, and so are missed people, which are counted.
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torchvision.ops import box_iou
from tqdm import tqdm

from export.densepose import targets as tg
from export.densepose.config import DecodeConfig, NetworkConfig
from export.densepose.crop_pass import CropGraphs, axis_of_surface, crop_maps, crop_of, painted
from export.densepose.decode import Graphs, detect, paint
from export.densepose.network import MobileParsingRCNN
from export.shards import LabelledImage, read_images, shard_paths
from export.surface import LIMB_SIDE

WAYS = ("whole picture", "crop, surface's axis", "crop, box head's axis", "crop, true axis")
TILTS = ((0, 15), (15, 30), (30, 60), (60, 180))  # degrees from upright
SIZES = ((0, 64), (64, 128), (128, 256), (256, 10_000))  # long side of the box, pixels of the image
MATCH_IOU = 0.5


@dataclass(frozen=True)
class Score:
    """Counts of one person and method: pixels of the body, pixels with the right part, mask IoU, limb pixels labelled
    as a limb, and limb pixels with the right side. axis_off: degrees between the used and the true axis, NaN
    without."""

    pixels: int
    right: int
    mask_iou: float
    limb: int
    same_side: int
    axis_off: float


def score(label: np.ndarray, truth: LabelledImage, number: int, axis_off: float = float("nan")) -> Score:
    """label: uint8 [H, W, 3] of one person alone."""
    own = truth.label[..., 3] == number
    found, true, part = label[..., 0] > 0, truth.label[own, 0], label[own, 0]
    side, painted_side = LIMB_SIDE[true], LIMB_SIDE[part]
    limb = (side > 0) & (painted_side > 0)
    iou = float((found & own).sum() / max((found | own).sum(), 1))
    return Score(len(true), int((true == part).sum()), iou, int(limb.sum()),
                 int((side == painted_side)[limb].sum()), axis_off)  # fmt: skip


def degrees_between(a: np.ndarray | None, b: np.ndarray) -> float:
    """NaN without a direction."""
    if a is None or not np.isfinite(b).all() or not np.linalg.norm(a) > 0 or not np.linalg.norm(b) > 0:
        return float("nan")
    return float(np.degrees(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1, 1))))


class CropJudge:
    """Labels the people of an image in all `WAYS` and keeps their scores by group. crop_net: for the second pass."""

    def __init__(
        self, net: MobileParsingRCNN, crop_net: MobileParsingRCNN, crop_size: int, config: DecodeConfig
    ) -> None:
        self.net, self.crop_net, self.crop_size, self.config = net, crop_net, crop_size, config
        self.graphs = Graphs.of_network(net)
        self.scores: dict[str, dict[str, list[Score]]] = defaultdict(lambda: defaultdict(list))
        self.people = self.missed = 0

    @torch.no_grad()
    def add(self, image: LabelledImage) -> None:
        wanted = np.flatnonzero(~image.ignore)
        self.people += len(wanted)
        found = detect(self.graphs, image.image, self.net.config, self.config)
        if not len(wanted) or not len(found.boxes):
            self.missed += len(wanted)
            return
        features, network = found.features, self.net.config
        maps = self.net.dense_head(tg.pooled(features, [found.boxes], network, network.dense_pool, level=0))
        told = None
        if network.axis:
            told = self.net.box_head.with_axis(tg.pooled(features, [found.boxes], network, network.box_pool))[2].numpy()
        boxes = found.boxes * found.boxes.new_tensor(found.scale * 2)
        overlap, match = box_iou(torch.from_numpy(image.box[wanted]), boxes).max(1)
        for person, iou, k in zip(wanted, overlap.tolist(), match.tolist(), strict=True):
            if iou < MATCH_IOU:
                self.missed += 1
                continue
            axis = None if told is None else told[k].astype(np.float64)
            self._add_person(image, person, [m[k] for m in maps], boxes[k].numpy(), axis)

    def _add_person(
        self, image: LabelledImage, person: int, maps: list[torch.Tensor], box: np.ndarray, told: np.ndarray | None
    ) -> None:
        shape, number = image.label.shape[:2], int(image.instance[person])
        first, instance = np.zeros((*shape, 3), np.uint8), np.zeros(shape, np.uint8)
        paint(maps, box.tolist(), 1, first, instance, self.config)
        true = np.full(2, np.nan) if image.axis is None else image.axis[person].astype(np.float64)
        axes = {WAYS[1]: axis_of_surface(first), WAYS[3]: true if np.isfinite(true).all() else None}
        if told is not None:
            axes[WAYS[2]] = told
        own = image.label[..., 3] == number
        crops = {
            way: crop_of(own if way == WAYS[3] else first[..., 0] > 0, box, axis, self.crop_size)
            for way, axis in axes.items()
        }
        picture = np.ascontiguousarray(image.image[..., ::-1])
        graphs = CropGraphs.of_network(self.crop_net)
        again = crop_maps(graphs, self.crop_net.config, picture, list(crops.values()))
        scores = {WAYS[0]: score(first, image, number)}
        for k, (way, crop) in enumerate(crops.items()):
            label = painted([m[k] for m in again], crop, shape, self.config)
            scores[way] = score(label, image, number, degrees_between(axes[way], true))
        for group in groups_of(image, person, true):
            for way, value in scores.items():
                self.scores[group][way].append(value)

    def table(self) -> dict[str, dict[str, dict[str, float]]]:
        """Metrics by group and way."""
        return {
            group: {way: figures(ways[way]) for way in WAYS if way in ways}
            for group, ways in sorted(self.scores.items(), key=lambda item: GROUPS.index(item[0]))
        }


GROUPS = (
    "everybody found", *(f"tilt {low}-{high}" for low, high in TILTS), "from the front", "from behind",
    *(f"{low}-{high} px" for low, high in SIZES),
)  # fmt: skip


def groups_of(image: LabelledImage, person: int, axis: np.ndarray) -> list[str]:
    groups = [GROUPS[0]]
    tilt = degrees_between(axis, np.array([0.0, -1.0]))
    groups += [f"tilt {low}-{high}" for low, high in TILTS if low <= tilt < high or (high == 180 and tilt == 180)]
    part = image.label[..., 0][image.label[..., 3] == image.instance[person]]
    back, chest = (part == 1).sum(), (part == 2).sum()
    if back + chest >= 50:
        groups.append("from behind" if back > chest else "from the front")
    x0, y0, x1, y1 = image.box[person]
    side = max(x1 - x0, y1 - y0)
    return groups + [f"{low}-{high} px" for low, high in SIZES if low <= side < high]


def figures(scores: list[Score]) -> dict[str, float]:
    """Part accuracy is the mean over people, so that small ones count as much as large ones."""
    limb = sum(s.limb for s in scores)
    off = [s.axis_off for s in scores if not np.isnan(s.axis_off)]
    return {
        "people": len(scores),
        "part": float(np.mean([s.right / s.pixels for s in scores])),
        "mask_iou": float(np.mean([s.mask_iou for s in scores])),
        "left_right": sum(s.same_side for s in scores) / limb if limb else float("nan"),
        "axis_off_degrees": float(np.median(off)) if off else float("nan"),
    }


def load_network(path: Path) -> MobileParsingRCNN:
    saved = torch.load(path, map_location="cpu", weights_only=True)
    net = MobileParsingRCNN(NetworkConfig.of(saved)).eval()
    net.load_state_dict(saved["ema"])
    return net


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(".data/people-wide/val"), metavar="DIR")
    parser.add_argument("--weights", type=Path, default=Path("export/weights/densepose-b.pt"), metavar="FILE")
    parser.add_argument("--crop-weights", type=Path, metavar="FILE", help="of the second pass (default: the same)")
    parser.add_argument("--crop-size", type=int, default=192, help="pixels (default %(default)s)")
    parser.add_argument("--long-side", type=int, default=DecodeConfig.long_side, help="of the first pass's input")
    parser.add_argument("--score", type=float, default=0.3, help="min score of a person (default %(default)s)")
    parser.add_argument("--limit", type=int, metavar="N", help="only the first N images")
    parser.add_argument("--out", type=Path, default=Path("build/evaluation/person_crops.json"), metavar="FILE")
    options = parser.parse_args()
    config = DecodeConfig(long_side=options.long_side, score_threshold=options.score)
    crop_weights = options.crop_weights or options.weights
    judge = CropJudge(load_network(options.weights), load_network(crop_weights), options.crop_size, config)
    for image in tqdm(read_images(shard_paths(options.data), options.limit), unit="image"):
        judge.add(image)
    table = judge.table()
    print(f"{judge.people} people, {judge.missed} missed")
    print(f"{'':18}{'people':>7}" + "".join(f"{way:>24}" for way in WAYS) + "   (part, mask IoU, left/right)")
    for group, ways in table.items():
        cells = [
            "{part:10.3f} {mask_iou:6.3f} {left_right:6.3f}".format(**ways[way]) if way in ways else "-" for way in WAYS
        ]
        print(f"{group:18}{ways[WAYS[0]]['people']:7}" + "".join(f"{cell:>24}" for cell in cells))
    for way in WAYS[1:3]:
        if way in table.get(GROUPS[0], {}):
            print(f"{way}: median {table[GROUPS[0]][way]['axis_off_degrees']:.1f} degrees off")
    options.out.parent.mkdir(parents=True, exist_ok=True)
    weights = {"weights": str(options.weights), "crop_weights": str(crop_weights)}
    options.out.write_text(json.dumps({**weights, "people": judge.people, "missed": judge.missed, "groups": table}))


if __name__ == "__main__":
    main()
