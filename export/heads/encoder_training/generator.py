"""Generates synthetic heads as triangles with their colours from one small file, in processes beside the training.

The file (`export.heads.encoder_training.pack`) has the shapes of the training heads, as sums of a few bases, and the
skin. Each time a head is used, it gets other hair, tones and cameras. This takes numpy and scipy alone. Surfaces inside
other parts stay in the mesh, because they are not visible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch.utils.data import IterableDataset

from export.heads.hair import Barber
from export.heads.sampling import Extras, Lamps, sample_camera, sample_extras, sample_lamps, sample_tones
from export.heads.shapes import vertex_normals

SKIN, EYE, HAIR, BUST = 0, 1, 2, 3
MAX_LAMPS = 2


@dataclass(frozen=True)
class PackedHeads:
    """template [V, 3] dm, its triangles: `skin_faces` (of bust and inside of the mouth too) for hair's roots, `faces`
    [F, 3] seen from outside and what closes them, with `uv` [F, 3, 2]; `eye_faces`, `bust_faces`, `bust_uv`. Each
    vertex above V is the mean of the loop that closes a hole: `loops`. mean [V, 3], bases [K, V, 3], weights [N, K]:
    shapes of N heads; gender_age [N, 2]."""

    template: np.ndarray
    skin_faces: np.ndarray
    faces: np.ndarray
    uv: np.ndarray
    eye_faces: np.ndarray
    bust_faces: np.ndarray
    bust_uv: np.ndarray
    loops: list[np.ndarray]
    mean: np.ndarray
    bases: np.ndarray
    weights: np.ndarray
    gender_age: np.ndarray

    def vertices(self, number: int) -> np.ndarray:
        """[V, 3], dm, head frame."""
        return self.mean + np.tensordot(self.weights[number], self.bases, 1)


@dataclass(frozen=True)
class _Places:
    """The attributes of shapes that `Barber` uses."""

    template: np.ndarray
    faces: np.ndarray


@dataclass
class Meshes:
    """H heads' triangles, one after another, and K images to be drawn of each.

    positions, normals, template float32 [V, 3], dm; shade [V]: how much hair the skin has; faces int64 [F, 3], of all
    vertices; uv float32 [F, 3, 2]; kind int64 [F]; face_head [F]; tone, hair, iris float32 [H, 3], RGB; brows [H].
    cameras float32 [H, K, 15]: rotation, shift, focal length, cx, cy; ambient [H, K, 3], lamps [H, K, 2, 6]: direction
    and colour, 0 where there is none; extras [H, K, 12]: gloss, cloth RGB, collar, lens, rim, frame RGB, size.
    """

    positions: torch.Tensor
    normals: torch.Tensor
    template: torch.Tensor
    shade: torch.Tensor
    faces: torch.Tensor
    uv: torch.Tensor
    kind: torch.Tensor
    face_head: torch.Tensor
    tone: torch.Tensor
    hair: torch.Tensor
    iris: torch.Tensor
    brows: torch.Tensor
    cameras: torch.Tensor
    ambient: torch.Tensor
    lamps: torch.Tensor
    extras: torch.Tensor

    def to(self, device: torch.device) -> Meshes:
        return Meshes(**{name: value.to(device) for name, value in vars(self).items()})


def lamp_row(lamps: Lamps) -> tuple[np.ndarray, np.ndarray]:
    """Ambient [3], and direction and colour [2, 6] of each lamp."""
    rows = np.zeros((MAX_LAMPS, 6))
    rows[: len(lamps.directions)] = np.concatenate([lamps.directions, lamps.colours], 1)
    return lamps.ambient, rows


def extras_row(extras: Extras, gloss: float) -> np.ndarray:
    """[12], as in `Meshes`."""
    return np.concatenate(
        [[gloss], extras.cloth, [extras.collar, extras.lens, extras.rim], extras.frame, extras.size]
    )  # fmt: skip


class HeadStream(IterableDataset):
    """Endless `Meshes` of `heads` heads each, `views` images a head."""

    def __init__(self, packed: PackedHeads, heads: int, views: int, seed: int) -> None:
        self.packed, self.heads, self.views, self.seed = packed, heads, views, seed
        self._barber = Barber(_Places(packed.template, packed.skin_faces))
        eyes = np.concatenate([packed.faces, packed.eye_faces])
        self._inner = np.concatenate([eyes, packed.bust_faces])
        kinds = [np.full(len(f), k) for f, k in
                 ((packed.faces, SKIN), (packed.eye_faces, EYE), (packed.bust_faces, BUST))]  # fmt: skip
        self._kind = np.concatenate(kinds)
        self._uv = np.concatenate([packed.uv, np.zeros((len(packed.eye_faces), 3, 2)), packed.bust_uv])
        self._template = self._with_middles(packed.template)

    def __iter__(self):
        info = torch.utils.data.get_worker_info()
        rng = np.random.default_rng([self.seed, info.id if info else 0])
        torch.set_num_threads(1)
        while True:
            yield self.meshes(rng.integers(len(self.packed.weights), size=self.heads), rng)

    def _with_middles(self, points: np.ndarray) -> np.ndarray:
        return np.concatenate([points, [points[loop].mean(0) for loop in self.packed.loops]])

    def meshes(self, numbers: np.ndarray, rng: np.random.Generator) -> Meshes:
        """Meshes of these heads; `rng` samples hair and all other properties."""
        columns: dict[str, list] = {name: [] for name in Meshes.__dataclass_fields__}
        start = 0
        for k, number in enumerate(numbers):
            for name, value in self._row(int(number), rng).items():
                columns[name].append(value)
            columns["faces"][-1] = columns["faces"][-1] + start
            columns["face_head"].append(np.full(len(columns["kind"][-1]), k))
            start += len(columns["positions"][-1])
        out = {}
        for name, rows in columns.items():
            joined = np.stack(rows) if name in _OF_HEADS else np.concatenate(rows)
            whole = name in ("faces", "kind", "face_head")
            out[name] = torch.from_numpy(joined.astype(np.int64 if whole else np.float32))
        return Meshes(**out)

    def _row(self, number: int, rng: np.random.Generator) -> dict[str, np.ndarray]:
        packed = self.packed
        vertices = packed.vertices(number)
        style = self._barber.sample(rng, *packed.gender_age[number])
        shells = self._barber.shells(vertices, style, rng)
        tone, iris = sample_tones(rng)
        base = self._with_middles(vertices)
        positions, faces, template = [base], [self._inner], [self._template]
        # As on whole heads: the skin's normals are those of its own triangles, the bust's those of both.
        skin = len(packed.faces)
        normals = vertex_normals(base, self._inner[:skin])
        of_bust = vertex_normals(base, np.concatenate([packed.skin_faces, packed.bust_faces]))
        own = np.zeros(len(base), bool)
        own[self._inner[:skin]] = True
        below = ~own
        below[packed.bust_faces] = True
        normals[below] = of_bust[below]
        eyes = np.unique(packed.eye_faces)
        normals[eyes] = vertex_normals(base, packed.eye_faces)[eyes]
        normals, start, hair = [normals], len(base), 0
        for shell in shells:
            positions.append(shell.vertices)
            normals.append(vertex_normals(shell.vertices, shell.faces))
            template.append(packed.template[shell.below])
            faces.append(shell.faces + start)
            start, hair = start + len(shell.vertices), hair + len(shell.faces)
        shade = np.zeros(start)
        shade[: len(style.shade)] = style.shade
        points = np.concatenate(positions)
        cameras, ambient, lamps, extras = [], [], [], []
        for _ in range(self.views):
            seen = np.concatenate([base[own], *(s.vertices for s in shells)])
            camera = sample_camera(seen[seen[:, 2] > -1.6], rng)
            light, worn = sample_lamps(rng), sample_extras(rng)
            inner = [camera.fx_px, camera.cx_px, camera.cy_px]
            cameras.append(np.concatenate([camera.rotation.reshape(-1), camera.world_to_camera[:, 3], inner]))
            one, two = lamp_row(light)
            ambient.append(one)
            lamps.append(two)
            extras.append(extras_row(worn, light.gloss))
        return {
            "positions": points, "normals": np.concatenate(normals), "template": np.concatenate(template),
            "shade": shade, "faces": np.concatenate(faces), "uv": np.concatenate([self._uv, np.zeros((hair, 3, 2))]),
            "kind": np.concatenate([self._kind, np.full(hair, HAIR)]), "tone": tone, "hair": style.colour,
            "iris": iris, "brows": np.array(style.brows), "cameras": np.stack(cameras), "ambient": np.stack(ambient),
            "lamps": np.stack(lamps), "extras": np.stack(extras),
        }  # fmt: skip


_OF_HEADS = ("tone", "hair", "iris", "brows", "cameras", "ambient", "lamps", "extras")
