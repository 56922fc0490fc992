"""Writes the parts of the section "Edges" on fused views, the real box and real scans."""

from __future__ import annotations

import statistics

from benchmarks.edges import fused

SAYS = {"clean": "exact depth", "tof": "time of flight", "stereo": "stereo (0.08 px)"}


def carton_parts(found: dict | None) -> list:
    if found is None:
        return []
    table = [["real box, depth from 42 photos, fused: edge", "found of it, %", "off, px (median)"]]
    for row in found["edges"]:
        off = "" if row["median_px"] is None else f"{row['median_px']:.1f}"
        table.append([row["edge"], f"{100 * row['part']:.0f}", off])
    angles = "no angle" if found["angle_deg"] is None else (
        f"{found['angles']} angles between found lines that meet, off 90 degrees by "
        f"{found['median_angle_deg']:.1f} in the median and {found['angle_deg']:.1f} at most"
    )  # fmt: skip
    return [
        table,
        f"{found['found']} of 12 edges have a curve within 3 px along half of their length "
        f"({found['curves']} curves in all); {angles}. A to D are the corners in front, clockwise from above on the "
        "left; E to H are the corners behind them. Corners were marked by hand in three photos, which show nine edges.",
    ]


def fusion_parts(found: dict | None, timed: dict | None) -> list:
    """Returns the parts of fused.measure and fused.measure_times, if they have run."""
    return fusion_error_parts(found) + fusion_time_parts(timed)


def fusion_time_parts(timed: dict | None) -> list:
    if timed is None or not timed["times"]:
        return []
    seconds, cpu_seconds, points = ([row[key] for row in timed["times"]] for key in ("s", "cpu_s", "points"))
    return [
        f"Fusing {fused.TIMED_VIEWS} views of {len(seconds)} solids, time of flight, took "
        f"{statistics.median(seconds):.1f} s in the median ({min(seconds):.1f} to {max(seconds):.1f}; of the CPU "
        f"{statistics.median(cpu_seconds):.1f}, {min(cpu_seconds):.1f} to {max(cpu_seconds):.1f}), {min(points):,} to "
        f"{max(points):,} points: curves of each view, points, and curves in the world, without the network."
    ]


def fusion_error_parts(found: dict | None) -> list:
    if found is None:
        return []
    errors = [["fused views, 320 x 240", "one view, RMSE, r", f"{fused.VIEWS} fused, r", "ratio"]]
    for row in found["errors"]:
        errors.append([SAYS[row["level"]], f"{row['one_r']:.2f}", f"{row['fused_r']:.2f}", f"{row['ratio']:.2f}"])
    says = [
        f"Pixels of solids of `val`, seen from {fused.VIEWS} cameras, against the nearest sharp curve that any view "
        "sees. A fused point stands for its pixels. All distances are clipped at the limit of the point, 16 footprints "
        "of its nearest view."
    ]
    if found["memory"]:
        says.append(
            f"{found['memory']['points']:,} points of {fused.TIMED_VIEWS} views of 640 x 480 added "
            f"{found['memory']['memory_mb']:.0f} MB to the peak of a process after its network had run."
        )
    if found["missing"]:
        says.append(f"Left out: {'; '.join(found['missing'])}.")
    curves = [["curves of these solids: precision, recall, F", "one view", f"{fused.VIEWS} fused"]]
    for row in found["curves"]:
        scores = [[f"{row[way][key]:.2f}" for key in ("precision", "recall", "f_score")] for way in ("alone", "fused")]
        curves.append([SAYS[row["level"]], *(", ".join(score) for score in scores)])
    return [errors, curves, " ".join(says)]


def round_parts(found: dict | None) -> list:
    if found is None:
        return []
    table = [["scans of round toys", "pixels", "within r of an edge, %", "within 4 r, %"]]
    for row in [*found["scans"], {"name": "both", **found}]:
        table.append(
            [row["name"], f"{row['pixels']:,}", f"{100 * row['under_1r']:.2f}", f"{100 * row['under_4r']:.1f}"]
        )
    return [
        table,
        "Pixels of real scans without an edge, at least 17 px from their borders; each edge there is a false positive.",
    ]
