"""The reference decode gives a right image, also for networks and images that are not well behaved."""

import dataclasses
import math

import numpy as np
import pytest
import torch

from export.densepose import boxes as bx
from export.densepose.config import DecodeConfig, NetworkConfig
from export.densepose.decode import Canvas, Graphs, infer, keypoints_of, paint
from export.densepose.network import MobileParsingRCNN

CONFIG = NetworkConfig()
IMAGE = np.full((120, 160, 3), 90, np.uint8)
DECODE = DecodeConfig(long_side=160)
HALF = DecodeConfig(mask_threshold=0.5)


def fake_graphs(objectness=0.0, delta=0.0, person=10.0, part=3, u=0.5, v=0.25, evidence=None) -> Graphs:
    """Networks that answer the same everywhere: these logits, deltas, part and coordinates, this evidence of people."""

    def detector(image):
        sizes = [(-(-image.shape[2] // s), -(-image.shape[3] // s)) for s in CONFIG.rpn_strides]
        features = [torch.zeros(1, 64, *size) for size in sizes]
        scores = [torch.full((1, 3, *size), float(objectness)) for size in sizes]
        deltas = [torch.full((1, 12, *size), float(delta)) for size in sizes]
        return features, scores, deltas, None if evidence is None else torch.full((1, 1, *sizes[2]), evidence)

    def box_head(rois):
        logits = torch.tensor([float(person), 0.0]).expand(len(rois), 2)
        return logits, torch.full((len(rois), 4), float(delta))

    def dense_head(rois):
        coarse, index = torch.zeros(len(rois), 15, 64, 64), torch.zeros(len(rois), 25, 64, 64)
        coarse[:, 2], index[:, part] = 5.0, 5.0
        return coarse, index, torch.full_like(index, u), torch.full_like(index, v)

    return Graphs(detector, box_head, dense_head)


def assert_sound(result, image) -> None:
    height, width = image.shape[:2]
    assert result.iuv.shape == (height, width, 3)
    assert result.instance.shape == (height, width)
    assert np.isfinite(result.boxes).all()
    assert np.isfinite(result.scores).all()
    assert (result.boxes >= -1e-3).all()
    assert (result.boxes[:, [0, 2]] <= width + 1e-3).all()
    assert (result.boxes[:, [1, 3]] <= height + 1e-3).all()
    assert (result.iuv[..., 0] > 0).sum() == (result.instance > 0).sum()
    assert result.instance.max() <= len(result.boxes)


def test_nobody_gives_an_empty_image():
    result = infer(fake_graphs(person=-10), IMAGE, CONFIG, DECODE)
    assert len(result.boxes) == 0
    assert not result.iuv.any()


def test_people_are_painted_with_their_part_and_coordinates():
    result = infer(fake_graphs(), IMAGE, CONFIG, DECODE)
    assert_sound(result, IMAGE)
    assert len(result.boxes)
    assert np.unique(result.iuv[result.instance > 0], axis=0).tolist() == [[3, 128, 64]]


def test_evidence_is_added_to_the_logit_of_a_person():
    plain = infer(fake_graphs(person=2.0), IMAGE, CONFIG, DECODE)
    less = infer(fake_graphs(person=2.0, evidence=-1.0), IMAGE, CONFIG, DECODE)
    # The larger part of a box in the image's corner lies on the map, where the evidence is the same everywhere.
    assert less.scores.min() == pytest.approx(torch.tensor(1.0).sigmoid().item(), abs=1e-4)
    assert plain.scores.min() == pytest.approx(torch.tensor(2.0).sigmoid().item(), abs=1e-6)
    assert len(infer(fake_graphs(person=2.0, evidence=-3.0), IMAGE, CONFIG, DECODE).boxes) == 0


def test_the_second_pass_decides():
    graphs, passes = fake_graphs(), []

    def box_head(rois):
        passes.append(len(rois))
        logits = torch.tensor([0.0 if len(passes) == 1 else 3.0, 0.0]).expand(len(rois), 2)
        return logits, torch.zeros(len(rois), 4)

    unsure = dataclasses.replace(graphs, box_head=box_head)
    once = infer(unsure, IMAGE, CONFIG, dataclasses.replace(DECODE, score_threshold=0.7, second_pass_threshold=None))
    assert len(once.boxes) == 0
    assert len(passes) == 1
    passes.clear()
    twice = infer(unsure, IMAGE, CONFIG, dataclasses.replace(DECODE, score_threshold=0.7, second_pass_threshold=0.3))
    assert len(twice.boxes) > 0
    assert len(passes) == 2
    assert passes[1] < passes[0], "only boxes that survived the first pass's suppression"


@pytest.mark.parametrize("size", [(1, 1), (16, 16), (31, 33), (1, 400), (400, 1), (97, 640)])
def test_any_image_size_gives_boxes_inside_the_image(size):
    image = np.zeros((*size, 3), np.uint8)
    assert_sound(infer(fake_graphs(), image, CONFIG, DECODE), image)


@pytest.mark.parametrize("broken", [float("nan"), float("inf"), 1e4, -1e4])
def test_broken_deltas_give_no_broken_boxes(broken):
    assert_sound(infer(fake_graphs(delta=broken), IMAGE, CONFIG, DECODE), IMAGE)


def test_not_a_number_scores_give_nobody():
    assert len(infer(fake_graphs(objectness=float("nan")), IMAGE, CONFIG, DECODE).boxes) == 0
    assert len(infer(fake_graphs(person=float("nan")), IMAGE, CONFIG, DECODE).boxes) == 0


def test_coordinates_outside_the_chart_are_clamped():
    result = infer(fake_graphs(u=-3.0, v=7.0), IMAGE, CONFIG, DECODE)
    assert np.unique(result.iuv[result.instance > 0], axis=0).tolist() == [[3, 0, 255]]


def test_no_more_people_than_asked_for():
    few = DecodeConfig(long_side=160, max_people=2)
    assert len(infer(fake_graphs(), IMAGE, CONFIG, few).boxes) == 2


def test_a_box_without_a_painted_pixel_is_no_person():
    someone, halves = fake_graphs(), iter([True, False] * 100)

    def every_other_one_empty(rois):
        coarse, *others = someone.dense_head(rois)
        coarse[[k for k in range(len(rois)) if next(halves)], 0] = 20.0
        return coarse, *others

    everybody = infer(someone, IMAGE, CONFIG, DECODE)
    left = infer(Graphs(someone.detector, someone.box_head, every_other_one_empty), IMAGE, CONFIG, DECODE)
    assert 0 < len(left.boxes) < len(everybody.boxes)
    assert len(left.scores) == len(left.boxes)
    assert_sound(left, IMAGE)
    assert sorted(set(left.instance.flat) - {0}) == list(range(1, len(left.boxes) + 1))


def test_painted_where_the_person_is_likelier_than_the_threshold():
    coarse, index, u, v = (m[0] for m in fake_graphs().dense_head(torch.zeros(1, 64, 32, 32)))
    coarse[:] = -torch.inf
    coarse[0], coarse[7] = 0.0, math.log(0.3 / 0.7)  # a person with probability 0.3
    for threshold, painted in ((0.5, 0), (0.31, 0), (0.29, 1600)):
        canvas = Canvas.of_size(40, 40)
        config = DecodeConfig(mask_threshold=threshold)
        assert paint([coarse, index, u, v], [0, 0, 40, 40], 1, canvas, config) == painted
        assert canvas.instance.sum() == painted


def test_the_first_person_stays_in_front():
    maps = [m[0] for m in fake_graphs(part=3).dense_head(torch.zeros(1, 64, 32, 32))]
    later = [m[0] for m in fake_graphs(part=7).dense_head(torch.zeros(1, 64, 32, 32))]
    canvas = Canvas.of_size(40, 40)
    paint(maps, [0, 0, 20, 20], 1, canvas, HALF)
    paint(later, [10, 10, 40, 40], 2, canvas, HALF)
    assert canvas.instance[15, 15] == 1
    assert canvas.iuv[15, 15, 0] == 3
    assert canvas.instance[30, 30] == 2
    assert canvas.iuv[30, 30, 0] == 7


def test_a_pixel_goes_to_the_likelier_person():
    maps = [m[0] for m in fake_graphs(part=3).dense_head(torch.zeros(1, 64, 32, 32))]
    likelier = [m[0].clone() for m in fake_graphs(part=7).dense_head(torch.zeros(1, 64, 32, 32))]
    likelier[0][0] -= 2  # background
    canvas = Canvas.of_size(40, 40)
    assert paint(maps, [0, 0, 20, 40], 1, canvas, HALF) == 800
    assert paint(likelier, [10, 0, 40, 40], 2, canvas, HALF) == 1200
    assert canvas.painted == {1: 400, 2: 1200}
    assert (canvas.instance[:, 10:20] == 2).all()
    assert (canvas.iuv[:, 10:20, 0] == 7).all()
    # Nobody is left with less than the fraction that must be visible.
    canvas = Canvas.of_size(40, 40)
    paint(maps, [0, 0, 20, 40], 1, canvas, HALF)
    assert paint(likelier, [10, 0, 40, 40], 2, canvas, DecodeConfig(min_visible_fraction=0.51)) == 800
    assert (canvas.instance[:, 10:20] == 1).all()


def test_who_lies_mostly_on_others_leaves_no_trace():
    maps = [m[0] for m in fake_graphs(part=3).dense_head(torch.zeros(1, 64, 32, 32))]
    canvas = Canvas.of_size(40, 40)
    paint(maps, [0, 0, 20, 40], 1, canvas, HALF)
    before = canvas.iuv.copy()
    second = [maps, [10, 0, 30, 40], 2, canvas]  # half of its pixels are free
    assert paint(*second, DecodeConfig(min_visible_fraction=0.51)) == 0
    assert canvas.instance.max() == 1
    assert np.array_equal(canvas.iuv, before)
    assert paint(*second, DecodeConfig(min_visible_fraction=0.5)) == 400


def test_coarse_background_wins_over_a_part():
    coarse, index, u, v = (m[0] for m in fake_graphs().dense_head(torch.zeros(1, 64, 32, 32)))
    coarse[:, :32] = 0
    coarse[0, :32] = 5.0
    canvas = Canvas.of_size(64, 64)
    paint([coarse, index, u, v], [0, 0, 64, 64], 1, canvas, HALF)
    assert not canvas.instance[:32].any()
    assert canvas.instance[32:].all()


def test_parts_count_together_against_background():
    coarse, index, u, v = (m[0] for m in fake_graphs().dense_head(torch.zeros(1, 64, 32, 32)))
    coarse[:] = 0
    coarse[0, :32], coarse[0, 32:] = 1.0, 3.0  # log(14) = 2.64 lies between
    index[0] = 20.0
    canvas = Canvas.of_size(64, 64)
    paint([coarse, index, u, v], [0, 0, 64, 64], 1, canvas, HALF)
    assert canvas.instance[:31].all()
    assert not canvas.instance[33:].any()


def test_coordinates_are_resized_with_half_pixel_centres():
    coarse, index, u, v = (m[0] for m in fake_graphs().dense_head(torch.zeros(1, 64, 32, 32)))
    u = (torch.arange(64) / 63).expand(25, 64, 64)
    canvas = Canvas.of_size(30, 100)
    paint([coarse, index, u, v], [0, 0, 100, 30], 1, canvas, HALF)
    at = np.clip((np.arange(100) + 0.5) * 0.64 - 0.5, 0, 63)
    assert np.abs(canvas.iuv[15, :, 1] - at / 63 * 255).max() <= 0.51


def test_a_keypoint_lies_in_the_middle_of_its_likeliest_cells():
    logits = torch.full((1, 2, 64, 64), -20.0)
    logits[0, 0, 10, 20] = logits[0, 0, 10, 21] = 5.0  # cells to either side of x = 21
    logits[0, 1] = 0.0  # nowhere in particular
    (first, second) = keypoints_of(logits, torch.tensor([[100.0, 50.0, 164.0, 178.0]]))[0]
    torch.testing.assert_close(first, torch.tensor([121.0, 50 + 21.0, 1.0]), atol=1e-3, rtol=0)
    assert second[2] < 0.01


def test_an_untrained_network_runs_end_to_end():
    torch.manual_seed(0)
    net = MobileParsingRCNN(CONFIG).eval()
    anyone = DecodeConfig(long_side=160, score_threshold=0.0, max_people=3)
    result = infer(Graphs.of_network(net), IMAGE, CONFIG, anyone)
    assert_sound(result, IMAGE)
    assert 1 <= len(result.boxes) <= 3  # whom the first ones cover has no pixel left
    assert list(result.scores) == sorted(result.scores, reverse=True)


def test_boxes_are_clipped_at_the_image_not_at_its_padding():
    boxes = bx.clip(torch.tensor([[-5.0, -5.0, 500.0, 500.0]]), 120, 160)
    assert boxes.tolist() == [[0, 0, 160, 120]]
