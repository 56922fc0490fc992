"""The evaluation's results as a table on the terminal, a JSON file and a picture."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from export.evaluation.average_precision import THRESHOLDS
from export.evaluation.machine import describe_machine
from export.evaluation.measure import Figures
from export.surface import PART_COUNT, PART_NAMES

SCHEMA = "maquette-evaluation-1"
WIDTH_OF_FILES = 140  # columns of the table when it does not go to a terminal

# Rows of the table: label, field, unit. Shares are shown in points (hundredths), and so are differences.
ROWS = (
    ("box AP50", "ap_box_50", "points"),
    ("box AP .50:.95", "ap_box", "points"),
    ("GPS AP50", "ap_gps_50", "points"),
    ("GPS AP .50:.95", "ap_gps", "points"),
    ("part accuracy", "part_accuracy", "points"),
    ("mask IoU", "mask_iou", "points"),
    ("median |dU|", "median_du", "plain"),
    ("median |dV|", "median_dv", "plain"),
    ("surface error, right part", "error_cm_right_part", "cm"),
    ("surface error, all painted", "error_cm_painted", "cm"),
    ("people shown", "found", "count"),
    ("time per image", "seconds_per_image", "ms"),
)
FORMATS = {"points": "{:.1f}", "plain": "{:.3f}", "cm": "{:.1f} cm", "count": "{:.0f}", "ms": "{:.0f} ms"}


def column_name(kind: str, precision: str) -> str:
    return f"{precision} {kind}"


def print_table(results: dict[str, Figures], console: Console | None = None) -> None:
    """results: figures by column name; the first column is what the others are compared with."""
    console = console or Console(width=None if sys.stdout.isatty() else WIDTH_OF_FILES)
    first = next(iter(results.values()))
    console.print(
        f"{first.images} images, {first.people} people ({first.ignored} more too small or hidden). "
        f"AP is over all scores, the rest at score >= {first.threshold:g}."
    )
    table = Table()
    table.add_column("")
    for name in results:
        table.add_column(name, justify="right")
    for name in list(results)[1:]:
        table.add_column(f"{name}: difference", justify="right")
    for label, field, unit in ROWS:
        values = [getattr(figures, field) * {"points": 100, "ms": 1000}.get(unit, 1) for figures in results.values()]
        cells = [_text(value, unit) for value in values]
        differences = [_text(value - values[0], unit, signed=True) for value in values[1:]]
        table.add_row(label, *cells, *differences)
    console.print(table)


def _text(value: float, unit: str, signed: bool = False) -> str:
    if np.isnan(value):
        return "-"
    return FORMATS[unit].replace("{:", "{:+" if signed else "{:").format(value)


def largest_difference(results: dict[str, Figures]) -> float:
    """In points, over all rows in points, between any two columns; 0 for one column."""
    spans = [0.0]
    for _, field, unit in ROWS:
        values = [getattr(figures, field) for figures in results.values()]
        if unit == "points" and not np.isnan(values).any():
            spans.append(100 * (max(values) - min(values)))
    return max(spans)


def write_json(path: Path, results: dict[str, Figures], sources: dict[str, str], data: dict) -> None:
    """sources: path and fingerprint of each column's model. data: what was evaluated."""
    document = {
        "schema": SCHEMA,
        "machine": describe_machine(),
        "data": data,
        "thresholds": THRESHOLDS,
        "part_names": PART_NAMES,
        "results": {name: {"model": sources[name], **figures.as_json()} for name, figures in results.items()},
        "largest_difference_points": round(largest_difference(results), 3),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(document, indent=1) + "\n")


def write_picture(path: Path, results: dict[str, Figures]) -> None:
    """AP against the threshold on the left, recall of each body part on the right; one colour a column."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (left, right) = pyplot.subplots(1, 2, figsize=(13, 5), width_ratios=(1, 2), layout="constrained")
    width = 0.8 / len(results)
    for k, (name, figures) in enumerate(results.items()):
        color = f"C{k}"
        left.plot(THRESHOLDS, figures.ap_box_by_threshold, "--", color=color, label=f"{name}: box")
        left.plot(THRESHOLDS, figures.ap_gps_by_threshold, "-", color=color, label=f"{name}: GPS")
        position = np.arange(1, PART_COUNT + 1) + (k - (len(results) - 1) / 2) * width
        right.bar(position, figures.part_recall[1:], width, color=color, label=name)
    left.set(xlabel="similarity threshold", ylabel="average precision", ylim=(0, 1), xlim=(0.5, 0.95))
    left.grid(alpha=0.3)
    left.legend(fontsize=8)
    right.set(ylabel="share of the part's pixels painted with it", ylim=(0, 1), xlim=(0.4, PART_COUNT + 0.6))
    right.set_xticks(range(1, PART_COUNT + 1), PART_NAMES[1:], rotation=90, fontsize=8)
    right.grid(axis="y", alpha=0.3)
    right.legend(fontsize=8)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
