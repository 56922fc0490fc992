"""Makes test heads from another source: people of the Debian package sweethome3d-furniture (Reallusion, CC-BY 3.0).

    python -m benchmarks.heads.other_heads --out .data/heads/other

Nothing is trained on them: other shapes, photographed skins, hair as meshes with textures. Writes images as
`export.heads.view_shards` does, without template points, and beside them the points of the surface that cameras see.
"""

from __future__ import annotations

import argparse
import subprocess
import zipfile
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import trimesh
from tqdm import tqdm

from export.heads.head_shards import FACE_RADIUS_DM, HeadImages
from export.heads.sampling import look_at, sample_camera, sample_lamps
from export.heads.shapes import vertex_normals
from export.heads.surface import Place
from export.heads.view_shards import image_row
from export.heads.views import Scene
from export.people.assets import Package, fetch

PACKAGE = Package(
    "apt",
    "sweethome3d-furniture",
    "1.8-1",
    "sweethome3d-furniture_1.8-1_all.deb",
    "3ccb90c63f9525e887a767b9cd5c8b6933b8b6b2973a615a5359ee68a2118668",
    "CC-BY-3.0",
    "heads to judge with",
)
# Standing people, and their rotation about the vertical to face -y, degrees.
PEOPLE = {
    "female01": -90, "female02": 0, "female03": 0, "male01": 0, "male02": 25, "male03": 0, "boyStanding": 0,
    "girlStanding": 0, "holdingFemale01": 0, "holdingFemale02": 0, "holdingMale01": 0, "sitFemale01": 0,
    "sitMale01": 0, "sitMale02": 0,
}  # fmt: skip
HEAD_DM = 2.45  # dm, from the crown to below the chin


@dataclass(frozen=True)
class OtherHead:
    """A head in its own frame: dm, facing -y, z up, the origin near the middle of the head."""

    name: str
    scene: Scene
    nose_tip: np.ndarray


def unpacked(folder: Path) -> Path:
    """Returns the people's folder; fetches and unpacks it if it is missing."""
    out = folder / "people"
    if not out.exists():
        subprocess.run(["dpkg", "-x", str(fetch(PACKAGE)), str(folder / "package")], check=True)
        library = folder / "package/usr/share/sweethome3d/furniture/Reallusion.sh3f"
        with zipfile.ZipFile(library) as file:
            file.extractall(folder / "unpacked")
        (folder / "unpacked" / "reallusion").rename(out)
    return out


def load_head(folder: Path, name: str, turn_deg: float) -> OtherHead:
    """Returns the upper part of a person."""
    parts = trimesh.load(folder / name / f"{name}.obj", process=False, force="scene")
    positions, faces, uv, images, which = [], [], [], [], []
    start = 0
    for number, part in enumerate(parts.geometry.values()):
        p = np.asarray(part.vertices) / 10
        positions.append(np.stack([p[:, 0], -p[:, 2], p[:, 1]], 1))
        faces.append(np.asarray(part.faces) + start)
        found = getattr(part.visual, "uv", None)
        uv.append(np.zeros((len(p), 2)) if found is None else np.asarray(found))
        image = getattr(part.visual.material, "image", None)
        colour = np.asarray(part.visual.material.main_color)[:3] if image is None else None
        images.append(np.full((1, 1, 3), colour) if image is None else np.asarray(image.convert("RGB")))
        which.append(np.full(len(part.faces), number))
        start += len(p)
    vertices, triangles = np.concatenate(positions), np.concatenate(faces)
    texture, which = np.concatenate(uv), np.concatenate(which)
    angle = np.radians(turn_deg)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    vertices = vertices @ turn.T
    top = vertices[:, 2].max()
    head = vertices[vertices[:, 2] > top - HEAD_DM * 0.8]
    middle = (head.min(0) + head.max(0)) / 2
    vertices = vertices - [middle[0], middle[1], top - 1.2]
    kept = (vertices[triangles][..., 2] > -4.5).any(1)
    triangles, which = triangles[kept], which[kept]
    corners = texture[triangles]

    def colours(place: Place) -> np.ndarray:
        at = (corners[place.face] * place.weight[..., None]).sum(1)
        out = np.zeros((len(at), 3))
        for number, image in enumerate(images):
            own = which[place.face] == number
            x = ((at[own, 0] % 1) * image.shape[1]).astype(int).clip(0, image.shape[1] - 1)
            y = ((1 - at[own, 1] % 1) * image.shape[0]).astype(int).clip(0, image.shape[0] - 1)
            out[own] = image[y, x]
        return out

    front = vertices[(np.abs(vertices[:, 0]) < 0.15) & (vertices[:, 2] > -0.9) & (vertices[:, 2] < -0.15)]
    nose = front[np.argmin(front[:, 1])]
    chin = nose[2] - 0.75
    scene = Scene(
        vertices, triangles, vertex_normals(vertices, triangles), np.zeros_like(vertices), colours,
        lambda points: points[:, 2] > chin,
    )  # fmt: skip
    return OtherHead(name, scene, nose)


def seen_points(head: OtherHead, count: int, rng: np.random.Generator) -> np.ndarray:
    """Returns points [count, 3] of the surface above the chin, evenly spread over what cameras on all sides see."""
    lamps, found = sample_lamps(rng), []
    for pitch in (-0.5, 0.3, 1.0):
        for yaw in np.arange(8) * np.pi / 4:
            camera = look_at(yaw, pitch, 0.0, 12.0, np.zeros(3), 96 * 12 / 4.0, 96)
            seen = head.scene.seen(camera, lamps)
            y, x = np.nonzero(seen.mask)
            found.append(camera.lifted(np.stack([x, y], 1), seen.depth[y, x]))
    points = np.concatenate(found)
    return points[rng.choice(len(points), count, replace=False)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(".data/heads/other"))
    parser.add_argument("--views", type=int, default=8, help="images a head, from the front and sides")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    people = unpacked(arguments.out)
    for number, (name, turn) in enumerate(tqdm(PEOPLE.items(), unit="head")):
        rng = np.random.default_rng(number)
        head = load_head(people, name, turn)
        surface = seen_points(head, 6000, rng)
        rows = []
        while len(rows) < arguments.views:
            camera = sample_camera(surface, rng)
            away = -camera.rotation[2]  # dm from the head to the camera
            if abs(np.arctan2(away[0], -away[1])) < np.radians(50):
                rows.append(image_row(head.scene.seen(camera, sample_lamps(rng))))
        pictures = HeadImages(*(np.stack(column) for column in zip(*rows, strict=True)))
        face = np.linalg.norm(surface - head.nose_tip, axis=1) < FACE_RADIUS_DM
        columns = {f.name: getattr(pictures, f.name) for f in fields(pictures)}
        np.savez(arguments.out / f"{name}.npz", surface=surface.astype(np.float32), face=face, **columns)


if __name__ == "__main__":
    main()
