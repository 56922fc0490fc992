"""The curve of figures against training holds what the evaluations said."""

import json

import cv2
import pytest

from export.evaluation.progress import entry, main


def document(ap: float, columns: int = 1, photos: bool = True) -> dict:
    column = {"fingerprint": "abc", "images": 9, "ap_box": ap, "ap_gps": 0.2, "part_accuracy": 0.3, "mask_iou": 0.4}
    column["error_cm_painted"] = 7.0
    shares = {"recall_at_precision": 0.5, "mask_iou": 0.6, "part_at_landmark": 0.7, "left_right": 0.8}
    column["photos"] = shares | {"false_people": 1.5} if photos else None
    return {"results": {f"column {k}": column for k in range(columns)}}


def test_an_entry_holds_the_figures_of_the_evaluation():
    row = entry("first", 2.5, 1000, document(0.1))
    shares = {"ap_box": 0.1, "ap_gps": 0.2, "part_accuracy": 0.3, "mask_iou": 0.4}
    assert row["rendered"] == shares | {"error_cm_painted": 7.0}
    assert row["photos"]["false_people"] == 1.5
    assert (row["name"], row["hours"], row["images"], row["model"], row["test_images"]) == (
        "first", 2.5, 1000, "abc", 9,
    )  # fmt: skip
    assert entry("second", 1, 1, document(0.1, photos=False))["photos"]["mask_iou"] is None
    with pytest.raises(ValueError, match="2 columns"):
        entry("third", 1, 1, document(0.1, columns=2))


def test_entries_are_added_replaced_and_drawn(tmp_path, capsys):
    evaluation, progress, picture = (tmp_path / name for name in ("e.json", "p.json", "p.png"))
    paths = ["--evaluation", str(evaluation), "--progress", str(progress), "--picture", str(picture)]
    assert main(paths) == 1
    assert "no entries" in capsys.readouterr().err
    for name, ap in (("a", 0.1), ("b", 0.2), ("a", 0.3)):
        evaluation.write_text(json.dumps(document(ap)))
        assert main([*paths, "--add", name, "--hours", "2", "--images", "5"]) == 0
    assert {row["name"]: row["rendered"]["ap_box"] for row in json.loads(progress.read_text())} == {"b": 0.2, "a": 0.3}
    assert cv2.imread(str(picture)).std() > 5
