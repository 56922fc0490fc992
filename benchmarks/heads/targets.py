"""Compares measured metrics of heads with their targets."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from statistics import fmean, median

from benchmarks.heads.tables import ended_too_early, focal_within, found, having, ratio, table

LONG_ENOUGH_S = 1.0  # from then on, more time must not increase the error
ONE, THREE, OTHER = "one photo", "three photos", "other maker's heads, one photo"


def over(values: Mapping[float, float]) -> float:
    """Returns by which fraction the error, by seconds, rises above its minimum after LONG_ENOUGH_S."""
    long = [value for asked, value in values.items() if asked >= LONG_ENOUGH_S]
    return max(long) / min(long) - 1 if long else 0.0


class _Lines:
    """are_fits_whole: false if time ended the fits too early; metrics of fits and times then count as not measured."""

    def __init__(self, are_fits_whole: bool) -> None:
        self.lines: list[list[str]] = []
        self._are_fits_whole = are_fits_whole

    def add(
        self,
        what: str,
        value: float,
        target: float,
        goal: float,
        sign: str = "≤",
        digits: int = 2,
        of_fit: bool = True,
        is_measured: bool = True,
    ) -> None:
        def is_met(limit: float) -> bool:
            return value >= limit if sign == "≥" else value <= limit

        state = "goal" if is_met(goal) else "met" if is_met(target) else "missed"
        if not is_measured or (of_fit and not self._are_fits_whole):
            state = "not measured"
        self.lines.append([what, f"{value:.{digits}f}", f"{sign} {target:g}", f"{sign} {goal:g}", state])


def targets(measured: Mapping) -> str:
    """Returns the table of the first bundle; metrics that were not measured are left out."""
    rows = [row for row in measured["rows"] if row["bundle"] == measured["bundles"][0]]
    at_s = measured["at_s"]
    lines = _Lines(not ended_too_early(rows, at_s))
    of_time = [row for row in found(rows) if row["asked_s"] == at_s]

    def add(name: str, what: str, metric: Callable, target: float, goal: float, sign: str = "≤", needs=()) -> None:
        own = having([row for row in of_time if row["set"] == name], *needs)
        if own:
            lines.add(f"{name}: {what}", metric(own), target, goal, sign)

    def mean(key: str) -> Callable[[Sequence[Mapping]], float]:
        return lambda own: fmean(row[key] for row in own)

    add(ONE, "face, mm", mean("face_mm"), 1.8, 1.3)
    add(ONE, "face by mean head", lambda own: ratio(own, "face_mm"), 0.7, 0.5)
    add(ONE, "head by mean head", lambda own: ratio(own, "head_mm"), 0.65, 0.5)
    linear = ("linear_head_mm",)
    add(ONE, "head by linear head", lambda own: ratio(own, "head_mm", "linear"), 0.9, 0.75, needs=linear)
    add(THREE, "face, mm", mean("face_mm"), 1.5, 1.0)
    add(THREE, "head by mean head", lambda own: ratio(own, "head_mm"), 0.5, 0.4)
    add(OTHER, "face by mean head", lambda own: ratio(own, "face_mm"), 0.9, 0.75)
    for what in ("face", "head"):
        by_time: dict[float, list[float]] = {}
        for row in found(rows):
            if row["set"] == ONE:
                by_time.setdefault(row["asked_s"], []).append(row[f"{what}_mm"])
        means = {asked: fmean(values) for asked, values in by_time.items()}
        if sum(asked >= LONG_ENOUGH_S for asked in means) > 1:
            add(ONE, f"{what}, error after 1 s or more above its lowest, %", lambda _, m=means: 100 * over(m), 5, 2)
    if own := measured.get("prior"):
        lines.add(
            "codes fitted to the true distances: head, mm", fmean(row["head_mm"] for row in own), 1.0, 0.6, of_fit=False
        )
    views = ("view_psnr_db", "mean_view_psnr_db")
    gain = "new views, dB over the mean head with the photo projected"
    add(ONE, gain, lambda own: fmean(r["view_psnr_db"] - r["mean_view_psnr_db"] for r in own), 1.5, 3, "≥", views)
    _of_real_faces(measured, lines)
    add(ONE, "rotation of the camera, median, deg", lambda own: median(r["rotation_deg"] for r in own), 4, 2)
    add(ONE, "focal length within 20 %, of photos", focal_within, 0.7, 0.85, "≥")
    _of_program(measured, lines)
    _of_kernels(measured, lines)
    add(ONE, "mesh at 1.6 mm, s", lambda own: median(row["mesh_ms"] for row in own) / 1000, 1, 0.4)
    return table(("metric", "value", "threshold", "goal", "state"), lines.lines)


def _of_real_faces(measured: Mapping, lines: _Lines) -> None:
    own = [row for row in found(measured.get("real", ())) if row["asked_s"] == measured["at_s"]]
    if own:
        lines.add("real photographs: points by mean head posed alike", ratio(own, "points"), 0.9, 0.75)
    if masked := having(own, "matte_iou"):
        iou = fmean(row["matte_iou"] for row in masked)
        lines.add("real photographs: silhouette, IoU", iou, 0.9, 0.94, "≥")


def _of_program(measured: Mapping, lines: _Lines) -> None:
    for row in measured.get("program", ()):
        if row["what"] == "default":
            lines.add("photo to GLB, default settings, whole program, s", row["seconds"], 10, 4)
            lines.add("peak memory of this, MB", row["peak_mb"], 250, 150, digits=0, of_fit=False)
            lines.add(".maqh, KB", row["maqh_kb"], 128, 64, digits=0, of_fit=False)
        else:
            lines.add("photo to the first mesh, whole program, s", row["seconds"], 0.7, 0.3)
    if "bundle_mb" in measured:
        lines.add("bundle, MB", measured["bundle_mb"], 4, 2.8, of_fit=False)


def _of_kernels(measured: Mapping, lines: _Lines) -> None:
    own = [row for row in measured.get("field_kernels", ()) if row["what"] == "forward, back to all weights"]
    if own:
        best = min(own, key=lambda row: row["us"])
        # A fraction above 1 is impossible: other processes slowed PyTorch's peak.
        how = {"of_fit": False, "is_measured": best["fraction"] <= 1}
        by_torch = best["us"] / best["torch_us"]
        lines.add("field kernels: a point of a step, ratio to PyTorch, one thread", by_torch, 0.33, 0.15, **how)
        lines.add("field kernels: fraction of the float peak", best["fraction"], 0.4, 0.6, "≥", **how)
