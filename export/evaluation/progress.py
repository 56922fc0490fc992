"""How metrics grew with training: one entry for each set of weights, kept in docs/research/progress.json and drawn.

    python -m export.evaluation --backends torch=WEIGHTS
    python -m export.evaluation.progress --add photographs --hours 6.9 --images 420000
    python -m export.evaluation.progress            # draws docs/images/progress.png again
"""  # fmt: skip

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot

# figure: (what it is called, where it is in a column of evaluation.json, what the product wants)
RENDERED = {
    "ap_box": ("box AP", 0.65),
    "ap_gps": ("AP by GPS", 0.55),
    "part_accuracy": ("part accuracy", 0.85),
    "mask_iou": ("mask IoU", None),
}
ERROR = "error_cm_painted"  # of rendered people, median
MAX_ERROR_CM = 6.0
PHOTOS = {
    "recall_at_precision": ("recall at precision .9", 0.85),
    "mask_iou": ("mask IoU", 0.78),
    "part_at_landmark": ("part at landmark", 0.80),
    "left_right": ("left/right", 0.93),
}


def entry(name: str, hours: float, images: int, document: dict) -> dict:
    """One row of docs/research/progress.json from an evaluation.json. Raises ValueError for more than one column."""
    if len(document["results"]) != 1:
        raise ValueError(f"the evaluation has {len(document['results'])} columns; run it with one backend")
    (column,) = document["results"].values()
    photos = column["photos"] or {}
    return {
        "name": name,
        "hours": hours,
        "images": images,
        "model": column["fingerprint"],
        "test_images": column["images"],
        "rendered": {key: column[key] for key in (*RENDERED, ERROR)},
        "photos": {key: photos.get(key) for key in (*PHOTOS, "false_people")},
    }


def draw(rows: list[dict], path: Path) -> None:
    """Metrics against hours of training; dashed lines are what the product wants."""
    rows = sorted(rows, key=lambda row: row["hours"])
    figure, (*axes, centimetres) = pyplot.subplots(1, 3, figsize=(16, 5), layout="constrained")
    for axis, key, table, title in zip(
        axes, ("rendered", "photos"), (RENDERED, PHOTOS), ("rendered people", "real photographs"), strict=True
    ):
        for k, (field, (label, wanted)) in enumerate(table.items()):
            known = [row for row in rows if row[key].get(field) is not None]
            axis.plot([r["hours"] for r in known], [r[key][field] for r in known], "o-", color=f"C{k}", label=label)
            if wanted is not None:
                axis.axhline(wanted, color=f"C{k}", linestyle="--", linewidth=1)
        for row in rows:
            axis.annotate(row["name"], (row["hours"], 0.01), rotation=90, fontsize=8, ha="right", color="0.4")
            axis.axvline(row["hours"], color="0.9", zorder=0)
        axis.set(title=title, ylim=(0, 1))
        axis.legend(fontsize=8, loc="upper left")
    known = [row for row in rows if row["rendered"].get(ERROR) is not None]
    centimetres.plot([row["hours"] for row in known], [row["rendered"][ERROR] for row in known], "o-")
    centimetres.axhline(MAX_ERROR_CM, linestyle="--", linewidth=1)
    centimetres.set(title="rendered people: median surface error", ylabel="cm", ylim=(0, None))
    for axis in (*axes, centimetres):
        axis.set_xlabel("hours of training on two cores")
        axis.grid(alpha=0.3)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=90)
    pyplot.close(figure)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.evaluation.progress", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--add", metavar="NAME", help="take the metrics of --evaluation in, under this name")
    parser.add_argument("--hours", type=float, help="of training so far, runs that these weights descend from included")
    parser.add_argument("--images", type=int, help="images seen so far")
    parser.add_argument("--evaluation", type=Path, default=Path("build/evaluation/evaluation.json"), metavar="JSON")
    parser.add_argument("--progress", type=Path, default=Path("docs/research/progress.json"), metavar="JSON")
    parser.add_argument("--picture", type=Path, default=Path("docs/images/progress.png"), metavar="PNG")
    arguments = parser.parse_args(argv)
    if arguments.add and (arguments.hours is None or arguments.images is None):
        parser.error("--add needs --hours and --images")
    try:
        rows = json.loads(arguments.progress.read_text()) if arguments.progress.exists() else []
        if arguments.add:
            document = json.loads(arguments.evaluation.read_text())
            rows = [row for row in rows if row["name"] != arguments.add]
            rows.append(entry(arguments.add, arguments.hours, arguments.images, document))
            arguments.progress.write_text(json.dumps(rows, indent=1) + "\n")
        if not rows:
            raise ValueError(f"{arguments.progress} has no entries yet; --add makes one")
    except (OSError, ValueError) as error:
        print(f"No progress was drawn: {error}", file=sys.stderr)
        return 1
    draw(rows, arguments.picture)
    print(f"Written: {arguments.picture}, {len(rows)} sets of weights")
    return 0


if __name__ == "__main__":
    sys.exit(main())
