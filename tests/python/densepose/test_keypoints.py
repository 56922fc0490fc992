"""Keypoints from shards through augmented images to the targets of the dense head."""

import numpy as np
import pytest
import torch
from rectangle_people import BODY, picture

from export import keypoints
from export.densepose import data
from export.densepose import targets as tg
from export.densepose.config import NetworkConfig
from export.densepose.losses import crop_loss
from export.densepose.network import MobileParsingRCNN
from export.densepose.train import optimiser_of
from export.shards import Record, ShardWriter, load_records
from export.surface import MIRROR_PART

# A keypoint in the middle of each of these parts of the rectangles.
WHERE = {"left wrist": 21, "right wrist": 22, "left knee": 10, "right knee": 9, "left eye": 24, "right eye": 23}


def keypoints_in(label: np.ndarray) -> np.ndarray:
    """[people, 33, 3] of a picture of rectangles, from the label itself; all others are hidden."""
    out = np.zeros((label[..., 3].max(), keypoints.COUNT, 3), np.float32)
    for k, name in enumerate(keypoints.NAMES):
        for person in range(len(out)):
            y, x = np.nonzero((label[..., 0] == WHERE.get(name)) & (label[..., 3] == person + 1))
            if len(x):
                out[person, k] = x.mean() + 0.5, y.mean() + 0.5, 1
    return out


@pytest.fixture
def record(tmp_path) -> Record:
    image, label = picture(np.random.default_rng(4), people=1)
    shard = ShardWriter(boxes=False)
    shard.add(image, label, 95)  # nobody knows this one's
    shard.add(image, label, 95, keypoint=keypoints_in(label))
    shard.write(tmp_path / "shard-00000.npz", {})
    unknown, known = load_records(tmp_path)
    assert len(unknown.keypoint) == 0
    np.testing.assert_array_equal(known.keypoint, keypoints_in(label))
    return known


def test_the_mirror_of_a_keypoint_has_the_other_side():
    assert keypoints.NAMES[keypoints.MIRROR[keypoints.NAMES.index("mouth left")]] == "mouth right"
    assert (keypoints.MIRROR[keypoints.MIRROR] == np.arange(33)).all()
    assert [keypoints.NAMES[k] for k in keypoints.COCO[[0, 1, 5, 16]]] == [
        "nose", "left eye", "left shoulder", "right ankle",
    ]  # fmt: skip


@pytest.mark.parametrize(
    "cropping",
    [data.ANY_CROPPING, data.Cropping(towards_person=1, rolls=((1.0, 20, 160),)), data.PersonCropping(count=1)],
    ids=["upright", "rolled", "person"],
)
def test_keypoints_stay_on_their_part_in_augmented_images(record, cropping):
    seen = 0
    for seed in range(12):
        ((_, truth),) = cropping.draw(record, 96, np.random.default_rng(seed))
        label = truth.label.numpy()
        for name, part in WHERE.items():
            x, y, visible = truth.keypoint[0, keypoints.NAMES.index(name)].tolist()
            assert visible == 1
            if 2 <= x < 94 and 2 <= y < 94:
                assert label[int(y), int(x), 0] in (part, 0)
                seen += label[int(y), int(x), 0] == part
    assert seen > 12


def target_of(keypoint: list, owner: int = 1, box=(8, 8, 40, 40)) -> tuple[np.ndarray, bool]:
    """Target [64, 64] of one keypoint, and whether it is known. owner: whose pixels all are."""
    every = torch.full((1, keypoints.COUNT, 3), torch.nan)
    every[0, 5] = torch.tensor(keypoint)
    box = torch.tensor([box], dtype=torch.float32)
    label = torch.full((64, 64, 4), owner, dtype=torch.uint8)
    truth = tg.Truth(
        box, torch.tensor([1], dtype=torch.uint8), torch.tensor([False]), label, torch.full((1, 2), torch.nan), every
    )
    wanted, known = tg.keypoint_targets(box, torch.tensor([0]), truth, 64)
    assert not known[0, :5].any()
    return wanted[0, 5].reshape(64, 64).numpy(), bool(known[0, 5])


def test_a_shown_keypoint_is_the_peak_of_its_target():
    target, known = target_of([20.25, 30.25, 0.9])
    assert known
    assert np.unravel_index(target.argmax(), target.shape) == (44, 24)  # half a pixel a cell
    assert target.sum() == pytest.approx(1, abs=1e-5)


@pytest.mark.parametrize(
    ("keypoint", "owner", "box"),
    [([50, 30, 0.9], 1, (8, 8, 40, 40)), ([20, 30, 0.1], 1, (8, 8, 40, 40)), ([20, 30, 0.9], 2, (8, 8, 40, 40)),
     ([-900, 30, 0.9], 1, (8, 8, 40, 40)), ([20, 30, 0.1], 1, (8, 8, 8, 8))],
    ids=["outside of the box", "hidden", "behind another person", "outside of the image", "a box of no size"],
)  # fmt: skip
def test_what_the_box_does_not_show_has_a_flat_target(keypoint, owner, box):
    target, known = target_of(keypoint, owner, box)
    assert known
    assert (target == target[0, 0]).all()
    assert target.sum() == pytest.approx(1, abs=1e-4)


def test_a_keypoint_that_may_be_hidden_or_not_is_no_target():
    assert not target_of([20, 30, 0.3])[1]
    assert not target_of([np.nan, np.nan, np.nan])[1]


def test_the_dense_head_learns_keypoints(record):
    torch.manual_seed(0)
    net = MobileParsingRCNN(NetworkConfig(width=16, keypoints=keypoints.COUNT))
    batches = data.Batches([record], 4, seed=0, ahead=0)
    optimiser = optimiser_of(net, torch.nn.Module(), 4e-3, 0.0)
    losses = []
    for _ in range(30):
        image, truths = batches.make(0, (96,), data.PersonCropping(count=4, tilt_degrees=0, coarse=0))
        loss = crop_loss(net, image, truths, torch.autocast("cpu", enabled=False))["crop_keypoint"]
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(loss.item())
    assert np.mean(losses[-5:]) < 0.8 * np.mean(losses[:5])


def test_each_part_of_the_rectangles_has_its_mirror():
    assert {int(MIRROR_PART[WHERE[f"left {name}"]]) for name in ("wrist", "knee", "eye")} == {22, 9, 23}
    assert set(WHERE.values()) <= set(BODY)
