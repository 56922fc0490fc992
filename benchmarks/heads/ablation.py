"""Measures the cost and gain of each setting of a fit: time from a photo to a mesh, and the error.

One setting of the public API is changed at a time. Optimisations without a switch (empty blocks of the mesh, rays that
miss, samples without colour) cannot be compared here; see `field_kernels.py`.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import fmean, median
from typing import Any

from maquette import HeadBuilder, MaquetteError
from tqdm import tqdm

from benchmarks.heads.distances import measure
from benchmarks.heads.fitted import triangles_of
from benchmarks.heads.photos import Photo, TrueHead
from benchmarks.heads.tables import table


@dataclass(frozen=True)
class Setting:
    name: str
    seconds: float
    cell_m: float = 0.0
    box: bool = True
    focal: bool = False
    builder: Mapping[str, Any] = field(default_factory=dict)


def settings_of(at_s: float) -> list[Setting]:
    """Returns the settings; the others are compared with the first one."""
    return [
        Setting("as reported", at_s),
        Setting("no fit to the pixels", 0.0),
        Setting("half the time", at_s / 2),
        Setting("one thread", at_s, builder={"threads": 1}),
        Setting("focal length known", at_s, focal=True),
        Setting("the head's box not given", at_s, box=False),
        Setting("vertices 3.2 mm apart", at_s, cell_m=0.0032),
        Setting("vertices 0.8 mm apart", at_s, cell_m=0.0008),
    ]


def measure_settings(
    bundle: Path, heads: Sequence[tuple[TrueHead, Photo]], at_s: float, threads: int = 0
) -> list[dict]:
    """Returns one row for each setting and head that was found."""
    rows = []
    for setting in tqdm(settings_of(at_s), desc="settings", unit="setting", disable=None):
        with HeadBuilder(bundle, False, **{"threads": threads, **setting.builder}) as builder:
            for head, photo in heads:
                try:
                    rows.append({"setting": setting.name, "head": head.name} | _one(builder, head, photo, setting))
                except MaquetteError:
                    continue
    return rows


def _one(builder: HeadBuilder, head: TrueHead, photo: Photo, setting: Setting) -> dict:
    builder.clear()
    focal_px = photo.camera.fx_px if setting.focal else None
    start = time.perf_counter()
    builder.add_photo(photo.rgb, photo.box if setting.box else None, focal_px=focal_px)
    with builder.fit(setting.seconds) as result:
        before = time.perf_counter()
        mesh = result.mesh("all", cell_m=setting.cell_m)
        mesh_s = time.perf_counter() - before
    whole_s = time.perf_counter() - start
    found = measure(triangles_of(mesh), head.true)
    return {
        "whole_s": whole_s, "mesh_s": mesh_s, "steps": builder.stats["step_count"], "triangles": len(mesh.triangles),
        "face_mm": found.face_mm, "head_mm": found.head_mm,
    }  # fmt: skip


def settings_table(rows: Sequence[Mapping]) -> str:
    """Returns one line for each setting, over the heads that every setting found."""
    names = list(dict.fromkeys(row["setting"] for row in rows))
    everywhere = set.intersection(*({r["head"] for r in rows if r["setting"] == name} for name in names))
    lines = []
    for name in names:
        own = [r for r in rows if r["setting"] == name and r["head"] in everywhere]
        if own:
            lines.append(
                [name, f"{median(r['whole_s'] for r in own):.2f}", f"{median(r['mesh_s'] for r in own):.2f}",
                 f"{median(r['steps'] for r in own):.0f}", f"{median(r['triangles'] for r in own):.0f}",
                 f"{fmean(r['face_mm'] for r in own):.2f}", f"{fmean(r['head_mm'] for r in own):.2f}"]
            )  # fmt: skip
    header = ("setting", "photo to mesh, s", "mesh, s", "steps", "triangles", "face, mm", "head, mm")
    return table(header, lines)
