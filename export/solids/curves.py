"""The sharp curves of a view themselves, for judging what is extracted from its field: lines, arcs, polylines, corners.

In the camera's coordinates, metres. JSON, so that it can be stored beside the view and read without this package:
{"curves": [{"type": "line" | "arc" | "spline", "kind": 1 convex crease | 2 concave crease | 3 boundary, "sure": false
where a rounding is neither sharp nor smooth, "angle_deg" between its surfaces at its middle, "rounding_m" its radius
there, 0 of an edge without one, "points": [[x, y, z], ..], "centre", "axis", "radius" of arcs}, ..],
"corners": [[x, y, z], ..]}. An arc's points are its start, middle and end.
"""

from __future__ import annotations

import json

import numpy as np

from export.solids.brep import ARC, LINE
from export.solids.labels import SHARP_RAD, Labeller, Piece

_SAME_R = 0.02  # ends of pieces this near are one place


def curves_json(labeller: Labeller, pieces: list[Piece]) -> str:
    curves = [_curve(labeller, piece) for piece in pieces]
    return json.dumps({"curves": curves, "corners": corners(labeller, pieces).tolist()})


def _curve(labeller: Labeller, piece: Piece) -> dict:
    c = labeller.curves
    kind = c.kind[piece.edge]
    entry = {"type": {LINE: "line", ARC: "arc"}.get(kind, "spline"), "kind": piece.kind, "sure": bool(piece.sure)}
    angle, rounding = labeller.angle_and_rounding(piece)
    entry |= {"angle_deg": round(float(np.degrees(angle)), 2), "rounding_m": float(rounding)}
    if kind == ARC:
        x, y = c.x[piece.edge], c.y[piece.edge]
        axis = np.cross(x, y)
        entry |= {
            "points": _at(labeller, piece, np.linspace(piece.start, piece.end, 3)).tolist(),
            "centre": c.centre[piece.edge].tolist(),
            "axis": (axis / np.linalg.norm(axis)).tolist(),
            "radius": float(np.linalg.norm(x)),
        }
    elif kind == LINE:
        entry["points"] = _at(labeller, piece, np.array([piece.start, piece.end])).tolist()
    else:
        entry["points"] = labeller.outline(piece).tolist()
    return entry


def _at(labeller: Labeller, piece: Piece, t: np.ndarray) -> np.ndarray:
    return labeller.curves.at(np.full(len(t), piece.edge), t)[0]


def corners(labeller: Labeller, pieces: list[Piece]) -> np.ndarray:
    """Where three curves meet, or two that turn there by more than 18 degrees: [n, 3]."""
    place, way = [], []
    for piece in pieces:
        if not piece.sure:
            continue
        length = piece.end - piece.start
        for end, t, step in ((piece.start == 0, 0.0, 1e-3), (piece.end == 1, 1.0, -1e-3)):
            if end:
                a, b = _at(labeller, piece, np.array([t, t + step * length]))
                place.append(a)
                way.append((b - a) / max(np.linalg.norm(b - a), 1e-300))
    found: list[np.ndarray] = []
    left = list(range(len(place)))
    while left:
        first = left[0]
        reach = _SAME_R * place[first][2] / labeller.seen.camera.fx_px
        group = [k for k in left if np.linalg.norm(place[k] - place[first]) <= reach]
        left = [k for k in left if k not in group]
        if len(group) > 2 or (len(group) == 2 and way[group[0]] @ way[group[1]] > -np.cos(SHARP_RAD)):
            found.append(place[first])
    return np.array(found).reshape(-1, 3)
