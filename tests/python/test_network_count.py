"""The network is as large as the paper's, and its multiply-adds are counted right."""

import pytest
import torch

from export.densepose.config import NetworkConfig
from export.densepose.count import PAPER_MILLIONS, macs, parameters
from export.densepose.network import MobileParsingRCNN


@pytest.mark.parametrize("width", PAPER_MILLIONS)
def test_parameters_are_within_two_percent_of_the_paper(width):
    net = MobileParsingRCNN(NetworkConfig(width=width))
    assert parameters(net) / 1e6 == pytest.approx(PAPER_MILLIONS[width], rel=0.02)


def test_head_multiply_adds_equal_the_count_by_hand():
    net = MobileParsingRCNN(NetworkConfig())
    work = macs(net, 64, 64)
    c = 64
    assert work["box_head"] == 2 * 9 * c * c * 49 + c * 49 * 6
    aspp = (c * c + 3 * 9 * c * c + 5 * c * c) * 32 * 32 + c * c
    body = 4 * 9 * c * c * 32 * 32
    out = 4 * c * 90 * 64 * 64  # 4 x 4 kernel, stride 2: four taps an output pixel
    assert work["dense_head"] == aspp + body + out


def test_detector_multiply_adds_grow_with_the_picture():
    net = MobileParsingRCNN(NetworkConfig())
    small, large = macs(net, 192, 192), macs(net, 384, 192)
    for part in ("backbone", "neck"):
        assert large[part] == pytest.approx(2 * small[part], rel=0.015)  # squeeze-and-excitation does not grow


def test_detector_gives_five_levels_at_the_strides_of_the_format():
    net = MobileParsingRCNN(NetworkConfig()).eval()
    features, objectness, deltas = net.detector(torch.zeros(1, 3, 96, 160))
    assert [tuple(f.shape[-2:]) for f in features] == [(24, 40), (12, 20), (6, 10), (3, 5), (2, 3)]
    assert [o.shape[1] for o in objectness] == [3] * 5
    assert [d.shape[1] for d in deltas] == [12] * 5
