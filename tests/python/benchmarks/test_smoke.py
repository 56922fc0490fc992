"""A quick run of two sections writes a document with the agreed keys."""

import json

import pytest

from benchmarks import __main__ as benchmark
from benchmarks import frame_time, startup


@pytest.mark.skipif(
    not (frame_time.PROGRAM.exists() and startup.PROGRAM.exists()),
    reason="the programs are not built: make build; cmake --build --preset release --target measure_startup",
)
def test_a_quick_run_measures_checks_and_writes_a_report(tmp_path):
    arguments = ["--quick", "--threads", "1", "--out", str(tmp_path), "--only"]
    assert benchmark.main([*arguments, "startup"]) in (0, 1)
    assert benchmark.main([*arguments, "frames"]) in (0, 1)
    document = json.loads((tmp_path / "benchmark.json").read_text())
    assert document["schema"] == benchmark.SCHEMA
    assert document["quick"] is True
    assert set(document["measured"]) == {"startup", "frames"}
    assert all(set(stamp) == {"commit", "date", "quick"} for stamp in document["measured"].values())
    assert {"library_mb", "fps_one_person", "peak_memory_mb"} <= set(document["metrics"])
    assert all(isinstance(value, int | float) for value in document["metrics"].values())
    checked = {target["metric"]: target for target in document["targets"]}
    assert set(checked) == set(document["metrics"])
    assert set(checked["library_mb"]) == {
        "metric", "description", "value", "threshold", "goal", "state", "why", "tried",
    }  # fmt: skip
    text = (tmp_path / "report.md").read_text()
    assert "smoke test" in text
    assert "| stripped libmaquette.so, MB |" in text
    assert benchmark.main([*arguments, "startup", "--publish"]) == 2
