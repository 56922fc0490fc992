"""Targets are met or missed from both sides, hold on their machine alone, and belong to a metric that is measured."""

import re
from pathlib import Path

import pytest

from benchmarks import __main__ as benchmark
from benchmarks import cameras, prediction, sizes, startup, targets, ui_latency
from benchmarks.edges import measure as edges
from benchmarks.scenes import measure as scenes

MACHINE = {"architecture": "x86_64", "cores": 2, "instruction_sets": ["avx2", "fma"]}
TARGETS = """
[machine.two]
description = "two cores"
architecture = "x86_64"
cores = 2
instruction_sets = ["avx2"]

[[target]]
metric = "fps"
description = "speed"
min = 30
goal = 60
machine = "two"

[[target]]
metric = "mb"
description = "size"
max = 3.6
goal = 3.0
tried = "Smaller."
"""


def checked(tmp_path, metrics, machine=MACHINE, missing=None, only=None):
    path = tmp_path / "targets.toml"
    path.write_text(TARGETS)
    return {verdict.metric: verdict for verdict in targets.check(metrics, machine, missing or {}, path, only)}


@pytest.mark.parametrize(
    ("fps", "mb", "expected"),
    [(61, 2.9, ("goal", "goal")), (30, 3.6, ("met", "met")), (29.9, 3.7, ("missed", "missed"))],
)
def test_metrics_meet_or_miss_their_targets_from_both_sides(tmp_path, fps, mb, expected):
    found = checked(tmp_path, {"fps": fps, "mb": mb})
    assert (found["fps"].state, found["mb"].state) == expected
    assert found["mb"].tried == ("Smaller." if mb > 3.6 else "")


@pytest.mark.parametrize(
    "other", [{"cores": 8}, {"architecture": "aarch64"}, {"instruction_sets": ["sse4_1"]}], ids=str
)
def test_speeds_of_another_machine_are_not_measured_rather_than_passed(tmp_path, other):
    found = checked(tmp_path, {"fps": 1000, "mb": 1}, MACHINE | other)
    assert found["fps"].state == "not measured"
    assert "two cores" in found["fps"].why
    assert found["mb"].state == "goal"


def test_a_metric_that_is_missing_needs_a_reason(tmp_path):
    assert checked(tmp_path, {"fps": 40}, missing={"mb": "no bundle"})["mb"].state == "not measured"
    with pytest.raises(ValueError, match="no metric is called mb"):
        checked(tmp_path, {"fps": 40})


def test_targets_of_one_section_are_checked_alone(tmp_path):
    assert list(checked(tmp_path, {"mb": 1}, only=["mb"])) == ["mb"]


def test_a_section_that_is_measured_again_leaves_nothing_of_the_run_before():
    metrics, missing = {"a": 1, "b": 2, "other": 3}, {"c": "no machine", "other_missing": "x"}
    benchmark.replace(metrics, missing, ("a", "b", "c"), {"c": 4}, {"a": "gone", "b": "gone"})
    assert metrics == {"other": 3, "c": 4}
    assert missing == {"other_missing": "x", "a": "gone", "b": "gone"}


def test_each_shipped_target_has_a_metric_and_the_other_way_round():
    names = {"fps_one_person", "fps_four_people", "fps_empty", "bundle_mb", "peak_memory_mb", "first_result_ms",
             "int8_gps_loss_points", "int8_label_agreement", "time_by_openvino_int8", "time_by_pytorch_fp32",
             "roofline_fraction", *startup.METRICS, *sizes.METRICS.values(), *ui_latency.METRICS, *cameras.METRICS,
             *scenes.METRICS, *edges.METRICS, *prediction.METRICS}  # fmt: skip
    assert {verdict.metric for verdict in targets.check(dict.fromkeys(names, 1.0), MACHINE, {})} == names


def test_the_size_limit_of_the_library_is_written_once():
    """tests/native/CMakeLists.txt reads it from targets.toml with a regular expression."""
    assert re.search(r'metric = "library_mb"\n[^\n]*\nmax = [0-9.]+\n', targets.TARGETS.read_text())
    assert not re.search(r"LIMIT_MB=[0-9]", Path("tests/native/CMakeLists.txt").read_text())
