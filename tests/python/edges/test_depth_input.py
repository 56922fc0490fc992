"""The network's input: slopes that know no scale, and nothing that spreads from unknown pixels."""

import pytest
import torch

from export.edges.depth_input import folded, slopes


def plane(tilt_x: float, tilt_y: float, focal: tuple[float, float], at_m: float = 1.0, side: int = 24) -> torch.Tensor:
    """Depth [1, side, side] of a plane through (0, 0, at_m) that rises by tilt metres a metre sideways."""
    x = (torch.arange(side, dtype=torch.float64) - 11.5) / focal[0]
    y = (torch.arange(side, dtype=torch.float64) - 11.5) / focal[1]
    return (at_m / (1 - tilt_x * x[None] - tilt_y * y[:, None]))[None]


def squashed(g: torch.Tensor) -> torch.Tensor:
    return g / (1 + g.abs())


@pytest.mark.parametrize("focal", [(10.0, 10.0), (300.0, 300.0), (400.0, 250.0), (10000.0, 10000.0)])
def test_a_plane_is_a_slope_that_changes_only_with_its_depth(focal):
    depth = plane(0.5, -0.3, focal)
    out = slopes(depth, torch.tensor([focal], dtype=torch.float64))[0]
    ratio = depth[0] / 1.0  # inverse depth is linear, so the slope grows with the depth it is taken at
    assert torch.allclose(out[0, :, :-1], squashed(-0.5 * ratio)[:, :-1], atol=1e-9)
    assert torch.allclose(out[1, :-1], squashed(0.3 * ratio)[:-1], atol=1e-9)
    assert out[0, :, -1].abs().max() == out[1, -1].abs().max() == 0
    assert (out[2] == 1).all()


def test_the_size_of_a_scene_does_not_matter():
    focal = torch.tensor([[300.0, 300.0]])
    near = slopes(plane(1.5, 0.2, (300, 300), 0.01).float(), focal)
    far = slopes(plane(1.5, 0.2, (300, 300), 100.0).float(), focal)
    assert (near - far).abs().max() < 1e-3


def test_unknown_pixels_take_only_the_slopes_that_need_them():
    depth = plane(0.5, 0.1, (300, 300)).float()
    whole = slopes(depth, torch.full((1, 2), 300.0))[0]
    holed = depth.clone()
    holed[0, 5, 7] = 0
    out = slopes(holed, torch.full((1, 2), 300.0))[0]
    changed = {tuple(place) for place in torch.nonzero(out != whole).tolist()}
    assert changed == {(0, 5, 7), (0, 5, 6), (1, 5, 7), (1, 4, 7), (2, 5, 7)}
    assert torch.isfinite(out).all()


def test_jumps_are_squashed_into_one():
    depth = torch.ones(1, 4, 4)
    depth[0, :, 2:] = 1e6
    out = slopes(depth, torch.full((1, 2), 500.0))
    assert -1 <= out.min() < -0.99
    assert slopes(depth.flip(2), torch.full((1, 2), 500.0)).max() <= 1


def test_folding_puts_the_pixels_of_each_square_side_by_side():
    planes = torch.arange(2 * 4 * 6, dtype=torch.float32).view(1, 2, 4, 6)
    out = folded(planes, 2)
    assert out.shape == (1, 8, 2, 3)
    assert out[0, 4:, 1, 2].tolist() == [planes[0, 1, y, x].item() for y in (2, 3) for x in (4, 5)]
