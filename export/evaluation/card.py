"""Writes a bundle's model card from its manifest and from evaluation.json; every number in it comes from those two.

The same text goes beside the bundle's manifest and into docs/; only the path to the gallery's image differs. The
manifest does not list the card: its metrics are measured on the finished bundle.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path

from export.bundle import read_manifest
from export.evaluation.backends import fingerprint
from export.evaluation.failures import KINDS
from export.evaluation.gallery import CAPTIONS
from export.evaluation.report import FORMATS, ROWS, column_of

NAME = "MODEL_CARD.md"
CASES_IN_WORDS = 3
BAR = r"\|"  # a bar inside a cell
NUMBERS = FORMATS | {"rate": "{:.2f}"}
PHOTO_ROWS = (
    ("recall at precision .9", "recall_at_precision"),
    ("recall, as shown", "recall_shown"),
    ("precision, as shown", "precision_shown"),
    ("mask IoU", "mask_iou"),
    ("part at landmark", "part_at_landmark"),
    ("left/right", "left_right"),
)

EPILOG = """\
example:
  python -m export.evaluation && python -m export.evaluation.gallery && python -m export.evaluation.card
"""

USES = """\
## Uses

Meant for effects and measurements on people in photos and clips, on the device, where a wrong pixel does no harm:
virtual clothes and light, interaction by the body, research into dense pose.

Not meant for recognising who somebody is or telling age, sex, health or feelings; for watching people; for anything
where an error hurts somebody (driving, medicine, safety of machines, law). The surface under clothes is a guess.

Skin, hair, clothes and poses of real people are richer than what the network learned from. How the metrics differ
between groups of real people has not been measured.
"""


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.evaluation.card", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--bundle", type=Path, default=Path("sdk/models/densepose-b-int8"), metavar="DIR")
    parser.add_argument("--evaluation", type=Path, default=Path("build/evaluation/evaluation.json"), metavar="JSON")
    parser.add_argument("--gallery", type=Path, default=Path("docs/images/failures.jpg"), metavar="JPG")
    parser.add_argument("--docs", type=Path, default=Path("docs/reference/model-card.md"), metavar="MD")
    arguments = parser.parse_args(argv)
    try:
        if not arguments.gallery.exists():
            raise FileNotFoundError(f"{arguments.gallery} is not there; run `python -m export.evaluation.gallery`.")
        manifest, digest = read_manifest(arguments.bundle), fingerprint(arguments.bundle)
        document = json.loads(arguments.evaluation.read_text())
        for path in (arguments.docs, arguments.bundle / NAME):
            gallery = Path(os.path.relpath(arguments.gallery, path.parent)).as_posix()
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(card(manifest, digest, document, gallery))
            print(f"Written: {path}")
    except (FileNotFoundError, ValueError) as error:
        print(f"No model card was written: {error}", file=sys.stderr)
        return 1
    return 0


def card(manifest: dict, digest: str, document: dict, gallery: str) -> str:
    """Markdown. digest: the bundle's `fingerprint`. document: evaluation.json. gallery: link to its image.

    Raises ValueError when the document does not hold metrics of this bundle.
    """
    metrics = column_of(document, digest)
    sections = [
        _what_it_does(manifest, digest),
        _training_data(manifest),
        _rendered_metrics(document["data"], metrics),
        _fates(metrics["pixel_fates"]),
        _groups("By group of people", "part accuracy", metrics["groups"]),
        _parts(document["part_names"], metrics),
        _calibration(document["calibration_bins"], metrics["calibration"]),
        _photo_metrics(metrics["photos"]),
        _failures(metrics, gallery),
        USES,
    ]
    return "\n".join(sections)


def _what_it_does(manifest: dict, digest: str) -> str:
    source, boxes, dense = manifest["input"], manifest["box_head"], manifest["dense_head"]
    megabytes = sum(file["bytes"] for file in manifest["files"].values()) / 1e6
    return f"""\
# Model card: {manifest["name"]} {manifest["version"]}

Finds people in an image and maps every pixel of theirs to a point of a body surface: part I, coordinates U, V.
Written by `python -m export.evaluation.card` from the bundle `{digest}` (SHA-256 of its manifest, first digits) and
from what `python -m export.evaluation` measured on it.

| | |
| --- | --- |
| task, precision, size | {manifest["task"]}, {manifest["precision"]}, {megabytes:.2f} MB |
| licence | {manifest["licence"]} |
| in | an image ({source["color"]} inside; the SDK converts), resized to a long side of {source["long_side_px"]} px |
| out | for each person box and score; for each pixel I, U, V and which person is in front |
| people shown | score {boxes["score_threshold"]:g} or better, at most {boxes["max_people"]} an image |
| boxes dropped | IoU above {boxes["nms_iou"]:g} with a better one: of two people standing so, one is lost |
| pixels painted | probability of person above {dense["mask_threshold"]:g} |
| surface grid | {dense["output_size"]} x {dense["output_size"]} a person: finer detail in large people is interpolated |
"""  # noqa: E501


def _training_data(manifest: dict) -> str:
    rows = [[entry["name"], entry["licence"], entry["used_for"]] for entry in manifest["training_data"]]
    return "## Trained on\n\n" + _table(("what", "licence", "used for"), rows)


def _rendered_metrics(data: dict, metrics: dict) -> str:
    whole = "" if data["limit"] is None else f" (only the first {data['limit']} of the set)"
    text = f"""\
## Metrics on rendered people

{metrics["images"]} rendered images{whole}, {metrics["people"]} people; {metrics["ignored"]} more are
too small or hidden to be asked for. AP and calibration are over scores from {data["score_floor"]:g} up, the rest at
{metrics["threshold"]:g} or better. Fractions are in percent. Definitions: `python -m export.evaluation --help`.

"""
    rows = [(label, _number(metrics[field], unit)) for label, field, unit in ROWS if unit != "ms"]
    return text + _table(("figure", "value"), rows)


def _fates(fates: dict[str, float]) -> str:
    rows = [(name, _number(value, "points")) for name, value in fates.items()]
    text = "What people's pixels are painted with; background: also everything of people who were missed.\n\n"
    return "### Where pixels go\n\n" + text + _table(("painted with", "fraction"), rows)


def _groups(title: str, accuracy: str, groups: list[dict]) -> str:
    fractions = ("recall", "part_accuracy", "mask_iou")
    rows = [
        (f"{g['by']}: {g['name']}", str(g["people"]), *(_number(g[field], "points") for field in fractions))
        for g in groups
    ]
    text = "Heights are those of an image with a long side of 320 px. Missed people count as wrong everywhere.\n\n"
    return f"### {title}\n\n{text}" + _table(("people", "number", "recall", accuracy, "mask IoU"), rows)


def _parts(names: list[str], metrics: dict) -> str:
    rows = [
        (
            names[part],
            _number(metrics["part_recall"][part], "points"),
            _number(metrics["part_precision"][part], "points"),
            _number(metrics["part_error_cm"][part], "cm"),
        )
        for part in range(1, len(names))
    ]
    text = (
        "Recall: fraction of the part's visible pixels painted with it. "
        "Precision: fraction of the pixels painted with it that show it. "
        "Surface error: of the part's painted pixels, whatever they are painted with.\n\n"
    )
    return f"### By body part\n\n{text}" + _table(("part", "recall", "precision", "median surface error"), rows)


def _calibration(bins: int, calibration: dict) -> str:
    rows = [
        (
            f"{k / bins:.1f} to {(k + 1) / bins:.1f}",
            str(calibration["count"][k]),
            _number(calibration["mean_score"][k], "points"),
            _number(calibration["fraction_right"][k], "points"),
        )
        for k in range(bins)
    ]
    text = (
        "How far a score is the chance that the box is right (IoU .5). Expected calibration error: "
        f"{_number(calibration['expected_error'], 'points')} %.\n\n"
    )
    return f"### Calibration of scores\n\n{text}" + _table(("score", "detections", "mean score", "right"), rows)


def _photo_metrics(photos: dict | None) -> str:
    title = "## Metrics on real photographs\n\n"
    if photos is None:
        return title + "Not measured.\n"
    text = f"""\
{photos["photos"]} photographs that training never saw; {photos["people"]} people, {photos["masks"]} with a mask.
The truth is what other, permissively licensed networks say (`export/teachers`), so it has errors of its own.
Definitions: `python -m export.evaluation.photos --help`.

"""
    rows = [(label, _number(photos[field], "points")) for label, field in PHOTO_ROWS]
    rows.append(("calibration error", _number(photos["calibration"]["expected_error"], "points")))
    rows.append(
        (
            f"people shown in a photo without any ({photos['empty_photos']} photos)",
            _number(photos["false_people"], "rate"),
        )
    )
    if photos.get("animal_photos"):
        label = f"people shown in a photo of animals ({photos['animal_photos']} photos)"
        rows.append((label, _number(photos["false_people_by_animals"], "rate")))
    groups = _groups("By group of people, photographs", "part at landmark", photos["groups"])
    return title + text + _table(("figure", "value"), rows) + "\n" + groups


def _failures(metrics: dict, gallery: str) -> str:
    text = f"""\
## Known failures

The worst cases of the rendered test images, chosen by their metrics: image with the person or box in question on the
left, what is painted on the right. The images show fabrics and backgrounds under the licences named above.

![Worst cases]({gallery})

"""
    if metrics["photos"] is None:
        return text
    rows = []
    for kind, title in KINDS.items():
        cases = metrics["photos"]["failures"][kind][:CASES_IN_WORDS]
        told = "; ".join(f"`{case['image']}` {CAPTIONS[kind].format(case['figure'])}" for case in cases)
        rows.append((title, told or "none"))
    intro = "In the photographs (`python -m export.photos people` fetches them; most may not be redistributed):\n\n"
    return text + intro + _table(("failure", "worst"), rows)


def _number(value: float | None, unit: str) -> str:
    """As in the tables of the evaluation: fractions in percent; `-` where nothing was measured."""
    if value is None:
        return "-"
    scale = 100 if unit == "points" else 1
    return NUMBERS[unit].format(scale * value)


def _table(heads: tuple[str, ...], rows: list) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(cell.replace('|', BAR) for cell in line)} |\n" for line in lines)


if __name__ == "__main__":
    sys.exit(main())
