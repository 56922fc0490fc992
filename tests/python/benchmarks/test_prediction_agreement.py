"""Prediction on two processors: what counts as the same, and that a difference is never overlooked."""

import json

import cv2
import numpy as np
import pytest

from benchmarks.processors import emulated, prediction_agreement
from benchmarks.processors.prediction_agreement import compare, failure_of


def write_results(folder, bits=(8.4, 2.5), levels=0, event=False):
    """`levels`: by which the first of the 256 cells of the picture differs."""
    folder.mkdir(exist_ok=True)
    lines = [{"bits": value, "event": event, "cut": False, "start": k == 0} for k, value in enumerate(bits)]
    (folder / "surprise.json").write_text("".join(json.dumps(line) + "\n" for line in lines))
    picture = np.full((64, 64, 3), 100, np.uint8)
    picture[1, 2] += levels
    cv2.imwrite(str(folder / "next.png"), picture)
    return folder


def test_equal_results_agree_wholly(tmp_path):
    found = compare(write_results(tmp_path / "a"), write_results(tmp_path / "b"))
    assert (found.frames, found.worst_bits, found.same_events, found.same_cells) == (2, 0, True, 1)
    assert found.passes(1)
    assert failure_of(found, 1) is None


def test_bits_events_and_cells_that_differ_count(tmp_path):
    a = write_results(tmp_path / "a")
    bits = compare(a, write_results(tmp_path / "b", bits=(8.4, 2.55)))
    assert bits.worst_bits == pytest.approx(0.02)
    assert not bits.passes(0.99)
    assert "2.000 %" in failure_of(bits, 0.99)
    assert not compare(a, write_results(tmp_path / "c", event=True)).passes(0)
    assert compare(a, write_results(tmp_path / "d", levels=1)).same_cells == 1
    cells = compare(a, write_results(tmp_path / "e", levels=2))
    assert cells.same_cells == 255 / 256
    assert cells.passes(0.99)
    assert not cells.passes(0.999)


def test_other_frames_and_none_are_no_agreement(tmp_path):
    a = write_results(tmp_path / "a")
    with pytest.raises(ValueError, match="2 frames and 1 pictures"):
        compare(a, write_results(tmp_path / "b", bits=(8.4,)))
    (a / "next.png").unlink()
    with pytest.raises(ValueError, match="0 pictures"):
        compare(a, a)


def test_other_processors_are_compared_by_their_results(tmp_path, monkeypatch, capsys):
    other = emulated.OTHERS[0]
    levels = {}
    monkeypatch.setattr(emulated, "check_features", lambda processor: ["avx2"])
    monkeypatch.setattr(
        prediction_agreement, "run", lambda processor, bundle, out: write_results(out, levels=levels.get(processor, 0))
    )
    report = tmp_path / "x.xml"
    arguments = ["--out", str(tmp_path), "--only", other.name, "--junit", str(report), "--bar", "0.999"]
    assert prediction_agreement.main(arguments) == 0
    assert "held" in capsys.readouterr().out
    assert "failure" not in report.read_text()
    levels[other] = 9
    assert prediction_agreement.main(arguments) == 1
    assert "missed" in capsys.readouterr().out
    assert "failure" in report.read_text()


def test_a_failing_program_is_one_sentence_and_exit_code_one(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(emulated, "HERE", emulated.Processor("here", "this processor", "no-such-build"))
    assert prediction_agreement.main(["--out", str(tmp_path)]) == 1
    assert "no-such-build" in capsys.readouterr().err
