"""The frame budget's figures: what a run's row says, and how a process gets a fraction of the processor."""

import subprocess

import numpy as np
import pytest

from benchmarks import frame_budget


def run(ms, side_px, key_frames=1):
    frames = len(ms)
    labels = np.zeros((frames, 4, 4), np.uint8)
    labels[:, :2] = 3
    is_key = np.arange(frames) % key_frames == 0
    return frame_budget.Run(np.array(ms, float), np.array(side_px), is_key.astype(int), labels)


def test_deadlines_are_counted_over_all_frames_and_over_those_after_the_budget_was_found():
    found = frame_budget.row(run([50] * 5 + [20] * 15, [288] * 20), run([1] * 20, [288] * 20).labels, 33, 0.5, True)
    assert (found["met"], found["met_late"], found["side_px"], found["side_changes"]) == (0.75, 1, 288, 0)
    assert found["time"] == pytest.approx(20 / 33, abs=1e-3)
    assert found["agreement"] == 1


def test_a_change_costs_what_its_first_frame_takes_more_than_the_next_ones():
    ms = [40] * 10 + [60] + [20] * 19
    found = frame_budget.row(run(ms, [288] * 10 + [160] * 20, 4), run(ms, ms).labels, 33, 0.25, True)
    assert (found["side_changes"], found["change_cost"], found["side_px"]) == (1, [3.0], 160)
    assert found["key_frames"] == pytest.approx(0.25, abs=0.03)


def test_agreement_is_of_pixels_that_either_has_on_a_body():
    wanted = np.zeros((1, 2, 4), np.uint8)
    wanted[0, 0] = 5
    labels = wanted.copy()
    assert frame_budget.agreement(labels, wanted) == 1
    labels[0, 0, 0] = 6  # another part
    labels[0, 1, 0] = 5  # where no person is
    assert frame_budget.agreement(labels, wanted) == pytest.approx(3 / 5)


def test_all_of_the_processor_needs_no_control_group(tmp_path, monkeypatch):
    monkeypatch.setattr(frame_budget, "GROUPS", tmp_path / "none")
    with frame_budget.processor_fraction(1) as begin:
        assert begin == []
    with pytest.raises(FileNotFoundError), frame_budget.processor_fraction(0.5):
        pass
    measured = frame_budget.measure(quick=True)
    assert "no control group can be made" in measured["missing"]
    assert frame_budget.section(measured)[1] == [f"Not measured: {measured['missing']}."]


@pytest.mark.parametrize("unified", [False, True])
def test_a_share_is_written_as_either_kind_of_control_group_wants_it(tmp_path, monkeypatch, unified):
    parent = tmp_path if unified else tmp_path / "cpu"
    parent.mkdir(exist_ok=True)
    if unified:
        (tmp_path / "cgroup.controllers").write_text("cpu\n")
    monkeypatch.setattr(frame_budget, "GROUPS", tmp_path)
    removed = []
    monkeypatch.setattr(frame_budget.Path, "rmdir", lambda self: removed.append(self))  # its files are the kernel's
    with frame_budget.processor_fraction(0.25) as begin:
        (group,) = (path for path in parent.iterdir() if path.name.startswith("maquette-"))
        if unified:
            assert (group / "cpu.max").read_text() == "1000 4000"
        else:
            assert (group / "cpu.cfs_period_us").read_text() == "4000"
            assert (group / "cpu.cfs_quota_us").read_text() == "1000"
        said = subprocess.run([*begin, "echo", "two words"], check=True, stdout=subprocess.PIPE, text=True).stdout
        assert said == "two words\n"
        assert int((group / "cgroup.procs").read_text()) > 0
    assert removed == [group]


def test_the_section_has_a_row_for_each_run_and_says_whose_time_counts():
    rows = [
        frame_budget.row(run([20] * 20, [288] * 20), run([1] * 20, [1] * 20).labels, 33, fraction, has_budget)
        for fraction in frame_budget.FRACTIONS
        for has_budget in (False, True)
    ]
    title, (table, text) = frame_budget.section({"frames": 20, "room": 1.3, "others": 0.5, "rows": rows})
    assert "frame budget" in title
    assert len(table) == 1 + 2 * len(frame_budget.FRACTIONS)
    assert table[1][:3] == ["100%", "no", "100%"]
    assert "50%" in text
    assert "only ratios" in text
