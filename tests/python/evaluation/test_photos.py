"""The metrics on real photographs, where the answer is known."""

import numpy as np
import pytest
from photo_labels import BOX, SIZE, labels

from export.evaluation.average_precision import ImageMatches
from export.evaluation.backends import Prediction
from export.evaluation.photos import Tally, recall_at_precision
from export.teachers.label import PhotoLabels


def painted(part: int, box=BOX, score=0.8, rows=slice(None)) -> Prediction:
    """One person whose box is painted with one part, or only some of its rows."""
    iuv, inds = np.zeros((SIZE, SIZE, 3), np.uint8), np.zeros((SIZE, SIZE), np.uint8)
    x0, y0, x1, y1 = box[0].astype(int)
    inds[y0:y1, x0:x1][rows] = 1
    iuv[..., 0] = part * inds
    return Prediction(box, np.array([score], np.float32), iuv, inds)


NOBODY = Prediction(
    np.zeros((0, 4)), np.zeros(0), np.zeros((SIZE, SIZE, 3), np.uint8), np.zeros((SIZE, SIZE), np.uint8)
)


def metrics(found: Prediction, truth: PhotoLabels):
    tally = Tally(0.5)
    tally.add("photo.jpg", found, truth)
    return tally.metrics()


def test_a_perfect_answer_has_perfect_metrics():
    got = metrics(painted(10), labels(left_hip=(60, 100), left_knee=(60, 150)))
    assert (got.recall_at_precision, got.recall_shown, got.precision_shown) == (1, 1, 1)
    assert (got.mask_iou, got.part_at_landmark, got.left_right) == (1, 1, 1)


def test_nobody_found_counts_as_wrong_everywhere():
    got = metrics(NOBODY, labels(left_hip=(60, 100)))
    assert (got.recall_at_precision, got.mask_iou, got.part_at_landmark) == (0, 0, 0)
    assert np.isnan(got.precision_shown)
    assert np.isnan(got.left_right)  # no limb is painted there


def test_people_without_landmarks_are_asked_for_by_box_and_mask():
    got = metrics(painted(10), labels(sure=False, left_hip=(60, 100)))
    assert (got.people, got.masks, got.mask_iou) == (1, 1, 1)
    assert np.isnan(got.part_at_landmark)


def test_people_about_whom_the_teachers_disagree_are_asked_for_by_box_alone():
    got = metrics(painted(10), labels(sure=False, outlined=False, left_hip=(60, 100)))
    assert (got.people, got.masks, got.recall_shown) == (1, 0, 1)
    assert np.isnan([got.mask_iou, got.part_at_landmark]).all()


def test_half_a_mask_is_half_an_iou():
    assert metrics(painted(2, rows=slice(0, 80)), labels()).mask_iou == pytest.approx(0.5)


def test_the_wrong_leg_is_wrong_in_part_and_side_but_the_torso_has_no_side():
    truth = labels(left_knee=(60, 150), right_knee=(100, 150))
    assert (metrics(painted(9), truth).part_at_landmark, metrics(painted(9), truth).left_right) == (0.5, 0.5)
    assert np.isnan(metrics(painted(1), truth).left_right)


def test_whose_left_shoulder_is_on_the_right_shows_the_chest():
    facing = {"left_shoulder": (100, 60), "right_shoulder": (60, 60), "left_hip": (95, 120), "right_hip": (65, 120)}
    away = {
        name.replace("left", "r").replace("right", "left").replace("r_", "right_"): at for name, at in facing.items()
    }
    for truth, right in ((labels(**facing), 2), (labels(**away), 1)):
        assert metrics(painted(right), truth).chest_or_back == 1
        assert metrics(painted(3 - right), truth).chest_or_back == 0
        assert np.isnan(metrics(painted(9), truth).chest_or_back)  # no torso is painted
    sideways = labels(left_shoulder=(85, 60), right_shoulder=(75, 60), left_hip=(82, 120), right_hip=(78, 120))
    assert np.isnan(metrics(painted(2), sideways).chest_or_back)


def test_landmarks_outside_photo_or_mask_are_not_asked_for():
    truth = labels(left_knee=(60, 500), right_knee=(10, 10), left_hip=(60, 100))
    assert metrics(painted(8), truth).landmark["left hip"] == 1
    assert np.isnan(metrics(painted(8), truth).landmark["left knee"])
    assert np.isnan(metrics(painted(8), truth).landmark["right knee"])


@pytest.mark.parametrize("truth", [labels(score=0.4), labels(box=BOX * [1, 1, 1, 0.3])])
def test_unsure_and_small_people_count_neither_way(truth):
    hit, missed = metrics(painted(2, box=truth.box), truth), metrics(NOBODY, truth)
    assert hit.people == missed.people == hit.masks == 0
    assert np.isnan(hit.recall_shown)
    assert np.isnan(hit.precision_shown)


def test_a_second_box_on_the_same_person_is_a_false_one():
    first = painted(2)
    twice = Prediction(np.repeat(BOX, 2, 0), np.array([0.9, 0.8]), first.iuv, first.inds)
    assert metrics(twice, labels()).precision_shown == 0.5


def test_people_in_empty_photos_are_counted_from_the_threshold_on():
    tally = Tally(0.5)
    for found in (painted(2, score=0.8), painted(2, score=0.4), NOBODY, NOBODY):
        tally.add_empty("room.jpg", found)
    assert tally.metrics().false_people == 0.25
    assert np.isnan(tally.metrics().false_people_by_animals)
    tally.add_empty("dog.jpg", painted(2, score=0.8), animals=True)
    assert (tally.metrics().false_people, tally.metrics().false_people_by_animals) == (0.25, 1)
    assert (tally.metrics().empty_photos, tally.metrics().animal_photos) == (4, 1)


def test_recall_at_precision_takes_the_best_cut():
    score = np.array([0.9, 0.8, 0.7, 0.6, 0.5])
    right = np.array([1, 1, 0, 1, 1.0])
    one_each = np.diag(right)  # five people, each detection right or on nobody
    assert recall_at_precision([ImageMatches(score, one_each, np.zeros(5))], 0.9) == pytest.approx(2 / 5)
    assert recall_at_precision([ImageMatches(score, one_each, np.zeros(5))], 0.8) == pytest.approx(4 / 5)
    assert recall_at_precision([ImageMatches(score, one_each, np.array([0, 0, 1, 0, 0.0]))], 0.9) == pytest.approx(
        4 / 5
    )


def test_failures_name_the_photo_and_the_worst_landmarks():
    limbs = dict.fromkeys(("left_knee", "left_ankle", "left_elbow", "left_hip"), (60, 100))
    tally = Tally(0.5)
    tally.add("swapped.jpg", painted(9), labels(**limbs))  # all painted as a right leg
    tally.add("missed.jpg", NOBODY, labels())
    tally.add_empty("room.jpg", painted(2))
    failures = tally.metrics().failures
    assert [(case.image, case.figure) for case in failures["side"]] == [("swapped.jpg", 0)]
    assert [case.image for case in failures["missed"]] == ["missed.jpg"]
    assert [(case.image, case.figure) for case in failures["false"]] == [("room.jpg", pytest.approx(0.8))]


def test_people_of_a_photo_are_grouped_as_if_its_long_side_were_320_pixels():
    low = np.array([[40, 20, 120, 120]], np.float32)
    groups = {group.name: group for group in metrics(painted(10, low), labels(low, left_hip=(60, 100))).groups}
    assert groups["higher than 128 px"].people == 1  # 100 of 200 px are 160 of 320
    assert groups["inside the frame"].part_accuracy == 1
    assert not any(group.by == "visibility" for group in groups.values())
