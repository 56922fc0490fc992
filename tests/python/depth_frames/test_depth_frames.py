"""Real frames: depth out of pairs and scans, where no edge is right, and how mistakes are counted."""

import numpy as np
import pytest

pytest.importorskip("embreex", reason="Embree is not installed: scripts/make-venv.sh dev,solids")

import cv2
import trimesh

from export.depth_frames.frames import DepthFrame
from export.depth_frames.matching import MatchingError, Rectified, depth_of, uncalibrated
from export.depth_frames.originals import ORIGINALS, scanned
from export.depth_frames.sheet import TILE_PX, false_positives, row_of
from export.edges.data import Frame
from export.photos.packages import load_packages
from export.solids.records import LIMIT_R, RecordError


def texture(shape, seed=0):
    return cv2.GaussianBlur(np.random.default_rng(seed).integers(0, 255, shape, np.uint8), (0, 0), 1)


def test_matched_pairs_have_the_depth_of_their_disparity():
    left = texture((120, 200))
    pair = Rectified(left, np.roll(left, -10, 1), 300.0, 99.5, 59.5, 99.5, 0.06)
    depth = depth_of(pair, 32)[10:-10, 40:-20]
    assert (depth > 0).mean() > 0.95
    assert np.median(depth[depth > 0]) == pytest.approx(300 * 0.06 / 10, rel=0.01)
    moved = Rectified(left, pair.right, 300.0, 99.5, 59.5, 104.5, 0.06)  # of the 10 px, -5 are the cameras'
    depth = depth_of(moved, 32)[10:-10, 40:-20]
    assert np.median(depth[depth > 0]) == pytest.approx(300 * 0.06 / 15, rel=0.01)


def test_images_that_have_nothing_in_common_are_told():
    with pytest.raises(MatchingError, match="features"):
        uncalibrated(texture((120, 160), 1), texture((120, 160), 2), 150)


def test_a_scan_is_seen_from_where_it_was_taken():
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.1)
    frame = scanned("ball", np.asarray(ball.vertices) + [0.05, 0.02, 0.7], np.asarray(ball.faces))
    fx, _, cx, cy = frame.intrinsics
    width = frame.depth.shape[1]
    seen = frame.depth > 0
    y, x = np.nonzero(seen)
    point = np.stack([(x - cx) / fx, (y - cy) / fx, np.ones(len(x))], 1) * frame.depth[seen][:, None]
    np.testing.assert_allclose(np.linalg.norm(point - [0.05, 0.02, 0.7], axis=1), 0.1, atol=5e-4)
    assert abs(x.mean() - width / 2) < 5
    away = cv2.distanceTransform(seen.astype(np.uint8), cv2.DIST_C, 3)
    assert frame.smooth[away > 18].all()
    assert not frame.smooth[away < 16].any()


def record_of(smooth_ratio=0.5):
    depth = np.full((37, 50), 1.5, np.float32)
    depth[:, :3] = 0
    smooth = np.zeros(depth.shape, bool)
    smooth[:, : int(50 * smooth_ratio)] = True
    return DepthFrame("real/a", depth, (60.0, 60.0, 24.5, 18.0), smooth).record()


def test_a_frame_is_a_view_with_a_label_only_where_no_edge_can_be():
    record = record_of()
    planes = record.decoded()
    assert planes["depth"].shape == (32, 48)
    assert (planes["distance"] == LIMIT_R).all()
    assert (~planes["ignore"]).sum() == 32 * (25 - 3)
    assert record.seen_curves() == {"curves": [], "corners": [], "boxes": []}


def test_mistakes_are_counted_where_no_edge_can_be():
    counts = np.zeros((4, 5), bool)
    counts[:2] = True
    frame = Frame(np.ones((4, 5), np.float32), np.full((4, 5), 16.0), np.zeros((4, 5), int), counts, 100.0)
    found = np.full((4, 5), 16.0)
    found[0, :2] = 0.5, 3
    found[3] = 0
    figures = false_positives(lambda depth, focal_px: found, [frame])
    assert figures == {"pixels": 10, "under_1r": pytest.approx(0.1), "under_4r": pytest.approx(0.2)}


def test_a_row_of_the_sheet_shows_the_field_where_depth_is():
    row = row_of(record_of(), lambda depth, focal_px: np.zeros(depth.shape))
    assert row.shape[1] == 4 * TILE_PX
    field = row[:, 2 * TILE_PX : 3 * TILE_PX]
    assert field[:, -40:].mean() > 150
    assert field[:, :8].mean() < 30


def test_frames_come_from_listed_packages():
    assert {original.package for original in ORIGINALS} <= set(load_packages())


def test_crops_have_no_boxes_to_ask_for():
    record = record_of()
    with pytest.raises(RecordError, match="curves"):
        type(record)(record.name, record.height, record.width, record.intrinsics, record.data).seen_curves()
