"""The model card says what the JSON and the manifest say, and the gallery shows the cases that the JSON names."""

import json
import re
from dataclasses import fields
from pathlib import Path

import cv2
import numpy as np
import pytest

from export.bundle import read_manifest
from export.evaluation import gallery
from export.evaluation.backends import Prediction, fingerprint
from export.evaluation.breakdown import GroupMetrics
from export.evaluation.calibration import BINS
from export.evaluation.card import card, main
from export.evaluation.failures import KINDS
from export.evaluation.gallery import COLUMNS, HEADER_PX, TILE, draw_kind
from export.evaluation.measure import Metrics
from export.evaluation.photos import PhotoMetrics
from export.evaluation.report import SCHEMA
from export.evaluation.surface_accuracy import FATES
from export.shards import ShardWriter
from export.surface import PART_COUNT, PART_NAMES

BUNDLE = Path("sdk/models/densepose-b-int8")
DIGEST = "0123456789ab"
NUMBER = re.compile(r"\d+(?:\.\d+)?")


def document(start: float, step: float) -> dict:
    """An evaluation.json in which every figure is another number: start, start + step, ..."""
    count = iter(range(10000))

    def next_fraction() -> float:
        return start + step * next(count)

    def next_count() -> int:
        return 1000 + round(1e5 * next_fraction())

    groups = [
        {"by": "size", "name": name, "people": next_count()}
        | {f.name: next_fraction() for f in fields(GroupMetrics) if f.name not in ("by", "name", "people")}
        for name in ("small", "tall")
    ]

    def own(kind: type) -> dict:
        values = {f.name: next_count() if f.type == "int" else next_fraction() for f in fields(kind)}
        values["groups"] = groups
        values["calibration"] = {
            "count": [next_count() for _ in range(BINS)],
            "mean_score": [next_fraction() for _ in range(BINS)],
            "fraction_right": [next_fraction() for _ in range(BINS)],
            "expected_error": next_fraction(),
        }
        values["failures"] = {
            kind: [{"image": f"{kind}.jpg", "box": [1, 1, 9, 9], "figure": next_fraction()}] for kind in KINDS
        }
        return values

    metrics = own(Metrics) | {"model": "somewhere", "fingerprint": DIGEST, "photos": own(PhotoMetrics)}
    metrics["pixel_fates"] = {name: next_fraction() for name in FATES}
    for field in ("part_recall", "part_precision", "part_error_cm"):
        metrics[field] = [next_fraction() for _ in range(PART_COUNT + 1)]
    return {
        "schema": SCHEMA,
        "data": {"limit": next_count(), "score_floor": next_fraction()},
        "part_names": PART_NAMES,
        "calibration_bins": BINS,
        "results": {"int8 capi": metrics},
    }


def row(text: str, label: str) -> list[str]:
    """Cells of the first table row that begins with this label."""
    line = next(line for line in text.splitlines() if line.startswith(f"| {label} |"))
    return [cell.strip() for cell in line.split("|")[2:-1]]


def written(doc: dict) -> str:
    return card(read_manifest(BUNDLE), DIGEST, doc, "failures.jpg")


def test_the_cards_metrics_are_those_of_the_json():
    doc = document(0.1, 0.001)
    metrics = doc["results"]["int8 capi"]
    metrics |= {"ap_gpsm": 0.3127, "error_cm_painted": 9.84, "mask_iou": None}
    metrics["part_recall"][3], metrics["part_precision"][3], metrics["part_error_cm"][3] = 0.25, 0.5, 101.26
    metrics["calibration"]["expected_error"] = 0.116
    metrics["photos"] |= {"left_right": 0.658, "false_people": 1.588}
    text = written(doc)
    assert row(text, "GPSm AP .50:.95") == ["31.3"]
    assert row(text, "surface error, all painted") == ["9.8 cm"]
    assert row(text, "mask IoU") == ["-"]
    assert row(text, "right hand") == ["25.0", "50.0", "101.3 cm"]
    assert row(text, "size: small")[0] == str(metrics["groups"][0]["people"])
    assert "Expected calibration error: 11.6 %" in text
    photos = text[text.index("real photographs") :]
    assert row(photos, "left/right") == ["65.8"]
    assert f"({metrics['photos']['empty_photos']} photos) | 1.59 |" in photos


def test_every_row_of_a_table_has_as_many_cells_as_its_head():
    for table in re.findall(r"(?:^\|.*\n)+", written(document(0.1, 0.001)), re.MULTILINE):
        assert len({len(re.findall(r"(?<!\\)\|", line)) for line in table.splitlines()}) == 1, table


def test_no_number_of_the_card_but_those_of_labels_and_manifest_stays_when_all_metrics_change():
    manifest = json.dumps(read_manifest(BUNDLE))
    first, second = (
        [NUMBER.findall(line) for line in written(document(*numbers)).splitlines()]
        for numbers in ((0.1, 0.001), (0.107, 0.0013))
    )
    labels = {"50", "95", "5", "9", "320", *(f"{k / BINS:.1f}" for k in range(BINS + 1))}  # IoU .50:.95, bins, ...
    megabytes = sum(file["bytes"] for file in read_manifest(BUNDLE)["files"].values()) / 1e6
    labels |= {f"{megabytes:.2f}", DIGEST[:10], "0", "1"}
    kept = {a for x, y in zip(first, second, strict=True) for a, b in zip(x, y, strict=True) if a == b}
    assert {number for number in kept - labels if number not in manifest} == set()
    assert sum(a != b for x, y in zip(first, second, strict=True) for a, b in zip(x, y, strict=True)) > 100


def test_metrics_of_another_model_are_refused():
    doc = document(0.1, 0.001)
    with pytest.raises(ValueError, match="not of the model ffff"):
        card(read_manifest(BUNDLE), "ffff", doc, "failures.jpg")
    with pytest.raises(ValueError, match="measure again"):
        card(read_manifest(BUNDLE), DIGEST, doc | {"schema": "older"}, "failures.jpg")


def test_a_card_without_photographs_says_so():
    doc = document(0.1, 0.001)
    doc["results"]["int8 capi"]["photos"] = None
    assert "Not measured." in written(doc)


def test_the_command_writes_one_text_beside_the_manifest_and_into_the_docs(tmp_path, capsys):
    bundle = tmp_path / "models/bundle"
    bundle.mkdir(parents=True)
    (bundle / "manifest.json").write_bytes((BUNDLE / "manifest.json").read_bytes())
    doc = document(0.1, 0.001)
    doc["results"]["int8 capi"]["fingerprint"] = fingerprint(bundle)
    (tmp_path / "evaluation.json").write_text(json.dumps(doc))
    arguments = ["--bundle", str(bundle), "--evaluation", str(tmp_path / "evaluation.json")]
    arguments += ["--docs", str(tmp_path / "docs/model-card.md"), "--gallery", str(tmp_path / "docs/failures.jpg")]
    assert main(arguments) == 1
    assert "export.evaluation.gallery" in capsys.readouterr().err
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs/failures.jpg").touch()
    assert main(arguments) == 0
    in_docs, in_bundle = (tmp_path / "docs/model-card.md").read_text(), (bundle / "MODEL_CARD.md").read_text()
    assert "](failures.jpg)" in in_docs
    assert in_bundle == in_docs.replace("](failures.jpg)", "](../../docs/failures.jpg)")


def test_the_shipped_card_belongs_to_the_shipped_weights():
    """After new weights: python -m export.evaluation, .gallery, .card."""
    for path in (BUNDLE / "MODEL_CARD.md", BUNDLE.parents[2] / "docs/reference/model-card.md"):
        assert f"`{fingerprint(BUNDLE)}`" in path.read_text()


class Painter:
    """Paints the left half of every image as a left hand."""

    kind, precision, threshold, path = "fake", "fp32", 0.5, None

    def predict(self, image):
        iuv, inds = np.zeros((*image.shape[:2], 3), np.uint8), np.zeros(image.shape[:2], np.uint8)
        iuv[:, : image.shape[1] // 2, 0], inds[:, : image.shape[1] // 2] = 4, 1
        return Prediction(np.array([[0, 0, 9, 9]], np.float32), np.array([0.9]), iuv, inds)


def shard(folder: Path) -> None:
    """Two grey images of 100 x 80 px without anybody."""
    writer = ShardWriter(boxes=True)
    for _ in range(2):
        writer.add(np.full((80, 100, 3), 128, np.uint8), np.zeros((80, 100, 4), np.uint8), jpeg_quality=95)
    writer.write(folder / "shard-00000.npz", {})


def test_the_gallery_shows_image_and_paint_of_the_named_cases_and_no_private_photograph(tmp_path, monkeypatch):
    shard(tmp_path)
    cases = [{"image": f"shard-00000/000{k}", "box": [10, 10, 50, 70], "figure": 0.9 - 0.1 * k} for k in range(2)]
    private = {"image": "private.jpg", "box": [0, 0, 5, 5], "figure": 0.99}
    public = {"image": "public.jpg", "box": [0, 0, 5, 5], "figure": 0.95}
    for name in ("private.jpg", "public.jpg"):
        cv2.imwrite(str(tmp_path / name), np.full((80, 100, 3), 200, np.uint8))
    monkeypatch.setattr(gallery, "REDISTRIBUTABLE", {"public.jpg": tmp_path / "public.jpg"})
    metrics = {"failures": {"false": cases}, "photos": {"failures": {"false": [private, public]}}}
    data = {"folder": str(tmp_path), "photos": str(tmp_path), "empty": str(tmp_path)}
    drawn = draw_kind("false", Painter(), data, metrics, count=1, all_photos=False)
    assert drawn.shape == (HEADER_PX + TILE[1], COLUMNS * TILE[0], 3)
    tiles = drawn[HEADER_PX:].reshape(TILE[1], COLUMNS, TILE[0], 3)
    assert tiles.any((0, 2, 3)).tolist() == [True, True, False, False]  # one rendered image, one photograph
    tile = tiles[:, 0]
    assert tile[100, 120].tolist() == [128] * 3  # the image itself on the left,
    assert np.ptp(tile[100, 270].astype(int)) > 50  # in colour on the right
    everything = draw_kind("false", Painter(), data, metrics, count=3, all_photos=True)[HEADER_PX:]
    assert everything.reshape(TILE[1], COLUMNS, TILE[0], 3).any((0, 2, 3)).all()


def test_a_kind_without_cases_is_a_title_alone(tmp_path):
    metrics = {"failures": {"side": []}, "photos": None}
    drawn = draw_kind("side", Painter(), {"folder": str(tmp_path)}, metrics, 3, all_photos=False)
    assert drawn.shape == (HEADER_PX, COLUMNS * TILE[0], 3)
    assert drawn.any()
