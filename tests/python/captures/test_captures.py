"""Real captures: depth from neighbours, points that views agree on, up, masks, structure from motion that is known."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from export.camera import Camera
from export.captures.dense import dense_cloud
from export.captures.folder import write_depths
from export.captures.originals import ORIGINALS, Photo, box_mask
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


def sparse_points() -> np.ndarray:
    """Points on the wall, all seen by all cameras."""
    x, z = np.meshgrid(np.linspace(-0.4, 0.4, 6), np.linspace(-0.4, 0.4, 6))
    return np.stack([x.ravel(), np.zeros(36), z.ravel()], 1)


def test_points_lie_on_the_wall_that_the_photos_show(wall):
    cameras, seen = wall
    images = [np.repeat(picture[..., None], 3, 2).astype(np.uint8) for picture, _ in seen]
    images[0][..., 0] = 0
    masks = [np.ones(SIZE[::-1], bool) for _ in cameras]
    masks[1][:45] = False
    depths, xyz, rgb = dense_cloud(cameras, images, masks, sparse_points())
    assert len(xyz) == len(rgb) > 5000
    assert np.quantile(np.abs(xyz[:, 1]), 0.95) < 0.04  # of 2
    assert (rgb[:, 2] == 0).any()
    found = depths[0] > 0
    assert found.mean() > 0.6
    assert np.median(np.abs(depths[0] / seen[0][1] - 1)[found]) < 0.005
    assert not depths[1][:45].any()
    assert depths[1][45:].any()
    assert len(dense_cloud(cameras, images, masks, sparse_points(), max_points=5000)[1]) == 5000


def test_photos_without_anything_in_common_make_no_cloud(wall):
    cameras, _ = wall
    dark = [np.zeros((*SIZE[::-1], 3), np.uint8) for _ in cameras]
    masks = [np.ones(SIZE[::-1], bool) for _ in cameras]
    with pytest.raises(CaptureError, match="depth"):
        dense_cloud(cameras, dark, masks, sparse_points())


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
    # One similarity takes all cameras to where they were (Umeyama 1991).
    found = np.stack([camera.centre for camera in capture.cameras])
    true = np.stack([room.cameras[k].centre for k in chosen])
    a, b = found - found.mean(0), true - true.mean(0)
    left, sizes, right = np.linalg.svd(b.T @ a)
    sign = np.diag([1, 1, np.sign(np.linalg.det(left @ right))])
    turn, scale = left @ sign @ right, (sizes * np.diag(sign)).sum() / (a**2).sum()
    away = np.linalg.norm(scale * a @ turn.T - b, axis=1)
    assert away.max() < 0.02 * np.linalg.norm(np.ptp(true, axis=0))
    # Its turn about the path of the cameras is weak, so that up comes from how they look.
    turns = sum(room.cameras[k].rotation.T @ camera.rotation for k, camera in zip(chosen, capture.cameras, strict=True))
    left, _, right = np.linalg.svd(turns)
    assert (left @ right @ capture.up)[2] > np.cos(np.radians(3))
