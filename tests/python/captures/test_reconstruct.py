"""Rendered places with the clouds that their photos give."""

import numpy as np
import pytest

from export.captures.reconstruct import PhotoFaults, corners, reconstruct, worn
from export.places.dataset import render_place
from export.places.geometry_only import PlainStock
from export.places.place import load_place
from export.scenes.captures import read_captures


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("places") / "place-00002"
    render_place(PlainStock("train"), "train", 2, folder, small=True, exact=True, frames=14)
    return load_place(folder)


def test_a_place_becomes_a_capture_whose_cloud_was_made_of_the_photos_it_keeps(place, tmp_path):
    reconstruct(place, tmp_path / "a/place-00002", np.random.default_rng(1))
    (capture,) = read_captures(tmp_path / "a")
    assert len(capture.cameras) == 14
    assert 10 <= len(capture.sources()) < 14
    assert len(capture.held_out) + len(capture.sources()) == 14
    # Points of the cloud have the depth that a held-out view sees there.
    held_out = min(capture.held_out)
    pixels, depth = capture.cameras[held_out].projected(capture.cloud.positions.astype(np.float64))
    x, y = np.rint(pixels).astype(int).T
    inside = (depth > 0) & (x >= 0) & (y >= 0) & (x < place.images.width) & (y < place.images.height)
    seen = place.depth[held_out][y[inside], x[inside]]
    off = np.abs(depth[inside] / np.maximum(seen, 1e-9) - 1)[seen > 0]
    assert len(off) > 1000
    assert np.median(off) < 0.05
    # The held-out photo has no faults.
    assert capture.photos[held_out] == place.images.files[held_out].read_bytes()


def test_sparse_points_are_corners_with_their_depth(place):
    points = corners(place, [0, 1, 2], np.random.default_rng(0))
    _, depth = place.camera(0).projected(points[:50].astype(np.float64))
    assert len(points) > 50
    assert (depth > 0).mean() > 0.9


def test_faults_change_a_photo_as_they_say():
    grey = np.full((64, 64, 3), 100, np.uint8)
    assert np.array_equal(worn(grey, PhotoFaults(), np.random.default_rng(0)), grey)
    noisy = worn(grey, PhotoFaults(noise=4), np.random.default_rng(0)).astype(float)
    assert noisy.std() == pytest.approx(4, rel=0.1)
    exposed = [worn(grey, PhotoFaults(exposure=0.1), np.random.default_rng(k)).mean() for k in range(200)]
    assert np.std(np.log(exposed)) == pytest.approx(0.1, rel=0.2)
