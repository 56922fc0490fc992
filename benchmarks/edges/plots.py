"""Draws the images of the section on edges: error against time, error against noise, and a contact sheet of fields."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import matplotlib.ticker
import numpy as np

from benchmarks.edges.baselines import BASELINES
from benchmarks.edges.methods import SHIPPED
from benchmarks.sweep import pareto
from export.edges.validation import field_image, slope_image

COLOURS = {"shipped": "black", "savings": "tab:green", "networks": "tab:blue", "without a network": "0.55"}
SHEET = "edges-sheet.jpg"


def write(measured: dict, folder: Path) -> list[Path]:
    """Writes the images of the measured values into `folder`; the contact sheet exists already."""
    plots: dict[str, Callable[[dict], plt.Figure]] = {}
    if "speed" in measured:
        plots["edges-error-against-run-time.png"] = error_against_time
    if measured.get("groups"):
        plots["edges-groups.png"] = groups
    written = []
    for name, draw in plots.items():
        figure = draw(measured)
        figure.savefig(folder / name, dpi=110, bbox_inches="tight")
        plt.close(figure)
        written.append(folder / name)
    return written + ([folder / measured["sheet"]] if measured.get("sheet") else [])


def front_of(rows: list[dict]) -> list[dict]:
    """Returns the Pareto front of time and error, by increasing time."""
    return [rows[k] for k in pareto([(row["ms"], row["rmse_r"]) for row in rows])]


def error_against_time(measured: dict) -> plt.Figure:
    rows = measured["speed"]
    figure, axis = plt.subplots(figsize=(10, 6))
    front = front_of(rows)
    axis.plot([row["ms"] for row in front], [row["rmse_r"] for row in front], color="0.7", zorder=0,
              label="Pareto front")  # fmt: skip
    for kind, colour in COLOURS.items():
        chosen = [row for row in rows if row["axis"] == kind]
        if chosen:
            axis.scatter([r["ms"] for r in chosen], [r["rmse_r"] for r in chosen], color=colour, label=kind)
    for row in rows:
        if row in front or row["axis"] == "without a network":
            axis.annotate(row["setting"], (row["ms"], row["rmse_r"]), fontsize=7, rotation=15, xytext=(3, 4),
                          textcoords="offset points")  # fmt: skip
    axis.set(xlabel="milliseconds a frame of 640 x 480 (median)", ylabel="RMSE, r (mean of clean, tof, stereo)",
             xscale="log")  # fmt: skip
    axis.xaxis.set_major_locator(matplotlib.ticker.LogLocator(subs=(1, 2, 5)))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
    axis.set_ylim(bottom=0)
    axis.margins(x=0.15)
    axis.grid(alpha=0.3, which="both")
    axis.legend(fontsize=8)
    return figure


def groups(measured: dict) -> plt.Figure:
    """Plots recall within 4 r, or false positives for groups without an edge, by group of pixels."""
    rows = measured["groups"]
    axes_of = list(dict.fromkeys(row["axis"] for row in rows))
    levels = list(dict.fromkeys(row["level"] for row in rows))
    lines = -(-len(axes_of) // 3)
    figure, axes = plt.subplots(lines, 3, figsize=(12, 3.8 * lines), squeeze=False)
    for axis in axes.flat[len(axes_of) :]:
        axis.set_axis_off()
    for axis, name in zip(axes.flat, axes_of, strict=False):
        labels = list(dict.fromkeys(row["group"] for row in rows if row["axis"] == name))
        of_name = [row for row in rows if row["axis"] == name]
        key = "recall_4r" if any(row["recall_4r"] is not None for row in of_name) else "fpr_4r"
        for level in levels:
            value = {row["group"]: row[key] for row in of_name if row["level"] == level}
            points = [(k, 100 * value[g]) for k, g in enumerate(labels) if value.get(g) is not None]
            if points:
                axis.plot(*zip(*points, strict=True), "o-", label=level, markersize=4)
        axis.set_xticks(range(len(labels)), labels, rotation=40, ha="right", fontsize=7)
        what = "recall at 4 r" if key == "recall_4r" else "false positives at 4 r"
        axis.set_title(f"{what}, %, by\n{name}", fontsize=9)
        axis.set_ylim(bottom=0)
        axis.grid(alpha=0.3)
    axes[0][0].legend(fontsize=7)
    figure.tight_layout()
    return figure


def write_sheet(shown: list[dict], folder: Path) -> Path:
    """Writes a row for each view and sensor: input, true field, and the field of each method with its RMSE."""
    ways = ["network's input", "true field", SHIPPED, *BASELINES]
    figure, axes = plt.subplots(len(shown), len(ways), figsize=(2.6 * len(ways), 2.1 * len(shown)), squeeze=False,
                                layout="constrained")  # fmt: skip
    for line, row in zip(axes, shown, strict=True):
        frame, known = row["view"].frame, (row["depth"] > 0)[..., None]
        counts = frame.counts & known[..., 0]
        labelled = np.where(frame.counts[..., None], field_image(frame.distance), 60).astype(np.uint8)
        cells = {ways[0]: (slope_image(row["depth"], frame.focal_px), row["level"]), ways[1]: (labelled, "")}
        for name, distance in row["fields"].items():
            rmse = np.sqrt(np.mean((np.clip(distance, 0, None) - frame.distance)[counts] ** 2))
            cells[name] = np.where(known, field_image(distance), 0).astype(np.uint8), f"{rmse:.2f} r"
        for axis, name in zip(line, ways, strict=True):
            picture, under = cells.get(name, (np.full((2, 2, 3), 255, np.uint8), "not measured"))
            axis.imshow(picture)
            axis.set_xlabel(under, fontsize=8)
            axis.set(xticks=[], yticks=[])
    for axis, name in zip(axes[0], ways, strict=True):
        axis.set_title(name, fontsize=9)
    figure.savefig(folder / SHEET, dpi=80)
    plt.close(figure)
    return folder / SHEET
