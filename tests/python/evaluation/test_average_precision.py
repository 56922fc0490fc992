"""Average precision: the COCO rules, by hand and against pycocotools."""

import numpy as np
import pytest

from export.evaluation.average_precision import (
    THRESHOLDS,
    ImageMatches,
    average_precision,
    box_iou,
    match,
)


def image(scores, similarity, ignorable=None):
    scores = np.array(scores, float)
    similarity = np.array(similarity, float)
    return ImageMatches(scores, similarity, np.zeros(len(scores)) if ignorable is None else np.array(ignorable))


def test_box_iou_of_half_shifted_equal_and_empty_boxes():
    boxes = np.array([[0, 0, 10, 10], [5, 0, 15, 10], [3, 3, 3, 9]], np.float32)
    assert np.allclose(box_iou(boxes, boxes), [[1, 1 / 3, 0], [1 / 3, 1, 0], [0, 0, 0]])


def test_finding_everybody_exactly_gives_one():
    assert average_precision([image([0.9, 0.8], np.eye(2)), image([0.7], [[1]])], 0.95) == 1


def test_finding_nobody_gives_zero_and_nobody_to_find_gives_nan():
    assert average_precision([image([], np.zeros((0, 2)))], 0.5) == 0
    assert np.isnan(average_precision([image([0.9], np.zeros((1, 0)))], 0.5))


def test_a_better_scored_false_alarm_halves_the_precision_at_every_recall():
    assert average_precision([image([0.9, 0.8], [[0.1], [0.9]])], 0.5) == pytest.approx(0.5)


def test_a_missed_person_cuts_the_recalls_above_one_half():
    assert average_precision([image([0.9], [[0.8, 0.0]])], 0.5) == pytest.approx(51 / 101)


def test_a_second_detection_of_the_same_person_is_a_false_alarm():
    person, _ = match(image([0.8, 0.9], [[0.9], [0.6]]), 0.5, 0.5)
    assert person.tolist() == [-1, 0]


def test_a_detection_takes_the_next_best_person_when_its_best_is_taken():
    person, _ = match(image([0.9, 0.8], [[0.9, 0.6], [0.9, 0.6]]), 0.5, 0.5)
    assert person.tolist() == [0, 1]


def test_detections_of_ignored_people_count_neither_way():
    plain = image([0.9, 0.8], [[0.0], [1.0]])
    ignored = image([0.9, 0.8], [[0.0], [1.0]], ignorable=[0.7, 0.0])
    assert average_precision([plain], 0.5) == pytest.approx(0.5)
    assert average_precision([ignored], 0.5) == 1
    assert average_precision([ignored], 0.5, ignore_threshold=0.8) == pytest.approx(0.5)


def test_only_the_twenty_best_of_an_image_are_looked_at():
    scores = np.linspace(0.9, 0.1, 25)
    similarity = np.zeros((25, 1))
    similarity[24] = 1
    assert average_precision([image(scores, similarity)], 0.5) == 0


def test_agrees_with_pycocotools_on_random_boxes():
    coco = pytest.importorskip("pycocotools.coco", reason="pycocotools is not installed: pip install -e '.[dev]'")
    cocoeval = pytest.importorskip("pycocotools.cocoeval")
    rng = np.random.default_rng(1)
    images, truth, found = [], [], []
    for number in range(1, 41):
        boxes = rng.uniform(0, 150, (rng.integers(0, 6), 4))
        boxes[:, 2:] = boxes[:, :2] + rng.uniform(20, 90, (len(boxes), 2))
        kept = boxes[rng.random(len(boxes)) < 0.8]
        guesses = np.concatenate(
            [kept + rng.normal(0, 4, kept.shape), rng.uniform(0, 60, (3, 4)) + np.array([0, 0, 70, 70])]
        )
        scores = rng.permutation(len(guesses)) / 50 + number / 5000 + 0.1
        images.append(ImageMatches(scores, box_iou(guesses, boxes), np.zeros(len(guesses))))
        for box in boxes:
            x, y, width, height = *box[:2], *(box[2:] - box[:2])
            truth.append({"id": len(truth) + 1, "image_id": number, "category_id": 1, "iscrowd": 0,
                          "bbox": [x, y, width, height], "area": width * height})  # fmt: skip
        for box, score in zip(guesses, scores, strict=True):
            found.append({"image_id": number, "category_id": 1, "score": score,
                          "bbox": [*box[:2], *(box[2:] - box[:2])]})  # fmt: skip
    reference = coco.COCO()
    reference.dataset = {"images": [{"id": k} for k in range(1, 41)], "annotations": truth,
                         "categories": [{"id": 1, "name": "person"}]}  # fmt: skip
    reference.createIndex()
    evaluation = cocoeval.COCOeval(reference, reference.loadRes(found), "bbox")
    evaluation.evaluate()
    evaluation.accumulate()
    expected = evaluation.eval["precision"][:, :, 0, 0, -1].mean(1)
    assert np.allclose([average_precision(images, t) for t in THRESHOLDS], expected, atol=1e-9)
