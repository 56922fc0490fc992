"""The real carton's edges: corners from marks in photos, and what counts as found."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from benchmarks.edges import carton
from export.camera import Camera

SIDES = np.array([2.0, 0.6, 1.5])  # AB, AD, AE
PLACES = {
    "A": (0, 0, 0), "B": (1, 0, 0), "C": (1, 1, 0), "D": (0, 1, 0),
    "E": (0, 0, 1), "F": (1, 0, 1), "G": (1, 1, 1), "H": (0, 1, 1),
}  # fmt: skip
CORNERS = {name: np.array(place) * SIDES + (-1, -0.3, 4) for name, place in PLACES.items()}


def camera_at(x):
    return Camera.centred(640, 480, 600, np.eye(3), np.array([x, -0.4, 0.0]))


def pixel(camera, point):
    seen = camera.rotation @ (point - camera.centre)
    return tuple(seen[:2] / seen[2] * camera.fx_px + (camera.cx_px, camera.cy_px))


def curves_along(edges, off=0.0):
    return [np.array([CORNERS[a], CORNERS[b]]) + (0, off, 0) for a, b in edges]


def test_corners_are_where_the_rays_of_marks_meet():
    cameras = {f"{k}.jpg": camera_at(k - 1.0) for k in range(3)}
    marks = {name: {corner: pixel(camera, CORNERS[corner]) for corner in "ABCDEF"} for name, camera in cameras.items()}
    found = carton.corners_of(cameras, marks)
    assert found.keys() == CORNERS.keys()
    for name, corner in CORNERS.items():
        np.testing.assert_allclose(found[name], corner, atol=1e-9)


def test_all_edges_are_found_where_curves_lie_on_them():
    curves = curves_along(carton.EDGES)
    found = carton.compared(curves, curves, CORNERS, camera_at(0))
    assert found["found"] == 12
    assert found["median_px"] < 0.5
    assert found["angles"] == 24
    assert found["angle_deg"] == pytest.approx(0, abs=1e-6)


def test_an_edge_is_lost_without_half_of_it_and_beyond_three_pixels():
    half = [np.array([CORNERS["A"], CORNERS["A"] + 0.4 * (CORNERS["B"] - CORNERS["A"])])]
    found = carton.compared(half, half, CORNERS, camera_at(0))
    assert found["found"] == 0
    assert found["edges"][0]["part"] == pytest.approx(0.41, abs=0.02)  # and 3 px beyond its end
    off = 4 * 4 / 600  # metres: 4 px in front, at 4 m
    far = curves_along(["AB"], -off)
    assert carton.compared(far, far, CORNERS, camera_at(0))["found"] == 0
    near = curves_along(["AB"], -off / 2)
    found = carton.compared(near, near, CORNERS, camera_at(0))
    assert found["found"] == 1
    assert found["median_px"] == pytest.approx(2, abs=0.05)  # at the depth of the edge
    assert (found["angles"], found["angle_deg"]) == (0, None)


def test_a_leaning_line_spoils_the_angle():
    curves = curves_along(["AB", "DA"])
    leaning = curves[0].copy()
    leaning[1] += (0, 0.04, 0)
    found = carton.compared(curves, [leaning, curves[1]], CORNERS, camera_at(0))
    assert found["found"] == 2
    assert found["angle_deg"] == pytest.approx(np.degrees(np.arctan(0.04 / 2)), abs=1e-3)


def test_without_curves_nothing_is_found_and_no_gate_is_filled_but_the_count():
    found = carton.compared([], [], CORNERS, camera_at(0))
    assert found["found"] == 0
    assert carton.figures_from(found | {"curves": 0}) == {"edges_carton_edges": 0}
    assert carton.figures_from(None) == {}


def test_what_is_missing_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr(carton, "CAPTURE", tmp_path)
    assert carton.found_in(Path("bundle")) == (None, f"{tmp_path} has no depth: {carton.FETCH}")
    assert carton.main(["--capture", str(tmp_path)]) == 1

    def fails(*_):
        raise subprocess.CalledProcessError(1, "maquette", stderr="No bundle.\n")

    monkeypatch.setattr(carton, "measure", fails)
    assert carton.found_in(Path("bundle")) == (None, "No bundle.")
