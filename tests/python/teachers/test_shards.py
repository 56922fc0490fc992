"""Labels of photographs as training sees them: what is known is asked for, what is not known is left open."""

import dataclasses

import cv2
import numpy as np
import pytest

from export import surface
from export.densepose import data
from export.keypoints import NAMES
from export.shards import (
    BOX_ALONE,
    PART_ALONE,
    PERSON,
    POSSIBLE_PARTS,
    REGION,
    UNCERTAIN,
    UNSURE,
    load_records,
    mirror_iuv,
)
from export.teachers import shards
from export.teachers.facing import PhotoFacing
from export.teachers.fit import PhotoFits
from export.teachers.hands import Hand
from export.teachers.label import PhotoLabels
from export.teachers.shards import LONG_SIDE, composed, cut_outs, main, rounds_of, weak_label

SHAPE = (100, 200)
BOXES = np.array([[10, 10, 50, 90], [60, 10, 100, 90], [110, 10, 150, 90], [160, 10, 190, 90]], np.float32)


def photo_labels() -> PhotoLabels:
    """Somebody with landmarks (a left forearm alone is seen), with a mask, with a box, and a doubtful box."""
    mask, doubt = np.zeros((4, *SHAPE), bool), np.zeros((4, *SHAPE), bool)
    mask[0, 20:80, 15:45] = mask[1, 20:80, 65:95] = True
    doubt[1, 20:80, 90:95] = doubt[1, 80:85, 65:95] = True
    point, visible = np.zeros((4, 33, 2), np.float32), np.zeros((4, 33), np.float32)
    for name, at in {"left elbow": (40, 30), "left wrist": (40, 70), "left shoulder": (20, 30),
                     "right shoulder": (20, 31), "left hip": (20, 60), "right hip": (20, 60)}.items():  # fmt: skip
        point[0, NAMES.index(name)], visible[0, NAMES.index(name)] = at, 0.9
    return PhotoLabels(
        box=BOXES, score=np.array([0.9, 0.9, 0.8, 0.4], np.float32), outlined=np.array([True, True, False, False]),
        sure=np.array([True, False, False, False]), point=point, visible=visible,
        world=np.zeros((4, 33, 3), np.float32), mask=mask, doubt=doubt,
    )  # fmt: skip


def test_what_each_kind_of_person_is_labelled_with():
    label = weak_label(photo_labels(), SHAPE)
    assert label[50, 40].tolist() == [REGION + 12, 0, 0, 1]  # left lower arm
    assert label[78, 30].tolist() == [PERSON, 0, 0, 1]
    assert label[50, 70].tolist() == [PERSON, 0, 0, 2]
    assert label[82, 80].tolist() == [UNSURE, 0, 0, 0]
    assert label[50, 130].tolist() == [UNSURE, 0, 0, BOX_ALONE + 2]
    assert label[50, 170].tolist() == [UNSURE, 0, 0, UNCERTAIN + 3]
    assert label[50, 5].tolist() == [0, 0, 0, 0]


def test_a_fitted_body_gives_part_u_and_v_where_it_is_believed():
    label = np.zeros((2, 50, 100, 3), np.uint8)  # half the photo's size
    label[0, 10:40, 7:15], label[1, 10:40, 30:50] = (2, 50, 60), (2, 70, 80)
    label[0, 30:40, 7:15] = (PERSON, 0, 0)
    turned = np.zeros((2, 19, 3, 3))
    fits = PhotoFits(np.array([0, 1]), np.ones(2), np.zeros(2), np.array(["", "IoU"]), label, turned)
    found = weak_label(photo_labels(), SHAPE, fits)
    assert found[50, 20].tolist() == [2, 50, 60, 1]
    assert found[70, 20].tolist() == [PERSON, 0, 0, 1]  # of the fit's own
    assert found[50, 40].tolist() == [PERSON, 0, 0, 1]  # beside the fit
    assert found[50, 70].tolist() == [PERSON, 0, 0, 2]  # not believed


@pytest.mark.parametrize(("degrees", "value"), [(0, PART_ALONE + 2), (180, PART_ALONE + 1), (90, REGION + 1)])
def test_the_trunk_of_a_person_of_known_direction_is_a_chest_or_a_back(degrees, value):
    plain = weak_label(photo_labels(), SHAPE)
    label = weak_label(photo_labels(), SHAPE, facing=PhotoFacing(np.array([degrees, 0, 0, 0], np.float32)))
    trunk = plain[..., 0] == REGION + 1
    assert trunk.sum() > 50
    assert (label[trunk] == (value, 0, 0, 1)).all()
    assert np.array_equal(label[~trunk], plain[~trunk])
    assert np.flatnonzero(POSSIBLE_PARTS[PART_ALONE + 2]).tolist() == [2]


def test_a_group_that_is_seen_often_has_a_cap_and_each_of_it_is_seen():
    names = ["ab-1", "gm-1", "gm-2", "gm-3", "gmx-1", "ab-2", "gm-4", "gm-5"]
    rounds = rounds_of(names, 3, {"gm": 2, "none": 9})
    assert [sorted(names[k] for k in chosen) for chosen in rounds] == [
        ["ab-1", "ab-2", "gm-1", "gm-2", "gmx-1"],
        ["ab-1", "ab-2", "gm-3", "gm-4", "gmx-1"],
        ["ab-1", "ab-2", "gm-1", "gm-5", "gmx-1"],
    ]
    assert rounds_of(names, 2, {}) == [list(range(8))] * 2
    assert rounds_of(names, 1, {"gm": 9}) == [[0, 4, 5, 1, 2, 3, 6, 7]]


def open_hand(middle: tuple[float, float], size: float = 16) -> Hand:
    """Upright: the wrist below, five fingers side by side."""
    point = np.zeros((21, 2))
    for finger in range(5):
        x = -0.4 + 0.2 * finger
        point[1 + 4 * finger : 5 + 4 * finger] = [(x, 0.1 - 0.2 * joint) for joint in range(4)]
    point[0] = 0, 0.5
    return Hand(np.array(middle) + size * point, 0.9)


def test_a_hand_that_was_seen_is_labelled_as_one():
    hands = {(0, "left"): open_hand((40, 74)), (1, "right"): open_hand((64, 40))}
    label = weak_label(photo_labels(), SHAPE, None, hands)
    assert label[74, 40].tolist() == [REGION + 3, 0, 0, 1]
    assert label[40, 66].tolist() == [REGION + 2, 0, 0, 2]
    assert label[40, 63].tolist() == [REGION + 2, 0, 0, 2]  # beside the mask, which had lost it
    assert label[40, 75].tolist() == [PERSON, 0, 0, 2]
    assert np.array_equal(label[:30], weak_label(photo_labels(), SHAPE)[:30])


def test_a_fitted_hand_stays():
    label = np.zeros((1, *SHAPE, 3), np.uint8)
    label[0, 20:80, 15:45] = (4, 50, 60)
    label[0, 74, 38] = (2, 50, 60)
    fits = PhotoFits(np.array([0]), np.ones(1), np.zeros(1), np.array([""]), label, np.zeros((1, 19, 3, 3)))
    found = weak_label(photo_labels(), SHAPE, fits, {(0, "left"): open_hand((40, 74))})
    assert found[74, 40].tolist() == [4, 50, 60, 1]
    assert found[74, 38].tolist() == [REGION + 3, 0, 0, 1]


def test_boxes_and_masks_become_people_and_doubtful_boxes_are_ignored():
    truth = data.truth_of(weak_label(photo_labels(), SHAPE))
    assert truth.instance.tolist() == [1, 2, BOX_ALONE + 2, UNCERTAIN + 3]
    assert truth.ignore.tolist() == [False, False, False, True]
    assert truth.box[2].tolist() == BOXES[2].tolist()


def test_every_value_has_its_mirror_image():
    value = np.arange(256, dtype=np.uint8)
    once = mirror_iuv(np.stack([value, 0 * value, 0 * value], -1))[:, 0]
    assert np.array_equal(once[once], value)
    # The possible parts of a value are mirrored with it.
    assert np.array_equal(POSSIBLE_PARTS[once][:, surface.MIRROR_PART], POSSIBLE_PARTS)
    assert once[REGION + 12] == REGION + 13


@pytest.fixture
def folders(tmp_path):
    for name in ("people", "labels", "empty"):
        (tmp_path / name).mkdir()
    rng = np.random.default_rng(0)
    cv2.imwrite(str(tmp_path / "people" / "a.jpg"), rng.integers(0, 255, (*SHAPE, 3), np.uint8))
    cv2.imwrite(str(tmp_path / "empty" / "b.jpg"), rng.integers(0, 255, (600, 900, 3), np.uint8))
    return tmp_path


def arguments(folder) -> list[str]:
    names = {"photos": "people", "labels": "labels", "fits": "fits", "facing": "facing", "empty": "empty"}
    names["out"] = "shards"
    return [text for option, name in names.items() for text in (f"--{option}", str(folder / name))]


@pytest.fixture(autouse=True)
def no_hands(monkeypatch):
    monkeypatch.setattr(shards, "HandNetwork", lambda: None)
    monkeypatch.setattr(shards, "hands_of", lambda network, image, labels: {})


def test_shards_are_read_by_the_training(folders, capsys):
    photo_labels().save(folders / "labels" / "a.npz")
    assert main([*arguments(folders), "--composed", "3", "--repeat", "2"]) == 0
    told = capsys.readouterr().out
    assert "1 photographs of people, 1 without; 0 left out, with landmarks of nobody; 2 people with a mask (" in told
    assert "(0 of them with a fitted body, 0 with a direction, 0 hands)" in told
    assert "1 with a box alone; each 2 times; 3 images composed" in told
    records = load_records(folders / "shards")
    sizes = sorted(record.decoded()[0].shape[:2] for record in records)
    assert sizes[0] == SHAPE
    assert (round(600 * LONG_SIDE / 900), LONG_SIDE) in sizes
    assert len(sizes) == 2 * 2 + 3
    batches = data.Batches(records[:1] * 4, 8, 0, photos=records, photo_fraction=1.0)
    image, truths = batches.make(0, (64,))
    batches.close()
    assert image.shape == (8, 3, 64, 64)
    assert len(truths) == 8


def test_photographs_with_landmarks_of_nobody_are_left_out(folders, capsys):
    photo_labels().save(folders / "labels" / "a.npz")
    cv2.imwrite(str(folders / "people" / "b.jpg"), np.zeros((*SHAPE, 3), np.uint8))
    dataclasses.replace(photo_labels(), sure=np.zeros(4, bool)).save(folders / "labels" / "b.npz")
    assert main([*arguments(folders), "--composed", "1", "--repeat", "1"]) == 0
    assert "1 photographs of people, 1 without; 1 left out, with landmarks of nobody" in capsys.readouterr().out
    assert len(load_records(folders / "shards")) == 3


def test_a_capped_group_comes_into_the_shards_less_often(folders, capsys):
    for name in ("gm-1", "gm-2"):
        cv2.imwrite(str(folders / "people" / f"{name}.jpg"), np.zeros((*SHAPE, 3), np.uint8))
        photo_labels().save(folders / "labels" / f"{name}.npz")
    photo_labels().save(folders / "labels" / "a.npz")
    assert main([*arguments(folders), "--composed", "1", "--repeat", "2", "--cap", "gm=1"]) == 0
    assert len(load_records(folders / "shards")) == 2 * (1 + 1 + 1) + 1
    with pytest.raises(SystemExit):
        main([*arguments(folders), "--cap", "gm"])
    assert "'gm' is not PREFIX=N" in capsys.readouterr().err


def test_hands_can_be_left_to_wrists_and_knuckles(folders, monkeypatch):
    photo_labels().save(folders / "labels" / "a.npz")
    asked = []
    monkeypatch.setattr(shards, "HandNetwork", lambda: asked.append("opened") or "network")
    monkeypatch.setattr(shards, "hands_of", lambda network, image, labels: asked.append(network) or {})
    assert main([*arguments(folders), "--composed", "1", "--no-hands"]) == 0
    assert asked == []
    assert main([*arguments(folders), "--composed", "1"]) == 0
    assert asked == ["opened", "network"]


def test_photos_without_labels_are_named_before_anything_is_written(folders, capsys):
    assert main(arguments(folders)) == 1
    assert "export.teachers" in capsys.readouterr().err
    assert not (folders / "shards").exists()


def cut_out_scene() -> tuple[np.ndarray, np.ndarray]:
    """A red person cut by the lower border, and two who touch each other."""
    image, label = np.zeros((200, 300, 3), np.uint8), np.zeros((200, 300, 4), np.uint8)
    image[80:, 20:80], label[80:, 20:80] = (0, 0, 255), (PERSON, 0, 0, 1)
    label[50:150, 150:200], label[50:150, 200:250] = (PERSON, 0, 0, 2), (PERSON, 0, 0, 3)
    return image, label


def test_people_are_cut_out_who_stand_alone():
    found = cut_outs(*cut_out_scene())
    assert len(found) == 1
    assert found[0].image.shape == (120, 60, 3)
    assert found[0].cut == (False, False, False, True)
    assert found[0].opacity[60, 30] == pytest.approx(1)
    assert found[0].opacity[60, 0] < 0.5 < found[0].opacity[60, 5]


def test_composed_images_label_each_person_where_it_is_seen():
    people = cut_outs(*cut_out_scene())
    for seed in range(12):
        image, label, _ = composed(
            np.full((90, 120, 3), (0, 200, 0), np.uint8), people, (160, 128), np.random.default_rng(seed)
        )
        assert image.shape == (128, 160, 3)
        body = label[..., 3] > 0
        inside = cv2.erode(body.astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
        outside = (label[..., 0] == 0) & (cv2.dilate(body.astype(np.uint8), np.ones((7, 7), np.uint8)) == 0)
        assert (image[inside][:, 2].astype(int) > image[inside][:, 1]).mean() > 0.9  # red, softer between two people
        assert (image[outside] == (0, 200, 0)).all()
        assert set(np.unique(label[..., 3])) <= set(range(7))
        # The person was cut by the lower border, and still is.
        assert body.any()
        assert body[-1].any()


def test_keypoints_stay_on_the_people_who_are_cut_out():
    image, label = cut_out_scene()
    label[100:110, 40:50, 0] = 24
    known = np.zeros((1, 33, 3), np.float32)
    known[0, 5] = 45, 105, 1
    people = cut_outs(image, label, known)
    seen = 0
    for seed in range(12):
        _, marked, keypoint = composed(
            np.zeros((90, 120, 3), np.uint8), people, (160, 128), np.random.default_rng(seed)
        )
        for person, (x, y, visible) in enumerate(keypoint[:, 5]):
            assert visible == 1
            if 0 <= x < 160 and 0 <= y < 128 and marked[int(y), int(x), 3] == person + 1:
                assert marked[int(y), int(x), 0] == 24
                seen += 1
    assert seen > 6


def test_half_of_the_composed_images_show_people_side_by_side():
    (person,) = cut_outs(*cut_out_scene())
    free = dataclasses.replace(person, cut=(False, False, False, False))
    close = 0
    for seed in range(60):
        label = composed(np.zeros((90, 120, 3), np.uint8), [free], (160, 128), np.random.default_rng(seed))[1]
        numbers = np.unique(label[..., 3])[1:]
        masks = {n: cv2.dilate((label[..., 3] == n).astype(np.uint8), np.ones((5, 5))) > 0 for n in numbers}
        close += any((masks[n] & masks[n + 1]).any() for n in numbers if n + 1 in masks)
    assert 24 <= close <= 48  # the groups, and some of those who stand anywhere
