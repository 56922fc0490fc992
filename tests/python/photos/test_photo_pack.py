"""A pack of photographs comes from elsewhere: what is taken from it is checked, and its splits stay apart."""

import cv2
import numpy as np
import pytest

from export.photos.__main__ import main
from export.photos.photo_pack import COLUMNS, PhotoPackError, build, read_index

TRAIN = {
    "id": "ab-01", "split": "train", "file": "train/ab-01.jpg", "licence": "CC-BY-4.0", "author": "A. Author",
    "url": "", "source": "someone/book@1234", "path": "media/one.jpg", "width": "64", "height": "48",
    "credit_line": "(credit: “One” by A. Author, CC BY 4.0)",
}  # fmt: skip
OTHERS = (
    {"id": "ab-02", "split": "heldout", "file": "heldout/ab-02.jpg", "licence": "public-domain", "credit_line": ""},
    {"id": "ab-03", "file": "train-by-sa/ab-03.jpg", "licence": "CC-BY-SA-3.0-DE"},
    {"id": "ab-04", "split": "heldout", "file": "heldout-by-sa/ab-04.jpg", "licence": "CC-BY-SA"},
    {"id": "ab-05", "file": "train/ab-05.jpg", "licence": "MIT", "credit_line": "", "url": "https://example.org/5"},
)


def write_pack(folder, *changed, extra_columns=("people_ssd",)):
    """A pack of five photographs; `changed` lines follow with all else as the first one's."""
    rows = [TRAIN, *(TRAIN | row for row in (*OTHERS, *changed))]
    names = (*COLUMNS, *extra_columns)
    lines = ["\t".join(names), *("\t".join(row.get(name, "1") for name in names) for row in rows)]
    for row in rows[: 1 + len(OTHERS)]:
        path = folder / row["file"]
        path.parent.mkdir(parents=True, exist_ok=True)
        image = np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8)
        path.write_bytes(cv2.imencode(".jpg", image)[1].tobytes())
    (folder / "index.tsv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


def files_below(folder) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def test_each_photograph_comes_into_the_folder_of_its_split_and_licence(tmp_path, capsys):
    pack = write_pack(tmp_path / "pack")
    assert main(["pack", str(pack), "--data", str(tmp_path / "data")]) == 0
    assert "train 2, train-by-sa 1, heldout 1, heldout-by-sa 1" in capsys.readouterr().out
    out = tmp_path / "data/photos/pack"
    assert files_below(out) == [
        "credits.tsv", "heldout-by-sa/ab-04.jpg", "heldout/ab-02.jpg", "train-by-sa/ab-03.jpg", "train/ab-01.jpg",
        "train/ab-05.jpg",
    ]  # fmt: skip
    assert (out / "train/ab-01.jpg").read_bytes() == (pack / "train/ab-01.jpg").read_bytes()


def test_everyone_whose_photograph_is_trained_on_is_credited_and_nobody_else(tmp_path):
    build(write_pack(tmp_path / "pack"), tmp_path / "out")
    assert (tmp_path / "out/credits.tsv").read_text(encoding="utf-8").splitlines() == [
        "id\tlicence\tsource\tcredit",
        "ab-01\tCC-BY-4.0\tsomeone/book@1234\t(credit: “One” by A. Author, CC BY 4.0)",
        "ab-05\tMIT\tsomeone/book@1234\tA. Author, https://example.org/5",
    ]


def test_a_photograph_that_changed_its_split_leaves_the_other_one(tmp_path):
    pack = write_pack(tmp_path / "pack")
    build(pack, tmp_path / "out")
    index = (pack / "index.tsv").read_text().replace("ab-05\ttrain\ttrain/", "ab-05\theldout\theldout/")
    (pack / "index.tsv").write_text(index)
    (pack / "train/ab-05.jpg").rename(pack / "heldout/ab-05.jpg")
    assert build(pack, tmp_path / "out")["train"] == 1
    assert files_below(tmp_path / "out/train") == ["ab-01.jpg"]
    assert "ab-05" not in (tmp_path / "out/credits.tsv").read_text()


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"id": "../ab"}, r"index\.tsv:7: the id '\.\./ab'"),
        ({"id": "ab-01"}, "the id ab-01 is taken by an earlier line"),
        ({"id": "admin-lte-photo3", "file": "train/admin-lte-photo3.jpg"}, "is taken by export/photos/photographs"),
        ({"id": "ab-06", "split": "test"}, "the split 'test' is not train or heldout"),
        ({"id": "ab-06", "file": "/etc/ab-06.jpg"}, r"'/etc/ab-06\.jpg'; .* must be train/ab-06\.jpg"),
        ({"id": "ab-06", "file": "train/../ab-06.jpg"}, r"must be train/ab-06\.jpg"),
        ({"id": "ab-06", "file": "heldout/ab-06.jpg"}, r"must be train/ab-06\.jpg"),
        ({"id": "ab-06", "file": "train/ab-06.jpg", "licence": "CC-BY-SA-4.0"}, r"must be train-by-sa/ab-06\.jpg"),
        ({"id": "ab-06", "file": "train/ab-06.jpg", "licence": "CC-BY-NC-4.0"}, "licence 'CC-BY-NC-4.0' is not known"),
        ({"id": "ab-06", "file": "train/ab-06.jpg", "licence": ""}, "licence '' is not known"),
        ({"id": "ab-06", "file": "train/ab-06.jpg", "width": "-3"}, "the width '-3' is not 1 to 4096 pixels"),
        ({"id": "ab-06", "file": "train/ab-06.jpg", "height": "4097"}, "the height '4097' is not 1 to 4096 pixels"),
        ({"id": "ab-06", "file": "train/ab-06.jpg", "author": "", "credit_line": ""}, "an author or a credit_line"),
        ({"id": "ab-06", "file": "train/ab-06.jpg", "source": ""}, "needs a source"),
        ({"id": "ab-06", "file": "train/ab-06.jpg", "author": "a\x1b[2J"}, "author has a control character"),
        ({"id": "ab-06", "file": "train/ab-06.jpg", "author": "a\tb"}, "13 columns, the first line has 12"),
    ],
)  # fmt: skip
def test_a_wrong_line_is_named_and_nothing_is_taken(tmp_path, changed, said):
    with pytest.raises(PhotoPackError, match=said):
        build(write_pack(tmp_path / "pack", changed), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_an_index_that_is_missing_empty_or_no_text_is_refused(tmp_path):
    with pytest.raises(PhotoPackError, match=r"it has no index\.tsv"):
        read_index(tmp_path)
    index = tmp_path / "index.tsv"
    index.write_text("\t".join(COLUMNS) + "\n")
    with pytest.raises(PhotoPackError, match="lists no photographs"):
        read_index(tmp_path)
    index.write_text("id\tsplit\tfile\n")
    with pytest.raises(PhotoPackError, match="has no column licence, author"):
        read_index(tmp_path)
    index.write_bytes(b"id\xff")
    with pytest.raises(PhotoPackError, match="is not UTF-8: byte 2"):
        read_index(tmp_path)


def damage_of(kind: str, path) -> None:
    data = path.read_bytes()
    if kind == "missing":
        path.unlink()
    elif kind == "outside":
        path.unlink()
        path.symlink_to(path.parents[2] / "secret.jpg")
    elif kind == "torn":
        path.write_bytes(data[: len(data) // 2])
    elif kind == "png":
        path.write_bytes(cv2.imencode(".png", np.zeros((48, 64, 3), np.uint8))[1].tobytes())
    elif kind == "size":
        path.write_bytes(cv2.imencode(".jpg", np.zeros((64, 48, 3), np.uint8))[1].tobytes())
    elif kind == "huge":  # the header promises 65,535 pixels a side
        at = data.index(b"\xff\xc0") + 5
        path.write_bytes(data[:at] + b"\xff\xff\xff\xff" + data[at + 4 :])


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("missing", "is not there, but index.tsv lists it"), ("outside", "is not there, but index.tsv lists it"),
        ("torn", "is not a whole JPEG image"), ("png", "is not a whole JPEG image"),
        ("size", "has 48 x 64 pixels; index.tsv says 64 x 48"), ("huge", "is not a whole JPEG|has 655"),
    ],
)  # fmt: skip
def test_a_file_that_is_not_what_the_index_says_is_named(tmp_path, capsys, kind, said):
    pack = write_pack(tmp_path / "pack")
    (tmp_path / "secret.jpg").write_bytes((pack / "train/ab-05.jpg").read_bytes())
    damage_of(kind, pack / "train/ab-05.jpg")
    with pytest.raises(PhotoPackError, match=f"ab-05.jpg ({said})"):
        build(pack, tmp_path / "out")
    assert main(["pack", str(pack), "--data", str(tmp_path / "data")]) == 1
    assert "ab-05.jpg" in capsys.readouterr().err


def test_the_command_asks_for_the_folder(capsys):
    with pytest.raises(SystemExit):
        main(["pack"])
    assert "`pack` needs the folder of a pack" in capsys.readouterr().err
