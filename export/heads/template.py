"""The template head as it is wrapped onto fitted heads: MakeHuman's mesh of the head (CC0) with eyeballs, teeth and
tongue, its texture coordinates, and 52 facial actions (Face Units by Mika Suominen, CC0), named as ARKit names them.

    python -m export.heads.template --out .data/heads/template.maqt

It is open at the neck, at the plane where heads are cut.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import igl
import numpy as np

from export.heads.shapes import CUT_NORMAL, ORIGIN_M, boundary_loops
from export.heads.surface import HeadMaker, cut_distance
from export.heads.synthetic_heads import make_maker
from export.heads.template_file import Kind, Template, write_template
from export.people import assets

MIN_MOVE_DM = 0.0015  # the source is rounded to 0.001 dm: what moves by one such step alone is left out
_PARTS = {
    "helper-l-eye": Kind.EYE,
    "helper-r-eye": Kind.EYE,
    "helper-upper-teeth": Kind.TEETH,
    "helper-lower-teeth": Kind.TEETH,
    "helper-tongue": Kind.TONGUE,
}


@dataclass(frozen=True)
class _Part:
    """Triangles [F, 3] of the body's vertices and of its texture coordinates."""

    faces: np.ndarray
    uv: np.ndarray


def read_action(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices of the body [N] that a target file moves, and how [N, 3], dm in the head frame."""
    rows = np.loadtxt(path, comments="#", ndmin=2)
    return rows[:, 0].astype(int), np.stack([rows[:, 1], -rows[:, 3], rows[:, 2]], 1)  # y up, facing z, in the source


def _kinds(maker: HeadMaker, points: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Kinds [P] of the body's vertices `own`, which lie at `points` (dm)."""
    shapes = maker.shapes
    body, outer = shapes.body, shapes.kept[np.unique(maker.faces)]
    # Inside of the head, only the mouth is seen, when it opens.
    mouth = (np.abs(points[:, 0]) < 0.4) & (np.abs(points[:, 2] + 0.62) < 0.4)
    kinds = np.where(mouth, Kind.MOUTH, Kind.INSIDE).astype(np.uint8)
    kinds[np.isin(own, outer)] = Kind.SURFACE
    for group, kind in _PARTS.items():
        kinds[np.isin(own, body.groups[group])] = kind
    caps = [shapes.template[loop].mean(0) for loop in maker.cap_vertices]
    skin, faces = np.concatenate([shapes.template, caps]), np.concatenate([maker.faces, maker.caps])
    eyes = np.flatnonzero(kinds == Kind.EYE)
    is_behind = igl.fast_winding_number(skin, faces, np.ascontiguousarray(points[eyes])) > 0.5
    kinds[eyes[~is_behind]] = Kind.EYE_FRONT
    return kinds


def make_template(maker: HeadMaker) -> Template:
    """Raises FileNotFoundError where the facial actions were not unpacked."""
    shapes = maker.shapes
    body = shapes.body
    place = (body.template.vertices.astype(np.float64) - ORIGIN_M) * 10
    head = np.isin(np.arange(len(place)), shapes.kept[np.unique(shapes.faces)]) & (cut_distance(place) < 0)
    skin = head[body.faces["body"]].all(1).reshape(-1, 2).all(1).repeat(2)  # whole quads
    parts = [_Part(body.faces["body"][skin], body.face_uv["body"][skin])]
    parts += [_Part(body.faces[group], body.face_uv[group]) for group in _PARTS]
    faces, uv = (np.concatenate([getattr(part, name) for part in parts]) for name in ("faces", "uv"))
    own = np.unique(faces)
    number = np.full(len(place), -1)
    number[own] = np.arange(len(own))
    points = place[own]
    neck = min(boundary_loops(number[faces]), key=lambda loop: points[loop, 2].mean())
    # An even border: its points move onto the plane, across which the neck goes nearly straight.
    points[neck] -= cut_distance(points[neck])[:, None] * CUT_NORMAL
    corners, vertices = np.unique(np.stack([number[faces], uv], -1).reshape(-1, 2), axis=0, return_inverse=True)
    actions = {}
    for path in sorted(assets.facial_actions().glob("*.target")):
        at, moves = read_action(path)
        kept = (number[at] >= 0) & (np.abs(moves).max(1) > MIN_MOVE_DM)
        order = np.argsort(number[at[kept]])
        actions[path.stem] = (number[at[kept]][order], moves[kept][order])
    return Template(
        points=points,
        kinds=_kinds(maker, points, own),
        vertex_points=corners[:, 0],
        uv=body.texture_uv[corners[:, 1]].astype(np.float64) * [1, -1] + [0, 1],
        triangles=vertices.reshape(-1, 3),
        actions=actions,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(".data/heads/template.maqt"))
    out = parser.parse_args().out
    template = make_template(make_maker())
    out.parent.mkdir(parents=True, exist_ok=True)
    write_template(template, out)
    counts = ", ".join(f"{(template.kinds == kind).sum()} {kind.name.lower()}" for kind in Kind)
    print(f"{len(template.points)} points ({counts}), {len(template.vertex_points)} vertices")
    print(f"{len(template.triangles)} triangles, {len(template.actions)} actions")
    print(f"{out}: {out.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
