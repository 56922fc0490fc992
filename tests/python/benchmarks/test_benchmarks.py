"""Gates say what they should, counts of work are right, and a report holds its tables and pictures."""

import json
from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from benchmarks import __main__ as benchmark
from benchmarks import cameras, compare, gates, graphs, prediction, report, roofline, start, sweep, window
from benchmarks.edges import measure as edges
from benchmarks.scenes import measure as scenes

MACHINE = {"architecture": "x86_64", "cores": 2, "instruction_sets": ["avx2", "fma"], "processor": "P",
           "memory_mib": 2048, "system": "S"}  # fmt: skip
GATES = """
[machine.two]
says = "two cores"
architecture = "x86_64"
cores = 2
instruction_sets = ["avx2"]

[[gate]]
figure = "fps"
says = "speed"
min = 30
stretch = 60
machine = "two"

[[gate]]
figure = "mb"
says = "size"
max = 3.6
stretch = 3.0
"""


def states(tmp_path, figures, machine=MACHINE, missing=None):
    path = tmp_path / "targets.toml"
    path.write_text(GATES)
    return {v.figure: v for v in gates.check(figures, machine, missing or {}, path)}


@pytest.mark.parametrize(
    ("fps", "mb", "expected"),
    [(61, 2.9, ("stretch", "stretch")), (30, 3.6, ("met", "met")), (29.9, 3.7, ("missed", "missed"))],
)
def test_figures_meet_or_miss_their_gates_from_both_sides(tmp_path, fps, mb, expected):
    found = states(tmp_path, {"fps": fps, "mb": mb})
    assert (found["fps"].state, found["mb"].state) == expected


@pytest.mark.parametrize(
    "other", [{"cores": 8}, {"architecture": "aarch64"}, {"instruction_sets": ["sse4_1"]}], ids=str
)
def test_speeds_of_another_machine_are_not_measured_rather_than_passed(tmp_path, other):
    found = states(tmp_path, {"fps": 1000, "mb": 1}, MACHINE | other)
    assert found["fps"].state == "not measured"
    assert "two cores" in found["fps"].why
    assert found["mb"].state == "stretch"


def test_a_figure_that_is_missing_needs_a_reason(tmp_path):
    assert states(tmp_path, {"fps": 40}, missing={"mb": "no bundle"})["mb"].state == "not measured"
    with pytest.raises(ValueError, match="no figure is called mb"):
        states(tmp_path, {"fps": 40})


def test_gates_of_one_part_can_be_checked_alone(tmp_path):
    path = tmp_path / "targets.toml"
    path.write_text(GATES)
    (found,) = gates.check({"mb": 1}, MACHINE, {}, path, only=["mb"])
    assert (found.figure, found.state) == ("mb", "stretch")


def test_a_part_that_is_measured_again_leaves_nothing_of_before():
    figures, missing = {"a": 1, "b": 2, "other": 3}, {"c": "no machine", "other_missing": "x"}
    benchmark.replace(figures, missing, ("a", "b", "c"), {"c": 4}, {"a": "gone", "b": "gone"})
    assert figures == {"other": 3, "c": 4}
    assert missing == {"other_missing": "x", "a": "gone", "b": "gone"}


def test_the_shipped_targets_can_be_read():
    names = {"fps_one_person", "fps_four_people", "fps_empty", "bundle_mb", "peak_memory_mb", "first_result_ms",
             "int8_gps_loss_points", "int8_label_agreement", "time_by_openvino_int8", "time_by_pytorch_fp32",
             "roofline_fraction", *start.FIGURES, *window.FIGURES, *cameras.FIGURES, *scenes.FIGURES,
             *edges.FIGURES, *prediction.FIGURES}  # fmt: skip
    assert {v.figure for v in gates.check(dict.fromkeys(names, 1.0), MACHINE, {})} == names


def test_the_front_holds_what_no_other_beats():
    points = [(10, 0.5), (5, 0.7), (20, 0.4), (12, 0.6), (20, 0.45), (5, 0.8)]
    assert sweep.pareto(points) == [1, 0, 2]


def test_a_moving_picture_ends_where_it_is_labelled():
    image = np.random.default_rng(0).integers(0, 255, (40, 200, 3), np.uint8)
    frames = list(sweep.moving(image, 3))
    assert len(frames) == 3
    assert np.array_equal(frames[-1], image)
    step = int(sweep.MOTION * 200)
    assert np.array_equal(frames[0][:, : -2 * step], image[:, 2 * step :])


def convolution(weight_shape, size, **attributes):
    weight = numpy_helper.from_array(np.ones(weight_shape, np.float32), "w")
    value = helper.make_tensor_value_info
    channels = weight_shape[1] * attributes.get("group", 1)
    node = helper.make_node("Conv", ["x", "w"], ["y"], "conv", **attributes)
    inputs, outputs = [value("x", TensorProto.FLOAT, [1, channels, "h", "w"])], [value("y", TensorProto.FLOAT, None)]
    graph = helper.make_graph([node], "g", inputs, outputs, [weight])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    return model, {"x": np.ones((1, channels, size, size), np.float32)}


@pytest.mark.parametrize(
    ("weight", "attributes", "expected"),
    [((8, 4, 3, 3), {"pads": [1] * 4}, 10 * 10 * 8 * 4 * 9), ((6, 1, 3, 3), {"group": 6}, 8 * 8 * 6 * 9)],
)
def test_multiply_adds_are_counted_at_the_sizes_of_the_input(tmp_path, weight, attributes, expected):
    model, feed = convolution(weight, 10, **attributes)
    onnx.save(model, tmp_path / "g.onnx")
    (work,) = graphs.work_of(tmp_path / "g.onnx", feed)
    assert (work.node, work.macs, work.integer) == ("conv", expected, False)


@pytest.mark.parametrize("graph", ["box_head", "dense_head"])
def test_the_work_of_the_shipped_heads_is_linear_in_people(graph):
    path = Path("sdk/models/densepose-b-int8") / f"{graph}.onnx"
    (value,) = onnx.load(path).graph.input
    sizes = [dimension.dim_value for dimension in value.type.tensor_type.shape.dim][1:]

    def multiply_adds(people):
        return sum(work.macs for work in graphs.work_of(path, {value.name: np.zeros((people, *sizes), np.float32)}))

    assert multiply_adds(30) == 30 * multiply_adds(1) > 0


def test_the_roofline_is_the_slower_of_work_and_bytes():
    work = [graphs.Work("a", 1000, 10, True), graphs.Work("b", 1000, 10, False), graphs.Work("c", 1, 1000, True)]
    assert roofline.min_seconds(work, 100, 1000, 100) == pytest.approx(1 + 10 + 10)


def test_runs_that_differ_are_told_apart(tmp_path, capsys):
    figures = {"time_by_openvino_int8": 0.9, "time_by_pytorch_fp32": 0.2, "roofline_fraction": 0.3}
    for name, scale in (("a", 1.0), ("b", 1.04), ("c", 1.06)):
        values = {key: value * scale for key, value in figures.items()}
        (tmp_path / f"{name}.json").write_text(json.dumps({"figures": values}))
    assert compare.main([str(tmp_path / "a.json"), str(tmp_path / "b.json")]) == 0
    assert compare.main([str(tmp_path / "a.json"), str(tmp_path / "c.json")]) == 1
    assert "roofline_fraction" in capsys.readouterr().out


def case(source, people, ms):
    times = {stage: {"p50": ms / 8, "p90": ms / 7, "p99": ms / 6} for stage in report.STAGES}
    times["frame"] = {"p50": ms, "p90": ms + 1, "p99": ms + 2}
    return {"source": source, "people": people, "ms": times, "fps": 1000 / ms, "cpu_ms": 2 * ms, "warnings": [],
            "size_px": [640, 480]}  # fmt: skip


def camera_host():
    run = {"age_ms": {"median": 0.1, "p99": 0.4}, "dropped_frames": 0, "cpu_utilization": 0.01}
    return {"stub": [run, run | {"age_ms": {"median": 0.3, "p99": 0.9}}, run], "recording": [run],
            "closing": [40.0, 44.0, 41.0], "outages": [{"noticed_ms": 4.0, "replug_ms": 90.0, "reopen_ms": 90.0}],
            "allocations": {"frames": 1000, "allocations": 5}, "others_fraction": 0.0}  # fmt: skip


def document():
    frames = {name: {"cases": [case("s0", 0, 8.0), case("s1", 1, 10.0)], "warnings": ["others were busy"]}
              for name in ("people", "sizes", "one_thread", "no_spin")}  # fmt: skip
    rows = [{"setting": name, "axis": axis, "ms": ms, "error": error, "error_cm": 10 * error, "box_ap": 0.5,
             "part_accuracy": 0.6}
            for name, axis, ms, error in (("as shipped", "shipped", 10.0, 0.6), ("192 px", "input size", 7.0, 0.65),
                                          ("fp32 <slow>", "precision", 20.0, 0.61))]  # fmt: skip
    runtimes = [{"name": "Maquette", "version": "1", "precision": "int8", "ms": {"trunk": 4.0}, "total_ms": 4.0,
                 "ours_int8_ratio": 1.0, "missing": ""},
                {"name": "Other", "version": "", "precision": "fp32", "ms": {}, "total_ms": None,
                 "ours_int8_ratio": None, "missing": "does not load it"}]  # fmt: skip
    line = {"float32_macs_s": 1e11, "int8_macs_s": 4e11, "bytes_s": 1e11, "fraction": 0.4,
            "graphs": {"trunk": {"macs": 10**8, "int8_macs": 10**7, "min_ms": 1.6, "fraction": 0.4}}}  # fmt: skip
    gate = {
        "says": "speed",
        "value": 40.0,
        "gate": "≥ 30",
        "stretch": "≥ 60",
        "state": "missed",
        "why": "",
        "tried": "All of it.",
    }
    measured = {"host": camera_host(), "guest": {}, "guest_missing": "not run: no <qemu>", "frames": 100,
                "warnings": []}  # fmt: skip
    unseen = {"rows": [], "places": [], "speed": {}, "speed_missing": "no <networks>", "warnings": ["0 real places"],
              "sheet": ""}  # fmt: skip
    sizes = [{"setting": "288 px", "axis": "no crops", "ms": 5.0, "rendered": None, "views": None,
              "photographs": dict.fromkeys(("recall", "mask", "part", "side"), 0.5)}]  # fmt: skip
    processes = {kind: {"libraries": ["libc.so.6"], "cpu_ms": [2.0]} for kind in start.NAMES}
    file = {"name": "libmaquette.so", "bytes": 10**6, "needed": ["libc.so.6"]}
    live = dict.fromkeys(("opening_ms", "running_ms", "result_ms", "lost_ms", "back_ms", "longest_call_ms"), 1.0)
    view = {"open_ms": 1.0, "first_view_ms": 2.0, "longest_call_ms": 0.5}
    waits = {"first": [live], "next": [live], "scene": [view], "capture": [view], "demo": {},
             "demo_missing": "there is no <Xvfb>", "warnings": []}  # fmt: skip
    return {"machine": MACHINE, "cameras": measured, "scenes": unseen, "edges": edges_document(),
            "prediction": prediction_document(), "window": waits,
            "start": {"processes": processes, "files": {"library": file}, "warnings": []},
            "frames": frames, "sweep": rows, "person_sizes": sizes, "threads": 2,
            "frame_budget": {"missing": "no control group can be made: <mkdir>"},
            "quick": True, "gates": [gate],
            "peers": {"runtimes": runtimes, "roofline": line},
            "agreement": {"labels": 0.98, "parts": 0.99, "mask_iou": 0.97, "same_count": 0.9, "images": 5}}  # fmt: skip


def prediction_document():
    ahead = [{"frames": n, "last_db": 20.0, "motion_db": 25.0, "dis_db": 24.0, "auto_db": 25.0, "network_db": 26.0,
              "motion_chosen": 1.0} for n in prediction.HORIZONS]  # fmt: skip
    row = {"film": "pushing 00000, 10 fps", "size_px": [320, 240], "threads": 2, "dis_ms": 9.0, "starts": 3,
           "push_ms": 3.0, "auto_push_ms": 4.0, "predict_ms": 2.0, "cpu_ms": 5.0, "horizons": ahead}  # fmt: skip
    waits = {"captured": 20, "predicted": 5, "wait_ms": {"median": 0.1, "p99": 0.5, "max": 0.6}}
    surprise = {"frames_a_second": 200.0, "cpu_ms": 4.0, "resize_ms": 0.3, "network_ms": 2.0, "nearest_ms": 0.9}
    return {"rows": [row], "sets": prediction.means_of([row]), "speed": [row | {"film": "street"}], "waits": waits,
            "surprise": surprise, "missing": ["real clips (<none>)"], "warnings": []}  # fmt: skip


def edges_document():
    figures = dict.fromkeys(("rmse_r", "rmse_near_r", "q95_r", "recall_1r", "fpr_1r", "recall_4r", "fpr_4r"), 0.5)
    levels = dict.fromkeys(("clean", "tof", "stereo"), 1.0)
    ways = ("int8, as shipped", "fp32, the same weights")
    errors = [figures | {"level": level, "way": way, "ms": 2.0} for level in levels for way in ways]
    groups = [figures | {"level": "clean", "axis": "kind", "group": name, "pixels": 5000, "recall_1r": None}
              for name in ("creases", "boundaries")]  # fmt: skip
    speed = [{"setting": "a field, 640 x 480", "axis": "shipped", "width_px": 640, "ms": 10.0, "ms_p90": 11.0,
              "rmse_r": 1.0, "by_level": levels}]  # fmt: skip
    saving = {"scene": "wall", "noise": "tof", "option": "skip planes", "ms_without": 2.0, "ms": 0.5,
              "difference_r": 0.01, "other_side": 0.0, "network_fraction": 0.0}  # fmt: skip
    curve = dict.fromkeys(("precision", "recall", "f_score", "chamfer_r", "hausdorff_r"), 0.5) | {"angle_deg": None}
    times = dict.fromkeys(("field_ms", "curves_ms", "boxes_ms", "ms"), 2.0)
    box = {"noise": "stereo", "way": ways[0], "frames": 10, "with_box": 0.0, "median_mm": None, "p90_mm": None,
           "steady_frames": 0, "turned_frames": 10, "deviation_mm": None}  # fmt: skip
    fusion = {"errors": [{"level": "tof", "views": 12, "one_r": 2.0, "fused_r": 1.5, "known": 1.0, "ratio": 0.75}],
              "curves": [{"level": "tof", **dict.fromkeys(("alone", "fused"), curve)}], "memory": None,
              "missing": []}  # fmt: skip
    timed = {"times": [{"solid": "crate 0", "points": 300_000, "s": 1.0, "cpu_s": 2.0}], "missing": []}
    scans = {"pixels": 10, "under_1r": 0.0, "under_4r": 0.1}
    found = {
        "fusion": fusion,
        "fusion_times": timed,
        "carton": None,
        "round": scans | {"scans": [{"name": "toy", **scans}]},
    }
    return {**found, "views": {"val": 2, "test": 3, "solids": 3}, "errors": errors, "groups": groups, "speed": speed,
            "agreement": [{"level": "clean", "same_side": 0.99}], "savings": [saving], "sheet": "", "warnings": ["few"],
            "curves": [curve | {"level": "clean", "way": ways[0], "views": 3, "ms": 2.0}], "boxes": [box],
            "curves_of_true_fields": [curve | {"level": "tof", "views": 3}],
            "curves_of_scenes": [curve | {"scene": "box", "noise": "tof"} | times],
            "sets": {"kicad": [figures | {"level": "clean"}]}, "missing": {"PCL": "no <header>"}}  # fmt: skip


@pytest.mark.parametrize("part", benchmark.PARTS)
def test_a_report_of_one_part_shows_what_is_there(tmp_path, part):
    whole = document()
    report.write({name: whole[name] for name in ("machine", "threads", "quick", "gates", part)}, tmp_path)
    headings = [line for line in (tmp_path / "report.md").read_text().splitlines() if line.startswith("## ")]
    assert len(headings) == 2
    assert headings[0] == "## Gates"


def test_a_report_holds_its_figures_and_pictures(tmp_path):
    written = report.write(document(), tmp_path)
    assert all(path.stat().st_size > 1000 for path in written if path.suffix == ".png")
    text, page = (tmp_path / "report.md").read_text(), (tmp_path / "index.html").read_text()
    for said in ("Missed: speed. All of it.", "others were busy", "does not load it", "192 px", "quick run",
                 "closing a source whose device hangs"):  # fmt: skip
        assert said in text
        assert said in page
    assert "fp32 &lt;slow&gt;" in page
    assert "Not measured in the virtual machine: not run: no <qemu>." in text
    assert "Time of a frame was not measured: no <networks>." in text
    assert page.count("data:image/png;base64,") == 7
    assert "| as shipped | 10.0 | 0.600 | 6.0 | 0.500 | 0.600 | ● |" in text
    assert "| fp32 <slow> | 20.0 | 0.610 | 6.1 | 0.500 | 0.600 |  |" in text
