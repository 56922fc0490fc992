"""Fused views beside one: what is compared with the truth, what the library gives, and what is said to be missing."""

import subprocess
from pathlib import Path
from types import SimpleNamespace

import maquette
import numpy as np
import pytest
from maquette.fusion import POINT

from benchmarks.edges import fused, fusion_memory, section_of_views
from benchmarks.edges.edges_api import Edges, Pinhole
from benchmarks.edges.fusion_api import Fusion
from benchmarks.edges.measure import BUNDLE
from export.camera import Camera
from export.edges.config import EPS_R
from export.edges.fusion import FieldView
from export.edges.judged_pixels import STEP_PX, judged_pixels

WIDTH, HEIGHT, FOCAL_PX = 64, 48, 60.0
R_M = 1 / FOCAL_PX  # of a wall at 1 m
BUILT = pytest.mark.skipif(
    not maquette.library_path().exists(), reason=f"{maquette.library_path()} is not built: run `make build`"
)
pytestmark = pytest.mark.usefixtures("one_thread")


def camera_at(x_m=0.0, scale=1):
    """scale: pixels along a side, in multiples of the usual picture's."""
    return Camera.centred(scale * WIDTH, scale * HEIGHT, scale * FOCAL_PX, np.eye(3), np.array([x_m, 0, 0]))


def wall(own_error_r=0.0):
    """A wall 1 m away whose edge is its middle column: what is true, depth, and what a network finds."""
    true = np.broadcast_to(np.minimum(np.abs(np.arange(WIDTH) - (WIDTH - 1) / 2), EPS_R), (HEIGHT, WIDTH))
    posed = SimpleNamespace(camera=camera_at(), distance=true, distance_of_all=true, counts=np.ones(true.shape, bool))
    result = SimpleNamespace(distance=true + own_error_r, spread=np.ones(true.shape))
    return posed, np.ones(true.shape, np.float32), result


def points_of(posed, depth, distance_r, r_m=R_M):
    """A fused point for each pixel."""
    view = FieldView(posed.camera, depth.astype(np.float64), distance_r, distance_r)
    points = np.zeros(depth.size, POINT)
    points["point_m"] = view.points.reshape(-1, 3) + posed.camera.centre
    points["r_m"] = r_m
    points["distance_m"] = np.minimum(distance_r.ravel() * R_M, EPS_R * r_m)
    return points


def errors_of(posed, depth, result, points):
    return fused.errors_of(SimpleNamespace(views=[posed]), [depth], [result], points, R_M)


def test_one_view_and_fused_points_are_judged_by_the_same_truth():
    posed, depth, result = wall(0.5)
    (row,) = errors_of(posed, depth, result, points_of(posed, depth, posed.distance + 0.25))
    assert row["known"] == 1
    assert row["one_r"] == pytest.approx(0.5, rel=0.3)  # distances end at 16 r
    assert row["fused_r"] == pytest.approx(row["one_r"] / 2, rel=0.02)
    (exact,) = errors_of(posed, depth, result, points_of(posed, depth, posed.distance))
    assert exact["fused_r"] == pytest.approx(0, abs=1e-6)


def test_all_distances_are_cut_where_those_of_a_point_end():
    posed, depth, result = wall()
    far = SimpleNamespace(distance=np.maximum(result.distance, 12), spread=result.spread)  # wrong from 0 to 12 r
    points = points_of(posed, depth, posed.distance, R_M / 2)  # which say up to 8 r
    (row,) = errors_of(posed, depth, far, points)
    assert row["fused_r"] == pytest.approx(0, abs=1e-6)
    true = posed.distance[::STEP_PX, ::STEP_PX]
    assert row["one_r"] == pytest.approx(np.sqrt(np.mean((8 - np.minimum(true, 8)) ** 2)))


def test_pixels_without_a_point_count_neither_for_one_view_nor_for_fused_ones():
    posed, depth, result = wall()
    result.distance = np.where(np.arange(WIDTH) < WIDTH // 2, result.distance, 3.0)
    points = points_of(posed, depth, posed.distance)
    left = points[points["point_m"][:, 0] < -3 * R_M]
    (row,) = errors_of(posed, depth, result, left)
    assert row["one_r"] == 0
    assert row["known"] == pytest.approx(0.5, abs=0.05)
    assert errors_of(posed, depth, result, points[:0]) == []
    posed.counts[:] = False
    assert errors_of(posed, depth, result, points) == []


def test_judged_pixels_are_every_fourth_whose_depth_is_known():
    posed, depth, result = wall()
    depth[:, : WIDTH // 2] = 0
    posed.counts[0] = False
    pixels = judged_pixels(FieldView(posed.camera, depth, result.distance, result.spread), posed)
    assert len(pixels.own) == WIDTH * HEIGHT // (2 * STEP_PX**2)
    assert pixels.counts.sum() == len(pixels.own) - WIDTH // (2 * STEP_PX)
    np.testing.assert_allclose(pixels.targets.point[:, 2], 1)
    error = np.where(pixels.counts, 2.0, 9.0)
    assert pixels.rmse(error) == pixels.rmse(error, np.ones(len(error), bool)) == 2
    assert pixels.rmse(np.arange(len(error)), np.arange(len(error)) == len(error) - 1) == len(error) - 1


def measured():
    rows = {"clean": [{"one_r": 2.0, "fused_r": 1.0, "known": 1.0}, {"one_r": 4.0, "fused_r": 2.0, "known": 1.0}],
            "tof": [{"one_r": 2.0, "fused_r": 1.8, "known": 1.0}]}  # fmt: skip
    times = [
        {"solid": f"crate {k}", "points": 300_000 + k, "s": s, "cpu_s": 2 * s} for k, s in enumerate((3.0, 1.0, 2.0))
    ]
    memory = {"points": 800_000, "cell_m": 0.001, "memory_mb": 200.0}
    half = {"precision": 0.5, "recall": 0.25, "f_score": 1 / 3}
    curves = [{"level": "tof", "alone": half, "fused": dict.fromkeys(half, 1.0)}]
    found = {"errors": fused.summed(rows), "curves": curves, "memory": memory, "missing": ["val 4: lost"]}
    return found, {"times": times, "missing": []}


def test_gates_are_the_worst_level_the_median_solid_and_a_million_points():
    found, timed = measured()
    assert [row["ratio"] for row in found["errors"]] == pytest.approx([0.5, 0.9])
    figures = fused.figures_from(found)
    assert figures.keys() == set(fused.FIGURES)
    assert list(figures.values()) == pytest.approx([250.0, 0.9])
    assert fused.figures_from(timed) == {fused.TIME_FIGURE: 2}
    assert fused.figures_from({"errors": [], "memory": None}) == fused.figures_from({"times": []}) == {}
    assert fused.figures_from(None) == {}


def test_the_report_tells_what_was_measured_and_nothing_without_it():
    table, of_curves, text, of_times = section_of_views.fusion_parts(*measured())
    assert table[1] == ["exact depth", "3.00", "1.50", "0.50"]
    assert "2.0 s in the median (1.0 to 3.0; of the CPU 4.0, 2.0 to 6.0)" in of_times
    assert "800,000 points" in text
    assert of_curves[1] == ["time of flight", "0.50, 0.25, 0.33", "1.00, 1.00, 1.00"]
    assert "val 4: lost" in text
    assert section_of_views.fusion_parts(None, None) == []
    assert section_of_views.fusion_parts(None, measured()[1]) == [of_times]


def test_what_is_missing_is_said():
    def raises(error):
        def measuring():
            raise error

        return fused.found_by(measuring)

    assert raises(ImportError("no", name="OCP")) == (None, f"OCP is not installed: {fused.INSTALL}")
    failed = subprocess.CalledProcessError(1, "python", stderr="Traceback\nMaquetteError: No bundle.\n")
    assert raises(failed) == (None, "MaquetteError: No bundle.")


def test_curves_in_the_world_are_judged_by_one_footprint():
    true = [np.array([[0, 0, 0], [1, 0, 0]], float), np.array([[0, 1, 0], [0, 1, 3]], float)]
    beside = [true[0] + [0, 0.015, 0]]
    assert fused.world_score(beside, true, 0.01)["precision"] == 1
    assert fused.world_score(beside, true, 0.01)["recall"] == pytest.approx(0.25, abs=0.01)
    assert fused.world_score(beside, true, 0.005)["precision"] == 0
    assert fused.world_score(true, true, 0.01)["f_score"] == 1


def corner_from(camera):
    """The walls z = 1 - |x| of a room, which meet in a vertical edge: depth in metres."""
    x, at = (np.arange(camera.width_px) - camera.cx_px) / camera.fx_px, camera.centre[0]
    depth = np.minimum((1 + at) / (1 - x), (1 - at) / (1 + x))
    return np.repeat(depth[None], camera.height_px, 0).astype(np.float32)


@BUILT
def test_the_library_fuses_posed_views():
    cameras = [camera_at(x) for x in (-0.05, 0.0, 0.05)]
    with Edges(BUNDLE, threads=1) as edges:
        with Fusion(edges, threads=1) as fusion:
            results = [fusion.add_view(corner_from(camera), camera) for camera in cameras]
            added = fusion.seconds
            curves = fusion.finish()
            points, info = fusion.points(), fusion.info
        assert fusion.seconds > added > 0
        assert fusion.cpu_seconds > 0
        alone = edges.run(corner_from(cameras[1]), Pinhole.centred((HEIGHT, WIDTH), FOCAL_PX))
        with pytest.raises(maquette.MaquetteError, match="min_views"):
            Fusion(edges, min_views=0)
    np.testing.assert_array_equal(results[1].distance, alone.distance)
    assert (info.view_count, info.blind_view_count, info.point_count) == (3, 0, len(points))
    assert POINT.itemsize == 48
    np.testing.assert_allclose(np.linalg.norm(points["normal"], axis=1), 1, atol=1e-4)
    x, _, z = points["point_m"].T
    assert np.abs(z - (1 - np.abs(x))).max() < 0.02
    assert points["view_count"].max() == 3
    assert (points["distance_m"] <= EPS_R * points["r_m"] * 1.001).all()
    assert all(curve.shape[1] == 3 for curve in curves.points)


@BUILT
def test_memory_is_that_of_a_process_of_its_own(tmp_path):
    # Large enough to add some 10 MB: the kernel counts pages by thread, and is wrong by tenths of a MB.
    cameras = [camera_at(x, scale=4) for x in (0.0, 0.05)]
    depths = [corner_from(camera) for camera in cameras]
    usual = fusion_memory.in_child(depths, cameras, BUNDLE, 1, tmp_path)
    coarse = fusion_memory.in_child(depths, cameras, BUNDLE, 1, tmp_path, 2 * usual["cell_m"])
    assert coarse["cell_m"] == pytest.approx(2 * usual["cell_m"])
    assert usual["points"] > 2 * coarse["points"] > 1000
    assert 1 < coarse["memory_mb"] < usual["memory_mb"] < 100
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(subprocess.CalledProcessError) as failed:
        fusion_memory.in_child(depths, cameras, Path("nowhere"), 1, tmp_path)
    assert "nowhere" in failed.value.stderr
