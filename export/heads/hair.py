"""Hair and beards as volumes: a piece of skin pushed outwards, closed behind, and let down where hair hangs.

Everything is decided on the template, whose places all heads share, so a style fits every head.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from export.heads.shapes import HeadShapes, boundary_loops, vertex_normals

STYLES = ("none", "cropped", "short", "full", "curly", "long", "tied")
_STYLE_SHARES = (0.12, 0.13, 0.25, 0.15, 0.1, 0.15, 0.1)
# The hairline's height (dm) by the angle from the front, as seen from above; sides are mirrored.
_LINE_ANGLES = np.radians([0, 25, 50, 68, 80, 98, 112, 135, 180])
_LINE_HEIGHTS = np.array([0.78, 0.74, 0.56, 0.2, 0.05, 0.3, -0.25, -0.65, -0.8])
COLOURS = np.array(
    [(20, 16, 14), (40, 26, 18), (75, 48, 30), (120, 80, 45), (180, 140, 85), (215, 185, 130), (150, 150, 150),
     (115, 60, 36), (205, 200, 195)], float,
)  # fmt: skip


@dataclass(frozen=True)
class Shell:
    """A closed volume on a head: vertices [N, 3], faces [M, 3], the head's vertex below each of its own [N]; `outer`:
    those of its vertices of which each lies above another vertex of the head."""

    vertices: np.ndarray
    faces: np.ndarray
    below: np.ndarray
    outer: slice


@dataclass(frozen=True)
class Style:
    """Thickness (dm) of hair at each vertex of a head and how far it hangs down there; that of the beard."""

    name: str
    thickness: np.ndarray  # [V]
    hang: np.ndarray  # [V]
    beard: np.ndarray  # [V]
    bun: tuple[np.ndarray, float] | None  # middle (head frame, from the crown outwards) and radius
    shade: np.ndarray  # [V] how much of the hair's colour the skin has, 0..1: short hair and its roots
    colour: np.ndarray  # RGB, 0..255
    brows: float  # how dark, 0..1


def _smoothstep(low: float, high: float, x: np.ndarray) -> np.ndarray:
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def slow_noise(points: np.ndarray, frequency: float, rng: np.random.Generator) -> np.ndarray:
    """A sum of sines of about that many waves per decimetre, of variance 1: [N]."""
    out = np.zeros(len(points))
    for _ in range(6):
        direction = rng.normal(size=3)
        direction *= frequency * 2 * np.pi * rng.uniform(0.6, 1.4) / np.linalg.norm(direction)
        out += np.sin(points @ direction + rng.uniform(0, 2 * np.pi))
    return out / np.sqrt(3)


class Barber:
    """Knows where hair and beards grow on the template."""

    def __init__(self, shapes: HeadShapes) -> None:
        self.shapes = shapes
        p = shapes.template
        self.angle = np.abs(np.arctan2(p[:, 0], -(p[:, 1] - 0.1)))
        line = np.interp(self.angle, _LINE_ANGLES, _LINE_HEIGHTS)
        self.above_line = p[:, 2] - line
        # Ears stick out of the skull: no hair grows on them.
        self.ear = (np.abs(p[:, 0]) > 0.7) & (np.abs(p[:, 1] - 0.15) < 0.42) & (p[:, 2] > -0.55) & (p[:, 2] < 0.3)
        skin = np.zeros(len(p), bool)
        skin[shapes.faces] = True
        self.skin = skin
        mouth = np.array([0, -1.1, -0.62])
        reach = np.linalg.norm((p - mouth) * [1, 0.6, 1.3], axis=1)
        # The beard lies below the line from ear to mouth corner, in front of the ears, above the neck's middle.
        line = np.interp(np.abs(p[:, 0]), [0, 0.3, 0.6, 0.8], [-0.42, -0.5, -0.45, -0.2])
        self.beard = np.where(
            (p[:, 1] < 0.0) & (p[:, 2] < line) & (p[:, 2] > -1.35) & ~self.ear, np.clip((reach - 0.24) / 0.1, 0, 1), 0
        )
        self.beard *= _smoothstep(0, 0.12, line - p[:, 2]) * _smoothstep(0.0, 0.15, -p[:, 1])

    def sample(self, rng: np.random.Generator, gender: float, age: float) -> Style:
        """A style of hair; beards for men (gender near 1) who are no children."""
        name = STYLES[rng.choice(len(STYLES), p=_STYLE_SHARES)]
        p = self.shapes.template
        lowered = rng.uniform(-0.12, 0.1) if rng.random() < 0.8 else rng.uniform(0.1, 0.45)  # receding or a fringe
        front = np.exp(-((self.angle / 0.9) ** 2))
        above = self.above_line + lowered * front
        present = self.skin * ~self.ear
        top = _smoothstep(0.4, 1.1, p[:, 2])
        back = _smoothstep(0.0, 0.8, p[:, 1]) * (1 - top)
        side = 1 - top - back
        amounts = {
            "none": (0.0, 0.0), "cropped": (0.03, 0.07), "short": (0.06, 0.25), "full": (0.2, 0.5),
            "curly": (0.25, 0.7), "long": (0.1, 0.3), "tied": (0.05, 0.14),
        }  # fmt: skip
        low, high = amounts[name]
        a = rng.uniform(low, high, 3)
        if name == "short":
            a[1:] *= rng.uniform(0.3, 1.0)
        thick = a[0] * top + a[1] * back + a[2] * side
        waves = slow_noise(p, 1.6 if name == "curly" else 0.6, rng)
        # Thick hair rises over a longer way than thin hair.
        grows = _smoothstep(0.0, rng.uniform(0.1, 0.2) + 0.7 * a.max(), above) * present
        thick = grows * thick * np.clip(1 + (0.25 if name == "curly" else 0.18) * waves, 0.3, 2)
        # A parting makes one side higher than the other.
        thick *= 1 + rng.uniform(-0.25, 0.25) * np.tanh(3 * p[:, 0]) * top
        hang = np.zeros(len(p))
        if name == "long":
            length = rng.uniform(0.5, 2.4)
            hang = length * (1 - _smoothstep(0.0, 0.55, above)) * _smoothstep(0.9, 1.5, self.angle) * (grows > 0)
        beard = np.zeros(len(p))
        if gender > 0.6 and age > 0.55 and rng.random() < 0.4:
            beard = self.beard * rng.uniform(0.03, 0.3) * np.clip(1 + 0.2 * slow_noise(p, 0.8, rng), 0.3, 2)
        bun = None
        if name == "tied":
            turn = rng.uniform(-0.6, 1.1)  # from straight back up to the crown
            bun = (np.array([rng.normal(0, 0.05), np.cos(turn), 0.25 + np.sin(turn)]), rng.uniform(0.2, 0.42))
        colour = COLOURS[rng.choice(len(COLOURS))] * rng.uniform(0.8, 1.15)
        shade = _smoothstep(-0.04, 0.1, above) * present * (rng.uniform(0, 0.5) if name == "none" else 0.9)
        shade = np.maximum(
            shade, np.minimum(1, 12 * beard) if beard.any() else rng.uniform(0, 0.2) * self.beard * (gender > 0.6)
        )
        return Style(name, thick, hang, beard, bun, shade, np.clip(colour, 8, 235), float(rng.uniform(0.3, 0.9)))

    def shells(self, vertices: np.ndarray, style: Style, rng: np.random.Generator) -> list[Shell]:
        """The volumes of a style on a head with these vertices [V, 3]."""
        normals = vertex_normals(vertices, self.shapes.faces)
        out = []
        for thickness, hang in ((style.thickness, style.hang), (style.beard, np.zeros(len(vertices)))):
            patch = self.shapes.faces[(thickness[self.shapes.faces] > 0.004).any(1)]
            if len(patch) > 20:
                out.append(_shell(vertices, normals, patch, thickness, hang, rng))
        if style.bun:
            middle, radius = style.bun
            skull = vertices[self.skin & (self.above_line > 0)]
            direction = middle / np.linalg.norm(middle)
            reach = float((skull @ direction).max())
            out.append(_ball(direction * (reach + 0.55 * radius), radius, vertices))
        return out


def _shell(
    vertices: np.ndarray,
    normals: np.ndarray,
    patch: np.ndarray,
    thickness: np.ndarray,
    hang: np.ndarray,
    rng: np.random.Generator,
) -> Shell:
    used = np.unique(patch)
    number = np.full(len(vertices), -1)
    number[used] = np.arange(len(used))
    faces = number[patch]
    sag = np.array([0.0, 0.12, -1.0])
    spread = rng.uniform(0.0, 0.12)
    outer = vertices[used] + normals[used] * thickness[used, None] + hang[used, None] * sag
    outer[:, 0] += spread * hang[used] * np.sign(vertices[used, 0]) * np.minimum(1, np.abs(vertices[used, 0]) * 2)
    inner = vertices[used] - normals[used] * 0.03  # inside the head: no face of it is left there
    count = len(used)
    walls = []
    for loop in boundary_loops(faces):
        following = np.roll(loop, -1)
        # The border runs with its triangles; the wall's triangles run against them.
        walls.append(np.stack([following, loop, loop + count], 1))
        walls.append(np.stack([following, loop + count, following + count], 1))
    closed = np.concatenate([faces, faces[:, ::-1] + count, *walls])
    return Shell(np.concatenate([outer, inner]), closed, np.concatenate([used, used]), slice(0, count))


def _ball(middle: np.ndarray, radius: float, vertices: np.ndarray) -> Shell:
    rows, columns = 10, 16
    polar = np.linspace(0, np.pi, rows + 1)[1:-1]
    around = np.arange(columns) * 2 * np.pi / columns
    ring = np.stack(
        [np.outer(np.sin(polar), np.cos(around)), np.outer(np.sin(polar), np.sin(around)),
         np.repeat(np.cos(polar)[:, None], columns, 1)], -1,
    ).reshape(-1, 3)  # fmt: skip
    points = middle + radius * np.concatenate([ring, [[0, 0, 1], [0, 0, -1]]])
    faces, top, bottom = [], len(ring), len(ring) + 1
    for c in range(columns):
        n = (c + 1) % columns
        faces += [(top, c, n), (bottom, (rows - 2) * columns + n, (rows - 2) * columns + c)]
        for r in range(rows - 2):
            a, b, d, e = r * columns + c, r * columns + n, (r + 1) * columns + c, (r + 1) * columns + n
            faces += [(a, d, e), (a, e, b)]
    nearest = int(np.argmin(np.linalg.norm(vertices - middle, axis=1)))
    return Shell(points, np.array(faces), np.full(len(points), nearest), slice(0, 0))
