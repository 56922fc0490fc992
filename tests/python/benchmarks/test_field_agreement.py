"""Edges on two processors: what counts as the same, and that a difference is never overlooked."""

import cv2
import numpy as np
import pytest

from benchmarks.processors import emulated, field_agreement


def write_field(folder, distance_r, stem="0"):
    folder.mkdir(exist_ok=True)
    cv2.imwrite(str(folder / f"{stem}_distance.png"), (np.asarray(distance_r) * 1000).round().astype(np.uint16))
    return folder


@pytest.fixture
def field():
    """A vertical edge at column 10 of a field of 20 x 50 px, in r."""
    return np.broadcast_to(np.minimum(np.abs(np.arange(50.0) - 10), 16), (20, 50)).copy()


def test_equal_fields_agree_wholly(tmp_path, field):
    found = field_agreement.compare(write_field(tmp_path / "a", field), write_field(tmp_path / "b", field))
    assert (found.pixels, found.same_side, found.rms_r) == (1000, 1, 0)
    assert found.passes(1)


def test_pixels_on_the_other_side_of_r_count(tmp_path, field):
    other = field.copy()
    other[:5, 10] = 2  # 5 of 1,000 pixels are no edge any more
    other[:, 40] -= 1  # as far from r as before
    found = field_agreement.compare(write_field(tmp_path / "a", field), write_field(tmp_path / "b", other))
    assert found.same_side == pytest.approx(0.995)
    assert found.rms_r == pytest.approx(np.sqrt((5 * 4 + 20) / 1000), rel=1e-3)
    assert found.passes(0.99)
    assert not found.passes(0.996)
    assert "99.500 %" in field_agreement.failure_of(found, 0.996)


def test_other_frames_sizes_and_empty_ones_are_no_agreement(tmp_path, field):
    a = write_field(tmp_path / "a", field)
    with pytest.raises(ValueError, match=r"but .* of 0"):
        field_agreement.compare(a, tmp_path / "none")
    with pytest.raises(ValueError, match=r"is \(20, 50\)"):
        field_agreement.compare(a, write_field(tmp_path / "b", field[:10]))
    flat = write_field(tmp_path / "c", field * 0 + 16)
    with pytest.raises(ValueError, match="nothing to compare"):
        field_agreement.compare(flat, flat)
    (a / "0_distance.png").write_bytes(b"no picture")
    with pytest.raises(ValueError, match="cannot be read"):
        field_agreement.compare(a, a)


def test_other_processors_are_compared_by_their_fields(tmp_path, monkeypatch, field, capsys):
    other = emulated.OTHERS[0]

    def run(processor, bundle, sources, out):
        write_field(out, field + (3 if processor is other and "wrong" in sources else 0))

    monkeypatch.setattr(emulated, "check_features", lambda processor: ["avx2"])
    monkeypatch.setattr(field_agreement, "run", run)
    report = tmp_path / "x.xml"
    arguments = ["--out", str(tmp_path), "--only", other.name, "--junit", str(report)]
    assert field_agreement.main([*arguments, "right"]) == 0
    assert "held" in capsys.readouterr().out
    assert "failure" not in report.read_text()
    assert field_agreement.main([*arguments, "wrong"]) == 1
    assert "missed" in capsys.readouterr().out
    assert "failure" in report.read_text()


def test_a_failing_program_is_one_sentence_and_exit_code_one(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(emulated, "HERE", emulated.Processor("here", "this processor", "no-such-build"))
    assert field_agreement.main(["--out", str(tmp_path), "x"]) == 1
    assert "no-such-build" in capsys.readouterr().err
