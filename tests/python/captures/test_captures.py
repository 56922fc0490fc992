"""Real captures: depth from neighbours, points that views agree on, up, masks, structure from motion that is known."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from export.camera import Camera
from export.captures.dense import depth_maps, fused, neighbours_of
from export.captures.folder import write_depths
from export.captures.originals import ORIGINALS, Photo, box_mask
from export.captures.plane_sweep import GreyView, depth_of
from export.captures.structure import CaptureError, up_of_cameras
from export.photos.packages import load_packages
from export.scenes.captures import read_capture

ROOM = Path(__file__).parents[2] / "media" / "room"
SIZE = 120, 90


def looking(eye, target=(0, 0, 0)) -> Camera:
    """Upright, z up."""
    forward = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    return Camera(*SIZE, 130.0, 130.0, (SIZE[0] - 1) / 2, (SIZE[1] - 1) / 2, rotation, np.array(eye, float))


def seen_wall(camera: Camera, pattern: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns a camera's image of the wall y = 0 with `pattern` from -1 to 1, and its depth."""
    x, y = np.meshgrid(*(np.arange(n) for n in SIZE))
    rays = np.stack([x, y, np.ones_like(x)], -1) @ np.linalg.inv(camera.intrinsics).T @ camera.rotation
    depth = -camera.centre[1] / rays[..., 1]
    at = camera.centre + rays * depth[..., None]
    across, down = ((at[..., k] * s + 1) / 2 * (len(pattern) - 1) for k, s in ((0, 1), (2, -1)))
    seen = cv2.remap(pattern, across.astype(np.float32), down.astype(np.float32), cv2.INTER_LINEAR)
    return seen, depth.astype(np.float32)


@pytest.fixture(scope="module")
def wall():
    """Five cameras before a wall, their images and depth."""
    rng = np.random.default_rng(0)
    pattern = cv2.GaussianBlur(rng.uniform(0, 255, (400, 400)).astype(np.float32), (0, 0), 3)
    pattern = np.clip(128 + 6 * (pattern - 128), 0, 255)
    cameras = [looking((0.5 * x, -2 + 0.05 * x * x, 0.15 * (k % 2))) for k, x in enumerate((-2, -1, 0, 1, 2))]
    return cameras, [seen_wall(camera, pattern) for camera in cameras]


def test_a_sweep_finds_the_depth_of_a_slanted_wall(wall):
    cameras, seen = wall
    full = np.ones(SIZE[::-1], bool)
    views = [GreyView(camera, picture, full) for camera, (picture, _) in zip(cameras, seen, strict=True)]
    depth = depth_of(views[0], [views[1], views[2]], 1.4, 4.0)
    found = depth > 0
    assert found.mean() > 0.6
    assert np.median(np.abs(depth / seen[0][1] - 1)[found]) < 0.005
    # Were a camera elsewhere, so would be what is found.
    moved = GreyView(looking((-0.1, -2, 0)), views[1].grey, full)
    wrong = depth_of(views[0], [moved, moved], 1.4, 4.0)
    assert np.median(np.abs(wrong / seen[0][1] - 1)[wrong > 0]) > 0.02


def sparse_points(cameras):
    """Numbers and places of points on the wall, all seen by all cameras."""
    grid = np.linspace(-0.4, 0.4, 6)
    places = {k: np.array([x, 0, z]) for k, (x, z) in enumerate((x, z) for x in grid for z in grid)}
    return [set(places)] * len(cameras), places


def test_points_are_kept_where_views_agree(wall):
    cameras, seen = wall
    known, places = sparse_points(cameras)
    images = [np.repeat(picture[..., None], 3, 2).astype(np.uint8) for picture, _ in seen]
    masks = [np.ones(SIZE[::-1], bool) for _ in cameras]
    depths = depth_maps(cameras, images, masks, known, places)
    xyz, rgb = fused(cameras, images, depths)
    assert len(xyz) == len(rgb) > 5000
    assert np.quantile(np.abs(xyz[:, 1]), 0.95) < 0.04  # of 2
    assert 4000 < len(fused(cameras, images, depths, max_points=5000)[0]) <= 5000
    assert len(fused(cameras, images, depths, min_witnesses=4)[0]) < len(xyz)
    # Images of nothing in common make no cloud.
    rng = np.random.default_rng(1)
    noise = [rng.integers(0, 255, image.shape, dtype=np.uint8) for image in images]
    with pytest.raises(CaptureError, match="points"):
        fused(cameras, noise, depth_maps(cameras, noise, masks, known, places))


def test_neighbours_stand_aside_a_little():
    cameras = [looking((2 * np.sin(np.radians(a)), -2 * np.cos(np.radians(a)), 0)) for a in (0, 0.5, 10, 40, 11)]
    known, places = sparse_points(cameras)
    assert set(neighbours_of(0, cameras, known, places)[:2]) == {2, 4}
    assert neighbours_of(0, cameras, known, places)[-1] == 3


def test_up_is_level_though_all_cameras_look_down_from_one_side():
    angles = np.radians(np.linspace(-45, 45, 12))
    rotations = np.stack([looking((np.cos(a), np.sin(a), 0.9)).rotation for a in angles])
    mean = -rotations[:, 1].mean(0)
    assert mean[2] / np.linalg.norm(mean) < np.cos(np.radians(30))
    assert up_of_cameras(rotations)[2] > np.cos(np.radians(2))


def test_the_mask_is_the_hull_of_the_yellow_box():
    frame = np.full((240, 320, 3), (160, 150, 150), np.uint8)
    corners = np.array([(60, 60), (200, 40), (240, 150), (90, 180)])
    cv2.fillConvexPoly(frame, corners, (20, 170, 230))
    frame[80:130, 110:180] = (200, 60, 30)  # its image is blue
    wanted = cv2.fillConvexPoly(np.zeros((240, 320), np.uint8), corners, 255)
    both = box_mask(frame) & wanted
    assert both.sum() > 0.97 * wanted.sum()
    assert box_mask(frame).sum() < 1.03 * wanted.sum()
    assert not box_mask(np.zeros_like(frame)).any()


def test_every_original_names_a_package_whose_licence_permits():
    packages = load_packages()
    assert {packages[original.package].licence for original in ORIGINALS} <= {"Apache-2.0", "MIT", "CC0-1.0"}


def test_depth_is_written_for_the_photos_that_have_it(tmp_path):
    near, far = np.full((4, 6), 0.5, np.float32), np.zeros((4, 6), np.float32)
    far[1:3, 2] = 3.25
    entries, unit = write_depths(tmp_path, ["images/007.jpg", "images/009.jpg"], [near, far])
    assert entries["images/009.jpg"] == {"depth_file_path": "depth/009.png"}
    for depth, name in ((near, "007"), (far, "009")):
        stored = cv2.imread(str(tmp_path / f"depth/{name}.png"), cv2.IMREAD_UNCHANGED)
        assert stored.dtype == np.uint16
        np.testing.assert_allclose(stored * unit, depth, atol=3.25 / 60_000)
        assert ((stored == 0) == (depth == 0)).all()


def test_the_cameras_of_the_rendered_room_are_found_again(tmp_path, monkeypatch):
    pytest.importorskip("pycolmap", reason="of the extra `captures`")
    from export.captures import folder as writer
    from export.captures.originals import Original

    room = read_capture(ROOM)
    chosen = range(10, 16)
    images = [cv2.imdecode(np.frombuffer(room.photos[k], np.uint8), cv2.IMREAD_REDUCED_COLOR_2) for k in chosen]
    full = np.full(images[0].shape[:2], 255, np.uint8)
    photos = [Photo(image, full) for image in images]
    monkeypatch.setattr(Original, "photos", lambda self: photos)
    read, posed, points = writer.make(Original("room", "mvtb-data", "a room", False, None), tmp_path / "room")
    assert read == posed == len(chosen)
    assert points > 5_000
    capture = read_capture(tmp_path / "room")
    assert capture.held_out == {4}
    assert json.loads((tmp_path / "room" / "transforms.json").read_text())["reprojection_error_px"] < 1
    # One similarity takes all cameras to where they were (Umeyama 1991); up is one of what it must find.
    found = np.stack([camera.centre for camera in capture.cameras])
    true = np.stack([room.cameras[k].centre for k in chosen])
    a, b = found - found.mean(0), true - true.mean(0)
    left, sizes, right = np.linalg.svd(b.T @ a)
    sign = np.diag([1, 1, np.sign(np.linalg.det(left @ right))])
    turn, scale = left @ sign @ right, (sizes * np.diag(sign)).sum() / (a**2).sum()
    away = np.linalg.norm(scale * a @ turn.T - b, axis=1)
    assert away.max() < 0.02 * np.linalg.norm(np.ptp(true, axis=0))
    assert (turn @ capture.up)[2] > np.cos(np.radians(3))
