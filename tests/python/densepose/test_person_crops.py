"""Crops of one person, turned upright, and what is learnt from them."""

import os
import signal

import cv2
import numpy as np
import pytest
import torch
from rectangle_people import picture

from export.densepose import data, train, validation
from export.densepose import targets as tg
from export.densepose.config import NetworkConfig
from export.densepose.losses import PixelHead, batch_loss, crop_loss
from export.densepose.network import MobileParsingRCNN
from export.densepose.person_crop import crop_around, cut, cut_label, outline, rotation, turn_upright, turned_box
from export.shards import Record, ShardWriter, load_records, visible_boxes

NO_AUTOCAST = torch.autocast("cpu", enabled=False)


def tilted(degrees: float, seed: int = 0, people: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """An image of upright people, turned clockwise, with their axes."""
    image, label = picture(np.random.default_rng(seed), people=people)
    height, width = label.shape[:2]
    matrix = cv2.getRotationMatrix2D((width / 2 - 0.5, height / 2 - 0.5), -degrees, 1.0)
    turned = [cv2.warpAffine(a, matrix, (width, height), flags=cv2.INTER_NEAREST) for a in (image, label)]
    return *turned, np.tile(rotation(degrees) @ [0.0, -1.0], (people, 1)).astype(np.float32)


def as_record(image, label, axis=None) -> Record:
    return Record(*(cv2.imencode(".png", array)[1].tobytes() for array in (image, label)), axis)


@pytest.mark.parametrize("degrees", [0, 30, 90, -135, 180])
def test_a_tilted_person_is_upright_in_the_crop_and_fills_it(degrees):
    _, label, axis = tilted(degrees)
    turn = turn_upright(axis[0])
    crop = crop_around(turned_box(outline(label[..., 3] == 1), turn), turn, 128)
    shown = cut_label(label, crop)
    (box,), *_ = visible_boxes(shown)
    assert np.abs(box - crop.box).max() < 3
    assert max(box[2:] - box[:2]) == pytest.approx(128 / 1.15, abs=3)
    rows = {part: np.nonzero(shown[..., 0] == part)[0].mean() for part in (23, 2, 9)}
    assert rows[23] < rows[2] < rows[9]
    columns = {part: np.nonzero(shown[..., 0] == part)[1].mean() for part in (9, 10)}
    assert columns[9] < columns[10]  # turned, not mirrored


@pytest.mark.parametrize("side", [300, 64])
def test_pixels_and_labels_of_a_crop_agree_and_map_back(side):
    """Enlarged or shrunk: the coloured rectangles lie where their labels do."""
    image, label, axis = tilted(25)
    turn = turn_upright(axis[0])
    crop = crop_around(turned_box(outline(label[..., 3] == 1), turn), turn, side)
    pixels, marked = cut(image, crop, (0, 0, 0)), cut_label(label, crop)
    border = 2 * int(np.ceil(np.hypot(*crop.into[:, 0]))) + 1  # where the colours of neighbours mix
    inside = cv2.erode((marked[..., 0] == 2).astype(np.uint8), np.ones((border, border))) > 0
    assert inside.sum() > 20
    assert np.abs(pixels[inside].astype(int) - [(2 * 67) % 256, (2 * 131) % 256, 0]).max() <= 3
    centre = crop.box.reshape(2, 2).mean(0)
    y, x = np.nonzero(label[..., 3] == 1)
    there = crop.back[:, :2] @ centre + crop.back[:, 2]
    assert x.min() <= there[0] <= x.max() + 1
    assert y.min() <= there[1] <= y.max() + 1


def test_crops_show_different_people_each_with_its_own_label():
    record = as_record(*tilted(40, seed=2, people=2))
    drawn = data.PersonCropping(box_shake=0, tilt_degrees=0, coarse=0).draw(record, 96, np.random.default_rng(0))
    assert {int(t.instance) for _, t in drawn} == {1, 2}
    for image, truth in drawn:
        assert image.shape == (96, 96, 3)
        dense = tg.dense_labels(truth.box, torch.tensor([0]), truth, 32)[0, ..., 0].numpy()
        assert {23, 24, 9, 10} & set(np.unique(dense))
        own = truth.label[..., 3].numpy() == int(truth.instance)
        assert (dense > 0).mean() > 0.3
        assert own.any()


def test_nobody_is_looked_at_where_nobody_is():
    record = as_record(np.full((60, 80, 3), 90, np.uint8), np.zeros((60, 80, 4), np.uint8))
    for image, truth in data.PERSON_CROPPING.draw(record, 64, np.random.default_rng(0)):
        assert image.shape == (64, 64, 3)
        assert not tg.dense_labels(truth.box, torch.tensor([0]), truth, 32).any()


def test_a_mirrored_image_has_the_mirrored_axis():
    record = as_record(*tilted(40, seed=4))
    signs = set()
    for seed in range(8):
        _, label, axis, _ = data.augmented(record, 96, np.random.default_rng(seed))
        if (label[..., 0] == 23).sum() > 10 and (label[..., 0] == 9).sum() > 10:
            head, leg = (np.argwhere(label[..., 0] == part).mean(0)[::-1] for part in (23, 9))
            assert np.sign((head - leg)[0]) == np.sign(axis[0, 0])
            signs.add(int(np.sign(axis[0, 0])))
    assert signs == {-1, 1}


def test_photographs_are_turned_and_tilted_renderings_are_not():
    image, label = picture(np.random.default_rng(0), people=1)
    cropping = data.Cropping(towards_person=1, rolls=((1.0, 90, 90),))
    for axis, turned in ((None, True), (np.float32([[0, -1]]), False)):
        _, marked, *_ = data.augmented(as_record(image, label, axis), 96, np.random.default_rng(3), cropping)
        head, leg = (np.argwhere(marked[..., 0] == part).mean(0) for part in (23, 9))
        down, across = np.abs(head - leg)
        assert (across > down) == turned


@pytest.fixture(scope="module")
def shards(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tilted")
    for split, count in (("train", 6), ("val", 2)):
        (folder / split).mkdir()
        shard = ShardWriter(boxes=True)
        for k in range(count):
            image, label, axis = tilted(30.0 * k, seed=k, people=1 + k % 2)
            shard.add(image, label, 95, axis=axis)
        shard.write(folder / split / "shard-00000.npz", {})
    return folder


def test_shards_keep_the_axis_by_person(shards):
    axis = [record.axis for record in load_records(shards / "train")]
    assert [len(a) for a in axis] == [1, 2, 1, 2, 1, 2]
    assert np.allclose(axis[3], rotation(90) @ [0, -1], atol=1e-6)


def test_crops_teach_the_dense_head_and_leave_boxes_alone(shards):
    torch.manual_seed(0)
    net = MobileParsingRCNN(NetworkConfig(width=16, axis=True)).train()
    head = PixelHead(net.config)
    image, truths = data.Batches(load_records(shards / "train"), 4, seed=0).make(0, (96,), data.PERSON_CROPPING)
    optimiser = torch.optim.AdamW([*net.parameters(), *head.parameters()], lr=3e-3)
    history = []
    for _ in range(16):
        terms = crop_loss(net, image, truths, NO_AUTOCAST, head)
        optimiser.zero_grad()
        sum(terms.values()).backward()
        optimiser.step()
        history.append({name: value.item() for name, value in terms.items()})
    for name in ("crop_coarse", "crop_index", "crop_u", "crop_v"):
        assert history[-1][name] < 0.9 * history[0][name], name
    without = {id(p) for p in net.box_parameters()}
    named = dict(net.named_parameters())
    assert {n for n, p in named.items() if p.grad is None} == {n for n, p in named.items() if id(p) in without}


def test_the_axis_is_learnt_where_it_is_known_alone(shards):
    torch.manual_seed(0)
    net = MobileParsingRCNN(NetworkConfig(width=16, axis=True)).train()
    image, truths = data.Batches(load_records(shards / "train"), 4, seed=0).make(0, (96,), data.CLOSE_CROPPING)
    assert all(torch.isfinite(t.axis).all() for t in truths)
    first = batch_loss(net, image, truths, NO_AUTOCAST)["axis"]
    assert first > 0
    first.backward()
    assert net.box_head.axis.weight.grad.abs().max() > 0
    unknown = [data.truth_of(t.label.numpy()) for t in truths]
    assert batch_loss(net, image, unknown, NO_AUTOCAST)["axis"] == 0


def test_weights_without_an_axis_start_a_network_with_one(tmp_path):
    old, new = (MobileParsingRCNN(NetworkConfig(width=16, axis=axis)) for axis in (False, True))
    train.start_from(new, old.state_dict(), tmp_path)
    for name, value in old.state_dict().items():
        assert torch.equal(new.state_dict()[name], value)
    rois = torch.randn(3, 16, 7, 7)
    assert new.box_head.with_axis(rois)[2].shape == (3, 2)
    assert len(new.box_head(rois)) == 2  # what is exported stays


def options(shards, out, *more: str) -> list[str]:
    given = ["train", "--recipe", "both", "--data", str(shards), "--out", str(out), "--batch", "2", "--crops", "2"]
    return [*given, "--crop-size", "64", "--width", "16", "--threads", "1", "--no-bf16", *more]


@pytest.fixture
def run(monkeypatch, shards, one_thread, signal_handlers):
    monkeypatch.setitem(train.RECIPES, "both", (train.Stage(0.0, (96,), data.WIDE_CROPPING, crops=True),))

    def start(out, *more: str, stop_after: int | None = None) -> list[tuple[float, bool]]:
        steps = []

        def recorded(*given):
            terms = batch_loss(*given)
            steps.append((sum(terms.values()).item(), "axis" in terms))
            if len(steps) == stop_after:
                os.kill(os.getpid(), signal.SIGTERM)
            return terms

        monkeypatch.setattr(train, "batch_loss", recorded)
        monkeypatch.setattr("sys.argv", options(shards, out, *more))
        train.main()
        return steps

    return start


def test_boxes_are_learnt_in_every_nth_step_and_a_resumed_run_keeps_count(run, tmp_path):
    more = ("--steps", "4", "--boxes-every", "3")
    straight = run(tmp_path / "straight", *more)
    assert [boxes for _, boxes in straight] == [True, False, False, True]
    parts = run(tmp_path / "stopped", *more, stop_after=2) + run(tmp_path / "stopped", *more)
    assert [loss for loss, _ in parts] == pytest.approx([loss for loss, _ in straight], rel=1e-5)


def test_a_run_made_longer_goes_on_from_where_its_rate_still_stood(run, tmp_path):
    """Four steps of which two decay, made six of which two decay, are the six of a run that knew it before."""
    straight = run(tmp_path / "long", "--steps", "6", "--decay", "0.33")
    run(tmp_path / "short", "--steps", "4", "--decay", "0.5")
    more = run(tmp_path / "short", "--steps", "6", "--decay", "0.33")
    assert len(more) in (3, 4)
    assert [loss for loss, _ in more] == pytest.approx([loss for loss, _ in straight[-len(more) :]], rel=1e-5)
    assert run(tmp_path / "short", "--steps", "6", "--decay", "0.33") == []


def test_crops_are_validated_on_true_boxes_and_axes(shards):
    torch.manual_seed(0)
    records = load_records(shards / "val")
    net = MobileParsingRCNN(NetworkConfig(width=16)).eval()
    figures = validation.validate_crops(net, records, 64)
    assert set(figures) == {"crop_part", "crop_mask_iou", "crop_side"}
    assert all(0 <= value <= 1 for value in figures.values())
    assert figures == validation.validate_crops(net, records, 64)
