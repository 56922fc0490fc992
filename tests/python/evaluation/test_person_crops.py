"""Figures of the second pass are taken of people apart, in groups, by the same truth."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from rectangle_people import picture

from export.densepose.config import DecodeConfig, NetworkConfig
from export.densepose.decode import detect
from export.densepose.network import MobileParsingRCNN
from export.evaluation import person_crops
from export.shards import LabelledImage, visible_boxes


def labelled(people: int = 2, axis=((0.0, -1.0), (0.8, -0.6))) -> LabelledImage:
    image, label = picture(np.random.default_rng(3), people=people)
    box, instance, ignore = visible_boxes(label)
    return LabelledImage(
        "a/0000", image[..., ::-1].copy(), label, None, box, instance, ignore, np.float32(axis)[:people]
    )


def test_a_perfect_label_scores_all_and_a_mirrored_one_no_side():
    image = labelled(people=1)
    perfect = image.label[..., :3].copy()
    score = person_crops.score(perfect, image, 1)
    assert (score.right, score.mask_iou, score.same_side) == (score.pixels, 1.0, score.limb)
    swapped = perfect.copy()
    for a, b in ((9, 10), (21, 22)):
        swapped[perfect[..., 0] == a, 0], swapped[perfect[..., 0] == b, 0] = b, a
    assert person_crops.score(swapped, image, 1).same_side == 0
    assert person_crops.score(np.zeros_like(perfect), image, 1).mask_iou == 0


def test_people_are_grouped_by_tilt_side_and_size():
    image = labelled()
    upright, leaning = (person_crops.groups_of(image, k, image.axis[k]) for k in (0, 1))
    assert "tilt 0-15" in upright
    assert "tilt 30-60" in leaning
    assert "from the front" in upright  # the torso is part 2
    assert {g for g in upright if g.endswith("px")} <= {"64-128 px", "128-256 px"}
    unknown = person_crops.groups_of(image, 0, np.full(2, np.nan))
    assert not [group for group in unknown if group.startswith("tilt")]


def test_axes_are_compared_by_direction_alone():
    assert person_crops.degrees_between(np.array([0, -0.1]), np.array([1.0, 0])) == pytest.approx(90)
    assert np.isnan(person_crops.degrees_between(None, np.array([1.0, 0])))


@pytest.mark.parametrize("axis", [False, True])
def test_everybody_is_found_or_missed_and_judged_in_every_way(axis, monkeypatch):
    """The first box is where the first person is; nobody finds the second one."""

    def detected(*given):
        found = detect(*given)
        box = torch.from_numpy(image.box[:1]) / torch.tensor(found.scale * 2)
        return replace(found, boxes=box, scores=torch.ones(1))

    image = labelled()
    monkeypatch.setattr(person_crops, "detect", detected)
    torch.manual_seed(0)
    net = MobileParsingRCNN(NetworkConfig(width=16, axis=axis)).eval()
    judge = person_crops.CropJudge(net, net, 64, DecodeConfig(long_side=96))
    judge.add(image)
    assert (judge.people, judge.missed) == (2, 1)
    ways = judge.table()["everybody found"]
    assert {figures["people"] for figures in ways.values()} == {1}
    assert set(ways) == set(person_crops.WAYS if axis else [w for w in person_crops.WAYS if "box head" not in w])
    assert ways["crop, true axis"]["axis_off_degrees"] == pytest.approx(0, abs=0.1)
