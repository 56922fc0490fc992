"""Parts of the benchmark of edges beside its errors: Voronoi covariance, parameters of curves."""

from types import SimpleNamespace

import maquette
import numpy as np
import pytest

from benchmarks.edges import quality, section, sensitivity, voronoi
from benchmarks.edges.edges_api import Edges, Pinhole
from benchmarks.edges.measure import BUNDLE
from benchmarks.edges.rivals import tuned

HEIGHT, WIDTH, FOCAL_PX = 72, 96, 100.0
pytestmark = pytest.mark.usefixtures("one_thread")
needs_library = pytest.mark.skipif(
    not maquette.library_path().exists(), reason=f"{maquette.library_path()} is not built: run `make build`"
)


def ridge():
    """Two planes that meet at right angles in the middle, nearest to the camera: depth, and the true distance in r."""
    x = (np.arange(WIDTH) - (WIDTH - 1) / 2) / FOCAL_PX
    depth = np.tile(1 / (1 - np.abs(x)), (HEIGHT, 1))
    distance = np.hypot(x * depth, depth - 1) * FOCAL_PX / depth
    return depth.astype(np.float32), np.minimum(distance, 16)


# A needle of a pixel's area and 2 ball_r length: its second moment along the normal is 2 ball_r^3 / 3.
@pytest.mark.parametrize("pitch_px", [1.0, 2.0])
def test_the_cells_of_a_plane_are_needles_along_its_normal(pitch_px):
    depth = np.full((HEIGHT, WIDTH), 1.0, np.float32)
    cells = voronoi.cell_covariances(depth, FOCAL_PX, 6.0, pitch_px)
    inside = cells[16:-16, 16:-16]
    assert inside[..., 5].mean() == pytest.approx(2 * 6**3 / 3, rel=0.05)
    sums = voronoi.averaged(cells, depth, FOCAL_PX, 3.0)
    assert voronoi.middle_fraction(sums[16:-16, 16:-16]).max() < 0.03
    assert np.allclose(voronoi.averaged(np.ones((HEIGHT, WIDTH, 6)), depth, FOCAL_PX, 1.01)[5, 5], 5)


def test_unknown_depth_has_no_cell():
    depth = ridge()[0]
    depth[:, :20] = 0
    assert (voronoi.strength(depth, FOCAL_PX, (6.0, 3.0), ())[:, :20] == 0).all()
    assert (voronoi.cell_covariances(np.zeros_like(depth), FOCAL_PX, 6.0) == 0).all()


def test_voronoi_covariance_finds_a_ridge():
    depth, distance = ridge()
    strength = voronoi.strength(depth, FOCAL_PX, (6.0, 3.0), ())
    middle = strength[HEIGHT // 2]
    sharp = np.flatnonzero(middle[8:-8] > 0.15) + 8
    assert (sharp.min(), sharp.max()) == (WIDTH // 2 - 2, WIDTH // 2 + 1)
    assert middle[WIDTH // 2] > 5 * middle[WIDTH // 4]
    counts = np.zeros(depth.shape, bool)
    counts[12:-12, 12:-12] = True  # cells at the border of the frame are wide
    found = tuned(voronoi.VORONOI, [depth], [FOCAL_PX], [distance], [counts]).run(depth, FOCAL_PX)[0]
    error = np.sqrt(np.mean((found - distance)[counts] ** 2))
    assert error < 0.5 * np.sqrt(np.mean((16 - distance)[counts] ** 2))


@needs_library
def test_half_and_double_of_each_parameter_are_tried(tmp_path):
    depth, _ = ridge()
    top = (HEIGHT - 1) / 2 / FOCAL_PX
    curve = {"type": "line", "kind": 1, "sure": True, "points": [[0, -top, 1], [0, top, 1]]}
    view = SimpleNamespace(camera=Pinhole.centred(depth.shape, FOCAL_PX), seen=lambda level: depth,
                           curves={"curves": [curve]})  # fmt: skip
    with Edges(BUNDLE, 1) as model:
        rows = sensitivity.measure([view], model)
    assert [row["parameter"] for row in rows] == list(sensitivity.PARAMETERS)
    assert len(rows) == 10
    by_name = {row["parameter"]: row for row in rows}
    assert by_name["min_length_px"]["values"] == [5, 10, 20]
    assert by_name["max_curves"]["values"] == [512, 1024, 2048]
    for row in rows:
        assert set(row["f_score"]) == set(quality.LEVELS)
        assert row["f_score"]["clean"][1] > 0.8
    assert by_name["max_curves"]["f_score"]["clean"] == [by_name["select_px"]["f_score"]["clean"][1]] * 3
    assert sensitivity.draw(rows, tmp_path).stat().st_size > 0
    parts = section.sensitivity_parts(rows)
    assert parts[1][1][1] == "2, 4, 8"
