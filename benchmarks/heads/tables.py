"""Writes tables in Markdown: by seconds of fitting, by traits of heads, beside baselines."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from statistics import fmean, median

FOCAL_WITHIN = 0.2
MIN_STEPS = 20  # fits that time ends earlier are not reliable
YAWS_DEG, SIZES_PX = (0, 15, 30, 45), (0, 120, 150, 180, 1000)
_HEADER = (
    "seconds", "found", "face, mm", "by mean head", "head, mm", "by mean head", "not aligned, mm", "by mean head",
    "normals, deg", "size off by", "focal within 20 %", "camera rotated by", "steps", "fit, s",
)  # fmt: skip


def table(header: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    return "\n".join(f"| {' | '.join(line)} |" for line in (header, ["---"] * len(header), *lines))


def found(rows: Sequence[Mapping]) -> list[Mapping]:
    """Returns the rows of heads that were fitted."""
    return [row for row in rows if "missing" not in row]


def having(rows: Sequence[Mapping], *keys: str) -> list[Mapping]:
    """Returns the rows of fitted heads with all these values."""
    return [row for row in found(rows) if all(row.get(key) is not None for key in keys)]


def ratio(rows: Sequence[Mapping], what: str, baseline: str = "mean") -> float:
    """Returns the mean metric divided by that of a baseline on the same heads."""
    return fmean(row[what] for row in rows) / fmean(row[f"{baseline}_{what}"] for row in rows)


def focal_within(rows: Sequence[Mapping]) -> float:
    """Returns the fraction of heads with a focal length within 20 % of the true one."""
    return fmean(abs(row["focal_ratio"] - 1) <= FOCAL_WITHIN for row in rows if row["focal_ratio"])


def ended_too_early(rows: Sequence[Mapping], at_s: float) -> bool:
    """Returns whether time ended half of the fits too early."""
    steps = [row["steps"] for row in found(rows) if row["asked_s"] == at_s > 0]
    return bool(steps) and median(steps) < MIN_STEPS


def by_seconds(rows: Sequence[Mapping]) -> str:
    """Returns one line for each time of fitting, after the mean head's line."""
    times = sorted({row["asked_s"] for row in rows})
    first = found([row for row in rows if row["asked_s"] == times[0]])
    lines = []
    if first:
        mean = {key: fmean(row[f"mean_{key}"] for row in first) for key in ("face_mm", "head_mm", "unaligned_mm")}
        degrees = [row["mean_normals_deg"] for row in first if row["mean_normals_deg"] is not None]
        lines.append(
            ["mean head", "", f"{mean['face_mm']:.2f}", "1", f"{mean['head_mm']:.2f}", "1",
             f"{mean['unaligned_mm']:.2f}", "1", f"{fmean(degrees):.1f}" if degrees else "", *[""] * 5]
        )  # fmt: skip
    for asked in times:
        every = [row for row in rows if row["asked_s"] == asked]
        own = found(every)
        line = [f"{asked:g}", f"{len(own)} of {len(every)}"]
        if own:
            degrees = [row["normals_deg"] for row in own if row["normals_deg"] is not None]
            for what in ("face_mm", "head_mm", "unaligned_mm"):
                line += [f"{fmean(row[what] for row in own):.2f}", f"{ratio(own, what):.2f}"]
            line += [
                f"{fmean(degrees):.1f}" if degrees else "",
                f"{100 * median(abs(row['scale'] - 1) for row in own):.1f} %",
                f"{100 * focal_within(own):.0f} %",
                "" if own[0]["rotation_deg"] is None else f"{median(row['rotation_deg'] for row in own):.1f}°",
                f"{median(row['steps'] for row in own):.0f}",
                f"{median(row['fit_s'] for row in own):.2f}",
            ]
        lines.append(line + [""] * (len(_HEADER) - len(line)))
    return table(_HEADER, lines)


def by_group(rows: Sequence[Mapping], header: str, group_of: Callable[[Mapping], str | None]) -> str:
    """Returns one line for each group, at one time of fitting; empty if there are none."""
    groups: dict[str, list[Mapping]] = {}
    for row in found(rows):
        groups.setdefault(group_of(row) or "", []).append(row)
    groups.pop("", None)
    lines = [
        [name, str(len(own)), f"{fmean(r['face_mm'] for r in own):.2f}", f"{ratio(own, 'face_mm'):.2f}",
         f"{fmean(r['head_mm'] for r in own):.2f}", f"{ratio(own, 'head_mm'):.2f}"]
        for name, own in sorted(groups.items(), key=lambda item: _order(item[0]))
    ]  # fmt: skip
    return table((header, "heads", "face, mm", "by mean head", "head, mm", "by mean head"), lines) if lines else ""


def _order(name: str) -> tuple[float, str]:
    """Sorts numbers by value, then words."""
    start = name.split()[0]
    return (float(start), "") if start.isdigit() else (float("inf"), name)


def span_of(value: float, limits: Sequence[int], unit: str) -> str | None:
    """Names the range of a value; the last limit belongs to the last range."""
    for low, high in pairwise(limits):
        if low <= value < high or value == high == limits[-1]:
            return f"{low} to {high}{unit}"
    return None


def yaw_of(row: Mapping) -> str | None:
    return span_of(abs(row["yaw_deg"]), YAWS_DEG, "°")


def size_of(row: Mapping) -> str | None:
    return span_of(row["head_px"], SIZES_PX, " px")


PARTS = (
    ("face_mm", "face, mm"), ("inner_face_mm", "inner face, mm"), ("head_mm", "head, mm"), ("seen_mm", "seen side, mm"),
    ("unseen_mm", "unseen side, mm"), ("back_mm", "result to truth, mm"), ("normals_deg", "normals, deg"),
    ("view_psnr_db", "new views, dB"), ("view_distance", "by features"),
    ("coloured_view_psnr_db", "without texture, dB"),
)  # fmt: skip


def by_baseline(rows: Sequence[Mapping], at_s: float) -> str:
    """Returns the fitted head, at one time and at 0 s, beside all baselines, over the heads that all methods found."""
    own = [row for row in found(rows) if row["asked_s"] == at_s]
    glance = {row["head"]: row for row in found(rows) if row["asked_s"] == 0 and at_s != 0}
    names = [("mean", "mean head")]
    if having(own, "linear_head_mm"):
        names.append(("linear", "linear head, same encoder"))
    if having(own, "face_mesh_inner_face_mm"):
        names.append(("face_mesh", "MediaPipe's 468 points"))
    needed = {"linear": "linear_head_mm", "face_mesh": "face_mesh_inner_face_mm"}
    own = having(own, *(needed[name] for name, _ in names if name in needed))
    if glance:
        own = [row for row in own if row["head"] in glance]
    if not own:
        return ""
    sources: list[tuple[str, Callable[[Mapping, str], float | None]]] = [
        (label, lambda row, key, name=name: row.get(f"{name}_{key}")) for name, label in names
    ]
    if glance:
        sources.append(("encoder alone, 0 s", lambda row, key: glance[row["head"]].get(key)))
    sources.append((f"fitted, {at_s:g} s", lambda row, key: row.get(key)))
    lines = []
    for label, value_of in sources:
        values = {key: [v for row in own if (v := value_of(row, key)) is not None] for key, _ in PARTS}
        lines.append([label, *(f"{fmean(v):.2f}" if len(v) == len(own) else "" for v in values.values())])
    return table((f"{len(own)} heads", *(header for _, header in PARTS)), lines)


def by_real_face(rows: Sequence[Mapping]) -> str:
    """Returns real photographs by seconds of fitting, after the mean head."""
    times = sorted({row["asked_s"] for row in rows})
    lines = []
    for asked in times:
        every = [row for row in rows if row["asked_s"] == asked]
        own, masked = found(every), having(every, "matte_iou", "mean_matte_iou")
        for prefix, label in (("mean_", "mean head, posed by the encoder"), ("", f"{asked:g} s")):
            if own and (not prefix or asked == times[0]):
                iou = f"{fmean(r[f'{prefix}matte_iou'] for r in masked):.3f} ({len(masked)})" if masked else ""
                lines.append(
                    [label, f"{len(own)} of {len(every)}", f"{fmean(r[f'{prefix}points_px'] for r in own):.2f}",
                     f"{100 * fmean(r[f'{prefix}points'] for r in own):.2f} %", iou]
                )  # fmt: skip
    return table(("", "faces", "points, px", "by the eyes' distance", "silhouette, IoU (faces with a mask)"), lines)
