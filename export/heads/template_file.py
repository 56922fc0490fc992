"""Template files (.maqt) in numpy: written and read. The layout is that of sdk/src/head/files/file_format.h, version 1
(docs/reference/formats.md)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

import numpy as np

from export.checked_file import START, checked_head, signed, write_whole
from export.heads.prior import PriorError
from export.heads.stored_numbers import NumberReader

MAGIC, VERSION = b"MAQTEM\r\n", 1
MAX_POINTS, MAX_ACTIONS, MAX_NAME = 65535, 256, 64
POINT_STEP_DM, MOVE_STEP_DM = 1e-4, 1e-3
HEAD = np.dtype(
    [
        *START,
        ("points", "<u4"),
        ("vertices", "<u4"),
        ("triangles", "<u4"),
        ("actions", "<u4"),
        ("point_step_dm", "<f4"),
        ("move_step_dm", "<f4"),
    ]
)


class Kind(IntEnum):
    """Kind of a point of the template."""

    INSIDE = 0  # of the skin behind the surface: follows its neighbours
    SURFACE = 1
    MOUTH = 2  # as INSIDE, seen when the mouth opens
    EYE = 3  # of an eyeball, behind the lids
    EYE_FRONT = 4  # of an eyeball, where it is seen
    TEETH = 5
    TONGUE = 6


@dataclass(frozen=True, eq=False)
class Template:
    """P points, V vertices (a point that lies in two places of the texture is two of them). Lengths in dm, head frame.

    points [P, 3]; kinds [P] of Kind; vertex_points [V]: the point of each vertex; uv [V, 2]: to the right, down, 0 to
    1; triangles [T, 3] of vertices, counter-clockwise seen from outside; actions: by name the points that move,
    increasing [N], and by how much [N, 3].
    """

    points: np.ndarray
    kinds: np.ndarray
    vertex_points: np.ndarray
    uv: np.ndarray
    triangles: np.ndarray
    actions: dict[str, tuple[np.ndarray, np.ndarray]]


def _steps(values: np.ndarray, step: float) -> bytes:
    steps = np.rint(np.asarray(values, np.float64) / step)
    if not (np.abs(steps) <= 32767).all():
        raise PriorError(f"The template reaches {np.abs(values).max():g} dm; a file holds {32767 * step:g}.")
    return steps.astype("<i2").tobytes()


def template_bytes(template: Template) -> bytes:
    """The bytes of a file. Raises PriorError for a template that the SDK would refuse."""
    check_template(template)
    head = np.zeros((), HEAD)
    head["points"], head["vertices"] = len(template.points), len(template.vertex_points)
    head["triangles"], head["actions"] = len(template.triangles), len(template.actions)
    head["point_step_dm"], head["move_step_dm"] = POINT_STEP_DM, MOVE_STEP_DM
    parts = [
        _steps(template.points, POINT_STEP_DM),
        np.asarray(template.kinds, "u1").tobytes(),
        np.asarray(template.vertex_points, "<u2").tobytes(),
        np.rint(np.asarray(template.uv) * 65535).astype("<u2").tobytes(),
        np.asarray(template.triangles, "<u2").tobytes(),
    ]
    for name, (points, moves) in template.actions.items():
        parts += [bytes([len(name.encode())]), name.encode(), np.uint16(len(points)).tobytes()]
        parts += [np.asarray(points, "<u2").tobytes(), _steps(moves, MOVE_STEP_DM)]
    return signed(head, MAGIC, VERSION, b"".join(parts))


def write_template(template: Template, path: Path) -> None:
    """The file appears atomically. Raises what template_bytes() raises, OSError for what cannot be written."""
    write_whole(template_bytes(template), path)


def template_from_bytes(data: bytes, name: str = "The template in memory") -> Template:
    """name: begins the sentence of errors. Raises PriorError for what is damaged or no template."""
    head = checked_head(data, HEAD, MAGIC, VERSION, name, "a template head (.maqt)", PriorError)
    points, vertices, triangles = int(head["points"]), int(head["vertices"]), int(head["triangles"])
    read = NumberReader(data, HEAD.itemsize, name)
    u1, u2, i2 = np.dtype("u1"), np.dtype("<u2"), np.dtype("<i2")
    place = read.records(3 * points, i2).reshape(-1, 3) * float(head["point_step_dm"])
    kinds, vertex_points = read.records(points, u1), read.records(vertices, u2).astype(int)
    uv = read.records(2 * vertices, u2).reshape(-1, 2) / 65535
    corners = read.records(3 * triangles, u2).reshape(-1, 3).astype(int)
    actions = {}
    for _ in range(int(head["actions"])):
        action = read.records(int(read.records(1, u1)[0]), u1).tobytes().decode(errors="replace")
        count = int(read.records(1, u2)[0])
        moved = read.records(count, u2).astype(int)
        actions[action] = (moved, read.records(3 * count, i2).reshape(-1, 3) * float(head["move_step_dm"]))
    read.end()
    template = Template(place, kinds, vertex_points, uv, corners, actions)
    check_template(template)
    return template


def read_template(path: Path) -> Template:
    """Raises PriorError for what is damaged or no template, OSError for what cannot be read."""
    return template_from_bytes(path.read_bytes(), str(path))


def check_template(template: Template) -> None:
    """Raises PriorError, with what is wrong, for a template that the SDK would refuse."""
    points, vertices = len(template.points), len(template.vertex_points)
    if not (3 <= points <= MAX_POINTS and 3 <= vertices <= MAX_POINTS and len(template.triangles) > 0):
        raise PriorError(f"A template has {points} points, {vertices} vertices, {len(template.triangles)} triangles.")
    if len(template.kinds) != points or not (template.kinds <= max(Kind)).all():
        raise PriorError("Points of a template are of kinds that there are not.")
    if template.vertex_points.max() >= points or template.triangles.max() >= vertices:
        raise PriorError("A template has vertices or triangles of points that it does not have.")
    if len(template.actions) > MAX_ACTIONS:
        raise PriorError(f"A template has {len(template.actions)} actions, but may have {MAX_ACTIONS}.")
    for name, (moved, moves) in template.actions.items():
        if not 1 <= len(name.encode()) <= MAX_NAME:
            raise PriorError(f'An action is named "{name}"; names have 1 to {MAX_NAME} bytes.')
        if len(moved) != len(moves) or (np.diff(moved) <= 0).any() or (len(moved) and moved.max() >= points):
            raise PriorError(f"The points of action {name} do not increase, or are not the template's.")
