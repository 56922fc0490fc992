"""Scenes in torch: cameras, who is seen, rasters, the regression; each against something written another way."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
import torch
from box_scene import BoxScene, looking, ring

from export.camera import Camera
from export.scenes.config import SIZES
from export.scenes.descriptors import Moments
from export.scenes.fitting import Options, View, background_of, fitted_to_views, painted, render, sampled, seen_in
from export.scenes.geometry.cameras import between, rotated_upright, upright, warped
from export.scenes.geometry.raster import (
    NOTHING,
    OCCLUSION_BLOCK_PX,
    depths_of,
    filled,
    halved,
    projected,
    pyramid,
    visible,
    without_occluded,
)
from export.scenes.geometry.source_views import drawn, scores
from export.scenes.networks.system import Networks

pytestmark = pytest.mark.usefixtures("one_thread", "fixed_seed")


def pixels_of(camera: Camera, places: np.ndarray) -> np.ndarray:
    seen = (places - camera.centre) @ camera.rotation.T
    at = seen @ camera.intrinsics.T
    return at[:, :2] / at[:, 2:]


# Cameras


@pytest.mark.parametrize("roll", [0.0, 0.3, -1.2, np.pi / 2, 3.0])
def test_an_upright_camera_has_the_worlds_up_above(roll):
    camera = looking((1, 0.7, 2), (0, 0, 0), roll=roll)
    turned = rotated_upright(camera, np.array([0, 1.0, 0]))
    foot = np.array([[0, 0, 0], [0, 0.1, 0.0]])
    low, high = pixels_of(turned, foot)
    centre = (turned.rotation @ (0, 1, 0))[0]
    assert abs(centre) < 1e-12
    assert high[1] < low[1]
    np.testing.assert_allclose(turned.rotation[2], camera.rotation[2], atol=1e-12)
    np.testing.assert_allclose(turned.rotation @ turned.rotation.T, np.eye(3), atol=1e-12)


def test_a_camera_that_looks_along_up_stays_as_it_is():
    camera = replace(looking((1, 0, 2), (0, 0, 0)), rotation=np.array([[0.6, 0, 0.8], [-0.8, 0, 0.6], [0, -1.0, 0]]))
    np.testing.assert_allclose(rotated_upright(camera, np.array([0, 1.0, 0])).rotation, camera.rotation, atol=1e-12)
    np.testing.assert_array_equal(rotated_upright(camera, np.zeros(3)).rotation, camera.rotation)


@pytest.mark.parametrize("roll", [0.0, 0.2, 0.8, np.pi / 2])
def test_the_aligned_frame_holds_the_whole_photo_and_little_more(roll):
    camera = looking((1, 0.7, 2), (0, 0, 0), 100, 60, roll)
    turned = upright(camera, np.array([0, 1.0, 0]), 16)
    assert turned.width_px % 16 == turned.height_px % 16 == 0
    there = warped(np.ones((60, 100), np.float32), camera, turned, cv2.BORDER_CONSTANT)
    assert there.sum() == pytest.approx(6000, rel=0.02)
    diagonal = int(np.ceil(np.hypot(100, 60)))
    tight = 100 * abs(np.cos(roll)) + 60 * abs(np.sin(roll))
    assert tight <= turned.width_px < tight + 17
    assert turned.width_px * turned.height_px < (diagonal + 16) ** 2
    if roll == 0:
        assert (turned.width_px, turned.height_px) == (112, 64)


def test_turned_images_show_what_the_turned_camera_sees():
    scene, camera = BoxScene(0), looking((1.5, 0.4, 2), (0, -0.5, 0), 200, 140, roll=0.5)
    turned = upright(camera, np.array([0, 1.0, 0]), 32)
    expected, _ = scene.photo(turned, 3)
    found = warped(scene.photo(camera, 3)[0], camera, turned)
    inside = warped(np.ones((140, 200), np.float32), camera, turned, cv2.BORDER_CONSTANT) > 0.999
    off = np.abs(found - expected).mean(2)[inside]
    assert np.median(off) < 0.01
    assert off.mean() < 0.04  # edges of squares are blurred
    shifted = np.abs(np.roll(found, 2, 1) - expected).mean(2)[inside]
    assert off.mean() < 0.5 * shifted.mean()


def test_pixels_of_two_cameras_map_as_points_do():
    camera = replace(looking((1, 0.7, 2), (0, 0, 0), 100, 60, 0.4), fx_px=90.0, fy_px=120.0, cx_px=70.0)
    turned = upright(camera, np.array([0, 1.0, 0]), 16)
    places = np.random.default_rng(0).uniform(-0.5, 0.5, (20, 3))
    before = np.c_[pixels_of(camera, places), np.ones(20)]
    np.testing.assert_allclose(before @ between(camera, turned).T, pixels_of(turned, places), atol=1e-9)


# Who is seen


def naive_keys(points: torch.Tensor, camera: Camera, near: float) -> dict[tuple[int, int], int]:
    """Row and column to winner, one point after the other."""
    columns, rows, depths = (x.numpy() for x in projected(points, camera))
    best = {}
    for k, (x, y, z) in enumerate(zip(columns, rows, depths, strict=True)):
        if not (np.isfinite(z) and z >= max(near, np.finfo(np.float32).tiny)):
            continue
        x, y = np.floor(np.float32(x) + np.float32(0.5)), np.floor(np.float32(y) + np.float32(0.5))
        if 0 <= x < camera.width_px and 0 <= y < camera.height_px:
            at = int(y), int(x)
            if at not in best or z < depths[best[at]]:
                best[at] = k
    return best


def test_who_wins_a_pixel_is_who_a_plain_loop_finds():
    rng = np.random.default_rng(1)
    places = rng.uniform(-3, 3, (3000, 3))
    places[100:200] = places[:100]  # as deep as another: the first counts
    places[5] = np.nan
    places[6] = np.inf
    camera = looking((0.5, 0.4, 1.0), (0, 0, 0), 33, 17, 0.3)
    points = torch.from_numpy(places)
    for near in (0.0, 1.5):
        keys = visible(points, camera, near)
        expected = naive_keys(points, camera, near)
        found = {(y, x): int(keys[y, x] & 0xFFFFFFFF) for y, x in np.argwhere((keys != NOTHING).numpy())}
        assert found == expected
        assert len(expected) > 150
        depth = depths_of(keys)
        assert depth[keys != NOTHING].min() >= near
        assert torch.isinf(depth[keys == NOTHING]).all()


def test_pixels_are_exact_far_from_the_worlds_origin():
    camera = looking((1, 0.7, 2), (0, 0, 0), 640, 480)
    places = np.random.default_rng(0).uniform(-0.5, 0.5, (200, 3))
    far = np.array([1e6, -2e6, 5e5])
    columns, rows, _ = projected(torch.from_numpy(places + far), replace(camera, centre=camera.centre + far))
    np.testing.assert_allclose(np.c_[columns, rows], pixels_of(camera, places), atol=0.01)


@pytest.mark.parametrize("principal", [(31.5, 23.5), (20.3, 40.9), (-15.0, 70.0)])
def test_a_coarser_level_is_what_a_smaller_camera_finds(principal):
    places = np.random.default_rng(2).uniform(-2, 2, (20000, 3))
    camera = looking((0.3, 0.4, 3.0), (0, 0, 0), 64, 48, 0.2)
    camera = replace(camera, cx_px=principal[0], cy_px=principal[1])
    points, keys = torch.from_numpy(places), visible(torch.from_numpy(places), camera)
    for level in range(1, 5):
        keys = halved(keys)
        direct = visible(points, camera.resized(64 >> level, 48 >> level))
        assert torch.equal(keys, direct)
    assert (keys != NOTHING).any()


def test_odd_rasters_are_not_halved():
    with pytest.raises(ValueError, match="multiples of 16"):
        halved(torch.zeros(3, 4, dtype=torch.int64))


def test_rasters_hold_the_looks_of_winners_and_nothing_elsewhere():
    places = np.random.default_rng(3).uniform(-2, 2, (300, 3))
    camera = looking((0.3, 0.4, 3.0), (0, 0, 0), 32, 16)
    keys = visible(torch.from_numpy(places), camera)
    shown = pyramid(keys, 5)
    found_descriptors = torch.randn(len(shown.points), 8)
    rows = dict(zip(shown.points.tolist(), found_descriptors, strict=True))
    for level, raster in enumerate(shown.rasters(found_descriptors)):
        assert raster.shape == (9, 16 >> level, 32 >> level)
        for y, x in np.ndindex(*keys.shape):
            if keys[y, x] == NOTHING:
                assert not raster[:, y, x].any()
            else:
                assert torch.equal(raster[:8, y, x], rows[int(keys[y, x] & 0xFFFFFFFF)])
                assert raster[8, y, x] == 1
        keys = halved(keys) if level < 4 else keys


def test_no_points_make_empty_rasters():
    for places in (np.zeros((0, 3)), np.array([[0, 0, 50.0]])):
        shown = pyramid(visible(torch.from_numpy(places), looking((0, 0, 3), (0, 0, 0), 32, 16)), 5)
        rasters = shown.rasters(torch.zeros(len(shown.points), 8))
        assert [tuple(r.shape) for r in rasters] == [(9, 16 >> k, 32 >> k) for k in range(5)]
        assert not any(r.any() for r in rasters)


def test_only_the_front_is_seen_and_coarser_photos_see_through_less():
    wall = np.stack(np.meshgrid(np.linspace(-1, 1, 41), np.linspace(-1, 1, 41), [0.0, -0.5]), -1).reshape(-1, 3)
    camera = looking((0, 0, 3), (0, 0, 0), 96, 96, focal=1.2)
    points, front = torch.from_numpy(wall), torch.from_numpy(wall[:, 2] == 0)
    through = []
    for scale in (1.0, 0.4):
        seen = seen_in(points, camera, Options(visibility_scale=scale, depth_tolerance=np.inf))
        through.append(int(seen[~front].sum()))
    assert through[1] < through[0]
    assert not seen_in(points, camera, Options())[~front].any()


def test_bilinear_samples_are_those_between_pixel_centres():
    features = torch.randn(3, 5, 7)
    found = sampled(features, torch.tensor([0.0, 2.0, 2.5, -3.0]), torch.tensor([0.0, 3.0, 3.25, 9.0]))
    a, b = features[:, 3, 2:4].mean(1), features[:, 4, 2:4].mean(1)
    expected = [features[:, 0, 0], features[:, 3, 2], 0.75 * a + 0.25 * b, features[:, 4, 0]]
    torch.testing.assert_close(found, torch.stack(expected), rtol=1e-5, atol=1e-6)


# The regression


def numpy_look(ys: np.ndarray, hs: np.ndarray, alpha: float) -> tuple[np.ndarray, np.ndarray]:
    """beta0 and beta from all views at once, as the paper writes it; float64."""
    mean = ys.mean(0)
    matrix = hs.T @ hs + alpha * np.eye(hs.shape[1])
    return mean, np.linalg.solve(matrix, hs.T @ ys - np.outer(hs.sum(0), mean))


def descriptors_of(ys: np.ndarray, hs: np.ndarray, seen: np.ndarray, alpha: float, precision=torch.float64):
    """ys [K, P, 8], hs [K, P, 6], seen [K, P]."""
    moments = Moments.zeros(ys.shape[1], torch.zeros((), dtype=precision))
    for y, h, s in zip(ys, hs, seen, strict=True):
        moments = moments.with_view(*(torch.from_numpy(x) for x in (y, h, s)))
    return moments.solved(alpha)


@pytest.mark.parametrize("alpha", [1.0, 1e-2, 1e-6])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_the_regression_is_numpys(alpha, scale):
    rng = np.random.default_rng(4)
    ys, hs = scale * rng.normal(size=(9, 20, 8)), rng.normal(size=(9, 20, 6))
    seen = rng.random((9, 20)) < 0.6
    found_descriptors = descriptors_of(ys, hs, seen, alpha)
    target = torch.from_numpy(rng.normal(size=(20, 6)))
    found = found_descriptors.seen_from(target).numpy()
    for p in range(20):
        mean, slope = numpy_look(ys[seen[:, p], p], hs[seen[:, p], p], alpha)
        np.testing.assert_allclose(found[p], mean + target[p].numpy() @ slope, rtol=1e-7, atol=1e-7 * scale)


def test_the_regression_in_float_is_near_enough():
    rng = np.random.default_rng(5)
    ys = rng.normal(size=(1000, 5, 8)) + 3
    hs = rng.normal(size=(1000, 5, 6)) * 0.01 + rng.normal(size=(5, 6))  # nearly one direction
    found_descriptors = descriptors_of(ys, hs, np.ones((1000, 5), bool), 1.0, torch.float32)
    for p in range(5):
        mean, slope = numpy_look(ys[:, p], hs[:, p], 1.0)
        expected = mean + hs[0, p] @ slope
        found = found_descriptors.seen_from(torch.from_numpy(hs[0]).float())[p].numpy()
        np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4)


def test_points_never_seen_and_seen_once_or_from_one_side_have_no_slope():
    rng = np.random.default_rng(6)
    ys, hs = rng.normal(size=(4, 3, 8)), np.repeat(rng.normal(size=(1, 3, 6)), 4, 0)
    seen = np.array([[False, True, True], [False, False, True], [False, False, True], [False, False, True]])
    for precision in (torch.float32, torch.float64):
        found_descriptors = descriptors_of(ys, hs, seen, 1.0, precision)
        assert found_descriptors.views.tolist() == [0, 1, 4]
        assert not found_descriptors.slope.any()  # exactly
        assert not found_descriptors.mean[0].any()
        assert torch.equal(found_descriptors.mean[1], torch.from_numpy(ys[0, 1]).to(precision))


def test_without_a_regulariser_what_cannot_be_solved_is_counted_and_constant():
    rng = np.random.default_rng(7)
    ys, hs = rng.normal(size=(8, 3, 8)), rng.normal(size=(8, 3, 6))
    seen = np.ones((8, 3), bool)
    seen[3:, 0] = False  # three views for six unknowns
    hs[:, 1, 5] = hs[:, 1, 4]  # two basis functions that are one
    found_descriptors = descriptors_of(ys, hs, seen, 0.0)
    assert found_descriptors.singular.tolist() == [True, True, False]
    assert not found_descriptors.slope[:2].any()
    _, slope = numpy_look(ys[:, 2], hs[:, 2], 0.0)
    np.testing.assert_allclose(found_descriptors.slope[2], slope, rtol=1e-8)


def test_the_order_of_views_hardly_matters():
    rng = np.random.default_rng(8)
    ys, hs, seen = rng.normal(size=(500, 4, 8)), rng.normal(size=(500, 4, 6)), np.ones((500, 4), bool)
    order = rng.permutation(500)
    first = descriptors_of(ys, hs, seen, 1.0, torch.float32)
    other = descriptors_of(ys[order], hs[order], seen, 1.0, torch.float32)
    direction = torch.from_numpy(hs[7]).float()
    torch.testing.assert_close(first.seen_from(direction), other.seen_from(direction), rtol=1e-4, atol=1e-5)


# All of it


@pytest.fixture(scope="module")
def room():
    scene, cameras = BoxScene(3), ring(4, 64, 48)
    views = [View(scene.photo(camera, 1)[0], camera) for camera in cameras]
    places, colours = scene.cloud(cameras)
    return torch.from_numpy(places), torch.from_numpy(colours).float(), views


def test_a_model_for_one_image_is_as_good_as_the_whole_one(room):
    points, _, views = room
    networks, options = Networks(SIZES["tiny"]).eval(), Options()
    camera = upright(views[1].camera, np.array([0, 1.0, 0]), 16)
    with torch.no_grad():
        whole = fitted_to_views(points, [views[0], views[2]], networks, options)
        part = fitted_to_views(points, [views[0], views[2]], networks, options, camera)
        assert len(part.positions) < len(whole.positions) < len(points)
        expected, found = (m.rasters(camera, networks, options) for m in (whole, part))
    for a, b in zip(expected, found, strict=True):
        assert torch.equal(a, b)


def test_features_are_those_of_the_pixel_a_point_is_in(room):
    """With an extractor that passes the photo through, points have their own colours."""
    points, colours, _ = room
    networks, camera = Networks(SIZES["tiny"]).eval(), looking((0.2, 0.3, 2.4), (0, -0.5, 0), 64, 48)
    view = View(BoxScene(3).photo(camera, 1)[0], camera)
    networks.extractor.forward = lambda image: torch.cat([image, image, image[:, :2]], 1)
    with torch.no_grad():
        model = fitted_to_views(points, [view], networks, Options())
    (seen,) = torch.where(seen_in(points, camera, Options()))
    columns, rows, _ = (x.numpy() for x in projected(points[seen], camera))
    at = columns[:, None], rows[:, None]
    photo = cv2.remap(view.image, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)[:, 0]
    np.testing.assert_allclose(model.fit.mean[:, :3], photo, atol=0.05)  # OpenCV blends in steps of 1/32
    assert np.abs(photo - colours[seen].numpy()).mean() < 0.1  # what blending at the squares' edges does


@pytest.mark.parametrize("roll", [0.0, 0.7])
def test_an_image_of_any_size_and_turn_is_what_the_camera_sees(room, roll):
    """With networks that pass colours through, a rendered image is the painted cloud, turned and back."""
    points, colours, views = room
    networks, options = Networks(SIZES["tiny"]).eval(), Options()
    camera = looking((0.2, 0.3, 2.4), (0, -0.5, 0), 61, 45, roll)
    networks.extractor.forward = lambda image: torch.cat([image, image, image[:, :2]], 1)
    networks.refiner.forward = lambda rasters: rasters[0][:, :3]
    with torch.no_grad():
        picture = render(fitted_to_views(points, views, networks, options), camera, networks, options)
    assert picture.shape == (45, 61, 3)
    photo, _ = BoxScene(3).photo(camera, 2)
    plain = painted(points, colours, camera)
    assert plain.shape == photo.shape
    off = np.abs(picture - photo).mean()
    assert off < 0.15
    assert off < 0.6 * np.abs(np.roll(picture, 4, 1) - photo).mean()


def test_a_gradient_reaches_extractor_basis_and_refiner(room):
    points, _, views = room
    networks = Networks(SIZES["tiny"]).train()
    camera = upright(views[1].camera, np.array([0, 1.0, 0]), 1).reframed(8, 8, 32, 32)
    model = fitted_to_views(points, [views[0], views[2], views[3]], networks, Options(), camera)
    rasters = model.rasters(camera, networks, Options())
    networks.refiner([r[None] for r in rasters]).square().mean().backward()
    for name, parameter in networks.named_parameters():
        assert parameter.grad is not None, name
        assert torch.isfinite(parameter.grad).all(), name
    for part in (
        "extractor.final.weight",
        "extractor.trunk.stem.conv.weight",
        "basis.0.weight",
        "refiner.final.weight",
    ):
        assert networks.get_parameter(part).grad.abs().max() > 0, part


def test_sources_are_drawn_from_aside_and_from_those_that_see_the_same():
    cameras = [looking((3 * np.sin(a), 0, 3 * np.cos(a)), (0, 0, 0)) for a in np.radians([0, 1, 15, 60])]
    cameras.append(looking((0, 0, 3), (0, 0, 9)))  # looks away
    places = np.random.default_rng(0).uniform(-0.3, 0.3, (200, 3))
    score = scores(cameras[0], cameras[1:], places)
    assert score.argmax() == 1
    assert score[3] == 0
    rng = np.random.default_rng(0)
    counts = np.bincount([k for _ in range(200) for k in drawn(0, cameras, range(5), places, 1, rng)], minlength=5)
    assert counts[0] == 0
    assert counts[2] > 120
    assert sorted(drawn(0, cameras, range(5), places, 9, rng)) == [1, 2, 3, 4]
    assert sorted(drawn(0, cameras, [0, 3, 4], places, 9, rng)) == [3, 4]


def test_pixels_without_a_point_have_the_colours_of_the_next_coarser_raster():
    rasters = [torch.rand(9, 32 >> k, 48 >> k) for k in range(3)]
    for raster, share in zip(rasters, (0.3, 0.6, 0.9), strict=True):
        raster[8] = (torch.rand_like(raster[8]) < share).float()
        raster *= raster[8].clone()
    background = torch.tensor([0.1, 0.5, 0.7])
    full = filled(rasters, background)
    for level in range(3):
        there = rasters[level][8] > 0
        assert torch.equal(full[level][:, there], rasters[level][:, there])
        assert torch.equal(full[level][3:], rasters[level][3:])
        if level < 2:
            below = full[level + 1][:3].repeat_interleave(2, 1).repeat_interleave(2, 2)
            assert torch.equal(full[level][:3, ~there], below[:, ~there])
        else:
            assert torch.equal(full[level][:3, ~there], background[:, None].expand(3, int((~there).sum())))


def test_points_behind_a_sparse_surface_are_hidden_and_a_slope_is_not():
    rng = np.random.default_rng(5)
    wall = np.c_[rng.uniform(-1, 1, (400, 2)), np.full(400, 2.0)]
    behind = np.c_[rng.uniform(-2, 2, (4000, 2)), np.full(4000, 4.0)]
    points = torch.from_numpy(np.concatenate([behind, wall]))
    camera = Camera(66, 46, 60.0, 60.0, 33.0, 23.0, np.eye(3), np.zeros(3))
    keys = visible(points, camera)
    left = without_occluded(keys, 0.1)
    behind_before, behind_after = (((k != NOTHING) & (depths_of(k) > 3))[8:36, 8:56].sum() for k in (keys, left))
    assert behind_before > 300
    assert behind_after < behind_before / 4
    assert torch.equal(left[depths_of(keys) < 3], keys[depths_of(keys) < 3])
    assert torch.equal(without_occluded(keys, torch.inf), keys)
    # A point that remains is the nearest of its block, or near it: computed by hand.
    depth = depths_of(keys).numpy()
    for row, column in np.argwhere(left.numpy() != NOTHING)[::17]:
        top, first = row - row % OCCLUSION_BLOCK_PX, column - column % OCCLUSION_BLOCK_PX
        assert (
            depth[row, column]
            <= depth[top : top + OCCLUSION_BLOCK_PX, first : first + OCCLUSION_BLOCK_PX].min() * 1.1001
        )
    columns, rows = (x.ravel() for x in np.meshgrid(np.linspace(-3, 3, 200), np.linspace(-2, 2, 200)))
    slope = torch.from_numpy(np.c_[columns, rows, 4 + columns])
    keys = visible(slope, camera)
    assert torch.equal(without_occluded(keys, 0.2), keys)


def test_the_background_is_what_photos_show_where_no_point_is():
    # Points in the left half of a photo whose right half is red; blocks that the border cuts belong to their side.
    image = np.zeros((48, 64, 3), np.float32)
    image[:, :32] = (0.2, 0.4, 0.6)
    image[:, 32:] = (0.9, 0.1, 0.0)
    camera = Camera(64, 48, 50.0, 50.0, 31.5, 23.5, np.eye(3), np.zeros(3))
    columns, rows = (x.ravel() for x in np.meshgrid(np.arange(0, 32, 4), np.arange(0, 48, 4)))
    left = torch.from_numpy(np.c_[(columns - 31.5) / 50, (rows - 23.5) / 50, np.ones(len(rows))] * 2)
    views = [View(image, camera)]
    for scale in (1.0, 0.5):
        options = Options(visibility_scale=scale)
        found = background_of(left, [seen_in(left, camera, options)], views, options)
        torch.testing.assert_close(found, torch.tensor([0.9, 0.1, 0.0]))
    everywhere = torch.cat([left, left * torch.tensor([-1, 1, 1])])
    found = background_of(everywhere, [seen_in(everywhere, camera, Options())], views, Options())
    torch.testing.assert_close(found, torch.tensor([0.55, 0.25, 0.3]))
