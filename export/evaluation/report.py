"""The evaluation's results as tables on the terminal and a JSON file."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from export.evaluation.average_precision import THRESHOLDS
from export.evaluation.breakdown import GroupMetrics
from export.evaluation.calibration import BINS
from export.evaluation.json_values import plain
from export.evaluation.machine import describe_machine
from export.evaluation.measure import Metrics
from export.evaluation.photos import PhotoMetrics
from export.surface import PART_NAMES

SCHEMA = "maquette-evaluation-2"
WIDTH_OF_FILES = 140  # columns of the table when it does not go to a terminal

# Rows of the table: label, field, unit. Fractions are shown in percent, and so are differences.
ROWS = (
    ("box AP50", "ap_box_50", "points"),
    ("box AP .50:.95", "ap_box", "points"),
    ("GPS AP50", "ap_gps_50", "points"),
    ("GPS AP .50:.95", "ap_gps", "points"),
    ("GPSm AP50", "ap_gpsm_50", "points"),
    ("GPSm AP .50:.95", "ap_gpsm", "points"),
    ("recall, as shown", "recall_shown", "points"),
    ("precision, as shown", "precision_shown", "points"),
    ("part accuracy", "part_accuracy", "points"),
    ("left/right", "left_right", "points"),
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


def print_table(results: dict[str, Metrics], console: Console | None = None) -> None:
    """results: metrics by column name; the first column is what the others are compared with."""
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
        values = [getattr(metrics, field) * {"points": 100, "ms": 1000}.get(unit, 1) for metrics in results.values()]
        _add_row(table, label, unit, values)
    _add_row(table, "calibration error", "points", [100 * f.calibration.expected_error for f in results.values()])
    console.print(table)


def _add_row(table: Table, label: str, unit: str, values: list[float]) -> None:
    differences = [_text(value - values[0], unit, signed=True) for value in values[1:]]
    table.add_row(label, *(_text(value, unit) for value in values), *differences)


def _text(value: float, unit: str, signed: bool = False) -> str:
    if np.isnan(value):
        return "-"
    return FORMATS[unit].replace("{:", "{:+" if signed else "{:").format(value)


def largest_difference(results: dict[str, Metrics]) -> float:
    """In points, over all rows in points, between any two columns; 0 for one column."""
    spans = [0.0]
    for _, field, unit in ROWS:
        values = [getattr(metrics, field) for metrics in results.values()]
        if unit == "points" and not np.isnan(values).any():
            spans.append(100 * (max(values) - min(values)))
    return max(spans)


def print_groups(title: str, groups: list[GroupMetrics], console: Console | None = None) -> None:
    """Metrics by size, truncation, crowding and visibility."""
    console = console or Console(width=None if sys.stdout.isatty() else WIDTH_OF_FILES)
    table = Table(title=title, title_justify="left")
    table.add_column("")
    for name in ("people", "recall", "part accuracy", "mask IoU"):
        table.add_column(name, justify="right")
    for before, group in zip([None, *groups], groups, strict=False):
        if before is not None and before.by != group.by:
            table.add_section()
        fractions = (group.recall, group.part_accuracy, group.mask_iou)
        cells = [_text(100 * value, "points") for value in fractions]
        table.add_row(f"{group.by}: {group.name}", str(group.people), *cells)
    console.print(table)


def write_json(
    path: Path,
    results: dict[str, Metrics],
    photo_results: dict[str, PhotoMetrics],
    sources: dict[str, tuple[Path, str]],
    data: dict,
) -> None:
    """sources: path and fingerprint of each column's model. data: what was evaluated."""
    document = {
        "schema": SCHEMA,
        "machine": describe_machine(),
        "data": data,
        "thresholds": THRESHOLDS,
        "calibration_bins": BINS,
        "part_names": PART_NAMES,
        "results": {},
        "largest_difference_points": round(largest_difference(results), 3),
    }
    for name, metrics in results.items():
        model, digest = sources[name]
        photos = photo_results.get(name)
        document["results"][name] = {
            "model": str(model),
            "fingerprint": digest,
            **plain(metrics),
            "photos": None if photos is None else plain(photos),
        }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(document, indent=1) + "\n")


def column_of(document: dict, digest: str) -> dict:
    """The metrics in a file of `write_json` that belong to the model with this fingerprint.

    Raises ValueError for files of another schema and when that model was not measured.
    """
    if document.get("schema") != SCHEMA:
        raise ValueError(f"the metrics are of schema {document.get('schema')}, not {SCHEMA}; measure again.")
    for metrics in document["results"].values():
        if metrics["fingerprint"] == digest:
            return metrics
    measured = ", ".join(f"{f['model']} {f['fingerprint']}" for f in document["results"].values())
    raise ValueError(f"the metrics are of {measured}, not of the model {digest}; run `python -m export.evaluation`.")
