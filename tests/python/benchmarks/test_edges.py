"""The benchmark of edges: what it measures on views whose edges are known, and what it says to be missing."""

import json
import tomllib

import maquette
import numpy as np
import pytest

from benchmarks import __main__ as benchmark
from benchmarks import gates
from benchmarks.edges import curve_scores, curves, planes, quality, rivals, section, speed, true_fields
from benchmarks.edges import measure as edges
from benchmarks.edges.edges_api import LINE, SPLINE, Curves, Edges, Pinhole, depth_frames
from benchmarks.edges.methods import FLOAT, NOTHING, SHIPPED
from benchmarks.edges.views import View, bending_radius_r, bins, incidence_deg, polyline, read_views
from export.edges.data import Frame
from export.solids.records import packed, write_shard

WIDTH, HEIGHT, FOCAL_PX = 96, 72, 90.0
CAMERA = Pinhole.centred((HEIGHT, WIDTH), FOCAL_PX)
pytestmark = pytest.mark.usefixtures("one_thread")


def rays(width=WIDTH, height=HEIGHT, focal_px=FOCAL_PX):
    x, y = np.meshgrid(np.arange(width) - (width - 1) / 2, np.arange(height) - (height - 1) / 2)
    return np.stack([x / focal_px, y / focal_px, np.ones_like(x)], -1)


def ridge(width=WIDTH, height=HEIGHT, focal_px=FOCAL_PX, near_m=1.0):
    """Two planes that meet at right angles in a vertical crease in the middle, nearest to the camera: depth, true
    distance in r, and its curve."""
    x = rays(width, height, focal_px)[..., 0]
    depth = near_m / (1 - np.abs(x))  # z = near + |X|
    point = x * depth
    distance = np.hypot(point, depth - near_m) * focal_px / depth
    top = (height - 1) / 2 / focal_px * near_m
    curve = {"type": "line", "kind": 1, "sure": True, "angle_deg": 90.0, "rounding_m": 0.0,
             "points": [[0, -top, near_m], [0, top, near_m]]}  # fmt: skip
    return depth.astype(np.float32), np.minimum(distance, 16), curve


def record_of(number, width=WIDTH, height=HEIGHT, focal_px=FOCAL_PX):
    depth, distance, curve = ridge(width, height, focal_px, 0.6 + 0.1 * number)
    planes = {"depth": depth, "distance": distance, "kind": (distance < 16).astype(np.uint8),
              "ignore": np.zeros(depth.shape, bool), "patch": np.zeros(depth.shape, np.uint16)}  # fmt: skip
    intrinsics = focal_px, focal_px, (width - 1) / 2, (height - 1) / 2
    curves = json.dumps({"curves": [curve], "corners": []})
    return packed(f"test/{number:06d}/0/{width}x{height}/ridge/alone", planes, intrinsics, curves)


@pytest.fixture(scope="module")
def solids(tmp_path_factory):
    folder = tmp_path_factory.mktemp("solids")
    for split in ("val", "test"):
        (folder / split).mkdir()
        records = [record_of(k, *size) for k in range(2) for size in ((WIDTH, HEIGHT), (2 * WIDTH, 2 * HEIGHT, 180.0))]
        write_shard(folder / split / "solids-00000.npz", records, {})
    return folder


class Known:
    """A way that knows the truth of one view after the other, but for a mean error."""

    def __init__(self, error_r=0.0):
        self.error_r = error_r

    def run(self, depth, camera):
        near = 0.6 if abs(depth[depth > 0].min() - 0.6) < 0.05 else 0.7
        _, distance, _ = ridge(depth.shape[1], depth.shape[0], camera.focal_px, near)
        return (distance + self.error_r).astype(np.float32), 1.0


def test_views_are_those_of_a_width_with_their_curves(solids):
    views = read_views(solids / "test", WIDTH, None)
    assert [view.frame.depth.shape for view in views] == [(HEIGHT, WIDTH)] * 2
    assert views[0].curves["curves"][0]["angle_deg"] == 90
    assert len(read_views(solids / "test", None, 3)) == 3


def test_pixels_are_grouped_by_the_angle_of_the_edge_that_they_are_near(solids):
    view = read_views(solids / "test", WIDTH, None)[0]
    groups = view.groups["angle between the surfaces"]
    near = view.frame.distance < 4
    assert (groups["85 to 95 deg"] == near).mean() > 0.99
    assert groups["85 to 95 deg"].sum() == sum(mask.sum() for mask in groups.values())
    assert view.groups["kind"]["creases"].all()
    assert (view.groups["kind"]["boundaries"] == ~near).all()


def test_the_angle_of_incidence_is_that_of_the_planes():
    depth, _, _ = ridge()
    angle = incidence_deg(depth, CAMERA)
    # Their normals are at 45 degrees to the axis, so that the ray in the middle meets both at 45.
    middle = angle[HEIGHT // 2, [WIDTH // 2 - 2, WIDTH // 2 + 1]]
    assert middle == pytest.approx(45, abs=1.5)
    ray = rays()[..., 0]
    expected = np.degrees(np.arccos(np.clip((1 - np.abs(ray)) / np.sqrt(2) / np.linalg.norm(rays(), axis=-1), -1, 1)))
    assert np.abs(angle - expected)[:, 4 : WIDTH // 2 - 2].max() < 0.5


def test_a_sphere_has_its_radius_and_a_plane_none():
    ray, centre, radius = rays(), np.array([0, 0, 2.0]), 0.6
    a, b, c = (ray**2).sum(-1), -2 * ray @ centre, centre @ centre - radius**2
    root = b**2 - 4 * a * c
    depth = np.where(root > 0, (-b - np.sqrt(np.maximum(root, 0))) / (2 * a), 0).astype(np.float64)
    found = bending_radius_r(depth, FOCAL_PX)
    middle = found[HEIGHT // 2 - 4 : HEIGHT // 2 + 4, WIDTH // 2 - 4 : WIDTH // 2 + 4]
    assert np.median(middle) == pytest.approx(radius * FOCAL_PX / depth[HEIGHT // 2, WIDTH // 2], rel=0.05)
    flat = bending_radius_r(ridge()[0].astype(np.float64), FOCAL_PX)[:, 5 : WIDTH // 2 - 5]
    assert np.isinf(flat[5:-5]).all()


def test_ranges_share_no_value_and_leave_out_what_is_no_number():
    found = bins(np.array([0.5, 1, 3, np.nan]), (1, 2), "m")
    assert {name: mask.tolist() for name, mask in found.items()} == {
        "under 1 m": [True, False, False, False],
        "1 to 2 m": [False, True, False, False],
        "over 2 m": [False, False, True, False],
    }


def test_an_arc_becomes_a_polyline_through_its_middle():
    arc = {"type": "arc", "centre": [0, 0, 1], "axis": [0, 0, 1]}
    for angles in ((0.0, 1.0, 2.0), (0.0, -1.0, -2.0), (0.0, np.pi, 2 * np.pi), (1.0, 3.0, 5.0)):
        points = [[np.cos(a), np.sin(a), 1] for a in angles]
        line = polyline(arc | {"points": points})
        length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
        assert length == pytest.approx(abs(angles[2] - angles[0]), rel=1e-3)
        assert np.linalg.norm(line - points[1], axis=1).min() < 0.06


def jump():
    """A plane that faces the camera before another one: depth, and the true distance on the nearer one."""
    depth = np.where(np.arange(WIDTH) < WIDTH // 2, 1.0, 1.4) * np.ones((HEIGHT, 1))
    distance = np.where(depth < 1.2, np.abs(np.arange(WIDTH) - WIDTH / 2 + 0.5), 16.0)
    return depth.astype(np.float32), np.minimum(distance, 16)


# Canny sees jumps alone: at a crease depth has a corner, but no step.
@pytest.mark.parametrize(("name", "scene"), [("depth-Canny", jump), ("angles between normals", ridge),
                                             ("surface variation", ridge)])  # fmt: skip
def test_a_rival_finds_an_edge_and_its_distances(name, scene):
    rival = rivals.RIVALS[name]
    if rival.missing():
        pytest.skip(rival.missing())
    depth, distance = scene()[:2]
    counts = (depth < 1.2) if scene is jump else np.ones(depth.shape, bool)
    found = rivals.tuned(rival, [depth], [FOCAL_PX], [distance], [counts])
    field, ms = found.run(depth, FOCAL_PX)
    assert ms > 0
    none = np.full(depth.shape, 16.0)
    assert _rmse(field[counts], distance[counts]) < 0.5 * _rmse(none[counts], distance[counts])


def _rmse(field, distance):
    return np.sqrt(np.mean((field - distance) ** 2))


def test_a_frame_without_strength_has_no_edges():
    flat = np.ones((HEIGHT, WIDTH), np.float32)
    assert (rivals.field(np.zeros((4, 4), bool)) == 16).all()
    assert rivals.canny(flat, FOCAL_PX, 1.0, (0.5, 1)).max() == 0
    assert rivals.surface_variation(np.zeros_like(flat), FOCAL_PX, (2,), ()).max() == 0


def test_a_reduced_frame_is_brought_back_to_the_size_and_the_footprints_of_the_whole():
    depth, distance, _ = ridge(2 * WIDTH, 2 * HEIGHT, 180.0, 0.6)
    camera = Pinhole.centred(depth.shape, 180.0)

    class Half:
        def run(self, small, of_small):
            assert small.shape == (HEIGHT, WIDTH)
            assert of_small.focal_px == 90
            return distance[::2, ::2].astype(np.float32) / 2, 1.0

    field, ms = speed.reduced(Half(), depth, camera, WIDTH)
    assert ms > 1
    inside = np.abs(field - distance)[2:-2, 2:-2]
    assert inside.max() < 1.2  # at the crease, between samples
    assert np.median(inside) < 0.05


@pytest.fixture(scope="module")
def errors(solids):
    val, test = (read_views(solids / split, WIDTH, None) for split in ("val", "test"))
    return quality.measure(val, test, {SHIPPED: Known(0.5), FLOAT: Known(0.0)}, ["plain-1"])


def test_errors_are_those_of_the_fields(errors):
    rows = {(row["level"], row["way"]): row for row in errors.rows}
    assert rows["clean", SHIPPED]["rmse_near_r"] == pytest.approx(0.5, abs=0.05)
    assert rows["clean", SHIPPED]["rmse_r"] < 0.5  # distances end at 16 r
    assert rows["clean", FLOAT]["rmse_r"] == pytest.approx(0, abs=0.02)
    assert set(rows) >= {("stereo", name) for name in (*rivals.RIVALS, NOTHING)}
    assert ("plain-1", FLOAT) not in rows
    assert errors.agreement[0]["same_side"] < 1
    crease = next(row for row in errors.groups if (row["level"], row["group"]) == ("clean", "creases"))
    assert crease["rmse_near_r"] == pytest.approx(0.5, abs=0.05)


def test_gates_are_filled_from_the_rows(errors):
    figures = quality.figures_from(errors.rows, errors.agreement)
    ours = next(r["rmse_r"] for r in errors.rows if (r["level"], r["way"]) == ("clean", SHIPPED))
    assert figures["edges_rmse_clean"] == ours
    assert figures["edges_recall_r_clean"] == 100  # the threshold, too, is chosen on fields that are 0.5 r off
    rivals_of_clean = [r["rmse_r"] for r in errors.rows if r["level"] == "clean" and r["way"] in rivals.RIVALS]
    assert figures["edges_rmse_by_rival"] >= ours / min(rivals_of_clean)
    assert figures["edges_int8_same_side"] < 100


def test_another_set_is_cut_where_own_solids_say(errors, solids):
    rows = quality.of_set(read_views(solids / "test", WIDTH, None), Known(1.0), edges.cuts_of(errors.cuts))
    assert [row["level"] for row in rows] == list(quality.LEVELS)
    assert rows[0]["rmse_near_r"] == pytest.approx(1, abs=0.05)
    assert edges.set_ratio(rows, errors.rows) > 1.5


def test_each_gate_of_edges_has_a_figure_and_the_other_way_round():
    names = {g["figure"] for g in tomllib.loads(gates.TARGETS.read_text())["gate"] if g["figure"].startswith("edges_")}
    assert names == set(edges.FIGURES)
    assert len(edges.FIGURES) == len(names)
    assert tuple(edges.FIGURES_OF) == edges.PARTS


def test_a_part_of_its_own_leaves_the_other_of_the_last_run(monkeypatch, tmp_path):
    def found(name, value):
        return lambda *_: edges.Found(
            {name: value, "views": {"test": 1}}, {f"edges_{name}": value}, {"edges_why": "no"}
        )

    given = edges.Sources(tmp_path, edges.BUNDLE, tmp_path / "none.pt", {}, {}, {}, None)
    monkeypatch.setattr(edges, "measure_fields", found("errors", 1.0))
    monkeypatch.setattr(edges, "measure_times", found("speed", 2.0))
    document, figures, missing = edges.measure(given, tmp_path, 1, True, ["fields"])
    assert (document["errors"], figures, missing) == (1, {"edges_errors": 1}, {"edges_why": "no"})
    assert "speed" not in document
    assert any("200 are wanted" in text for text in document["warnings"])
    monkeypatch.setattr(edges, "measure_times", found("speed", 3.0))
    both, figures, _ = edges.measure(given, tmp_path, 1, True, ["times"], document)
    assert (both["errors"], both["speed"], figures) == (1, 3, {"edges_speed": 3})
    assert set(both["warnings"]) >= set(document["warnings_of"]["fields"])


def test_the_report_tells_of_the_part_that_was_measured():
    empty = {"warnings": [], "speed": [], "savings": [], "curves_of_scenes": [], "fusion_times": None}
    _, of_times = section.section(empty | {"speed": [speed_row("a", 2.0), speed_row("b", 1.0)]})
    table = next(part for part in of_times if isinstance(part, list) and part[0][0].startswith("frames of 640"))
    assert [row[0] for row in table[1:]] == ["b", "a"]
    assert section.section({"warnings": ["busy"]})[1] == ["Warnings of the measurement: busy."]


def speed_row(name, ms):
    by_level = dict.fromkeys(quality.LEVELS, 1.0)
    return {"setting": name, "ms": ms, "ms_p90": ms, "by_level": by_level, "rmse_r": 1.0}


@pytest.mark.skipif(not true_fields.PROGRAM.exists(), reason=f"{true_fields.PROGRAM} is not built")
def test_the_true_field_gives_the_true_curve(solids, tmp_path):
    views = read_views(solids / "test", 2 * WIDTH, None)
    found, _ = true_fields.found_in(views, tmp_path)
    assert [(row["level"], row["views"]) for row in found] == [(level, 2) for level in quality.LEVELS]
    assert true_fields.figures_from(found)["edges_curves_true"] > 0.95
    # A sensor's error along the ray stays where the field is true.
    assert found[-1]["chamfer_r"] > 2 * found[0]["chamfer_r"]
    assert list(tmp_path.iterdir()) == []


def test_without_its_program_or_curves_the_true_field_says_why(solids, tmp_path, monkeypatch):
    views = read_views(solids / "test", WIDTH, 1)
    monkeypatch.setattr(true_fields, "PROGRAM", tmp_path / "nowhere")
    found, why = true_fields.found_in(views, tmp_path)
    assert found == []
    assert "nowhere is not there" in why
    assert true_fields.figures_from([]) == {}


def test_options_name_further_networks_and_sets():
    parser = benchmark.argparse.ArgumentParser()
    edges.add_arguments(parser)
    options = parser.parse_args(["--other-edge-weights", "m=a/m.pt", "--edge-sets", "kicad=parts", "desk=desk"])
    assert dict(options.edge_sets) == {"kicad": edges.Path("parts"), "desk": edges.Path("desk")}
    assert dict(options.other_edge_weights) == {"m": edges.Path("a/m.pt")}
    with pytest.raises(SystemExit):
        parser.parse_args(["--edge-sets", "kicad"])


def test_a_view_without_curves_has_no_groups_by_angle():
    depth, distance, _ = ridge()
    frame = Frame(depth, distance.astype(np.float32), np.ones(depth.shape, int), np.ones(depth.shape, bool), FOCAL_PX)
    assert "angle between the surfaces" not in View("a", frame, CAMERA, None).groups
    assert section.SAYS.keys() == set(quality.LEVELS)


def found_curves(*lines, types=None):
    points = [np.array(line, np.float64) for line in lines]
    return Curves(types or [LINE] * len(points), [1] * len(points), points, [], 1.0, 0.1)


def test_curves_that_are_not_surely_sharp_need_not_be_found_and_are_not_wrong(solids):
    view = read_views(solids / "test", WIDTH, None)[0]
    (curve,) = view.curves["curves"]
    bottom, top = np.array(curve["points"])
    unsure = curve | {"sure": False, "points": [[0.1, 0, 0.6], [0.2, 0, 0.6]]}
    both = View(view.name, view.frame, view.camera, {"curves": [curve, unsure]})
    alone = curve_scores.view_score(found_curves([bottom, top]), both)
    assert (alone["precision"], alone["recall"], alone["f_score"]) == (1, 1, 1)
    assert alone["angle_deg"] == pytest.approx(0, abs=1e-4)
    more = curve_scores.view_score(found_curves([bottom, top], unsure["points"]), both)
    assert more["precision"] == 1
    half = curve_scores.view_score(found_curves([bottom, (bottom + top) / 2]), both)
    assert half["recall"] == pytest.approx(0.5, abs=0.05)


def test_the_angle_of_a_line_is_that_to_the_true_line_which_it_lies_along():
    true = [np.array([[0, -0.5, 1], [0, 0.5, 1]]), np.array([[0.3, -0.5, 1], [0.3, 0.5, 1]])]
    lean = np.tan(np.radians(2)) * 0.4
    found = found_curves([[0.3 - lean, -0.4, 1], [0.3 + lean, 0.4, 1]], [[0, 0, 1], [0.1, 0, 1]], types=[LINE, SPLINE])
    assert curve_scores.line_angle_deg(found, true, 300.0) == pytest.approx(2, abs=0.01)
    assert np.isnan(curve_scores.line_angle_deg(found_curves(), true, 300.0))


def test_gates_of_curves_say_why_they_are_missing():
    box = {
        "noise": "tof",
        "way": SHIPPED,
        "frames": 4,
        "median_mm": 3.0,
        "deviation_mm": None,
        "steady_frames": 1,
        "turned_frames": 9,
    }
    boxes = [box, box | {"noise": "stereo", "median_mm": None}, box | {"way": curves.PLANES, "median_mm": 9.0}]
    solid = [{"level": level, "way": SHIPPED, "f_score": 0.8} for level in ("clean", "tof")]
    scenes = [{"scene": "box", "noise": noise, "ms": ms} for noise, ms in (("tof", 10.0), ("none", 5.0))]
    figures, missing = curves.figures_from(solid, boxes)
    assert figures == {"edges_curves_clean": 0.8, "edges_curves_tof": 0.8, "edges_box_mm_tof": 3}
    assert curves.scene_figures_from(scenes) == {"edges_fps_box": 100}
    assert missing["edges_box_mm_stereo"] == "no box was found in 4 frames"
    assert missing["edges_box_deviation_mm"] == "a box was found in 1 of 9 frames"
    assert missing["edges_curves_stereo"] == "the test views have no curves stored"


@pytest.mark.skipif(
    not maquette.library_path().exists(), reason=f"{maquette.library_path()} is not built: run `make build`"
)
def test_the_library_gives_planes_curves_and_times_of_a_simulated_camera():
    frames = list(depth_frames("stub:solids?scene=box&size=160x120", 2))
    depth, camera = frames[0]
    assert depth.shape == (120, 160)
    assert camera.focal_px == pytest.approx(150)
    with Edges(edges.BUNDLE, threads=1) as model:
        result = model.run(depth, camera, curves=True)
        again = model.run(depth, camera)
    assert np.array_equal(result.distance, again.distance)
    assert result.distance.max() <= 16
    assert set(np.unique(result.kind)) <= {0, 1, 2}
    assert result.stats.total_ms > 0
    assert again.curves is None
    assert all(points.shape == (len(points), 3) for points in result.curves.points)
    assert len(result.curves.points) == len(result.curves.types) > 0
    with pytest.raises(maquette.MaquetteError, match=r"nowhere.*MAQ_ERROR_NOT_FOUND"):
        Edges(edges.Path("nowhere"))
    with pytest.raises(maquette.MaquetteError, match="intrinsics"):
        next(depth_frames("stub:people", 1))


def box_in_front(size_m=(0.4, 0.5, 0.3)):
    """A box seen onto one of its corners, on nothing: exact depth, and the camera."""
    width, height, focal_px = 160, 120, 150.0
    ray = rays(width, height, focal_px)
    turn = np.array([[0.8, 0.0, 0.6], [0.36, 0.8, -0.48], [-0.48, 0.6, 0.64]])  # rows: the axes of the box
    half, origin = np.array(size_m) / 2, -turn @ np.array([0, 0, 1.1])
    way = ray @ turn.T
    near, far = (-np.sign(way) * half - origin) / way, (np.sign(way) * half - origin) / way
    depth = np.where(near.max(-1) < far.min(-1), near.max(-1), 0)
    return depth.astype(np.float32), Pinhole.centred((height, width), focal_px)


def test_planes_measure_a_box_and_its_creases():
    if planes.missing():
        pytest.skip(planes.missing())
    depth, camera = box_in_front()
    found = planes.Planes(1.0).find(depth, camera)
    assert len(found.points) == 3
    assert np.array(found.boxes_m[0]) == pytest.approx([0.5, 0.4, 0.3], abs=0.03)
    ends = np.concatenate(found.points)
    corner = np.array([0, 0, 1.1])
    assert np.linalg.norm(ends - corner, axis=1).min() < np.linalg.norm([0.4, 0.5, 0.3])
    assert planes.Planes(1.0).find(np.zeros_like(depth), camera).points == []
