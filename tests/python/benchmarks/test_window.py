"""What an app with a window waits for: times out of what a program tells, and a demo that cannot be measured."""

import json

import pytest

from benchmarks import report, window


def opened(*events, longest_call_ms=0.1):
    return {"longest_call_ms": longest_call_ms, "events": [{"name": name, "ms": ms} for name, ms in events]}


# Until it is opened the source before it gives results; unplugged at 1010 ms, plugged in again at 1310 ms.
PLAYED = (("result", 4.0), ("opening", 10.0), ("running", 80.0), ("result", 100.0), ("reconnecting", 1030.0),
          ("result", 1350.0), ("running", 1351.0), ("result", 1380.0))  # fmt: skip


def test_times_count_from_what_the_uri_asks_for():
    times = {"opening_ms": 10.0, "running_ms": 80.0, "result_ms": 100.0, "lost_ms": 20.0, "back_ms": 40.0,
             "longest_call_ms": 0.1}  # fmt: skip
    assert window.source_times(opened(*PLAYED)) == times


@pytest.mark.parametrize(("left_out", "said"), [("reconnecting", "not told of"), ("opening", "not told of")])
def test_a_source_that_was_not_lost_is_an_error(left_out, said):
    with pytest.raises(ValueError, match=said):
        window.source_times(opened(*(event for event in PLAYED if event[0] != left_out)))


def test_a_source_that_does_not_come_back_is_an_error():
    with pytest.raises(ValueError, match="after it was plugged in again"):
        window.source_times(opened(*PLAYED[:5]))


def measured(demo=(), demo_missing=""):
    live, view = window.source_times(opened(*PLAYED)), {"open_ms": 300.0, "first_view_ms": 500.0, "longest_call_ms": 2}
    runs = [{"longest_ms": ms, "p99_ms": ms / 2, "frames": 50, "start_ms": 100.0} for ms in demo]
    return {"first": [live], "next": [live], "scene": [view], "capture": [view], "warnings": [],
            "demo": {"people": runs, "scene": [runs[0]]} if runs else {}, "demo_missing": demo_missing}  # fmt: skip


def test_the_demos_figure_is_that_of_its_slower_view():
    figures = window.figures_of(measured((30.0, 34.0, 90.0)))
    assert figures["demo_longest_ms"] == 34.0
    assert set(figures) == set(window.FIGURES)


def test_the_report_shows_medians_and_the_worst():
    text = report.markdown([window.section(measured((30.0, 34.0, 90.0)))])
    assert "| the source is unplugged | the app is notified | 20.0 | 20.0 | 1 |" in text
    assert "| stub:people?count=2 | 34.0 | 90.0 | 17.0 | 50 | 3 |" in text
    assert "window's thread made of all these: 2.00 ms" in text


def test_a_demo_that_is_not_there_is_not_measured_and_the_report_says_why(monkeypatch, tmp_path):
    monkeypatch.setattr(window, "DEMO", tmp_path / "maquette-demo")
    assert "is not built" in window.demo_missing()
    without = measured(demo_missing=window.demo_missing())
    assert "demo_longest_ms" not in window.figures_of(without)
    assert "window was not measured: maquette-demo is not built" in report.markdown([window.section(without)])


def test_a_machine_without_a_display_server_says_what_to_install(monkeypatch, tmp_path):
    demo = tmp_path / "maquette-demo"
    demo.touch()
    monkeypatch.setattr(window, "DEMO", demo)
    monkeypatch.setattr(window.shutil, "which", lambda name: None)
    assert "there is no Xvfb" in window.demo_missing()


def test_the_demos_times_are_those_of_its_report(monkeypatch):
    ui = {"longest_ms": 30.0, "p99_ms": 12.0, "frames": 50, "start_ms": 100.0}
    run = window.subprocess.CompletedProcess([], 0, stdout=json.dumps({"frames": 300, "ui": ui}))
    given = {}
    monkeypatch.setattr(window.subprocess, "run", lambda *_, **named: given.update(named) or run)
    assert window.demo_times("people", ":7") == ui
    assert given["env"]["DISPLAY"] == ":7"
