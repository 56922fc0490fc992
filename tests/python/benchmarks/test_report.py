"""A report shows the sections that were measured; a published one is of a single commit."""

import json

import pytest

from benchmarks import __main__ as benchmark
from benchmarks import prediction, provenance, report, startup
from benchmarks.heads import report as heads_report

MACHINE = {"architecture": "x86_64", "cores": 2, "instruction_sets": ["avx2", "fma"], "processor": "P",
           "memory_mib": 2048, "system": "S"}  # fmt: skip
COMMIT = "0123456789ab"


def stamps(**changed):
    sections = [name for name in benchmark.SECTIONS if name != "edges"] + ["edges.fields", "edges.times"]
    same = {name: {"commit": COMMIT, "date": "2026-01-02", "quick": False} for name in sections}
    return same | {name.replace("_of_", "."): same["frames"] | {"commit": commit} for name, commit in changed.items()}


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
              for name in ("people", "sizes", "one_thread")}  # fmt: skip
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
    target = {"description": "speed", "value": 40.0, "threshold": "≥ 30", "goal": "≥ 60", "state": "missed", "why": "",
              "tried": "All of it."}  # fmt: skip
    measured = {"host": camera_host(), "guest": {}, "guest_missing": "not run: no <qemu>", "frames": 100,
                "warnings": []}  # fmt: skip
    unseen = {"rows": [], "places": [], "speed": {}, "speed_missing": "no <networks>", "warnings": ["0 real places"],
              "sheet": ""}  # fmt: skip
    sizes = [{"setting": "288 px", "axis": "no crops", "ms": 5.0, "rendered": None, "views": None,
              "photographs": dict.fromkeys(("recall", "mask", "part", "side"), 0.5)}]  # fmt: skip
    processes = {kind: {"libraries": ["libc.so.6"], "cpu_ms": [2.0]} for kind in startup.NAMES}
    file = {"name": "libmaquette.so", "bytes": 10**6, "needed": ["libc.so.6"]}
    live = dict.fromkeys(("opening_ms", "running_ms", "result_ms", "lost_ms", "back_ms", "longest_call_ms"), 1.0)
    view = {"open_ms": 1.0, "first_view_ms": 2.0, "longest_call_ms": 0.5}
    waits = {"first": [live], "next": [live], "scene": [view], "capture": [view], "demo": {},
             "demo_missing": "there is no <Xvfb>", "warnings": []}  # fmt: skip
    return {"machine": MACHINE, "cameras": measured, "scenes": unseen, "edges": edges_document(),
            "prediction": prediction_document(), "ui_latency": waits,
            "sizes": {"configurations": {"densepose": {"library_bytes": 1_150_000, "models_bytes": 2_700_000}}},
            "startup": {"processes": processes, "files": {"library": file}, "warnings": []},
            "frames": frames, "sweep": rows, "person_sizes": sizes, "threads": 2,
            "frame_budget": {"missing": "no control group can be made: <mkdir>"},
            "quick": True, "targets": [target], "measured": stamps(),
            "runtimes": {"runtimes": runtimes, "roofline": line},
            "agreement": {"labels": 0.98, "parts": 0.99, "mask_iou": 0.97, "same_count": 0.9, "images": 5}}  # fmt: skip


def prediction_document():
    ahead = [{"frames": n, "last_db": 20.0, "motion_db": 25.0, "dis_db": 24.0, "auto_db": 25.0,
              "motion_chosen": 1.0} for n in prediction.HORIZONS]  # fmt: skip
    row = {"film": "pushing 00000, 10 fps", "size_px": [320, 240], "threads": 2, "dis_ms": 9.0, "starts": 3,
           "push_ms": 3.0, "auto_push_ms": 4.0, "predict_ms": 2.0, "cpu_ms": 5.0, "horizons": ahead}  # fmt: skip
    waits = {"captured": 20, "predicted": 5, "wait_ms": {"median": 0.1, "p99": 0.5, "max": 0.6}}
    return {"rows": [row], "sets": prediction.means_of([row]), "speed": [row | {"film": "street"}], "waits": waits,
            "health": {"frames_a_second": 700.0, "push_ms": 1.4, "cpu_ms": 1.5},
            "missing": ["real clips (<none>)"], "warnings": []}  # fmt: skip


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


@pytest.mark.parametrize("section", benchmark.SECTIONS)
def test_a_report_of_one_section_shows_that_section(tmp_path, section):
    whole = document()
    report.write({name: whole[name] for name in ("machine", "threads", "quick", "targets", section)}, tmp_path)
    headings = [line for line in (tmp_path / "report.md").read_text().splitlines() if line.startswith("## ")]
    assert len(headings) == 2
    assert headings[0] == "## Targets"


def test_a_report_holds_metrics_images_warnings_and_its_commit(tmp_path):
    written = report.write(document(), tmp_path)
    assert all(path.stat().st_size > 1000 for path in written if path.suffix == ".png")
    text, page = (tmp_path / "report.md").read_text(), (tmp_path / "index.html").read_text()
    for said in ("Missed: speed. All of it.", "others were busy", "does not load it", "192 px", "quick run",
                 "closing a source whose device hangs", f"Measured at commit {COMMIT}, 2026-01-02."):  # fmt: skip
        assert said in text
        assert said in page
    assert "fp32 &lt;slow&gt;" in page
    assert "Not measured in the virtual machine: not run: no <qemu>." in text
    assert page.count("data:image/png;base64,") == 7
    assert "| as shipped | 10.0 | 0.600 | 6.0 | 0.500 | 0.600 | ● |" in text
    assert "| speed | 40 | ≥ 30 | ≥ 60 | missed |" in text


def published(tmp_path, **changed):
    """Publishes a document with some stamps changed; returns the refusal and the published files."""
    shown = ("machine", "threads", "targets", "measured", "startup", "cameras", "scenes")  # without images: quick
    found = {name: own for name, own in document().items() if name in shown} | {"quick": False} | changed
    (tmp_path / "out").mkdir(exist_ok=True)
    picture, path = tmp_path / "out" / "stages.png", tmp_path / "out" / "benchmark.json"
    picture.touch()
    path.write_text(json.dumps(found))
    target = tmp_path / "published"
    refusal = benchmark.publish(found, [path, picture, *report.write(found, tmp_path / "out")], target)
    return refusal, {path.name for path in target.glob("*")}


def test_sections_of_one_commit_are_published_without_the_html_page(tmp_path):
    refusal, files = published(tmp_path)
    assert refusal == ""
    assert {"benchmark.json", "report.md", "stages.png"} <= files
    assert "index.html" not in files


def test_without_a_section_the_last_report_is_published_as_it_is(tmp_path, monkeypatch):
    shown = ("machine", "threads", "metrics", "missing", "measured", "startup", "cameras")
    found = {"schema": benchmark.SCHEMA, "quick": False, "metrics": {}, "missing": {}} | {
        name: own for name, own in document().items() if name in shown
    }
    (tmp_path / "benchmark.json").write_text(json.dumps(found))
    monkeypatch.setattr(benchmark.publish, "__defaults__", (tmp_path / "published",))
    assert benchmark.main(["--out", str(tmp_path), "--publish", "--only"]) in (0, 1)
    again = json.loads((tmp_path / "published" / "benchmark.json").read_text())
    assert {name: again[name] for name in found} == found
    assert "startup" in again
    assert "frames" not in again


def test_sections_of_different_commits_are_refused_with_the_command_that_helps(tmp_path):
    refusal, files = published(tmp_path, measured=stamps(cameras="fedcba987654", edges_of_times="fedcba987654"))
    assert files == set()
    assert "its sections are of different commits" in refusal
    assert f"frames is of commit {COMMIT}" in refusal
    assert "cameras is of commit fedcba987654" in refusal
    assert refusal.endswith("run there: python -m benchmarks --publish --only cameras edges")
    text = (tmp_path / "out" / "report.md").read_text()
    assert "Sections of different commits, not for publication" in text


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"quick": True}, "of a quick run"),
        ({"measured": {}}, "startup is of commit unknown"),
        ({"measured": stamps(**dict.fromkeys(stamps(), COMMIT + provenance.CHANGED))}, "Commit all changes"),
        ({"measured": {name: own for name, own in stamps().items() if name != "scenes"}}, "--only scenes"),
    ],
    ids=["quick", "no stamps", "uncommitted changes", "one section without a stamp"],
)
def test_a_report_whose_commit_is_not_known_is_refused(tmp_path, changed, said):
    refusal, files = published(tmp_path, **changed)
    assert said in refusal
    assert files == set()


def test_a_stamp_names_the_commit_and_the_date():
    stamp = provenance.stamp()
    assert set(stamp) == {"commit", "date"}
    assert len(stamp["commit"].removesuffix(provenance.CHANGED)) == 12 or stamp["commit"] == "unknown"


def head_row(head, face, **more):
    return {"bundle": "b", "set": "one photo", "head": head, "asked_s": 2, "face_mm": face, "head_mm": 2.0,
            "unaligned_mm": 9, "scale": 0.9, "normals_deg": 20, "mean_face_mm": 2, "mean_head_mm": 4, "yaw_deg": -20,
            "mean_unaligned_mm": 10, "mean_normals_deg": 30, "head_px": 130, "focal_ratio": 1.1, "rotation_deg": 3.0,
            "fit_s": 1, "steps": 50, "encode_ms": 1, "mesh_ms": 300, "used_photos": 1, "linear_head_mm": 2.5,
            "linear_face_mm": 1.5, "view_psnr_db": 20.0, "mean_view_psnr_db": 18.0, "seen_mm": 1.0, "unseen_mm": 3.0,
            "face_mesh_inner_face_mm": 2.6, "inner_face_mm": 1.1, "hair": "long"} | more  # fmt: skip


def test_the_page_of_heads_has_targets_baselines_groups_and_kernels():
    rows = [head_row("a", 1.0), head_row("b", 2.0, hair="none", face_mesh_inner_face_mm=None)]
    kernels = [{"isa": "avx2", "what": "forward, back to all weights", "us": 0.5, "torch_us": 2.0, "fraction": 0.5}]
    measured = {"machine": {"processor": "x", "cores": 2}, "bundles": ["b"], "at_s": 2, "rows": rows,
                "field_kernels": kernels, "measured": {"quality": stamps()["frames"]}}  # fmt: skip
    page = heads_report.page(measured)
    assert f"Measured at commit {COMMIT}, 2026-01-02." in page
    assert "| one photo: head by linear head | 0.80 | ≤ 0.9 | ≤ 0.75 | met |" in page
    assert "| one photo: mesh at 1.6 mm, s | 0.30 | ≤ 1 | ≤ 0.4 | goal |" in page
    assert "| MediaPipe's 468 points |  | 2.60 |" in page
    assert "| long | 1 | 1.00 | 0.50 | 2.00 | 0.50 |" in page
    assert "| avx2 | forward, back to all weights | 0.500 | 2.000 | 0.25 | 50 % |" in page
    slow = heads_report.page(measured | {"rows": [row | {"steps": 5} for row in rows]})
    assert "Fits of 2 s came no further than 5 steps: the machine was busy" in slow
    assert "| one photo: face, mm | 1.50 | ≤ 1.8 | ≤ 1.3 | not measured |" in slow
