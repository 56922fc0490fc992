"""Results of an emulated processor agree with those of this one, or the program fails; no difference is overlooked."""

import json
import subprocess

import cv2
import numpy as np
import pytest

from benchmarks.processors import emulated, field_agreement, label_agreement, prediction_agreement
from benchmarks.processors.emulated import OTHERS, check_features

BOX = (20, 10, 30, 30)


def write_labels(folder, other=False):
    """Writes a person of 20 x 10 pixels, part 3, as `maquette densepose` does; other: 4 of its rows are of part 4."""
    folder.mkdir(exist_ok=True)
    parts = np.zeros((100, 100), np.uint8)
    parts[10:30, 20:30] = 3
    if other:
        parts[10:14, 20:30] = 4
    cv2.imwrite(str(folder / "photo_IUV.png"), np.dstack([parts, parts * 0 + 7, parts * 0 + 9]))
    people = [{"box": list(BOX), "score": 0.9}]
    (folder / "photo.json").write_text(json.dumps({"width": 100, "height": 100, "people": people}))
    return folder


def write_prediction(folder, other=False):
    """Writes camera health and a predicted image; other: a cell of the image differs by 9 levels."""
    folder.mkdir(exist_ok=True)
    lines = [{"unexplained": 0.02 * k, "event": "ok", "state": "ok", "stream_start": k == 0} for k in range(2)]
    (folder / "health.json").write_text("".join(json.dumps(line) + "\n" for line in lines))
    image = np.full((64, 64, 3), 100, np.uint8)
    image[1, 2] += 9 if other else 0
    cv2.imwrite(str(folder / "next.png"), image)
    return folder


def write_field(folder, other=False):
    """Writes a vertical edge at column 10 of a field of 20 x 50 px; other: 5 of its pixels are 2 r from the edge."""
    folder.mkdir(exist_ok=True)
    field = np.broadcast_to(np.minimum(np.abs(np.arange(50.0) - 10), 16), (20, 50)).copy()
    field[:5, 10] = 2 if other else 0
    cv2.imwrite(str(folder / "0_distance.png"), (field * 1000).round().astype(np.uint16))
    return folder


MODULES = {
    "labels": (label_agreement, write_labels, ["x.png"], 0.996, 0.997),
    "fields": (field_agreement, write_field, ["x"], 0.99, 0.996),
    "prediction": (prediction_agreement, write_prediction, [], 0.99, 0.999),
}


@pytest.mark.parametrize("kind", MODULES)
def test_equal_results_agree_and_different_ones_miss_a_high_bar(tmp_path, kind):
    module, write, _, low, high = MODULES[kind]
    a, b, c = (write(tmp_path / name, other=name == "c") for name in "abc")
    assert module.failure_of(module.compare(a, b), 1) is None
    found = module.compare(a, c)
    assert module.failure_of(found, low) is None
    assert "%" in module.failure_of(found, high)


@pytest.mark.parametrize("kind", ["labels", "fields"])
def test_missing_results_are_an_error(tmp_path, kind):
    module, write, *_ = MODULES[kind]
    with pytest.raises(ValueError, match=r"but .* of 0"):
        module.compare(write(tmp_path / "a"), tmp_path / "none")


@pytest.mark.parametrize("kind", MODULES)
def test_the_exit_status_and_the_junit_file_say_whether_processors_agree(tmp_path, monkeypatch, capsys, kind):
    module, write, sources, _, high = MODULES[kind]
    other, differs = OTHERS[0], False
    monkeypatch.setattr(emulated, "check_features", lambda processor: ["avx2"])
    monkeypatch.setattr(module, "run", lambda processor, *given: write(given[-1], other=differs and processor is other))
    report = tmp_path / "x.xml"
    arguments = ["--out", str(tmp_path), "--only", other.name, "--junit", str(report), "--bar", str(high), *sources]
    assert module.main(arguments) == 0
    assert "held" in capsys.readouterr().out
    assert "failure" not in report.read_text()
    differs = True
    assert module.main(arguments) == 1
    assert "missed" in capsys.readouterr().out
    assert "failure" in report.read_text()


def test_a_person_who_is_lost_misses_every_bar(tmp_path):
    a, b = (write_labels(tmp_path / name) for name in "ab")
    (b / "photo.json").write_text(json.dumps({"width": 100, "height": 100, "people": []}))
    found = label_agreement.compare(a, b)
    assert found.unmatched == 1
    assert not found.passes(0)


def test_a_processor_with_other_features_than_its_name_says_is_refused(monkeypatch):
    def offers(features):
        monkeypatch.setattr(subprocess, "run", lambda *a, **k: subprocess.CompletedProcess(a, 0, features, ""))

    avx2 = next(p for p in OTHERS if p.name == "avx2")
    offers("avx2\nfma\n")
    assert check_features(avx2) == ["avx2", "fma"]
    for wrong in ("avx2\nfma\navx512_vnni\n", "fma\n", ""):
        offers(wrong)
        with pytest.raises(ValueError, match="AVX2 without VNNI should offer"):
            check_features(avx2)
