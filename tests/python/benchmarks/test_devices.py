"""Reports of devices as a table, and damaged reports."""

import json

import pytest

from benchmarks import devices


def report(**changed):
    case = {
        "source": "stub:people?count=1",
        "people": 1.0,
        "fps": 60.4,
        "ms": {"frame": {"p50": 16.55, "p90": 18.0, "p99": 21.0}},
        "cpu_ms": 30.0,
        "valid": True,
    }
    made = {
        "schema": "maquette-bench-3",
        "machine": {"processor": "Maker Phone 1", "cores": 8, "system": "Android 15"},
        "peak_memory_mib": 91.4,
        "valid": True,
        "cases": [case],
    }
    return made | changed


def written(tmp_path, name, value):
    path = tmp_path / name
    path.write_text(value if isinstance(value, str) else json.dumps(value))
    return path


def test_each_source_of_each_device_is_a_line(tmp_path):
    second = report(valid=False, machine={"processor": "Laptop", "cores": 2, "system": "Linux 6.1"})
    paths = [written(tmp_path, "a.json", report()), written(tmp_path, "b.json", second)]
    lines = devices.table(paths).splitlines()
    assert lines[2] == (
        "| Maker Phone 1, 8 cores | Android 15 | `stub:people?count=1` | 1.0 | 60 | 16.6 | 21.0 | 30.0 | 91 MiB | yes |"
    )
    assert lines[3].startswith("| Laptop, 2 cores | Linux 6.1 |")
    assert lines[3].endswith("| no |")


def test_text_of_a_report_stays_in_its_cell(tmp_path):
    machine = {"processor": "a|b<script>\nc", "cores": 1, "system": "s" * 500}
    line = devices.table([written(tmp_path, "a.json", report(machine=machine))]).splitlines()[2]
    assert line.startswith("| a/b(script> c, 1 cores | " + 80 * "s" + " |")


@pytest.mark.parametrize(
    ("value", "sentence"),
    [
        ("{", "cannot be read as JSON"),
        ([], "has the schema None"),
        (report(schema="maquette-bench-2"), "has the schema 'maquette-bench-2'"),
        (report(cases=[{}]), "not a complete report"),
        (report(cases=5), "not a complete report"),
        (report(machine={"processor": "a", "cores": "many", "system": "b"}), "not a complete report"),
    ],
)
def test_what_is_no_report_is_a_sentence(tmp_path, value, sentence):
    with pytest.raises(ValueError, match=sentence):
        devices.table([written(tmp_path, "a.json", value)])


def test_a_missing_file_is_a_sentence(tmp_path):
    with pytest.raises(ValueError, match="cannot be read"):
        devices.table([tmp_path / "none.json"])
