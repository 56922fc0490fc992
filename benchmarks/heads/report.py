"""Tables of what `quality.py` measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from statistics import fmean, median

FOCAL_WITHIN = 0.2
LONG_ENOUGH_S = 1.0  # from then on more time must not make it worse
YAWS_DEG = (0, 15, 30, 45)
_HEADER = (
    "seconds", "found", "face, mm", "by mean head", "head, mm", "by mean head", "not aligned, mm", "by mean head",
    "normals, deg", "size off by", "focal within 20 %", "camera rotated by", "steps", "fit, s",
)  # fmt: skip

_HOW = """Distances go from points of the true surface, above the cut and seen from outside, to the mesh that the
library gives, after the true head was moved, rotated and scaled to where it fits best: by its face for the face (95 mm
around the tip of the nose), by all for the head; *not aligned*: as the library gives it. All are means over heads. *By
mean head*: divided by the same of the head that the prior has before it sees a photo. *Normals*: the true mesh itself
has 6 to 10 degrees, since its normals are smooth and its triangles flat. *Size off by*: the median over heads, with the
sign left out; *camera rotated by*: the median angle to the true camera, in frames that hold a head by its skull. Photos
are rendered, in front of photographs, from up to 45° to the side; the library is given the head's box"""


def table(header: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    return "\n".join(f"| {' | '.join(line)} |" for line in (header, ["---"] * len(header), *lines))


def found(rows: Sequence[Mapping]) -> list[Mapping]:
    """Rows of heads that were fitted."""
    return [row for row in rows if "missing" not in row]


def ratio(rows: Sequence[Mapping], what: str) -> float:
    """Mean distance by that of the mean head on the same heads."""
    return fmean(row[what] for row in rows) / fmean(row[f"mean_{what}"] for row in rows)


def focal_within(rows: Sequence[Mapping]) -> float:
    """The fraction of heads whose focal length is right to 20 %."""
    return fmean(abs(row["focal_ratio"] - 1) <= FOCAL_WITHIN for row in rows if row["focal_ratio"])


def over(values: Mapping[float, float]) -> float:
    """How far the error, by seconds, rises above its lowest once there was time enough, as a fraction."""
    long = [value for asked, value in values.items() if asked >= LONG_ENOUGH_S]
    return max(long) / min(long) - 1 if long else 0.0


def by_seconds(rows: Sequence[Mapping]) -> str:
    """One line a time of fitting, after the mean head's."""
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


def by_yaw(rows: Sequence[Mapping], at_s: float) -> str:
    """From how far to the side the photo was taken, at one time of fitting."""
    own = found([row for row in rows if row["asked_s"] == at_s])
    lines = []
    for low, high in pairwise(YAWS_DEG):
        some = [row for row in own if low <= abs(row["yaw_deg"]) < high or abs(row["yaw_deg"]) == high == YAWS_DEG[-1]]
        if some:
            lines.append(
                [f"{low} to {high}°", str(len(some)), f"{fmean(r['face_mm'] for r in some):.2f}",
                 f"{ratio(some, 'face_mm'):.2f}", f"{fmean(r['head_mm'] for r in some):.2f}",
                 f"{ratio(some, 'head_mm'):.2f}"]
            )  # fmt: skip
    return table(("yaw", "heads", "face, mm", "by mean head", "head, mm", "by mean head"), lines)


def targets(rows: Sequence[Mapping], at_s: float) -> str:
    """Figures beside what is aimed at; what was not measured is left out."""
    sets: dict[str, list[Mapping]] = {}
    for row in found(rows):
        sets.setdefault(row["set"], []).append(row)
    lines = []

    def add(name: str, what: str, figure: Callable[[list[Mapping]], float], gate: float, stretch: float, sign: str):
        own = [row for row in sets.get(name, []) if row["asked_s"] == at_s]
        if not own:
            return
        value = figure(own)
        kept = value >= gate if sign == "≥" else value <= gate
        best = value >= stretch if sign == "≥" else value <= stretch
        state = "stretch" if best else "met" if kept else "missed"
        lines.append([f"{name}: {what}", f"{value:.2f}", f"{sign} {gate:g}", f"{sign} {stretch:g}", state])

    one, three, other = "one photo", "three photos", "other maker's heads, one photo"
    add(one, "face, mm", lambda own: fmean(r["face_mm"] for r in own), 1.8, 1.3, "≤")
    add(one, "face by mean head", lambda own: ratio(own, "face_mm"), 0.7, 0.5, "≤")
    add(one, "head by mean head", lambda own: ratio(own, "head_mm"), 0.65, 0.5, "≤")
    add(three, "face, mm", lambda own: fmean(r["face_mm"] for r in own), 1.5, 1.0, "≤")
    add(three, "head by mean head", lambda own: ratio(own, "head_mm"), 0.5, 0.4, "≤")
    add(other, "face by mean head", lambda own: ratio(own, "face_mm"), 0.9, 0.75, "≤")
    add(one, "focal length within 20 %, of photos", focal_within, 0.7, 0.85, "≥")
    add(one, "rotation of the camera, median, deg", lambda own: median(r["rotation_deg"] for r in own), 4, 2, "≤")
    for what in ("face", "head"):
        by_time: dict[float, list[float]] = {}
        for row in sets.get(one, []):
            by_time.setdefault(row["asked_s"], []).append(row[f"{what}_mm"])
        means = {asked: fmean(values) for asked, values in by_time.items()}
        if sum(asked >= LONG_ENOUGH_S for asked in means) > 1:
            rise = f"{what}, error after 1 s or more above its lowest, %"
            add(one, rise, lambda _, means=means: 100 * over(means), 5, 2, "≤")
    return table(("what", "figure", "gate", "stretch", "state"), lines)


def beside(rows: Sequence[Mapping], bundles: Sequence[str], at_s: float) -> str:
    """Further bundles beside the first: how much farther the first is off, on heads that both found."""
    lines = []
    own = {(r["bundle"], r["set"], r["head"]): r for r in found(rows) if r["asked_s"] == at_s}
    for other in bundles[1:]:
        for name in dict.fromkeys(row["set"] for row in rows):
            both = [
                (row, own[other, name, head])
                for (bundle, its, head), row in own.items()
                if bundle == bundles[0] and its == name and (other, name, head) in own
            ]
            if both:
                loss = [fmean(a[what] - b[what] for a, b in both) for what in ("face_mm", "head_mm")]
                lines.append([other, name, str(len(both)), *(f"{value:+.3f}" for value in loss)])
    return table((f"{bundles[0]} beside", "set", "heads", "face, mm more", "head, mm more"), lines)


def page(measured: Mapping, sheet: str = "") -> str:
    """The whole report, Markdown. sheet: the picture's name, in the page's folder."""
    at_s, bundles, machine = measured["at_s"], measured["bundles"], measured["machine"]
    rows = [row for row in measured["rows"] if row["bundle"] == bundles[0]]
    parts = [
        "# Heads from photos: how far from the true ones",
        f"Bundle {bundles[0]}; {machine['processor']}, {machine['cores']} cores. Written by `python -m "
        "benchmarks.heads` ([benchmarks/heads](../../benchmarks/heads/README.md)).",
        f"{_HOW} {'and the focal length' if measured.get('known_focal') else 'and knows nothing of the camera'}.",
        f"## Targets, after {at_s:g} s",
        targets(rows, at_s),
    ]
    for name in dict.fromkeys(row["set"] for row in rows):
        own = [row for row in rows if row["set"] == name]
        parts += [f"## {name[0].upper()}{name[1:]}", by_seconds(own)]
        if "three" not in name:
            parts += [f"By the camera's yaw, after {at_s:g} s:", by_yaw(own, at_s)]
        lost = {row["head"]: row["missing"] for row in own if "missing" in row}
        parts += [f"Not found: {head}: {why}" for head, why in lost.items()]
    if sheet:
        parts += [
            "## To look at",
            f"![Photo, mesh over it, its normals, two new views, and the true head from there]({sheet})",
            f"Of each set with one photo the best, the median and the worst by the whole head, after {at_s:g} s; then "
            "real photographs.",
        ]
    if len(bundles) > 1:
        parts += [f"## Other bundles, after {at_s:g} s", beside(measured["rows"], bundles, at_s)]
    return "\n\n".join(parts) + "\n"
