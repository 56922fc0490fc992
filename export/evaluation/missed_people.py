"""Measures the gain from better boxes: replaces parts of the detector by the truth and counts people again.

    python -m export.evaluation.missed_people
    python -m export.evaluation.missed_people --photos .data/photos/fresh

Photographs as in `export.evaluation.photos`, the networks in torch. Each row replaces one thing: the proposals have the
true boxes among them, each side moved by up to a tenth; NMS never lets one person's box drop another person's; the
true boxes themselves stand beside those found, with the score that the box head gives them. A row that gains nothing
shows a part that is not worth improving by itself.
"""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Iterator
from unittest import mock

import numpy as np
import torch
from rich.console import Console
from rich.table import Table
from torch import Tensor
from torchvision.ops import box_iou, nms

from export.densepose import decode
from export.densepose import targets as tg
from export.evaluation.backends import TorchBackend, open_backend
from export.evaluation.photos import PhotoFigures, PhotoSet, Tally, add_arguments, read_photo
from export.teachers.label import PhotoLabels

ROWS = {
    "as it is": frozenset(),
    "true boxes among the proposals": frozenset({"proposals"}),
    "NMS that knows who is who": frozenset({"nms"}),
    "both": frozenset({"proposals", "nms"}),
    "true boxes beside those found, and that NMS": frozenset({"boxes", "nms"}),
}
SCORE_FLOOR = 0.05
SHIFT = 0.1  # of a side, at most
MIN_IOU = 0.3  # min overlap of a box with the person that it belongs to; below, it belongs to no person


class Truth:
    """The true boxes [n, 4] of the photograph at hand, in pixels of the network's input."""

    def __init__(self) -> None:
        self.box = torch.zeros(0, 4)
        self._rng = np.random.default_rng(0)

    def look_at(self, labels: PhotoLabels, shape: tuple[int, int], long_side: int) -> None:
        self.box = torch.from_numpy(labels.box).float() * (long_side / max(shape))

    def shifted(self) -> Tensor:
        side = (self.box[:, 2:] - self.box[:, :2]).repeat(1, 2)
        return self.box + side * torch.from_numpy(self._rng.uniform(-SHIFT, SHIFT, self.box.shape)).float()

    def nms(self, boxes: Tensor, scores: Tensor, iou: float) -> Tensor:
        """As torchvision's, but for boxes of two people."""
        if not len(self.box) or not len(boxes):
            return nms(boxes, scores, iou)
        overlap, person = box_iou(boxes, self.box).max(1)
        person = torch.where(overlap > MIN_IOU, person, -1)
        among = box_iou(boxes, boxes) > iou
        one = (person[:, None] == person[None]) | (person[:, None] < 0) | (person[None] < 0)
        kept: list[int] = []
        for k in scores.argsort(descending=True).tolist():
            if not (among & one)[k, kept].any():
                kept.append(k)
        return torch.tensor(kept, dtype=torch.long)


@contextlib.contextmanager
def replaced(truth: Truth, what: frozenset[str]) -> Iterator[None]:
    """`export.densepose.decode` with some of its parts replaced by the truth."""
    proposals, box_pass = tg.proposals, decode._box_pass

    def with_true_proposals(*arguments: object) -> Tensor:
        return torch.cat([proposals(*arguments), truth.shifted()])

    def with_true_boxes(graphs, features, evidence, boxes, network, config, inner, threshold):
        found, scores = box_pass(graphs, features, evidence, boxes, network, config, inner, threshold)
        if threshold != config.score_threshold or not len(truth.box):
            return found, scores
        logits, _ = graphs.box_head(tg.pooled(features, [truth.box], network, network.box_pool))
        said = (logits[:, 0] - logits[:, 1] + tg.mean_evidence(evidence, truth.box)).sigmoid()
        seen = said > threshold
        # NMS keeps the best scored box of a person.
        found, scores = torch.cat([truth.box[seen], found]), torch.cat([said[seen], scores])
        kept = truth.nms(found, scores, config.box_nms_iou)
        return found[kept], scores[kept]

    with contextlib.ExitStack() as stack:
        if "proposals" in what:
            stack.enter_context(mock.patch.object(tg, "proposals", with_true_proposals))
        if "nms" in what:
            stack.enter_context(mock.patch.object(decode, "nms", truth.nms))
        if "boxes" in what:
            stack.enter_context(mock.patch.object(decode, "_box_pass", with_true_boxes))
        yield


def figures(backend: TorchBackend, chosen: PhotoSet, what: frozenset[str], long_side: int) -> PhotoFigures:
    tally, truth = Tally(backend.threshold), Truth()
    with replaced(truth, what):
        for path in chosen.photos:
            labels, image = PhotoLabels.load(chosen.labels / f"{path.stem}.npz"), read_photo(path)
            truth.look_at(labels, image.shape[:2], long_side)
            tally.add(path.name, backend.predict(image), labels)
    return tally.figures()


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.evaluation.missed_people", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    add_arguments(parser)
    parser.add_argument("--weights", default="torch", help="torch or torch=CHECKPOINT")
    options = parser.parse_args(argv)
    chosen = PhotoSet.find(options.photos, options.labels, [])
    backend = open_backend(options.weights, SCORE_FLOOR)
    table = Table()
    for column in ("", "recall at precision .9", "shown: recall, precision", "where boxes overlap", "mask IoU / part"):
        table.add_column(column)
    for name, what in ROWS.items():
        of = figures(backend, chosen, what, decode.DecodeConfig().long_side)
        overlapping = [g.recall for g in of.groups if g.by == "crowding"][-1]
        table.add_row(
            name, f"{of.recall_at_precision:.2f}", f"{of.recall_shown:.2f}, {of.precision_shown:.2f}",
            f"{overlapping:.2f}", f"{of.mask_iou:.2f} / {of.part_at_landmark:.2f}",
        )  # fmt: skip
    Console(width=110).print(table)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
