"""A quick run writes a document with the agreed keys, and is not published."""

import json

import pytest

from benchmarks import __main__ as benchmark
from benchmarks import frame_time, startup


@pytest.mark.skipif(not frame_time.PROGRAM.exists(), reason="the command line is not built: make build")
def test_a_quick_run_measures_checks_and_writes_a_report(tmp_path, capsys):
    sections = ["frames", *(["startup"] if startup.PROGRAM.exists() else [])]
    arguments = ["--quick", "--threads", "1", "--out", str(tmp_path), "--publish", "--only", *sections]
    assert benchmark.main(arguments) == 2
    assert "is of a quick run" in capsys.readouterr().err
    document = json.loads((tmp_path / "benchmark.json").read_text())
    assert document["schema"] == benchmark.SCHEMA
    assert document["quick"] is True
    assert set(document["measured"]) == set(sections)
    assert all(set(stamp) == {"commit", "date", "quick"} for stamp in document["measured"].values())
    assert {"fps_one_person", "peak_memory_mb", "bundle_mb"} <= set(document["metrics"])
    assert all(isinstance(value, int | float) for value in document["metrics"].values())
    checked = {target["metric"]: target for target in document["targets"]}
    assert set(checked) == set(document["metrics"])
    assert set(checked["bundle_mb"]) == {
        "metric", "description", "value", "threshold", "goal", "state", "why", "tried",
    }  # fmt: skip
    text = (tmp_path / "report.md").read_text()
    assert "smoke test" in text
    assert "| model bundle, MB |" in text
