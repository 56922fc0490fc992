"""Triangles with a material, and how they are made: OBJ files, the boxes of `export.people.props`, smooth normals.

World axes everywhere: z up, metres; the front of a thing looks to -y.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import cv2
import numpy as np
import scipy.sparse as sp

from export.people.props import Prop, Solid
from export.places.polygons import triangles_of

_CREASE = np.cos(np.radians(45))  # edges sharper than this stay edges
_MANY_FACES = 48  # around one vertex: the middle of a lid, which is flat


class ModelError(ValueError):
    """A model file is not what it should be."""


@dataclass(frozen=True, eq=False)
class Material:
    """texture: uint8 [h, w, 3 or 4] RGB(A), first row at v = 1, repeats; colour: display values that multiply it.

    specular: strength of highlights, 0..1; shininess: their Blinn-Phong exponent; mirror: share of the surroundings'
    light that is reflected at right angles; opacity below 1 is glass: drawn, but no surface for depth; emission: light
    of its own.
    """

    texture: np.ndarray | None = None
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)
    specular: float = 0.0
    shininess: float = 20.0
    mirror: float = 0.0
    opacity: float = 1.0
    emission: float = 0.0


@dataclass(frozen=True, eq=False)
class Part:
    """corners, normals float32 [F, 3, 3]; uv float32 [F, 3, 2]; cut [F, 3], if given: drawn where above 0.

    shades: whether it takes light from others (walls and ceilings around the light do not).
    """

    corners: np.ndarray
    normals: np.ndarray
    uv: np.ndarray
    material: Material = field(default_factory=Material)
    cut: np.ndarray | None = None
    shades: bool = True

    def moved(self, rotation: np.ndarray, shift) -> Part:
        """Turned by `rotation` [3, 3] about the origin, then shifted."""
        turn = np.asarray(rotation, np.float32).T
        corners = self.corners @ turn + np.asarray(shift, np.float32)
        return replace(self, corners=corners, normals=self.normals @ turn)


def flat_normals(corners: np.ndarray) -> np.ndarray:
    """Unit normals of triangles [F, 3, 3], the same at the three corners; 0 where a triangle has no area."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-20
    return np.repeat(normal[:, None], 3, 1).astype(np.float32)


def smooth_normals(corners: np.ndarray) -> np.ndarray:
    """Normals averaged, by area, over the triangles that meet at a corner without a crease: float32 [F, 3, 3]."""
    flat = flat_normals(corners)[:, 0]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    grain = max(float(np.ptp(corners.reshape(-1, 3), axis=0).max()), 1e-9) * 1e-5
    keys = np.round(corners.reshape(-1, 3) / grain).astype(np.int64)
    _, vertex = np.unique(keys, axis=0, return_inverse=True)
    vertex = vertex.reshape(-1)
    faces = np.repeat(np.arange(len(corners)), 3)
    at = sp.csr_matrix((np.ones(len(vertex), np.int8), (vertex, faces)), shape=(vertex.max() + 1, len(corners)))
    count = np.diff(at.indptr)[vertex]
    count = np.where(count > _MANY_FACES, 0, count)
    corner = np.repeat(np.arange(len(vertex)), count)
    within = np.arange(len(corner)) - np.repeat(np.cumsum(count) - count, count)
    other = at.indices[at.indptr[vertex[corner]] + within]
    own = flat[faces[corner]]
    together = (own * flat[other]).sum(1) > _CREASE
    total = np.zeros((len(vertex), 3))
    weight = np.where(together, area[other], 0)
    for k in range(3):
        total[:, k] = np.bincount(corner, weight * flat[other][:, k], minlength=len(vertex))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    normal = np.where(length > 1e-12, total / np.maximum(length, 1e-12), flat[faces])
    return normal.reshape(-1, 3, 3).astype(np.float32)


def part_of(
    solid: Solid, material: Material | None = None, smooth: bool = False, repeats: float = 1.0, shades: bool = True
) -> Part:
    """A solid of `export.people.props`; repeats: of the texture, a metre."""
    corners = solid.corners.astype(np.float32)
    normals = smooth_normals(corners) if smooth else flat_normals(corners)
    return Part(corners, normals, (solid.uv * repeats).astype(np.float32), material or Material(), shades=shades)


def part_of_prop(prop: Prop) -> Part:
    corners = prop.corners.astype(np.float32)
    material = Material(prop.texture, tuple(map(float, prop.tint)), float(prop.specular))
    return Part(corners, smooth_normals(corners), prop.uv.astype(np.float32), material)


def read_obj(path: Path) -> list[tuple[np.ndarray, np.ndarray, Material]]:
    """A Wavefront OBJ file: for each material the triangles' corners [F, 3, 3], their uv [F, 3, 2], and the material.

    In the file's own axes and units. Lines, points and whatever has no area are left out. Raises ModelError.
    """
    positions, texture_at, faces, used = [], [], {}, ""
    libraries: dict[str, Material] = {}
    try:
        for line in path.read_text("latin-1").splitlines():
            word, _, rest = line.strip().partition(" ")
            if word == "v":
                positions.append([float(t) for t in rest.split()[:3]])
            elif word == "vt":
                texture_at.append([float(t) for t in (rest.split() + ["0"])[:2]])
            elif word == "usemtl":
                used = rest.strip()
            elif word == "mtllib":
                libraries |= read_materials(path.parent / rest.strip())
            elif word == "f":
                corners = [_indices(c, len(positions), len(texture_at)) for c in rest.split()]
                faces.setdefault(used, []).append(corners)
        position = np.array(positions, np.float64).reshape(-1, 3)
    except ValueError as error:
        raise ModelError(f"{path} has a line that cannot be read: {error}.") from None
    uv = np.array([*texture_at, (0.0, 0.0)], np.float64)  # the last, number -1, is that of corners without any
    parts = []
    for name, polygons in faces.items():
        at, to = np.array([corner for polygon in polygons for corner in polygon], np.int64).reshape(-1, 2).T
        if at.min() < 0 or at.max() >= len(position) or to.min() < -1 or to.max() >= len(uv) - 1:
            raise ModelError(f"{path}: material {name!r} has a face with a vertex that is not in the file.")
        at, to = np.concatenate([_cut(group, position) for group in _by_length(polygons)]).transpose(2, 0, 1)
        corners = position[at]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        keep = area > 0
        if keep.any():
            material = libraries.get(name, Material(colour=(0.8, 0.8, 0.8)))
            parts.append((corners[keep], uv[to[keep]], material))
    if not parts:
        raise ModelError(f"{path} has no triangle with an area.")
    return parts


def _by_length(polygons: list) -> list[np.ndarray]:
    """Polygons with as many corners, together: int64 [m, n, 2]."""
    groups: dict[int, list] = {}
    for polygon in polygons:
        if len(polygon) > 2:
            groups.setdefault(len(polygon), []).append(polygon)
    return [np.array(group, np.int64) for group in groups.values()] or [np.zeros((0, 3, 2), np.int64)]


def _cut(polygons: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Polygons [m, n, 2] (vertex, texture coordinate) -> triangles [F, 3, 2]."""
    count = polygons.shape[1]
    fan = np.array([(0, k, k + 1) for k in range(1, count - 1)])
    corners = position[polygons[..., 0]]
    edge = corners[:, 1:] - corners[:, :1]
    normals = np.cross(edge[:, :-1], edge[:, 1:])
    whole = normals.sum(1, keepdims=True)
    hollow = (normals * whole).sum(2).min(1) < -1e-6 * (whole**2).sum((1, 2))
    triangles = [polygons[~hollow][:, fan].reshape(-1, 3, 2)]
    for polygon, own in zip(polygons[hollow], corners[hollow], strict=True):
        triangles.append(polygon[np.array(triangles_of(own))])
    return np.concatenate(triangles)


def _indices(corner: str, vertices: int, coordinates: int) -> tuple[int, int]:
    """Vertex and texture coordinate (-1: none) of "7/3/2", from 0; the file counts from 1, or back from the end."""
    fields = corner.split("/")
    v = int(fields[0])
    t = int(fields[1]) if len(fields) > 1 and fields[1] else 0
    return v - 1 if v > 0 else vertices + v, t - 1 if t >= 0 else coordinates + t


def read_materials(path: Path) -> dict[str, Material]:
    """A Wavefront MTL file; what it does not say is grey and dull."""
    if not path.exists():
        return {}
    found: dict[str, dict[str, str]] = {}
    entry: dict[str, str] = {}
    for line in path.read_text("latin-1").splitlines():
        word, _, rest = line.strip().partition(" ")
        if word == "newmtl":
            entry = found.setdefault(rest.strip(), {})
        elif word:
            entry[word] = rest.strip()
    return {name: _material(entry, path.parent) for name, entry in found.items()}


def _figures(text: str) -> np.ndarray:
    return np.array([float(t) for t in text.split()], np.float64)


def _material(entry: dict[str, str], folder: Path) -> Material:
    texture = None
    if "map_Kd" in entry:
        # Some paths are those of the author's own disk: the image lies beside the model all the same, or is missing.
        file = folder / entry["map_Kd"].replace("\\", "/").split("/")[-1].strip()
        image = cv2.imread(str(file), cv2.IMREAD_UNCHANGED) if file.exists() else None
        if image is not None:
            image = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image
            side = 1024 / max(image.shape[:2])
            if side < 1:
                image = cv2.resize(image, None, fx=side, fy=side, interpolation=cv2.INTER_AREA)
            texture = image[..., [2, 1, 0, *range(3, image.shape[2])]]
            if texture.shape[2] == 4 and texture[..., 3].min() > 250:
                texture = np.ascontiguousarray(texture[..., :3])
    colour = np.clip(_figures(entry.get("Kd", "0.8 0.8 0.8")), 0, 1)
    if texture is not None:
        colour = np.ones(3)  # exporters leave any grey here, or black, beside an image
    strength = float(np.clip(_figures(entry.get("Ks", "0 0 0")).mean(), 0, 1))
    shininess = float(np.clip(_figures(entry.get("Ns", "20"))[0], 2, 400))
    emission = float(np.clip(_figures(entry.get("Ke", "0 0 0")).max(), 0, 4))
    opacity = float(np.clip(_figures(entry.get("d", "1"))[0], 0.05, 1))
    return Material(texture, tuple(map(float, colour)), strength, shininess, 0.0, opacity, emission)
