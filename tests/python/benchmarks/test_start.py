"""What a start costs: the libraries that a file needs, and the figures of processes."""

import pytest

from benchmarks import report, start

DOCUMENT = {
    "processes": {
        "context": {"libraries": ["libmaquette.so.0.2", "libc.so.6"], "cpu_ms": [2.0, 9.0, 2.5]},
        "densepose": {"libraries": ["libmaquette.so.0.2", "libc.so.6", "libdl.so.2"], "cpu_ms": [200.0]},
    },
    "files": {
        "library": {"name": "libmaquette.so.0.3.0", "bytes": 1_300_000, "needed": ["libc.so.6"]},
        "files_library": {"name": "libmaquette_files.so", "bytes": 20_000, "needed": ["libopencv_imgcodecs.so.406"]},
    },
    "warnings": [],
}


def test_every_figure_is_of_what_was_measured():
    figures = start.figures_of(DOCUMENT)
    assert figures == {"library_mb": 1.3, "files_library_mb": 0.02, "libraries_context": 2, "libraries_densepose": 3,
                       "context_cpu_ms": 2.5, "first_result_cpu_ms": 200.0}  # fmt: skip
    assert set(figures) == set(start.FIGURES)


def test_the_report_names_the_libraries():
    text = report.markdown([start.section(DOCUMENT)])
    assert "| a context alone | 2 | 2.5 | 9.0 | 3 | libmaquette.so.0.2, libc.so.6 |" in text
    assert "| libmaquette_files.so | 0.020 | libopencv_imgcodecs.so.406 |" in text


def test_the_needed_libraries_of_the_shipped_library_are_found():
    library = start.library_files()["library"]
    if not library.exists():
        pytest.skip("the library is not built")
    found = start.needed(library)
    assert "libc.so.6" in found
    assert not [name for name in found if "opencv" in name]


def test_a_program_that_is_not_built_is_an_error_that_says_what_to_do(monkeypatch, tmp_path):
    monkeypatch.setattr(start, "PROGRAM", tmp_path / "measure_start")
    with pytest.raises(FileNotFoundError, match="make bench builds it"):
        start.start("context")
