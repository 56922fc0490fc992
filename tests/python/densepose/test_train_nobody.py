"""Training of neck and box head on what is no person, while what is said of people is kept."""

import copy

import pytest
import torch

from export.densepose import targets as tg
from export.densepose import train_nobody
from export.densepose.config import NetworkConfig
from export.densepose.network import MobileParsingRCNN
from export.densepose.train_nobody import View

BOXES = torch.tensor([[8, 8, 100, 120], [30, 20, 90, 110], [60, 4, 124, 100]]).float()


@pytest.fixture(scope="module")
def net() -> MobileParsingRCNN:
    torch.manual_seed(0)
    return MobileParsingRCNN(NetworkConfig(width=16)).eval()


def likely(net: MobileParsingRCNN, view: View) -> torch.Tensor:
    with torch.no_grad():
        features = net.neck([tap.float() for tap in view.taps])
        rois = tg.pooled(features, [view.boxes], net.config, net.config.box_pool)
        return net.box_head(rois)[0].softmax(1)[:, 0]


@pytest.fixture(scope="module")
def seen(net) -> list[View]:
    """Two kinds of pictures, which the backbone's maps tell apart; the box head takes both for people at first."""
    with torch.no_grad():
        net.box_head.logits.bias.copy_(torch.tensor([2.0, 0.0]))
    made = []
    for k in range(8):
        taps = [torch.randn(1, c, s, s) for c, s in zip(net.config.tap_channels, (32, 16, 8, 4), strict=True)]
        for tap in taps[1:]:
            tap[:, ::2] += 2 if k % 2 else -2
        made.append(View([tap.half() for tap in taps], BOXES, torch.full((3,), 0.9), keeps=k % 2 == 0))
    return made


def test_pictures_without_people_become_nobody_and_all_others_stay(net, seen):
    before = copy.deepcopy(net.state_dict())
    after = train_nobody.fit(net, seen, steps=60, rate=3e-3, seed=0)
    for view in seen:
        if view.keeps:
            assert (likely(after, view) - likely(net, view)).abs().max() < 0.15
        else:
            assert likely(net, view).min() > 0.6
            assert likely(after, view).max() < 0.3
    changed = {n.split(".")[0] for n, value in after.state_dict().items() if not torch.equal(value, before[n])}
    assert changed == {"neck", "box_head"}
    assert all(torch.equal(value, before[name]) for name, value in net.state_dict().items())


def test_maps_of_kept_pictures_cost_what_they_differ(net, seen):
    kept, nobody = seen[0], seen[1]
    assert set(train_nobody.step_loss(net, net, nobody)) == {"nobody"}
    same = train_nobody.step_loss(net, net, kept)
    assert same["maps"] == 0
    assert same["kept"].abs() < 1e-6
    other = copy.deepcopy(net)
    with torch.no_grad():
        other.neck.lateral[0].weight.mul_(1.5)
    assert train_nobody.step_loss(other, net, kept)["maps"] > 1e-4


def test_a_view_has_maps_boxes_and_how_likely_each_is_a_person(net):
    view = train_nobody.view(net, torch.randn(1, 3, 128, 128), keeps=True)
    assert [tuple(tap.shape[-2:]) for tap in view.taps] == [(32, 32), (16, 16), (8, 8), (4, 4)]
    assert len(view.boxes) == len(view.likely)
    assert view.likely.min() >= 0
    assert view.likely.max() <= 1
