"""Writes the page of `python -m benchmarks.heads`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import fmean, median

from benchmarks import provenance
from benchmarks.heads.ablation import settings_table
from benchmarks.heads.field_kernels import kernel_table
from benchmarks.heads.tables import (
    by_baseline,
    by_group,
    by_real_face,
    by_seconds,
    ended_too_early,
    found,
    size_of,
    table,
    yaw_of,
)
from benchmarks.heads.targets import targets

_HOW = """Distances go from points of the true surface, above the clip plane and visible from outside, to the mesh of
the library. The true head is first moved, rotated and scaled to the best fit: with its face for the face (95 mm around
the tip of the nose), with all points for the head. *Not aligned*: without this fit. Values are means over heads. *By
mean head*: ratio to the same value of the prior's mean head. *Normals*: the true mesh itself has 6 to 10 degrees, since
its normals are smooth and its triangles flat. *Size off by*: median absolute value over heads. *Camera rotated by*:
median angle to the true camera, in frames aligned by the skull. Photos are rendered in front of photographs, from up to
45° to the side. The library gets the head's box"""

_TIME = """A fit ends by its time, after 300 steps, or when the held-out pixels no longer improve. If time ends it, the
metrics depend on the machine and its load; the column of steps shows the progress."""

_BASELINES = """*Linear head*: the 64 principal components of the vertices of the training heads, fitted to the same
encoder output (template points) with the same camera model and prior. *MediaPipe's 468 points*: points and depth of its
face network as a mesh. It covers the inner face alone; in that column all heads are aligned by the inner face. *Seen
side*: true points that the photos show, after the alignment of the whole head; *unseen side*: the others. *Result to
truth*: from points of the mesh to the true surface. *New views*: PSNR inside both silhouettes of six views, 30° to 60°
around from the photo, in its light, before grey. The fitted head has a texture of 512 x 512, and *without texture* the
colours of the network. The mean head has the photo projected onto it by the true camera; unseen points have the colour
of the nearest seen point. *By features*: relative difference of features of the person detector's trunk, averaged over
four layers (lower is better), similar to LPIPS but without human judgement. NeuS from a sphere takes minutes and is not
among the baselines (its errors are in docs/research/heads.md; its program is at the tag studies-0.2)."""

_REAL = """Faces of photographs that training never saw (the validation split decided when it ended). Points: mean
distance in the photo between the points of MediaPipe's face network and the same landmarks of the rendered mesh; also
relative to the distance of the outer corners of the eyes. Silhouette: IoU of the rendered mesh and the person's mask
above the chin, where the mask is certain. The fit gets neither."""

_GROUPS = (("yaw", yaw_of), ("size of the head", size_of))
_TRAITS = ("hair", "beard", "skin", "glasses")


def beside(rows: Sequence[Mapping], bundles: Sequence[str], at_s: float) -> str:
    """Compares further bundles with the first: how much larger the first one's distance is, on heads that both
    found."""
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


def _title(text: str) -> str:
    return f"## {text[0].upper()}{text[1:]}"


def warning(rows: Sequence[Mapping], at_s: float) -> str:
    """Returns a warning if time ended the fits too early; otherwise ""."""
    if not ended_too_early(rows, at_s):
        return ""
    steps = median(row["steps"] for row in found(rows) if row["asked_s"] == at_s)
    return (
        f"**Fits of {at_s:g} s came no further than {steps:.0f} steps: the machine was busy, or is too slow for this "
        "time. Measure again, on an idle machine or with more `--seconds`. Metrics at 0 s, of baselines and of sizes "
        "are reliable.**"
    )


def _set_parts(name: str, own: Sequence[Mapping], at_s: float) -> list[str]:
    """Returns the parts of one set."""
    parts = [_title(name), by_seconds(own)]
    now = [row for row in own if row["asked_s"] == at_s]
    if name == "one photo":
        parts += [f"### Beside baselines, after {at_s:g} s", by_baseline(own, at_s), _BASELINES]
        groups = [by_group(now, header, of) for header, of in _GROUPS]
        groups += [by_group(now, trait, lambda row, trait=trait: row.get(trait)) for trait in _TRAITS]
        parts += [f"### By what heads and photos have in common, after {at_s:g} s", *groups]
    else:
        parts.append(by_baseline(own, at_s))
    lost = {row["head"]: row["missing"] for row in own if "missing" in row}
    return [part for part in parts if part] + [f"Not found: {head}: {why}" for head, why in lost.items()]


def _real_parts(rows: Sequence[Mapping], at_s: float) -> list[str]:
    lost = [row for row in rows if "missing" in row and row["asked_s"] == at_s]
    return [
        _title("real photographs"), by_real_face(rows), _REAL,
        *(f"Not found: {row['face']}: {row['missing']}" for row in lost),
    ]  # fmt: skip


def _program_parts(rows: Sequence[Mapping]) -> list[str]:
    stages = ("encode", "pose", "fit", "mesh")
    lines = [
        [row["what"], f"{row['seconds']:.2f}", *(f"{row['ms'][stage]:.0f}" for stage in stages),
         f"{row['peak_mb']:.0f}", f"{row['glb_mb']:.2f}", f"{row['maqh_kb']:.0f}"]
        for row in rows
    ]  # fmt: skip
    header = ("`maquette head`", "whole, s", "encoder, ms", "pose, ms", "fit, ms", "mesh and files, ms")
    return [_title("the program"), table((*header, "peak memory, MB", "GLB, MB", ".maqh, KB"), lines)]


def _more_parts(measured: Mapping, sheet: str) -> list[str]:
    """Returns the parts on real photographs, settings, the program, the kernels and the contact sheet, if measured."""
    at_s, parts = measured["at_s"], []
    if own := measured.get("prior"):
        mm = [f"{fmean(row[key] for row in own):.2f}" for key in ("face_mm", "head_mm", "mean_face_mm", "mean_head_mm")]
        parts += [
            _title("limit of the prior"),
            f"Codes fitted to the true distances of {len(own)} heads instead of to photos, without alignment: face "
            f"{mm[0]} mm, head {mm[1]} mm; the mean head {mm[2]} and {mm[3]} mm.",
        ]
    if measured.get("real"):
        parts += _real_parts(measured["real"], at_s)
    if measured.get("ablation"):
        parts += [
            _title("cost and gain of settings"),
            settings_table(measured["ablation"]),
            "One photo, one setting changed at a time; times are medians from the photo to the mesh.",
        ]
    if measured.get("program"):
        parts += _program_parts(measured["program"])
    if measured.get("field_kernels"):
        parts += [
            _title("field kernels, one thread"),
            kernel_table(measured["field_kernels"]),
            "Both alternate, and the fastest runs count; PyTorch has its best batch size. *Of the float peak*: ratio "
            "of multiply-adds a second to the fastest matrix product on this machine.",
        ]
    if sheet:
        parts += [
            "## Contact sheet",
            f"![Photo, mesh over it, its normals, two new views, and the true head from there]({sheet})",
            f"The best, the median and the worst head of each set with one photo, by the whole head, after {at_s:g} s; "
            "then real photographs.",
        ]
    return parts


def page(measured: Mapping, sheet: str = "") -> str:
    """Returns the whole report in Markdown. sheet: file name of the contact sheet, in the page's folder."""
    at_s, bundles, machine = measured["at_s"], measured["bundles"], measured["machine"]
    rows = [row for row in measured["rows"] if row["bundle"] == bundles[0]]
    parts = [
        "# Heads from photos: how far from the true ones",
        f"Bundle {bundles[0]}; {machine['processor']}, {machine['cores']} cores. Written by `python -m "
        "benchmarks.heads` ([benchmarks/heads](../../benchmarks/heads/README.md)). "
        f"{provenance.sentence(measured.get('measured', {}))}",
        f"{_HOW} {'and the focal length' if measured.get('known_focal') else 'and no information about the camera'}.",
        _TIME,
        *filter(None, [warning(rows, at_s)]),
        f"## Targets, after {at_s:g} s",
        targets(measured),
    ]
    for name in dict.fromkeys(row["set"] for row in rows):
        parts += _set_parts(name, [row for row in rows if row["set"] == name], at_s)
    parts += _more_parts(measured, sheet)
    if len(bundles) > 1:
        parts += [f"## Other bundles, after {at_s:g} s", beside(measured["rows"], bundles, at_s)]
    return "\n\n".join(parts) + "\n"
