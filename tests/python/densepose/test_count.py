"""The network is as large as the paper's, and its multiply-adds are counted right."""

import pytest
import torch
from torchvision.models import mobilenet_v2

from export.densepose.config import NetworkConfig
from export.densepose.count import PAPER_MILLIONS, macs, parameters
from export.densepose.network import MobileParsingRCNN


@pytest.mark.parametrize("width", PAPER_MILLIONS)
def test_parameters_are_within_two_percent_of_the_paper(width):
    net = MobileParsingRCNN(NetworkConfig(width=width, backbone="mobilenet_v3_large"))
    assert parameters(net) / 1e6 == pytest.approx(PAPER_MILLIONS[width], rel=0.02)


@pytest.mark.parametrize("width", PAPER_MILLIONS)
def test_the_shipped_network_is_smaller_than_the_paper_s(width):
    assert parameters(MobileParsingRCNN(NetworkConfig(width=width))) / 1e6 < 0.8 * PAPER_MILLIONS[width]


def test_the_mobilenet_v2_is_the_published_one():
    ours, theirs = NetworkConfig().tap_channels, mobilenet_v2().features[:17]
    net = MobileParsingRCNN(NetworkConfig()).backbone
    assert parameters(net) == parameters(theirs)
    assert [f.shape[1] for f in net(torch.zeros(1, 3, 64, 64))] == list(ours)


def test_frozen_backbone_computes_the_same_and_learns_but_its_first_layers():
    torch.manual_seed(1)
    net = MobileParsingRCNN(NetworkConfig()).backbone
    for module in net.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            module.running_mean.normal_(0, 0.1)
            module.running_var.uniform_(0.5, 2)
    image = torch.randn(2, 3, 64, 64)
    expected = net.eval()(image)
    net.freeze()
    net.train()
    before = {name: value.clone() for name, value in net.state_dict().items()}
    taps = net(image)
    for tap, plain in zip(taps, expected, strict=True):
        torch.testing.assert_close(tap, plain, rtol=1e-4, atol=1e-4)
    sum(tap.sum() for tap in taps).backward()
    for name, value in net.state_dict().items():
        assert torch.equal(value, before[name]), f"{name} moved without an optimiser"
    for name, parameter in net.named_parameters():
        frozen = name.startswith(("stem.", "blocks.0.", "blocks.1."))
        assert (parameter.grad is None) == frozen, name


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
