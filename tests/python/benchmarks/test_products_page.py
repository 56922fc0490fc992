"""The table of products: which is best in a row, where others are better, the page, the figure, publishing."""

import argparse
import json
import subprocess

import pytest

from benchmarks import provenance
from benchmarks.products import __main__ as program
from benchmarks.products import figure, page
from benchmarks.products.rows import FOREGROUND, Row, losses, rows_of
from benchmarks.products.running import NO_MASKS

NAMES = ("ours", "theirs", f"theirs{NO_MASKS}", "segmenter")
STAMP = {"commit": "0123456789ab", "date": "2026-11-29", "quick": False, "library": "aaaaaaaaaaaa"}


def products():
    return {
        name: {"version": f"{name} 1", "is_ours": name == "ours", "has_people": name != "segmenter"} for name in NAMES
    }


def document(**sections):
    clips = {
        "ours": {"found": 0.9, "mask_iou": 0.7, "joints": 0.5, "foreground_iou": 0.8, "joint_jitter_p50": 0.012,
                 "common_people": 3, "people": 7, "ids": {"switches": 1},
                 "groups": [{"name": "higher than 128 px", "recall": 0.95}]},
        "theirs": {"found": 0.4, "mask_iou": 0.8, "joints": None, "foreground_iou": 0.7, "joint_jitter_p50": 0.02,
                   "ids": {"switches": 4}},
        "segmenter": {"foreground_iou": 0.9},
    }  # fmt: skip
    times = {
        "ours": {"clips": {"1": {"ms": 60.0}, "2": {"ms": 40.0}}, "networks_mb": 2.7},
        "theirs": {"clips": {"1": {"ms": 70.0}, "2": {"ms": 35.0}}, "networks_mb": 9.4},
        f"theirs{NO_MASKS}": {"clips": {"1": {"ms": 65.0}, "2": {"ms": 33.0}}, "networks_mb": 9.4},
        "segmenter": {"clips": {"1": {"ms": 5.0}, "2": {"ms": 4.0}}, "networks_mb": 0.2},
    }  # fmt: skip
    measured = {
        "clips": {"clips": 2, "frames": 20, "products": clips},
        "times": {"products": times, "warnings": ["other processes used 9% of the processor"]},
    }
    return {
        "schema": program.SCHEMA, "machine": {"processor": "A processor", "cores": 2}, "network_cut_off": True,
        "products": products(), "provenance": {"clips": dict(STAMP), "times": dict(STAMP)}, **measured, **sections,
    }  # fmt: skip


def row(title="a", better=1, digits=2, section="clips", **values):
    return Row(section, title, values, better, digits)


def cells(text, title):
    """The values of a row of the page, by product."""
    lines = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ")]
    found = next(line for line in lines if line[0] == title)
    return dict(zip(lines[0], found[1:], strict=True))


def test_the_best_value_of_a_row_is_that_of_the_shown_digits():
    assert row(ours=0.501, theirs=0.504).best(["ours", "theirs"]) == ("ours", 0.5)
    assert row(ours=0.50, theirs=0.51).best(["ours", "theirs"]) == ("theirs", 0.51)
    assert row(better=-1, ours=3.0, theirs=4.0).best(["ours", "theirs"]) == ("ours", 3.0)
    assert row(better=0, ours=3.0, theirs=4.0).best(["ours", "theirs"]) is None
    assert row(ours=None).best(["ours", "theirs"]) is None


def test_losses_are_the_rows_in_which_all_of_ours_are_worse():
    rows = [
        row("won", ours=0.6, theirs=0.5), row("even", ours=0.5, theirs=0.5), row("lost", ours=0.4, theirs=0.5),
        row("slow", better=-1, digits=0, ours=9, theirs=7), row("no value of ours", ours=None, theirs=1),
        row("fast segmenter", better=-1, ours=9, theirs=10, segmenter=1), row(FOREGROUND, ours=0.5, segmenter=0.6),
    ]  # fmt: skip
    assert losses(rows, products()) == [
        "clips, lost: theirs 0.50, ours 0.40",
        "clips, slow: theirs 7, ours 9",
        f"clips, {FOREGROUND}: segmenter 0.60, ours 0.50",
    ]


def test_rows_come_from_the_metrics_of_each_section():
    by_title = {row.title: row for row in rows_of(document())}
    assert by_title["people found"].values == {"ours": 0.9, "theirs": 0.4, "segmenter": None}
    assert by_title["people found, 256 px and higher"].values["ours"] == 0.95
    assert by_title["id switches"].values["theirs"] == 4
    assert by_title["jitter of joints, % of the torso a frame, median"].values["ours"] == pytest.approx(1.2)
    without = by_title["MediaPipe without masks: frame of a clip, 2 cores, ms"].values
    assert (without["ours"], without["theirs"]) == (40.0, 33.0)


def test_the_page_shows_values_losses_and_how_it_was_measured():
    text = page.page(document())
    assert cells(text, "people found") == {"ours": "**0.900**", "theirs": "0.400", "segmenter": "–"}
    # The segmenter is faster, but finds no people, so it does not compete.
    assert cells(text, "frame of a clip, 2 cores, ms") == {"ours": "40.0", "theirs": "**35.0**", "segmenter": "4.0"}
    assert cells(text, FOREGROUND)["segmenter"] == "**0.900**"
    assert "- clips, mask IoU, missed people count as 0: theirs 0.800, ours 0.700\n" in text
    assert "Measured at commit 0123456789ab, 2026-11-29." in text
    assert "Warning: other processes used 9% of the processor." in text
    assert "of its own without a network" in text
    assert "in a process of its own. One" in page.page(document(network_cut_off=False))
    assert "Clips: 2 of 20 frames, with 7 people to find, of whom all find 3." in text


def test_a_page_without_times_says_so():
    shown = document()
    del shown["times"], shown["provenance"]["times"]
    text = page.page(shown)
    assert "Times are not measured yet." in text
    assert "networks on disk" not in text
    assert page.FIGURE not in text


def test_the_figure_has_each_product_with_error_and_time(tmp_path):
    assert figure.points_of(document(), "clips", "joints", "clips") == {"ours": [(1, 60.0, 0.5), (2, 40.0, 0.5)]}
    assert set(figure.points_of(document(), "clips", "mask_iou", "clips")) == {"ours", "theirs"}
    assert figure.write(document(), tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert not figure.write(document(times={"products": {}, "warnings": []}), tmp_path / "b.png")
    assert not (tmp_path / "b.png").exists()


@pytest.mark.parametrize(
    ("stamp", "said"),
    [
        (STAMP, ""),
        (STAMP | {"quick": True}, "--quick"),
        (STAMP | {"commit": "fedcba987654"}, "different commits"),
        (STAMP | {"library": "bbbbbbbbbbbb"}, "Build it"),
        (STAMP | {"commit": STAMP["commit"] + provenance.CHANGED}, "with uncommitted changes"),
    ],
    ids=["one commit", "quick", "other commit", "another library", "uncommitted changes"],
)
def test_only_measurements_of_one_commit_are_published(stamp, said, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(provenance, "library_refusal", lambda commit: "Build it" if commit == "bbbbbbbbbbbb" else "")
    for name, folder in (("_DOCS", tmp_path / "docs"), ("_IMAGES", tmp_path / "images")):
        folder.mkdir()
        monkeypatch.setattr(program, name, folder)
    shown = document(provenance={"clips": dict(STAMP), "times": stamp})
    program.write(shown, tmp_path / "out")
    status = program.publish(shown, argparse.Namespace(out=tmp_path / "out"))
    files = sorted(path.name for name in ("docs", "images") for path in (tmp_path / name).iterdir())
    if said:
        assert (status, files) == (1, [])
        assert said in capsys.readouterr().err
    else:
        assert (status, files) == (0, ["products.json", "products.md", "products.png"])


def test_the_other_section_of_an_earlier_run_is_kept(tmp_path, capsys):
    shown = document()
    program.write(shown, tmp_path)
    assert program.main(["--only", "--out", str(tmp_path)]) == 0
    assert json.loads((tmp_path / program.JSON).read_text()) == shown
    assert program.main(["--only", "--out", str(tmp_path / "none")]) == 1
    assert "nothing is measured" in capsys.readouterr().err


@pytest.fixture
def commit(tmp_path, monkeypatch):
    """Commits a file to a new repository, which is the current folder, and returns the stamp's commit."""

    def git(*words):
        subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b", *words], cwd=tmp_path, check=True,
                       capture_output=True)  # fmt: skip

    def commit_file(name):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(name)
        git("add", "-A")
        git("commit", "-qm", name)
        return provenance.stamp_of_code()["commit"]

    git("init", "-q")
    monkeypatch.chdir(tmp_path)
    return commit_file


def test_a_stamp_of_code_ignores_changes_of_docs(commit, tmp_path):
    code = commit("code.py")
    assert len(code) == 12
    assert commit("docs/page.md") == code
    (tmp_path / "docs/page.md").write_text("other")
    assert provenance.stamp_of_code()["commit"] == code
    (tmp_path / "code.py").write_text("other")
    assert provenance.stamp_of_code()["commit"] == code + provenance.CHANGED
    assert commit("other.py") not in (code, code + provenance.CHANGED)


def test_a_library_of_other_sources_is_refused(commit):
    library = commit("sdk/a.cpp")
    assert provenance.library_refusal(library) == ""
    assert "uncommitted changes" in provenance.library_refusal(f"{library}+")
    commit("benchmarks/b.py")
    assert provenance.library_refusal(library) == ""
    commit("sdk/c.cpp")
    assert "differ" in provenance.library_refusal(library)
    assert "does not have" in provenance.library_refusal("0123456789ab")
