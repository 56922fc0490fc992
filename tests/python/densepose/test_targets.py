"""Training targets of a labelled image."""

import numpy as np
import pytest
import torch
from rectangle_people import picture
from torchvision.ops import box_iou, roi_align

from export import surface
from export.densepose import boxes as bx
from export.densepose import data
from export.densepose import targets as tg
from export.densepose.config import NetworkConfig
from export.densepose.losses import possible_classes_loss
from export.shards import BOX_ALONE, UNSURE, Record


def truth(boxes, ignore=None) -> tg.Truth:
    boxes = torch.tensor(boxes, dtype=torch.float32).reshape(-1, 4)
    ignore = torch.tensor(ignore or [False] * len(boxes), dtype=torch.bool)
    instance = torch.arange(1, len(boxes) + 1, dtype=torch.uint8)
    unknown = (torch.full((len(boxes), *shape), torch.nan) for shape in ((2,), (33, 3)))
    return tg.Truth(boxes, instance, ignore, torch.zeros(160, 160, 4, dtype=torch.uint8), *unknown)


@pytest.fixture
def anchors():
    return torch.cat(bx.anchors(NetworkConfig(), [(40, 40), (20, 20), (10, 10), (5, 5), (3, 3)]))


def test_anchors_far_from_people_are_negative_and_close_ones_positive(anchors):
    torch.manual_seed(0)
    people = truth([[20, 20, 84, 84]])
    positive, target, negative = tg.rpn_samples(anchors, people, 256)
    iou = box_iou(anchors, people.box)[:, 0]
    assert len(positive) > 0
    assert (iou[positive] >= 0.7).all() or (iou[positive] == iou.max()).all()
    assert (iou[negative] < 0.3).all()
    assert len(positive) + len(negative) == 256
    assert (target == people.box[0]).all()


def test_a_person_that_no_anchor_fits_still_gets_its_best_anchor(anchors):
    people = truth([[60, 5, 80, 155]])
    assert box_iou(anchors, people.box).max() < 0.7
    positive, _, _ = tg.rpn_samples(anchors, people, 256)
    assert len(positive) >= 1


def test_ignored_people_are_neither_positive_nor_negative(anchors):
    people = truth([[20, 20, 84, 84]], [True])
    positive, _, negative = tg.rpn_samples(anchors, people, 10**6)
    assert len(positive) == 0
    assert (box_iou(anchors, people.box)[negative, 0] <= 0.3).all()


def test_an_image_without_people_gives_negatives_only(anchors):
    positive, target, negative = tg.rpn_samples(anchors, truth([]), 64)
    assert (len(positive), tuple(target.shape), len(negative)) == (0, (0, 4), 64)


def test_box_samples_are_at_most_a_quarter_people_and_know_whom():
    torch.manual_seed(0)
    people = truth([[10, 10, 60, 110], [80, 20, 140, 150]])
    near = people.box.repeat(30, 1) + torch.randn(60, 4) * 2
    far = torch.tensor([[0.0, 0.0, 20.0, 20.0]]).repeat(60, 1)
    boxes, person, match = tg.box_samples(torch.cat([near, far]), people, 32)
    assert len(boxes) == 32
    assert int(person.sum()) == 8
    overlap = box_iou(boxes, people.box)[torch.arange(32), match]
    assert (overlap[person] >= 0.5).all()
    assert (overlap[~person] < 0.5).all()


def test_true_boxes_are_samples_even_without_proposals():
    people = truth([[10, 10, 60, 110]])
    _, person, _ = tg.box_samples(torch.zeros(0, 4), people, 16)
    assert person.tolist() == [True]


def test_dense_samples_leave_out_ignored_people():
    torch.manual_seed(0)
    people = truth([[10, 10, 60, 110], [80, 20, 140, 150]], [True, False])
    boxes, person = tg.dense_samples(people.box, people, 4)
    assert person.tolist() == [1]
    assert box_iou(boxes, people.box[1:]).min() > 0.7


def test_dense_labels_are_the_pixels_under_the_grid():
    people = truth([[0, 0, 160, 160]])
    people.label[..., 0] = 2
    people.label[..., 1] = torch.arange(160, dtype=torch.uint8)[None]
    people.label[..., 2] = torch.arange(160, dtype=torch.uint8)[:, None]
    people.label[..., 3] = 1
    label = tg.dense_labels(torch.tensor([[32.0, 64.0, 96.0, 128.0]]), torch.tensor([0]), people, 64)
    assert label[0, 0, 0].tolist() == [2, 32, 64]
    assert label[0, 63, 10].tolist() == [2, 42, 127]


def test_other_people_and_the_outside_are_background_for_a_person():
    people = truth([[0, 0, 160, 160], [80, 0, 160, 160]])
    people.label[..., 0] = 2
    people.label[:, :80, 3], people.label[:, 80:, 3] = 1, 2
    label = tg.dense_labels(torch.tensor([[-160.0, 0.0, 160.0, 160.0]]), torch.tensor([0]), people, 64)
    assert not label[0, :, :32].any()
    assert (label[0, :, 32:48, 0] == 2).all()
    assert not label[0, :, 48:].any()


def test_a_mirrored_cut_carries_the_mirrored_labels():
    """Among random cuts both straight and mirrored ones turn up, and each part is where it belongs."""
    image, label = picture(np.random.default_rng(3), people=1)
    record = as_record(image, label)
    seen = set()
    for seed in range(12):
        cut, marked, *_ = data.augmented(record, 128, np.random.default_rng(seed))
        assert cut.shape == (128, 128, 3)
        columns = {part: np.nonzero(marked[..., 0] == part)[1] for part in (9, 10, 23, 24)}
        if min(len(c) for c in (columns[9], columns[10])) < 20:
            continue
        # Part 9 is to the left of part 10 in the image, and stays so: mirroring swaps places and names.
        assert columns[9].mean() < columns[10].mean()
        # U rises to the right in part 9; V of it is turned round in a mirror.
        inside = marked[..., 0] == 9
        rising = np.corrcoef(np.nonzero(inside)[1], marked[..., 1][inside])[0, 1] > 0
        falling = np.corrcoef(np.nonzero(inside)[0], marked[..., 2][inside])[0, 1] < 0
        assert rising != falling
        seen.add(bool(falling))
    assert seen == {False, True}
    assert surface.MIRROR_FLIPS_V[9]
    assert not surface.MIRROR_FLIPS_U[9]


def as_record(image: np.ndarray, label: np.ndarray) -> Record:
    import cv2

    files = [cv2.imencode(".png", array)[1].tobytes() for array in (image, label)]
    return Record(*files)


def test_boxes_of_a_cut_are_around_what_is_left_of_a_person():
    image, label = picture(np.random.default_rng(0), people=2)
    _, marked, *_ = data.augmented(as_record(image, label), 96, np.random.default_rng(1))
    people = data.truth_of(marked)
    for box, number in zip(people.box.int().tolist(), people.instance.tolist(), strict=True):
        y, x = np.nonzero(marked[..., 3] == number)
        assert box == [x.min(), y.min(), x.max() + 1, y.max() + 1]


def test_batches_depend_on_seed_and_number_alone():
    rng = np.random.default_rng(0)
    records = [as_record(*picture(rng)) for _ in range(5)]
    third = data.Batches(records, 2, seed=7).make(3, (64,))[0]
    assert torch.equal(data.Batches(records, 2, seed=7).make(3, (64,))[0], third)
    assert not torch.equal(data.Batches(records, 2, seed=7).make(2, (64,))[0], third)
    assert not torch.equal(data.Batches(records, 2, seed=8).make(3, (64,))[0], third)
    # Made ahead, in another size, or when it is asked for: the fourth batch drawn is batch 3.
    for ahead in (4, 0):
        straight = data.Batches(records, 2, seed=7, ahead=ahead)
        drawn = [straight.next((size,))[0] for size in (32, 32, 96, 64, 96)]
        straight.close()
        assert torch.equal(drawn[3], third)
        assert torch.equal(drawn[4], data.Batches(records, 2, seed=7).make(4, (96,))[0])


def test_an_error_while_a_batch_is_made_reaches_the_caller():
    broken = data.Batches([Record(b"no picture", b"no label")], 1, seed=0)
    with pytest.raises(ValueError, match="damaged picture"):
        broken.next((64,))
    broken.close()


def test_every_record_is_drawn_once_before_any_comes_again():
    batches = data.Batches([], 3, seed=1)
    batches.records = list(range(7))
    drawn = [batches._shuffled(k) for k in range(14)]
    assert sorted(drawn[:7]) == sorted(drawn[7:]) == list(range(7))
    assert drawn[:7] != drawn[7:]


def test_align_rois_equals_torchvisions_forwards_and_backwards():
    torch.manual_seed(0)
    corner = torch.rand(12, 2) * 30 - 6  # some reach over the border, some are long, some small
    boxes = torch.cat([corner, corner + torch.rand(12, 2) * torch.tensor([40.0, 70.0]) + 0.5], 1)
    boxes[0] = torch.tensor([-200.0, -200, 300, 300])
    boxes[1] = torch.tensor([3.0, 4, 3.01, 4.01])
    grad = torch.randn(12, 5, 16, 16)
    results = []
    for align in (
        lambda f: tg.align_rois(f, boxes, 16),
        lambda f: roi_align(f[None], [boxes], 16, 1.0, sampling_ratio=0, aligned=True),
    ):
        features = torch.linspace(-1, 1, 5 * 21 * 34).sin().mul(3).view(5, 21, 34).requires_grad_()
        out = align(features)
        out.backward(grad)
        results.append((out, features.grad))
    for own, theirs in zip(*results, strict=True):
        assert torch.allclose(own, theirs, atol=2e-5)


def test_pooled_rois_come_in_the_order_of_the_boxes():
    config = NetworkConfig()
    size = 256
    features = [torch.randn(2, 3, size // s, size // s) for s in config.tap_strides]
    boxes = [torch.tensor([[5.0, 5, 240, 250], [9, 9, 30, 40], [0, 0, 120, 130]]), torch.zeros(0, 4)]
    boxes.append(torch.tensor([[50.0, 60, 70, 90], [3, 4, 200, 256]]))
    features = [torch.cat([f, f.flip(2)[:1]]) for f in features]
    for level in (None, 0):
        found = tg.pooled(features, boxes, config, 7, level)
        alone = [tg.pooled([f[n : n + 1] for f in features], [b[None]], config, 7, level)
                 for n in (0, 2) for b in boxes[n]]  # fmt: skip
        assert torch.allclose(found, torch.cat(alone), atol=1e-6)
    assert tg.pooled(features, [torch.zeros(0, 4)] * 3, config, 7).shape == (0, 3, 7, 7)


def test_people_known_by_box_alone_teach_boxes_but_no_surface():
    label = torch.zeros(40, 40, 4, dtype=torch.uint8)
    label[5:35, 5:35] = torch.tensor([UNSURE, 0, 0, BOX_ALONE], dtype=torch.uint8)
    truth = data.truth_of(label.numpy())
    assert len(truth.box) == 1
    assert not truth.ignore.any()
    assert tg.box_samples(torch.zeros(0, 4), truth, 8)[1].any()
    assert not len(tg.dense_samples(torch.zeros(0, 4), truth, 8)[0])


def test_unsure_pixels_stay_unsure_for_everybody():
    label = torch.zeros(40, 40, 4, dtype=torch.uint8)
    label[..., 0], label[..., 3] = 3, 1
    label[:, 20:] = torch.tensor([UNSURE, 0, 0, BOX_ALONE], dtype=torch.uint8)
    truth = data.truth_of(label.numpy())
    found = tg.dense_labels(torch.tensor([[0.0, 0, 40, 40]]), torch.tensor([0]), truth, 4)[0, ..., 0]
    assert found.tolist() == [[3, 3, UNSURE, UNSURE]] * 4


def test_a_label_asks_only_for_what_it_tells():
    logits = torch.tensor([[2.0, 1.0, 0.0, -1.0]])
    probability = logits.softmax(1)[0].numpy()
    possible = torch.zeros(256, 4, dtype=torch.bool)
    possible[0, 1], possible[1, 1:3], possible[2] = True, True, True
    weight = torch.ones(256)

    def loss(value: int) -> float:
        return possible_classes_loss(logits, torch.tensor([value]), possible, weight).item()

    assert loss(0) == pytest.approx(-np.log(probability[1]), rel=1e-5)
    assert loss(1) == pytest.approx(-np.log(probability[1] + probability[2]), rel=1e-5)
    assert loss(2) == pytest.approx(0, abs=1e-6)
    weight[1] = 3
    both = possible_classes_loss(logits.repeat(2, 1), torch.tensor([0, 1]), possible, weight).item()
    assert both == pytest.approx((loss(0) + 3 * loss(1)) / 4, rel=1e-5)
    assert possible_classes_loss(logits[:0], torch.zeros(0, dtype=torch.long), possible, weight).item() == 0
