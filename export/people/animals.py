"""Animals of the game 0 A.D. as things beside people: what a detector of people must not take for one.

Meshes come in the game's binary form (PMD, "PSMD": vertices with normals, texture coordinates and bone weights, then
triangles; the bind pose stands on the ground, y up, z forward). Which texture belongs to which mesh is written in the
game's actors and their variants. Splits share no animal.
"""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from export.people import assets
from export.people.motion import split_of
from export.people.props import Prop

METRES_PER_UNIT = 0.42  # a horse of 5.5 units is 2.3 m tall with its head


@dataclass(frozen=True)
class Animal:
    """corners [F, 3, 3] in metres, x to the left, y to the back, z up, feet on z = 0; normals [F, 3, 3]; uv [F, 3, 2];
    texture files."""

    name: str
    corners: np.ndarray
    normals: np.ndarray
    uv: np.ndarray
    textures: tuple[Path, ...]

    @property
    def species(self) -> str:
        return self.name.removeprefix("animal_").removeprefix("fauna_").split("_")[0].lower()

    @property
    def extent(self) -> float:
        """The larger of its height and three quarters of its length, metres."""
        _, length, height = np.ptp(self.corners.reshape(-1, 3), axis=0)
        return float(max(height, 0.75 * length))

    def scaled(self, rng: np.random.Generator, scale: float) -> Prop:
        """The animal facing -y at the origin, `scale` times its size, with one of its coats."""
        texture = _texture(self.textures[rng.integers(len(self.textures))])
        stretch = rng.uniform(0.9, 1.1, 3) * scale
        tint = tuple(rng.uniform(0.6, 1.15) * (1 + rng.normal(0, 0.06, 3)))
        return Prop(self.corners * stretch, self.uv, texture, tint, normals=self.normals / stretch)


def read_mesh(data: bytes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners [F, 3, 3] (the game's units and axes), normals [F, 3, 3] and texture coordinates [F, 3, 2] of a PMD file.

    Raises ValueError when the file is not one, of an unknown version, or shorter than it says.
    """
    if data[:4] != b"PSMD":
        raise ValueError("not a PMD mesh")
    version, _, count = struct.unpack_from("<III", data, 4)
    if version not in (3, 4):
        raise ValueError(f"PMD version {version}; 3 and 4 are read")
    layers, at = (struct.unpack_from("<I", data, 16)[0], 20) if version == 4 else (1, 16)
    stride = 24 + 8 * layers + 20
    if layers < 1 or at + stride * count + 4 > len(data):
        raise ValueError("PMD mesh is cut off")
    vertices = np.frombuffer(data, np.uint8, stride * count, at).reshape(count, stride)
    values = np.ascontiguousarray(vertices[:, :32]).view("<f4").astype(np.float64)
    at += stride * count
    (faces,) = struct.unpack_from("<I", data, at)
    if at + 4 + 6 * faces > len(data):
        raise ValueError("PMD mesh is cut off")
    triangle = np.frombuffer(data, "<u2", 3 * faces, at + 4).reshape(-1, 3)
    if faces and triangle.max() >= count:
        raise ValueError("PMD triangle names a vertex that is not there")
    corners = values[triangle]
    return corners[..., :3], corners[..., 3:6], corners[..., 6:] * [1, -1] + [0, 1]  # rows of textures count from below


@lru_cache(maxsize=64)
def _texture(path: Path) -> np.ndarray:
    """RGB uint8 [h, w, 3], at most 256 pixels a side, the first row at v = 0."""
    from PIL import Image  # reads DDS, which OpenCV does not

    image = Image.open(path).convert("RGB")
    scale = max(1, max(image.size) // 256)
    return np.asarray(image.reduce(scale))


def _texture_file(name: str) -> Path | None:
    """The cached DDS of a texture as actors name it ("skeletal/animal_wolf.png")."""
    for suffix in (".cached.dds", ""):
        path = assets.zero_ad() / "textures" / "skins" / f"{name}{suffix}"
        if path.exists() and path.suffix == ".dds":
            return path
    return None


def _coats(actor: Path) -> tuple[set[str], set[str]]:
    """Meshes and base textures that an actor names, itself or in its variants."""
    meshes, textures, left, seen = set(), set(), [actor], set()
    while left:
        path = left.pop()
        if path in seen or not path.exists():
            continue
        seen.add(path)
        root = ElementTree.parse(path).getroot()
        meshes |= {m.text.strip() for m in root.iter("mesh") if m.text}
        textures |= {t.get("file") for t in root.iter("texture") if t.get("name") == "baseTex" and t.get("file")}
        left += [assets.zero_ad() / "variants" / v.get("file") for v in root.iter("variant") if v.get("file")]
    return meshes, textures


@lru_cache(maxsize=3)
def load_animals(split: str) -> tuple[Animal, ...]:
    """The animals of a split ("train", "val", "test"), in the order of their names."""
    coats: dict[str, set[Path]] = {}
    for actor in sorted((assets.zero_ad() / "actors" / "fauna").glob("*.xml")):
        meshes, textures = _coats(actor)
        files = {f for f in map(_texture_file, textures) if f is not None}
        for mesh in meshes:
            coats.setdefault(mesh, set()).update(files)
    animals = []
    for mesh, files in sorted(coats.items()):
        path = assets.zero_ad() / "meshes" / f"{mesh}.cached.pmd"
        name = Path(mesh).stem
        if not files or not path.exists():
            continue
        corners, normals, uv = (a[:, ::-1] for a in read_mesh(path.read_bytes()))
        # Forward becomes -y, as for people; the order of corners changed with the handedness of the axes.
        corners, normals = (a[..., [0, 2, 1]] * [1, -1, 1] for a in (corners * METRES_PER_UNIT, normals))
        size = np.ptp(corners.reshape(-1, 3), axis=0)
        if not np.isfinite(corners).all() or size.min() < 0.02 or size.max() > 15:
            continue
        corners -= [0, 0, corners[..., 2].min()]
        animal = Animal(name, corners, normals, uv, tuple(sorted(files)))
        if split_of(animal.species) == split:
            animals.append(animal)
    return tuple(animals)
