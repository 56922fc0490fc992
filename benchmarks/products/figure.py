"""Error against time of all products: people in photographs, masks and joints in clips."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

# (title, section of the metrics, metric, section of the times, label of the y axis)
PANELS = (
    ("Photographs: people", "photographs", "found", "photographs", "people who are missed"),
    ("Clips: masks, missed people count as 0", "clips", "mask_iou", "clips", "1 - mask IoU"),
    ("Clips: limb joints, missed people are wrong", "clips", "joints", "clips", "joints farther than 0.1 torsos"),
    ("Clips: limb joints, people whom all find", "clips", "common_joints", "clips", "joints farther than 0.1 torsos"),
)
_COLOURS = ("tab:red", "tab:orange", "tab:blue", "tab:cyan", "tab:purple", "tab:green")


def points_of(document: dict, metrics: str, metric: str, times: str) -> dict[str, list[tuple[int, float, float]]]:
    """(cores, milliseconds, error) of each product that has both."""
    points: dict[str, list[tuple[int, float, float]]] = {}
    for name, own in document.get(metrics, {}).get("products", {}).items():
        measured = document.get("times", {}).get("products", {}).get(name, {}).get(times, {})
        if own.get(metric) is not None:
            found = [(int(cores), row["ms"], 1 - own[metric]) for cores, row in sorted(measured.items())]
            if found:
                points[name] = found
    return points


def draw(document: dict) -> plt.Figure | None:
    """None without times."""
    panels = [points_of(document, *panel[1:4]) for panel in PANELS]
    if not any(panels):
        return None
    names = list(dict.fromkeys(name for points in panels for name in points))
    colours = {name: _COLOURS[k % len(_COLOURS)] for k, name in enumerate(names)}
    figure, axes = plt.subplots(2, 2, figsize=(12, 9))
    for axis, points, (title, _, _, times, label) in zip(axes.flat, panels, PANELS, strict=True):
        for name, own in points.items():
            _, ms, error = zip(*own, strict=True)
            axis.plot(ms, error, color=colours[name], linewidth=1, zorder=1)
            for cores, x, y in own:
                face = colours[name] if cores > 1 else "white"
                axis.scatter(x, y, s=60, facecolor=face, edgecolor=colours[name], zorder=2)
        kind = "photograph" if times == "photographs" else "frame"
        axis.set(title=title, xlabel=f"milliseconds a {kind} (median)", ylabel=label, xscale="log")
        for direction in (axis.xaxis.set_major_formatter, axis.xaxis.set_minor_formatter):
            direction("{x:g}")
        axis.tick_params(axis="x", which="both", labelsize=8)
        axis.margins(x=0.15)
        axis.set_ylim(0, 1.15 * max((y for own in points.values() for _, _, y in own), default=1))
        axis.grid(alpha=0.3, which="both")
    handles = [plt.Line2D([], [], color=colours[name], marker="o", label=name) for name in names]
    for label, face in (("2 cores", "0.4"), ("1 core", "white")):
        handles.append(plt.Line2D([], [], color="0.4", marker="o", markerfacecolor=face, linestyle="", label=label))
    figure.legend(handles=handles, loc="lower center", ncols=5, frameon=False, fontsize=9)
    figure.tight_layout(rect=(0, 0.06, 1, 1))
    return figure


def write(document: dict, path: Path) -> bool:
    """Whether there was something to draw."""
    figure = draw(document)
    if figure is None:
        return False
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return True
