"""The truth in place of parts of the detector: NMS by people, and proposals."""

import torch
from torchvision.ops import nms

from export.densepose import decode
from export.densepose import targets as tg
from export.evaluation.missed_people import SHIFT, Truth, replaced

TWO = torch.tensor([[0.0, 0, 100, 100], [20, 0, 120, 100]])  # two people, IoU .67
FOUND = torch.tensor([[0.0, 0, 98, 100], [22, 0, 120, 100], [2, 0, 100, 98]])  # the first of them twice
SCORES = torch.tensor([0.9, 0.8, 0.7])


def two_people() -> Truth:
    truth = Truth()
    truth.box = TWO
    return truth


def test_only_boxes_of_one_person_drop_each_other() -> None:
    assert nms(FOUND, SCORES, 0.5).tolist() == [0]
    assert two_people().nms(FOUND, SCORES, 0.5).tolist() == [0, 1]


def test_without_people_nms_is_torchvisions() -> None:
    assert Truth().nms(FOUND, SCORES, 0.5).tolist() == [0]


def test_true_boxes_are_moved_by_a_tenth_at_most() -> None:
    moved = two_people().shifted() - TWO
    assert 0 < moved.abs().max() <= SHIFT * 100


def test_parts_are_put_back() -> None:
    before = tg.proposals, decode.nms, decode._box_pass
    with replaced(two_people(), frozenset({"proposals", "nms", "boxes"})):
        assert before[1] is not decode.nms
    assert (tg.proposals, decode.nms, decode._box_pass) == before
