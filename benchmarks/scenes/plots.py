"""Draws the images of the section on scenes: error against time, time of frames, and a contact sheet."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import matplotlib.ticker
import numpy as np

from benchmarks.scenes.command import STAGES
from benchmarks.scenes.quality import SHOWN
from benchmarks.scenes.speed import TARGET_SIZE
from benchmarks.sweep import pareto

COLOURS = {"shipped": "black", "baseline": "0.5", "points": "tab:blue", "size": "tab:cyan", "networks": "tab:olive",
           "precision": "tab:red", "coefficients": "tab:green", "view dependence": "tab:orange",
           "fine-tuned": "tab:purple"}  # fmt: skip
ERRORS = (("psnr_db", "PSNR, dB"), ("ssim", "SSIM"), ("distance", "distance by features (lower is better)"))
TITLES = {"as shipped": "ours"}
NAMED = ("shipped", "baseline", "fine-tuned")  # always named in the plots
SHEET = "scenes-sheet.jpg"  # JPEG, since photos as PNG would be eight times as large
MAX_ROWS = 6


def write(measured: dict, folder: Path) -> list[Path]:
    """Writes the images of the measured values into `folder`; the contact sheet exists already."""
    plots: dict[str, tuple[bool, Callable[[dict], plt.Figure]]] = {
        "scenes-quality.png": (any(row["rendered"] for row in measured["rows"]), quality),
        "scenes-frame-time.png": (bool(measured["speed"]), frame_time),
    }
    written = []
    for name, (is_there, draw) in plots.items():
        if is_there:
            figure = draw(measured)
            figure.savefig(folder / name, dpi=110, bbox_inches="tight")
            plt.close(figure)
            written.append(folder / name)
    return written + ([folder / measured["sheet"]] if measured["sheet"] else [])


def quality(measured: dict) -> plt.Figure:
    # Settings at half size are left out: they are compared with smaller photos.
    rows = [row for row in measured["rows"] if row["axis"] in COLOURS and row["axis"] != "size"]
    rows = [row for row in rows if row["rendered"] and "first_image_s" in row["rendered"]]
    errors = [(key, label) for key, label in ERRORS if any(key in row["rendered"] for row in rows)]
    figure, axes = plt.subplots(1, len(errors), figsize=(7.5 * len(errors), 6), squeeze=False)
    for axis, (key, label) in zip(axes[0], errors, strict=True):
        for kind, colour in COLOURS.items():
            chosen = [row["rendered"] for row in rows if row["axis"] == kind]
            if chosen:
                axis.scatter([f["first_image_s"] for f in chosen], [f[key] for f in chosen], color=colour, label=kind)
        points = [(row["rendered"]["first_image_s"], row["rendered"][key]) for row in rows]
        front = pareto([(seconds, value if key == "distance" else -value) for seconds, value in points])
        axis.plot(*zip(*(points[k] for k in front), strict=True), color="0.7", zorder=0,
                  label="no other is faster and better")  # fmt: skip
        for k, row in enumerate(rows):
            if k in front or row["axis"] in NAMED:
                axis.annotate(row["setting"], points[k], fontsize=7, rotation=20, xytext=(3, 4),
                              textcoords="offset points")  # fmt: skip
        axis.set(xlabel="seconds to the first image", ylabel=label, xscale="log")
        axis.xaxis.set_major_locator(matplotlib.ticker.LogLocator(subs=(1, 2, 5)))
        axis.xaxis.set_major_formatter("{x:g}")
        axis.xaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
        axis.margins(x=0.15, y=0.2)
        axis.grid(alpha=0.3, which="both")
    axes[0][0].legend(fontsize=8)
    return figure


def frame_time(measured: dict) -> plt.Figure:
    speed = measured["speed"]
    frames, usual = speed["frames"], speed["threads"]
    figure, axes = plt.subplots(1, 3, figsize=(15, 4))
    for size in sorted({tuple(row["size_px"]) for row in frames}):
        for threads in sorted({row["threads"] for row in frames}, reverse=True):
            chosen = [(row["points"] / 1e6, row["ms"]["total"]) for row in frames
                      if tuple(row["size_px"]) == size and row["threads"] == threads]  # fmt: skip
            if len(chosen) > 1:
                style = "o-" if threads == usual else "o--"
                label = f"{size[0]} x {size[1]}, {threads} thread{'s' if threads > 1 else ''}"
                axes[0].plot(*zip(*sorted(chosen), strict=True), style, label=label)
    axes[0].set(xlabel="million points in the scene", ylabel="milliseconds a frame (median)")
    axes[0].legend(fontsize=8)
    of_usual = [row for row in frames if row["threads"] == usual]
    for points in sorted({row["points"] for row in of_usual}):
        chosen = [(row["size_px"][0] * row["size_px"][1] / 1e6, row["ms"]["total"]) for row in of_usual
                  if row["points"] == points]  # fmt: skip
        if len(chosen) > 2:
            axes[1].plot(*zip(*sorted(chosen), strict=True), "o-", label=f"{points:,} points")
    axes[1].set(xlabel="megapixels of the image", ylabel="milliseconds a frame (median)")
    axes[1].legend(fontsize=8)
    stages(axes[2], [row for row in of_usual if tuple(row["size_px"]) == TARGET_SIZE])
    for axis in axes[:2]:
        axis.set_xlim(left=0)
        axis.set_ylim(bottom=0)
        axis.grid(alpha=0.3)
    figure.tight_layout()
    return figure


def stages(axis: plt.Axes, rows: list[dict]) -> None:
    rows = sorted(rows, key=lambda row: row["points"])
    for k, row in enumerate(rows):
        left = 0.0
        for stage, colour in zip(STAGES, plt.cm.tab10.colors, strict=False):
            axis.barh(k, row["ms"][stage], left=left, color=colour, label=stage if k == 0 else None)
            left += row["ms"][stage]
    axis.set_yticks(range(len(rows)), [f"{row['points']:,}" for row in rows])
    axis.set(xlabel="milliseconds by stage, 640 x 480", ylabel="points")
    axis.legend(fontsize=8)
    axis.invert_yaxis()


def write_sheet(shown: list[dict], rows: list[dict], folder: Path) -> Path | None:
    """Writes a row for each capture: its photo and the image of each method from the same camera, with its PSNR.
    Returns None without a capture."""
    if not shown:
        return None
    picked = [shown[k] for k in sorted({*np.linspace(0, len(shown) - 1, MAX_ROWS).round().astype(int).tolist()})]
    by_name = {row["setting"]: row for row in rows}
    figure, axes = plt.subplots(len(picked), 1 + len(SHOWN), figsize=(3.4 * (1 + len(SHOWN)), 2.85 * len(picked)),
                                squeeze=False, layout="constrained")  # fmt: skip
    for line, place in zip(axes, picked, strict=True):
        _cell(line[0], place["photo"], "photo", place["name"])
        for axis, name in zip(line[1:], SHOWN, strict=True):
            picture = place["pictures"].get(name)
            metrics = by_name[name]["places"].get(place["name"], {})
            under = f"{metrics['shown_psnr_db']:.1f} dB" if picture is not None else "not measured"
            # Cells without an image are white; another plain colour could be taken for an image.
            empty = np.ones_like(place["photo"])
            _cell(axis, empty if picture is None else picture, TITLES.get(name, name), under)
    for line in axes[1:]:
        for axis in line:
            axis.set_title("")
    figure.savefig(folder / SHEET, dpi=110, pil_kwargs={"quality": 88})
    plt.close(figure)
    return folder / SHEET


def _cell(axis: plt.Axes, picture: np.ndarray, title: str, under: str) -> None:
    axis.imshow(np.clip(picture, 0, 1), interpolation="antialiased")
    axis.set_title(title, fontsize=11)
    axis.set_xlabel(under, fontsize=9)
    axis.set(xticks=[], yticks=[])
    for side in axis.spines.values():
        side.set_visible(False)
