"""Compares input sizes, crops of people and key frames for people of any size: cost and gain.

Data: rendered people of 640 x 512 that no training saw, some small, tilted or in crowds; photographs, with labels by
other networks; and moments that four calibrated cameras saw (`export.evaluation.views`). All settings alternate.
"""

from __future__ import annotations

import statistics
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from tqdm import tqdm

from benchmarks.sweep import BLOCK, Column, Replay, Setting, pareto
from export.evaluation import photos, views
from export.evaluation.json_values import plain
from export.evaluation.measure import Tally
from export.evaluation.photos import PhotoSet
from export.shards import LabelledImage
from export.teachers.label import PhotoLabels

SIDES = (256, 288, 384, 480, 640)
CROPS = {
    "": {},
    ", crops of the small and leaning": {"person_crops": 1, "person_crop_px": 192},
    ", crops of all": {"person_crops": 2, "person_crop_px": 192},
    ", crops of all, 256 px": {"person_crops": 2, "person_crop_px": 256},
}
KEY_FRAMES = 4
# Metrics of each data set for which larger is better, and their names in the report.
METRICS = {
    "rendered": {"part": "part", "mask": "mask IoU", "side": "left/right", "gps": "AP by GPS"},
    "photographs": {"recall": "recall at P .9", "mask": "mask IoU", "part": "part", "side": "left/right"},
    "views": {"mask": "mask IoU", "part": "part", "side": "left/right", "gain": "gain"},
}


@dataclass(frozen=True)
class Pictures:
    """rendered: with surface points. photographs, moments: with labels by teachers (either may be missing)."""

    rendered: list[LabelledImage]
    photographs: PhotoSet
    moments: PhotoSet
    cameras: list[views.CalibratedCamera] = field(default_factory=list)


def settings() -> list[Setting]:
    """Returns the measured settings."""
    made = []
    for side in SIDES:
        for said, options in CROPS.items():
            made.append(Setting(f"{side} px{said}", said or "no crops", options={"long_side_px": side, **options}))
    for said in ("", ", crops of all"):
        options = {"long_side_px": 288, "key_frame_interval": KEY_FRAMES, **CROPS[said]}
        made.append(Setting(f"288 px{said}, key frame every {KEY_FRAMES}", "key frames", options=options))
    return made


def measure(pictures: Pictures, bundle: Path, table: object, threshold: float, threads: int = 2) -> list[dict]:
    """Returns for each setting its name, axis, milliseconds a frame (median over all images) and metrics by data
    set."""
    wanted = settings()
    columns = [Column(setting, bundle, threads) for setting in wanted]
    photographs = [photos.read_photo(path) for path in pictures.photographs.photos]
    moments = [photos.read_photo(path) for path in pictures.moments.photos]
    every = [image.image for image in pictures.rendered] + photographs + moments
    with tqdm(total=len(every) * len(columns), desc="people at any size", unit="image", disable=None) as bar:
        for start in range(0, len(every), BLOCK):
            for column in columns:
                for k, image in enumerate(every[start : start + BLOCK]):
                    column.run(image, counted=k > 0)
                    bar.update()
    rows = []
    for column in columns:
        column.close()
        backend = Replay(column, "int8", bundle, threshold)
        row = {"setting": column.setting.name, "axis": column.setting.axis}
        row["ms"] = round(statistics.median(column.ms), 3)
        row["rendered"] = rendered_metrics(backend, pictures.rendered, table)
        row["photographs"] = photograph_metrics(backend, pictures.photographs, photographs)
        row["views"] = view_metrics(backend, pictures, moments)
        rows.append(plain(row))
    return rows


def rendered_metrics(backend: Replay, images: list[LabelledImage], table: object) -> dict[str, float] | None:
    if not images:
        return None
    tally = Tally(backend.threshold)
    for image in images:
        tally.add(backend, image)
    found = tally.metrics(table)
    return {"part": found.part_accuracy, "mask": found.mask_iou, "side": found.left_right, "gps": found.ap_gps}


def photograph_metrics(backend: Replay, chosen: PhotoSet, images: list[np.ndarray]) -> dict[str, float] | None:
    if not images:
        return None
    tally = photos.Tally(backend.threshold)
    for path, image in zip(chosen.photos, images, strict=True):
        tally.add(path.name, backend.predict(image), PhotoLabels.load(chosen.labels / f"{path.stem}.npz"))
    found = tally.metrics()
    return {"recall": found.recall_at_precision, "mask": found.mask_iou, "part": found.part_at_landmark,
            "side": found.left_right}  # fmt: skip


def view_metrics(backend: Replay, pictures: Pictures, images: list[np.ndarray]) -> dict[str, float] | None:
    if not images:
        return None
    answers = iter([backend.predict(image) for image in images])
    judged, tally = views.judge(lambda _: next(answers), backend.threshold, pictures.moments, pictures.cameras)
    found = tally.metrics()
    return {"mask": found.mask_iou, "part": found.part_at_landmark, "side": found.left_right, "gain": judged.gain}


def draw(document: dict) -> plt.Figure:
    """Plots part accuracy of each data set against run time."""
    rows = document["person_sizes"]
    known = [name for name in METRICS if rows[0][name]]
    figure, axes = plt.subplots(1, len(known), figsize=(6 * len(known), 5), squeeze=False)
    for axis, name in zip(axes[0], known, strict=True):
        points = [(row["ms"], 1 - row[name]["part"]) for row in rows]
        front = pareto(points)
        axis.plot(*zip(*(points[k] for k in front), strict=True), color="0.7", zorder=0,
                  label="no other is faster and better")  # fmt: skip
        for kind in dict.fromkeys(row["axis"] for row in rows):
            chosen = [point for point, row in zip(points, rows, strict=True) if row["axis"] == kind]
            axis.plot(*zip(*chosen, strict=True), "o" if kind == "key frames" else "o-", label=kind.removeprefix(", "))
        for k in front:
            axis.annotate(rows[k]["setting"].split(",")[0], points[k], fontsize=7, xytext=(3, 4),
                          textcoords="offset points")  # fmt: skip
        axis.set(title=name, xlabel="milliseconds a frame (median)", ylabel="1 - part accuracy", xscale="log")
        for direction in (axis.xaxis.set_major_formatter, axis.xaxis.set_minor_formatter):
            direction("{x:g}")
        axis.grid(alpha=0.3, which="both")
    axes[0][0].legend(fontsize=7)
    figure.tight_layout()
    return figure


def section(rows: list[dict]) -> tuple[str, list]:
    """Returns the title and the parts of the section."""
    known = [name for name in METRICS if rows[0][name]]
    columns = [(name, key) for name in known for key in METRICS[name]]
    table = [["setting", "ms", *(f"{name}: {METRICS[name][key]}" for name, key in columns)]]
    for row in rows:
        metrics = (row[name][key] for name, key in columns)
        table.append([row["setting"], f"{row['ms']:.1f}", *("-" if x is None else f"{x:.3f}" for x in metrics)])
    missing = ", ".join(name for name in METRICS if name not in known)
    return "People at any size", [
        ("people-at-any-size.png", "Input size, crops of people and key frames, on images that no training saw."),
        "Rendered people of 640 x 512, a third of them from behind, many tilted, small or in crowds; photographs, "
        "scored with labels of other networks; a person seen by four calibrated cameras at five moments (gain: "
        "how much nearer points of equal part, U and V lie to each other's epipolar lines than points of the same part "
        "paired at random). The time is the median over all these images.",
        *([f"Not measured: {missing}, because labels are missing (python -m export.teachers)."] if missing else []),
        table,
    ]
