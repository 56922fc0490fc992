"""The evaluation's results as one image."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes

from export.evaluation.average_precision import THRESHOLDS
from export.evaluation.calibration import BINS
from export.evaluation.measure import Metrics
from export.evaluation.photos import PhotoMetrics
from export.surface import PART_COUNT, PART_NAMES

SHARES_OF_PHOTOS = (
    ("recall, as shown", "recall_shown"),
    ("precision, as shown", "precision_shown"),
    ("mask IoU", "mask_iou"),
    ("part at landmark", "part_at_landmark"),
    ("left/right", "left_right"),
)


def write_image(path: Path, results: dict[str, Metrics], photo_results: dict[str, PhotoMetrics]) -> None:
    """AP, calibration, groups and photographs above; the body parts below. One colour a column of the table; groups
    are those of the last column. photo_results may be empty."""
    figure = pyplot.figure(figsize=(18, 14), layout="constrained")
    above, below = figure.subfigures(2, 1, height_ratios=(1, 1.4), hspace=0.03)
    precision, calibration, groups, photos = above.subplots(1, 4)
    _draw_precision(precision, results)
    _draw_calibration(calibration, results)
    _draw_groups(groups, *list(results.items())[-1])
    _draw_photos(photos, photo_results)
    _draw_parts(*below.subplots(2, 1, sharex=True), results)
    first = next(iter(results.values()))
    figure.suptitle(f"{first.images} rendered images, {first.people} people", fontsize=13)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=90)
    pyplot.close(figure)


def _draw_precision(axes: Axes, results: dict[str, Metrics]) -> None:
    for k, (name, metrics) in enumerate(results.items()):
        curves = (("box", "--", metrics.ap_box_by_threshold), ("GPS", "-", metrics.ap_gps_by_threshold))
        curves += (("GPSm", ":", metrics.ap_gpsm_by_threshold),)
        for kind, style, values in curves:
            axes.plot(THRESHOLDS, values, style, color=f"C{k}", label=f"{name}: {kind}")
    axes.set(title="average precision", xlabel="similarity threshold", ylim=(0, 1), xlim=(0.5, 0.95))
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)


def _draw_calibration(axes: Axes, results: dict[str, Metrics]) -> None:
    axes.plot([0, 1], [0, 1], color="0.6", linewidth=1)
    for k, (name, metrics) in enumerate(results.items()):
        table = metrics.calibration
        label = f"{name}: expected error {table.expected_error:.3f}"
        axes.plot(table.mean_score, table.fraction_right, "o-", color=f"C{k}", label=label)
    counts = axes.twinx()
    counts.bar((np.arange(BINS) + 0.5) / BINS, table.count, 0.9 / BINS, color=f"C{k}", alpha=0.2)
    counts.set_ylim(0, 4 * max(table.count))
    counts.set_yticks([0, max(table.count)])
    counts.tick_params(labelsize=8)
    counts.set_ylabel(f"bars: detections, {name}", fontsize=8, loc="bottom")
    axes.set(title="calibration", xlabel="score", ylabel="fraction of right boxes, IoU .5", xlim=(0, 1), ylim=(0, 1))
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="upper left")


def _draw_groups(axes: Axes, name: str, metrics: Metrics) -> None:
    groups = metrics.groups
    place = np.arange(len(groups))
    for k, (field, label) in enumerate(
        (("recall", "recall at IoU .5"), ("part_accuracy", "part accuracy"), ("mask_iou", "mask IoU"))
    ):
        values = [getattr(group, field) for group in groups]
        axes.barh(place + (k - 1) * 0.27, values, 0.25, color=("0.3", "C2", "C4")[k], label=label)
    labels = [f"{group.name} ({group.people})" for group in groups]
    axes.set_yticks(place, labels, fontsize=8)
    for k in range(1, len(groups)):
        if groups[k].by != groups[k - 1].by:
            axes.axhline(k - 0.5, color="0.5", linewidth=0.8)
    axes.set(title=f"by group of people: {name}", xlim=(0, 1), ylim=(len(groups) - 0.5, -0.5))
    axes.grid(axis="x", alpha=0.3)
    axes.legend(fontsize=8, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.05))


def _draw_photos(axes: Axes, results: dict[str, PhotoMetrics]) -> None:
    axes.set_title("real photographs")
    if not results:
        axes.text(0.5, 0.5, "not measured", ha="center", va="center", transform=axes.transAxes)
        axes.set_axis_off()
        return
    place = np.arange(len(SHARES_OF_PHOTOS))
    width = 0.8 / len(results)
    for k, (name, metrics) in enumerate(results.items()):
        values = [getattr(metrics, field) for _, field in SHARES_OF_PHOTOS]
        label = f"{name}; {metrics.false_people:.2f} false people a photo without any"
        axes.bar(place + (k - (len(results) - 1) / 2) * width, values, width, color=f"C{k}", label=label)
    axes.set_xticks(place, [label.replace(" ", "\n") for label, _ in SHARES_OF_PHOTOS], fontsize=8)
    axes.set(ylim=(0, 1), xlabel=f"{metrics.photos} photos, {metrics.people} people, {metrics.masks} with a mask")
    axes.grid(axis="y", alpha=0.3)
    axes.legend(fontsize=7, loc="upper right")


def _draw_parts(above: Axes, below: Axes, results: dict[str, Metrics]) -> None:
    """Recall (bars) and precision (dots) of each part above, its surface error below."""
    width = 0.8 / len(results)
    for k, (name, metrics) in enumerate(results.items()):
        place = np.arange(1, PART_COUNT + 1) + (k - (len(results) - 1) / 2) * width
        above.bar(place, metrics.part_recall[1:], width, color=f"C{k}", alpha=0.7, label=f"{name}: recall")
        above.plot(place, metrics.part_precision[1:], "o", color=f"C{k}", markeredgecolor="k", markersize=5,
                   label=f"{name}: precision")  # fmt: skip
        below.bar(place, metrics.part_error_cm[1:], width, color=f"C{k}", alpha=0.7)
    above.set(title="body parts", ylabel="fraction of pixels", ylim=(0, 1))
    below.set_ylabel("median surface error, cm")
    above.legend(fontsize=8, ncols=len(results))
    below.set_xlim(0.4, PART_COUNT + 0.6)
    below.set_xticks(range(1, PART_COUNT + 1), PART_NAMES[1:], rotation=90, fontsize=8)
    for axes in (above, below):
        axes.grid(axis="y", alpha=0.3)
