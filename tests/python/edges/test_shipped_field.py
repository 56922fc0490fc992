"""Degenerate cases for the shipped network, on depth with a formula: planes, steps, round objects, creases.

Where the network misses a target, the bound is its result (docs/research/edges.md, "Degenerate cases").
"""

from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

from export.edges.graph_field import field_of_bundle
from export.edges.validation import field_of
from export.edges.weights import load_network

FOCAL_PX = 300.0
HEIGHT, WIDTH = 240, 320
EPS_R = 16.0
NEAR_EPS_R = 15.0  # what counts as "no edge within reach" of an estimate
FAR_M = 20.0
Y, X = (axis / FOCAL_PX for axis in np.mgrid[-119.5:120, -159.5:160])


@pytest.fixture(scope="module")
def shipped():
    field = field_of_bundle(Path("sdk/models/edges-int8"))
    return lambda depth: field(depth.astype(np.float32), FOCAL_PX)


def plane(tilt_deg: float, azimuth_deg: float) -> np.ndarray:
    """Depth of a plane through (0, 0, 1 m), 0 beyond 20 m."""
    tilt, azimuth = np.tan(np.radians(tilt_deg)), np.radians(azimuth_deg)
    inverse = 1 - tilt * (np.cos(azimuth) * X + np.sin(azimuth) * Y)
    return np.where(inverse > 1 / FAR_M, 1 / np.maximum(inverse, 1 / FAR_M), 0)


def inside(depth: np.ndarray, margin_px: int = 17) -> np.ndarray:
    """Pixels from which nothing unknown is within the margin; the frame's border is no end of the surface."""
    window = np.ones((2 * margin_px + 1,) * 2, np.uint8)
    return cv2.erode((depth > 0).astype(np.uint8), window, borderValue=1) > 0


@pytest.mark.parametrize("tilt_deg", [0, 30, 60, 80, 85])
@pytest.mark.parametrize("azimuth_deg", [30, 90])
def test_a_plane_at_any_tilt_has_no_edge_with_noise_and_without(shipped, tilt_deg, azimuth_deg):
    depth = plane(tilt_deg, azimuth_deg)
    counts = inside(depth)
    assert counts.sum() > 3000
    rng = np.random.default_rng(tilt_deg)
    for noise_r, share in ((0, 0.99), (1, 0.99), (2, 0.99), (4, 0.99)):
        noisy = np.maximum(depth * (1 + noise_r / FOCAL_PX * rng.standard_normal(depth.shape)), 1e-3) * (depth > 0)
        distance = shipped(noisy)[counts]
        assert (distance >= NEAR_EPS_R).mean() >= share, noise_r
        assert (distance < 4).mean() <= 0.002, noise_r
        assert distance.min() > 1, noise_r


@pytest.mark.parametrize("tilt_deg", [0, 3, 10, 30, 60])
@pytest.mark.parametrize("step_r", [0.1, 1])
def test_steps_of_quantised_depth_are_no_edges(shipped, tilt_deg, step_r):
    depth = plane(tilt_deg, 40)
    unit = step_r / FOCAL_PX
    distance = shipped(np.rint(depth / unit) * unit)[inside(depth)]
    assert (distance >= NEAR_EPS_R).mean() >= 0.99
    assert distance.min() > 4


def ball(radius_m: float) -> np.ndarray:
    a, half = X**2 + Y**2 + 1, 1.0
    rest = half**2 - a * (1 - radius_m**2)
    return np.where(rest > 0, (half - np.sqrt(np.maximum(rest, 0))) / a, 0)


def pipe(radius_m: float) -> np.ndarray:
    """Upright, over the whole frame."""
    a = X**2 + 1
    rest = 1 - a * (1 - radius_m**2)
    return np.where(rest > 0, (1 - np.sqrt(np.maximum(rest, 0))) / a, 0)


def cone(half_angle_deg: float) -> np.ndarray:
    """Its tip is a metre away, above the frame; it stands upright."""
    k, top = np.tan(np.radians(half_angle_deg)) ** 2, -0.6
    # x² + (z - 1)² = k (y - top)² along the ray (X, Y, 1) t.
    a = X**2 + 1 - k * Y**2
    half = 1 - k * Y * top
    rest = half**2 - a * (1 - k * top**2)
    depth = (half - np.sqrt(np.maximum(rest, 0))) / a
    return np.where((rest > 0) & (depth > 0) & (Y * depth > top), depth, 0)


@pytest.mark.parametrize(
    "depth",
    [ball(0.3), ball(0.1), pipe(0.3), pipe(0.1), cone(12)],
    ids=["ball", "small ball", "pipe", "thin pipe", "cone"],
)
@pytest.mark.parametrize("wall", [False, True])
def test_round_things_have_no_crease_and_their_silhouette_is_no_edge(shipped, depth, wall):
    known = depth > 0
    assert known.mean() > 0.03
    distance = shipped(np.where(known, depth, 1.6) if wall else depth)[known]
    assert (distance < 4).mean() <= 0.003
    assert (distance < 1).mean() <= 0.001


def roof(degrees: float, sign: int, shift_px: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Two planes that meet at an angle between their normals, convex (1) or concave (-1), and the distance in r."""
    slope = np.tan(np.radians(degrees / 2))
    across = np.cos(np.radians(20)) * X + np.sin(np.radians(20)) * Y - shift_px / FOCAL_PX
    inverse = 1 - sign * slope * np.abs(across)
    depth = np.where(inverse > 0.05, 1 / np.maximum(inverse, 0.05), 0)
    return depth, np.where(depth > 0, np.abs(across) * FOCAL_PX * np.hypot(1, slope), EPS_R)


@pytest.mark.parametrize("sign", [1, -1], ids=["convex", "concave"])
def test_recall_grows_with_the_angle_of_a_crease(shipped, sign):
    means, recalls = [], []
    for degrees in (5, 10, 18, 30, 45, 60, 90, 120):
        depth, true = roof(degrees, sign)
        distance = shipped(depth)
        means.append(distance[true < 1].mean())
        recalls.append((distance[true < 4] < 4).mean())
    assert (np.diff(means) < 0.1).all(), means
    assert (np.diff(recalls) > -0.02).all(), recalls
    assert recalls[0] < 0.1  # 5 degrees are no edge
    assert recalls[-2] > 0.95  # 90 are
    assert means[-2] < 1


def rounded_roof(radius_r: float) -> np.ndarray:
    """Two planes at a right angle with a rounding of so many r between them."""
    radius = radius_r / FOCAL_PX
    middle, u = 1 + radius * np.sqrt(2), np.abs(X)
    # Circle: (u t)² + (t - middle)² = radius²; planes: t = 1 + u t.
    rest = middle**2 - (1 + u**2) * (middle**2 - radius**2)
    bent = (middle - np.sqrt(np.maximum(rest, 0))) / (1 + u**2)
    return np.where((rest > 0) & (u * bent < radius / np.sqrt(2)), bent, 1 / (1 - u))


def test_an_edge_fades_as_it_is_rounded(shipped):
    means = [shipped(rounded_roof(r))[:, 158:162].mean() for r in (0.1, 0.5, 1, 2, 4, 8, 16, 40)]
    assert (np.diff(means) > -0.1).all(), means
    assert means[0] < 1.5  # 0.1 r is sharp; its four columns are 1.4 r away in the mean
    assert means[-1] > 12, means  # 40 r is smooth


@pytest.mark.parametrize("degrees", [45, 90, 120])
def test_a_shift_of_a_tenth_of_a_pixel_does_not_flicker(shipped, degrees):
    before = None
    for shift_px in np.arange(0, 1, 0.1):
        depth, true = roof(degrees, 1, shift_px)
        distance = shipped(depth)
        if before is not None:
            assert np.abs(distance - before)[(true < 15) & (depth > 0)].max() < 2
        before = distance


@pytest.mark.parametrize("degrees", [60, 80, 87, 89.5])
def test_surfaces_that_are_hardly_seen_give_numbers(shipped, degrees):
    slope = np.tan(np.radians(degrees))
    for inverse in (1 - slope * X, 1 + slope * np.abs(X), 1 - slope * np.abs(Y)):
        depth = np.where(inverse > 1e-6, 1 / np.maximum(inverse, 1e-6), 0)
        distance = shipped(depth)
        assert np.isfinite(distance).all()
        assert ((distance >= 0) & (distance <= EPS_R)).all()


@pytest.mark.parametrize("share", [0.5, 0.99])
def test_holes_everywhere_give_numbers_and_hardly_an_edge(shipped, share):
    depth = plane(20, 10) * (np.random.default_rng(3).random((HEIGHT, WIDTH)) > share)
    distance = shipped(depth)[depth > 0]
    assert np.isfinite(distance).all()
    assert (distance < 1).mean() < 0.01


def test_salt_and_pepper_hardly_spoil_a_field(shipped):
    depth, true = roof(90, 1)
    counts = (depth > 0) & (true < 12)
    rng = np.random.default_rng(4)
    where, much = rng.random(depth.shape), rng.uniform(0.5, 1.5, depth.shape)
    for share, most in ((0, 0.8), (0.01, 1.2), (0.05, 2)):
        seen = np.where(where < share, depth * much, depth)
        assert np.sqrt(np.mean((shipped(seen) - true)[counts] ** 2)) < most, share


def scene() -> np.ndarray:
    depth = plane(30, 40)
    depth[100:160, 120:200] *= 0.8
    return depth


@pytest.mark.usefixtures("one_thread")
def test_the_scale_of_a_scene_is_without_effect():
    """The fp32 network is tested: the int8 network may round a value at the border of two steps to the other one."""
    network, config = load_network(Path("export/weights/edges.pt"))
    field = field_of(network.eval(), config.bins)
    depth = scene().astype(np.float32)
    expected = field(depth, FOCAL_PX)
    for scale in (2.0**-7, 0.01, 0.3, 7.0, 100.0, 128.0):
        changed = np.abs(field((depth * np.float32(scale)).astype(np.float32), FOCAL_PX) - expected)
        exact = np.log2(scale) == np.rint(np.log2(scale))
        assert changed.max() <= (1e-4 if exact else 2e-2), scale
        assert np.quantile(changed, 0.99) <= 2e-3, scale
    assert torch.get_num_threads() == 1
