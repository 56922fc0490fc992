"""Labels on two processors: what counts as the same, and that a difference is never overlooked."""

import json
import subprocess
import xml.etree.ElementTree as ElementTree

import cv2
import numpy as np
import pytest

from benchmarks.processors import emulated, label_agreement
from benchmarks.processors.emulated import HERE, OTHERS, Processor, check_features, write_junit
from benchmarks.processors.label_agreement import Agreement


def write_results(folder, parts, boxes, stem="photo"):
    """Results of one picture as `maquette densepose` writes them; parts [H, W], boxes [N, 4]."""
    folder.mkdir(exist_ok=True)
    parts = np.asarray(parts, np.uint8)
    cv2.imwrite(str(folder / f"{stem}_IUV.png"), np.dstack([parts, parts * 0 + 7, parts * 0 + 9]))
    people = [{"box": list(map(float, box)), "score": 0.9} for box in boxes]
    text = json.dumps({"width": parts.shape[1], "height": parts.shape[0], "people": people})
    (folder / f"{stem}.json").write_text(text)
    return folder


@pytest.fixture
def parts():
    """A person of 20 x 10 pixels, part 3, in a picture of 100 x 100."""
    image = np.zeros((100, 100), np.uint8)
    image[10:30, 20:30] = 3
    return image


BOX = (20, 10, 30, 30)


def test_equal_results_agree_wholly(tmp_path, parts):
    a, b = (write_results(tmp_path / name, parts, [BOX]) for name in "ab")
    found = label_agreement.compare(a, b)
    assert (found.pictures, found.people, found.unmatched) == (1, 1, 0)
    assert (found.fraction, found.person_fraction, found.worst_picture, found.box_px) == (1, 1, 1, 0)
    assert found.passes(1)


def test_another_part_and_another_outline_count_as_different(tmp_path, parts):
    changed = parts.copy()
    changed[10:14, 20:30] = 4  # 40 pixels of another part
    changed[30:31, 20:30] = 3  # 10 pixels painted by one only
    found = label_agreement.compare(
        write_results(tmp_path / "a", parts, [BOX]), write_results(tmp_path / "b", changed, [(20, 10, 30, 31.5)])
    )
    assert found.fraction == pytest.approx(1 - 50 / 10000)
    assert found.person_fraction == pytest.approx(1 - 50 / 210)
    assert found.box_px == 1.5
    assert found.passes(0.995)
    assert not found.passes(0.9951)


def test_the_bar_is_about_all_pixels_and_the_worst_picture_is_told(tmp_path, parts):
    for k in range(4):
        for name in "ab":
            write_results(tmp_path / name, parts, [BOX], f"same{k}")
    write_results(tmp_path / "a", parts, [BOX], "worst")
    write_results(tmp_path / "b", parts * 2, [BOX], "worst")
    found = label_agreement.compare(tmp_path / "a", tmp_path / "b")
    assert found.fraction == pytest.approx(0.996)
    assert found.worst_picture == 0.98
    assert found.passes(0.995)
    assert not found.passes(0.997)


def test_somebody_lost_new_or_elsewhere_misses_the_bar(tmp_path, parts):
    a = write_results(tmp_path / "a", parts, [BOX, (60, 60, 70, 70)])
    for boxes, unmatched in (([BOX], 1), ([BOX, (60, 60, 70, 70), (0, 0, 5, 5)], 1), ([BOX, (66, 66, 76, 76)], 2)):
        found = label_agreement.compare(a, write_results(tmp_path / "b", parts, boxes))
        assert found.unmatched == unmatched
        assert not found.passes(0.995)
    swapped = label_agreement.compare(a, write_results(tmp_path / "b", parts, [(60, 60, 70, 70), BOX]))
    assert (swapped.unmatched, swapped.box_px) == (0, 0)


def test_other_pictures_sizes_and_empty_ones_are_no_agreement(tmp_path, parts):
    a = write_results(tmp_path / "a", parts, [BOX])
    with pytest.raises(ValueError, match=r"but .* of 0"):
        label_agreement.compare(a, tmp_path / "none")
    with pytest.raises(ValueError, match=r"is \(100, 100\)"):
        label_agreement.compare(a, write_results(tmp_path / "b", parts[:50], [BOX]))
    nobody = write_results(tmp_path / "c", parts * 0, [])
    with pytest.raises(ValueError, match="nothing to compare"):
        label_agreement.compare(nobody, nobody)
    (a / "photo_IUV.png").write_bytes(b"no picture")
    with pytest.raises(ValueError, match="cannot be read"):
        label_agreement.compare(a, a)


def test_the_report_of_each_processor_can_be_counted(tmp_path):
    good = Agreement(pictures=1, people=1, pixels=10, equal=10, person_pixels=5, person_equal=5)
    bad = Agreement(pictures=1, people=1, pixels=10, equal=9, person_pixels=5, person_equal=4, worst_picture=0.8)
    results = {"good": good, "bad": bad, "broken": "It did not start."}
    failures = {title: label_agreement.failure_of(found, 0.995) for title, found in results.items()}
    write_junit(tmp_path / "x.xml", "label_agreement", failures)
    cases = list(ElementTree.parse(tmp_path / "x.xml").iter("testcase"))
    assert [case.get("name") for case in cases] == ["good", "bad", "broken"]
    failures = [case.find("failure") for case in cases]
    assert failures[0] is None
    assert "90.000 %" in failures[1].get("message")
    assert failures[2].get("message") == "It did not start."


def test_a_processor_that_is_not_the_one_it_is_said_to_be_is_refused(monkeypatch):
    def offers(features):
        monkeypatch.setattr(subprocess, "run", lambda *a, **k: subprocess.CompletedProcess(a, 0, features, ""))

    avx2 = next(p for p in OTHERS if p.name == "avx2")
    offers("avx2\nfma\n")
    assert check_features(avx2) == ["avx2", "fma"]
    for wrong in ("avx2\nfma\navx512_vnni\n", "avx2\nfma\navx_vnni\n", "fma\n", ""):
        offers(wrong)
        with pytest.raises(ValueError, match="AVX2 without VNNI should offer"):
            check_features(avx2)


def test_frames_of_the_clip_are_the_ones_asked_for(tmp_path):
    paths = label_agreement.clip_frames(label_agreement.CLIP, (0, 3), tmp_path)
    assert [path.rsplit("/", 1)[1] for path in paths] == ["clip_000.png", "clip_003.png"]
    assert cv2.imread(paths[1]).shape == (360, 640, 3)
    with pytest.raises(ValueError, match="has 72 frames"):
        label_agreement.clip_frames(label_agreement.CLIP, (72,), tmp_path)


def test_a_failing_program_is_one_sentence_and_exit_code_one(tmp_path, monkeypatch, capsys):
    broken = Processor(HERE.name, HERE.title, "no-such-build")
    monkeypatch.setattr(emulated, "HERE", broken)
    assert label_agreement.main(["--out", str(tmp_path), "x.png"]) == 1
    assert "no-such-build" in capsys.readouterr().err


def test_other_processors_are_compared_by_their_results(tmp_path, monkeypatch, parts, capsys):
    other = OTHERS[0]

    def run(processor, bundle, sources, out):
        if processor is HERE:
            write_results(out, parts, [BOX])
        else:
            write_results(out, parts * (2 if "wrong.png" in sources else 1), [BOX])

    monkeypatch.setattr(emulated, "check_features", lambda processor: ["avx2"])
    monkeypatch.setattr(label_agreement, "run", run)
    report = tmp_path / "x.xml"
    arguments = ["--out", str(tmp_path), "--only", other.name, "--junit", str(report)]
    assert label_agreement.main([*arguments, "right.png"]) == 0
    assert "held" in capsys.readouterr().out
    assert label_agreement.main([*arguments, "wrong.png"]) == 1
    assert "missed" in capsys.readouterr().out
    assert ElementTree.parse(report).find(".//failure") is not None
