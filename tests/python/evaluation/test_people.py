"""Person by person: groups, calibration and the choice of failures, in cases that can be counted by hand."""

from dataclasses import replace

import numpy as np
import pytest

from export.evaluation.average_precision import ImageMatches
from export.evaluation.backends import Prediction
from export.evaluation.breakdown import breakdown, left_right, mean_mask_iou
from export.evaluation.calibration import calibrate
from export.evaluation.failures import worst_cases
from export.evaluation.people import LIMB_SIDE, FalseAlarm, PersonRecord, compare, crowding, rendered_people
from export.shards import LabelledImage
from export.surface import PART_NAMES

SOMEBODY = PersonRecord(
    image="a", box=(0, 0, 1, 1), height_px=100, cut=False, crowding=0, groups_seen=1, found=True, mask_iou=1,
    asked=100, right=100, limb=100, same_side=100,
)  # fmt: skip


def detections(score, right):
    """Detections of one image with one person each; those that are not right are of nobody."""
    return ImageMatches(np.array(score), np.diag(np.array(right, float)), np.zeros(len(score)))


def test_scores_that_are_the_share_of_right_boxes_have_no_calibration_error():
    table = calibrate([detections([0.75] * 4, [1, 1, 1, 0]), detections([0.25] * 4, [0, 0, 1, 0])])
    assert table.expected_error == pytest.approx(0)
    assert (table.count[7], table.fraction_right[7], table.mean_score[7]) == (4, 0.75, 0.75)
    assert np.isnan(table.fraction_right[0])


def test_calibration_error_is_the_gap_weighted_by_the_detections_of_a_bin():
    table = calibrate([detections([0.9, 0.9, 0.9], [1, 0, 0]), detections([0.4], [1])])
    assert table.expected_error == pytest.approx((3 * (0.9 - 1 / 3) + 1 * (1 - 0.4)) / 4)


def test_a_score_of_one_falls_into_the_last_bin_and_ignored_people_into_none():
    ignored = ImageMatches(np.array([0.9]), np.zeros((1, 0)), np.array([0.8]))
    table = calibrate([detections([1.0], [1]), ignored])
    assert table.count == [0] * 9 + [1]
    assert np.isnan(calibrate([]).expected_error)


def test_people_are_grouped_by_size_frame_neighbours_and_visible_body():
    people = [
        replace(SOMEBODY, height_px=63.9, cut=True, crowding=0.31, groups_seen=0.4),
        replace(SOMEBODY, height_px=64, crowding=0.3, groups_seen=0.5),
        replace(SOMEBODY, height_px=128, crowding=0.01, groups_seen=0.75),
        replace(SOMEBODY, height_px=128.1, groups_seen=float("nan")),
    ]
    assert [(group.by, group.people) for group in breakdown(people)] == [
        ("size", 1), ("size", 2), ("size", 1), ("truncation", 3), ("truncation", 1),
        ("crowding", 1), ("crowding", 2), ("crowding", 1), ("visibility", 1), ("visibility", 1), ("visibility", 1),
    ]  # fmt: skip


def test_a_group_weighs_parts_by_pixels_and_masks_by_people():
    missed = replace(SOMEBODY, found=False, mask_iou=0, asked=300, right=0)
    unknown = replace(SOMEBODY, mask_iou=float("nan"), asked=0, right=0)
    group = breakdown([SOMEBODY, missed, unknown])[0]
    assert (group.recall, group.part_accuracy, group.mask_iou) == (pytest.approx(2 / 3), 0.25, 0.5)
    assert np.isnan(mean_mask_iou([unknown]))
    assert left_right([SOMEBODY, replace(SOMEBODY, limb=300, same_side=0)]) == 0.25


def test_crowding_is_the_largest_overlap_with_anybody_else():
    box = np.array([[0, 0, 10, 10], [5, 0, 15, 10], [9, 0, 19, 10], [50, 50, 60, 60]], np.float32)
    assert np.allclose(crowding(box), [1 / 3, 3 / 7, 3 / 7, 0])
    assert crowding(box[:1]).tolist() == [0]
    assert crowding(box[:0]).tolist() == []


def test_every_limb_has_a_side_and_torso_and_head_have_none():
    sides = {name: int(side) for name, side in zip(PART_NAMES, LIMB_SIDE, strict=True)}
    assert (sides["left hand"], sides["right lower leg, back"]) == (1, 2)
    assert {sides[name] for name in ("background", "torso, front", "head, left", "head, right")} == {0}
    assert (LIMB_SIDE == 1).sum() == (LIMB_SIDE == 2).sum() == 10


def crowd() -> tuple[LabelledImage, Prediction]:
    """Three people of 10 x 10 px in 40 x 20: a left hand at the frame (three of its rows painted as a right one),
    a torso that is missed, and one nobody asks for. The third detection is of nobody."""
    label = np.zeros((20, 40, 4), np.uint8)
    box = np.array([[0, 5, 10, 15], [10, 5, 20, 15], [25, 5, 35, 15]], np.float32)
    for number, (part, (x0, y0, x1, y1)) in enumerate(zip((4, 1, 1), box.astype(int), strict=True), 1):
        label[y0:y1, x0:x1] = part, 0, 0, number
    iuv, inds = label[..., :3].copy(), np.zeros((20, 40), np.uint8)
    inds[5:15, :10], inds[5:15, 25:35] = 2, 1
    iuv[5:8, :10, 0] = 3
    iuv[:, 10:20] = 0
    point = np.zeros((20, 40, 3), np.float32)
    image = LabelledImage("a/0000", label[..., :3], label, point, box, np.array([1, 2, 3], np.uint8),
                          np.array([False, False, True]))  # fmt: skip
    guesses = np.array([box[2], box[0], [12, 0, 40, 4]], np.float32)
    return image, Prediction(guesses, np.array([0.9, 0.8, 0.7]), iuv, inds)


def test_a_rendered_image_tells_who_was_found_and_how():
    image, found = crowd()
    comparison = compare(found, image.box, ~image.ignore, 0.5)
    assert comparison.number.tolist() == [2, 0]
    assert [(alarm.image, alarm.score) for alarm in comparison.false_alarms("a")] == [("a", pytest.approx(0.7))]
    masks = np.array([[0, 0], [0.6, 0], [0, 0]])
    hand, torso = rendered_people(image, comparison, masks)
    assert (hand.found, hand.mask_iou, hand.cut, hand.height_px) == (True, 0.6, True, 80)  # 10 px of 40, of 320
    assert (hand.asked, hand.right, hand.limb, hand.same_side) == (100, 70, 100, 70)
    assert hand.groups_seen == pytest.approx(1 / 14)
    assert (torso.found, torso.mask_iou, torso.cut, torso.right, torso.limb) == (False, 0, False, 0, 0)


def test_people_below_the_threshold_are_missed():
    image, found = crowd()
    assert compare(found, image.box, ~image.ignore, 0.85).number.tolist() == [0, 0]


def test_failures_are_the_worst_first_and_one_an_image():
    people = [
        replace(SOMEBODY, image="small", found=False, mask_iou=0, height_px=70),
        replace(SOMEBODY, image="tall", found=False, height_px=200),
        replace(SOMEBODY, image="tall", found=False, height_px=150),
        replace(SOMEBODY, image="bad", mask_iou=0.1),
        replace(SOMEBODY, image="poor", mask_iou=0.4),
        replace(SOMEBODY, image="tiny", mask_iou=0.05, height_px=20),
        replace(SOMEBODY, image="mirrored", limb=100, same_side=5),
        replace(SOMEBODY, image="one finger", limb=3, same_side=0),
    ]
    alarms = [FalseAlarm("lamp", (0, 0, 1, 1), 0.6), FalseAlarm("tree", (0, 0, 1, 1), 0.9)]
    cases = worst_cases(people, alarms, min_limb=50)
    assert {kind: [case.image for case in found] for kind, found in cases.items()} == {
        "missed": ["tall", "small"], "false": ["tree", "lamp"], "mask": ["bad", "poor"], "side": ["mirrored"],
    }  # fmt: skip
    assert cases["missed"][0].figure == 200
    assert cases["side"][0].figure == 0.05
    assert len(worst_cases(people, alarms, 50, count=1)["false"]) == 1
