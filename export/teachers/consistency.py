"""Labels by consistency: answers of a trained network about people in photographs, seen large, upright and several
times, as labels for the same people turned, shrunk and blurred.

The teachers know a region here and there (`coarse.py`) and for the rest of a mask only that it is a person. Where
weights that are asked several times agree with themselves, and with what the teachers leave possible, their answer
becomes the label, so that training keeps on hard views what was right on easy ones.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from export.densepose import targets as tg
from export.densepose.config import DecodeConfig, NetworkConfig
from export.densepose.data import MEAN, normalised
from export.densepose.decode import Graphs, infer
from export.densepose.network import MobileParsingRCNN
from export.densepose.person_crop import crop_around, cut, outline, turned_box
from export.shards import BOX_ALONE, POSSIBLE_PARTS, UNSURE
from export.surface import MIRROR_COARSE, MIRROR_FLIPS_U, MIRROR_FLIPS_V, MIRROR_PART, PART_COUNT

CROP_SIDES_PX = (256,)  # three sizes take an hour of a core more for 1,000 photographs
MIN_HEIGHT_PX = 96  # smaller people are no easy view
MIN_PROBABILITY = 0.7  # of a part, as the mean of all answers
FINDING = DecodeConfig(long_side=480, score_threshold=0.3)  # of people whom the teachers may have missed


@dataclass(frozen=True)
class Answer:
    """About the 64 x 64 grid of one person's box: probability of the 15 coarse classes [15, s, s] and of the 25 parts
    [25, s, s] (0: none), and their U and V [25, s, s]."""

    coarse: Tensor
    index: Tensor
    u: Tensor
    v: Tensor

    @staticmethod
    def mean(answers: list[Answer]) -> Answer:
        """U and V of a part are averaged with the weight of its probability."""
        weight = torch.stack([a.index for a in answers])
        share = weight / weight.sum(0).clamp(min=1e-6)
        return Answer(
            torch.stack([a.coarse for a in answers]).mean(0), weight.mean(0),
            (share * torch.stack([a.u for a in answers])).sum(0), (share * torch.stack([a.v for a in answers])).sum(0),
        )  # fmt: skip

    def mirrored(self) -> Answer:
        """The answer about the mirrored image as one about the image."""
        part = torch.from_numpy(MIRROR_PART).long()

        def flipped(chart: Tensor, flips: np.ndarray) -> Tensor:
            turned = torch.where(torch.from_numpy(flips)[:, None, None], 1 - chart, chart)
            return turned.flip(-1)[part]

        return Answer(
            self.coarse.flip(-1)[torch.from_numpy(MIRROR_COARSE).long()], self.index.flip(-1)[part],
            flipped(self.u, MIRROR_FLIPS_U), flipped(self.v, MIRROR_FLIPS_V),
        )  # fmt: skip


class Consensus:
    """Several weights, asked at each of the crop sizes, mirrored and not."""

    def __init__(self, networks: list[MobileParsingRCNN], sides_px: tuple[int, ...] = CROP_SIDES_PX) -> None:
        self.networks, self.sides_px = networks, sides_px

    @staticmethod
    def of_files(weights: list[Path]) -> Consensus:
        networks = []
        for path in weights:
            saved = torch.load(path, map_location="cpu", weights_only=True)
            net = MobileParsingRCNN(NetworkConfig.of(saved)).eval()
            net.load_state_dict({name: value.float() for name, value in saved["ema"].items()})
            networks.append(net)
        return Consensus(networks)

    @torch.no_grad()
    def ask(self, image: np.ndarray, mask: np.ndarray) -> tuple[Answer, np.ndarray]:
        """The mean answer about the person with the outline `mask` bool [H, W] in `image` uint8 [H, W, 3] BGR, and the
        box float64 [4] in the image that its grid lies on."""
        box = turned_box(outline(mask), np.eye(2))
        answers = []
        for side in self.sides_px:
            crop = crop_around(box, np.eye(2), side)
            pixels = normalised(cut(image, crop, tuple(MEAN[::-1].tolist())))
            both = torch.from_numpy(np.stack([pixels, pixels[..., ::-1]]))
            low, _, high, _ = crop.box
            boxes = [torch.from_numpy(crop.box[None].astype(np.float32)) for _ in range(2)]
            boxes[1][0, 0], boxes[1][0, 2] = side - high, side - low
            for net in self.networks:
                pooled = tg.pooled([net.finest(both)], boxes, net.config, net.config.dense_pool, level=0)
                coarse, index, u, v = net.dense_head(pooled)
                index[:, 0] = -torch.inf  # asked of body pixels only
                plain, other = (
                    Answer(coarse[k].softmax(0), index[k].softmax(0), u[k].clamp(0, 1), v[k].clamp(0, 1))
                    for k in range(2)
                )
                answers += [plain, other.mirrored()]
        return Answer.mean(answers), box

    def complete(self, image: np.ndarray, label: np.ndarray, min_probability: float = MIN_PROBABILITY) -> np.ndarray:
        """label: uint8 [H, W, 4] of `export.shards`, with people of whom less than the part is known. A copy in which
        part, U and V stand where the answers agree on a part that the label leaves possible."""
        out = label.copy()
        for number in np.unique(label[..., 3]):
            mask = label[..., 3] == number
            rows = np.flatnonzero(mask.any(1))
            if number == 0 or number >= BOX_ALONE or rows[-1] - rows[0] < MIN_HEIGHT_PX:
                continue
            answer, box = self.ask(image, mask)
            y, x = np.nonzero(mask & (label[..., 0] > PART_COUNT) & (label[..., 0] != UNSURE))
            iuv, probability = _read(answer, box, np.stack([x, y], 1) + 0.5, POSSIBLE_PARTS[label[y, x, 0]])
            sure = probability >= min_probability
            out[y[sure], x[sure], :3] = iuv[sure]
        return out

    def ignore_unlabelled(self, image: np.ndarray, label: np.ndarray) -> np.ndarray:
        """A copy of the label in which training leaves out people whom the first weights find and the label does not
        have. In a crowd the teachers miss many, who would be learnt as background."""
        net, out = self.networks[0], label.copy()
        found = infer(Graphs.of_network(net), np.ascontiguousarray(image[..., ::-1]), net.config, FINDING)
        for k in range(len(found.boxes)):
            own = found.instance == k + 1
            free = own & (label[..., 3] == 0)
            if 2 * free.sum() > own.sum():
                out[free] = (UNSURE, 0, 0, 255 - k)
        return out


class KeptConsensus:
    """The consensus of weights files. It keeps its labels in a folder, by image, label and weights, so that a stopped
    run goes on where it was."""

    def __init__(self, weights: list[Path], folder: Path) -> None:
        self._consensus, self._folder = Consensus.of_files(weights), folder
        self._weights = b"".join(hashlib.sha256(path.read_bytes()).digest() for path in weights)

    def complete(self, image: np.ndarray, label: np.ndarray) -> np.ndarray:
        """As `Consensus.complete`, then `Consensus.ignore_unlabelled`."""
        name = hashlib.sha256(self._weights + image.tobytes() + label.tobytes()).hexdigest()
        path = self._folder / f"{name}.png"
        if path.exists():
            return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        completed = self._consensus.ignore_unlabelled(image, self._consensus.complete(image, label))
        self._folder.mkdir(parents=True, exist_ok=True)
        partial = path.with_suffix(".partial.png")
        cv2.imwrite(str(partial), completed)
        partial.replace(path)
        return completed


def _read(answer: Answer, box: np.ndarray, at: np.ndarray, possible: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The best part among `possible` bool [K, 25] at the points `at` [K, 2] of the image: uint8 [K, 3] =
    (I, U*255, V*255), and the part's probability float32 [K] among all."""
    if not len(at):
        return np.zeros((0, 3), np.uint8), np.zeros(0, np.float32)
    grid = torch.from_numpy(((at - box[:2]) / (box[2:] - box[:2]) * 2 - 1).astype(np.float32))[None, None]
    index, u, v = (
        F.grid_sample(m[None], grid, padding_mode="border", align_corners=False)[0, :, 0]
        for m in (answer.index, answer.u, answer.v)
    )
    allowed = torch.where(torch.from_numpy(possible.T.copy()), index, 0)
    probability, part = allowed.max(0)
    chart = [m.gather(0, part[None])[0].clamp(0, 1) * 255 for m in (u, v)]
    return torch.stack([part.float(), *chart], 1).round().byte().numpy(), probability.numpy()
