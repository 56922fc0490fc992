"""Anchors, box deltas and feature levels are those of docs/reference/formats.md."""

import math

import pytest
import torch

from export.densepose import boxes as bx
from export.densepose.config import NetworkConfig
from export.densepose.network import Fusion, MobileParsingRCNN

CONFIG = NetworkConfig()


def random_boxes(count: int) -> torch.Tensor:
    corner = torch.rand(count, 2) * 200
    return torch.cat([corner, corner + 5 + torch.rand(count, 2) * 100], 1)


def test_detector_and_heads_have_the_shapes_of_the_bundle_format():
    net = MobileParsingRCNN(CONFIG).eval()
    with torch.no_grad():
        features, objectness, deltas = net.detector(torch.zeros(2, 3, 96, 160))
        box = net.box_head(torch.zeros(3, 64, 7, 7))
        dense = net.dense_head(torch.zeros(2, 64, 32, 32))
    sizes = [(24, 40), (12, 20), (6, 10), (3, 5), (2, 3)]
    assert [tuple(f.shape) for f in features] == [(2, 64, *s) for s in sizes]
    assert [tuple(o.shape) for o in objectness] == [(2, 3, *s) for s in sizes]
    assert [tuple(d.shape) for d in deltas] == [(2, 12, *s) for s in sizes]
    assert [tuple(b.shape) for b in box] == [(3, 2), (3, 4)]
    assert [tuple(d.shape) for d in dense] == [(2, n, 64, 64) for n in (15, 25, 25, 25)]


def test_anchors_sit_on_the_cells_corner_with_the_asked_ratio_and_area():
    first, *_ = bx.anchors(CONFIG, [(3, 5), (2, 3), (1, 2), (1, 1), (1, 1)])
    row, column, ratio = 2, 3, 0
    anchor = first[(row * 5 + column) * 3 + ratio]
    width, height = float(anchor[2] - anchor[0]), float(anchor[3] - anchor[1])
    assert ((anchor[:2] + anchor[2:]) / 2).tolist() == pytest.approx([column * 4, row * 4], abs=1e-5)
    assert height / width == pytest.approx(0.5)
    assert width * height == pytest.approx(32 * 32, rel=1e-5)


def test_flat_outputs_follow_the_order_of_the_anchors():
    objectness = torch.arange(2 * 3 * 4 * 5.0).view(2, 3, 4, 5)
    deltas = torch.arange(2 * 12 * 4 * 5.0).view(2, 12, 4, 5)
    logits, offsets = bx.flat_outputs(objectness, deltas)
    row, column, anchor = 2, 3, 1
    at = (row * 5 + column) * 3 + anchor
    assert logits[1, at] == objectness[1, anchor, row, column]
    assert offsets[1, at].tolist() == deltas[1, 4 * anchor : 4 * anchor + 4, row, column].tolist()


@pytest.mark.parametrize("weights", [(1, 1, 1, 1), (10.0, 10.0, 5.0, 5.0)])
def test_decoding_undoes_encoding(weights):
    torch.manual_seed(0)
    wanted, reference = random_boxes(200), random_boxes(200)
    found = bx.decode(bx.encode(wanted, reference, weights), reference, weights)
    assert torch.allclose(found, wanted, atol=1e-3)


def test_huge_size_deltas_stay_finite():
    reference = torch.tensor([[0.0, 0.0, 16.0, 16.0]])
    box = bx.decode(torch.tensor([[0.0, 0.0, 1e4, 1e4]]), reference)[0]
    assert float(box[2] - box[0]) == pytest.approx(16 * math.exp(bx.MAX_LOG_SCALE), rel=1e-5)


def test_boxes_read_the_level_of_their_size():
    sides = torch.tensor([5.0, 111.0, 113.0, 223.0, 225.0, 447.0, 449.0, 4000.0])
    boxes = torch.cat([torch.zeros(8, 2), sides[:, None].expand(-1, 2)], 1)
    assert bx.levels_of(boxes, CONFIG).tolist() == [0, 0, 1, 1, 2, 2, 3, 3]


def test_fusion_is_a_mean_that_ignores_negative_weights():
    fusion = Fusion(3)
    fusion.weight.data = torch.tensor([1.0, -5.0, 3.0])
    maps = [torch.full((1, 1, 2, 2), value) for value in (10.0, 1000.0, 20.0)]
    assert fusion(*maps).mean().item() == pytest.approx(17.5, rel=1e-3)
