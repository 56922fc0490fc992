"""Makes test heads from scans: people of a linear model (`export.heads.scans`), some smiling, half of them bald.

    python -m benchmarks.heads.scanned_people --scans .data/heads/scans.npz --out .data/heads/scanned

Every head has components of identity that no training sees, at twice their size, and those that trainings see, in other
mixtures. Images show the source's own surface with hair, skin tones and light of synthetic heads, one from the front
and one from 30 degrees. Beside them: the points of the surface that cameras see, and the pupils.
"""

from __future__ import annotations

import argparse
import zlib
from dataclasses import dataclass, fields
from pathlib import Path

import igl
import numpy as np
from tqdm import tqdm

from export.heads.head_shards import HeadImages, is_face
from export.heads.sampling import look_at, sample_camera, sample_lamps
from export.heads.scans.scanned_heads import EYES, SKIN_VERTICES, ScannedHeads, read_scanned_heads, sample_coefficients
from export.heads.shapes import vertex_normals
from export.heads.surface import HAIR, Head, HeadMaker, Place, barycentric, cut_distance
from export.heads.synthetic_heads import make_maker
from export.heads.view_shards import image_row
from export.heads.views import Scene

YAWS = (0.0, np.radians(30))
SURFACE_POINTS = 6000
COLLAR_DM = -1.9  # of the template: what is lower wears clothes
SIZE_DM = 4.0  # side of the square around a head that `seen_points` looks at


@dataclass(frozen=True, eq=False)
class ScannedPerson:
    """A head ready to be seen, dm. pupils [2, 3]: fronts of the eyeballs; front [N, 3]: vertices of the face."""

    scene: Scene
    pupils: np.ndarray
    front: np.ndarray


def make_person(scans: ScannedHeads, maker: HeadMaker, number: int) -> ScannedPerson:
    rng = np.random.default_rng([zlib.crc32(b"scanned people"), number])
    identity = sample_coefficients(len(scans.identity), rng, held_out=True)
    expression = scans.sample_expression(rng, smiles=number % 3 == 0)
    gender = float(rng.random())
    style = maker.barber.sample(rng, gender, 0.7)
    while (style.name == "none") != (number % 2 == 0) or style.beard.any():
        style = maker.barber.sample(rng, gender, 0.7)
    vertices = scans.vertices(maker.shapes, identity, expression)
    head = Head(maker, vertices, style, maker.barber.shells(vertices, style, rng), rng)
    own = scans.surface(maker.shapes, identity, expression)
    first = SKIN_VERTICES
    pupils = []
    for start, end in EYES:
        ball = own[first : first + end - start]
        pupils.append(ball[np.argmin(ball[:, 1])])
        first += end - start
    skin = np.unique(maker.faces)
    front = vertices[skin[is_face(maker.shapes.template[skin])]]
    return ScannedPerson(_scene(scans, head, own, rng.uniform(20, 220, 3)), np.stack(pupils), front)


def _scene(scans: ScannedHeads, head: Head, own: np.ndarray, cloth: np.ndarray) -> Scene:
    """The source's own surface, hair, and the shoulders of the template below the neck."""
    shapes = head.maker.shapes
    is_hair = head.kind == HAIR
    skin_faces, painted = scans.own_faces, np.flatnonzero(~is_hair)
    below = shapes.bust_faces
    starts = np.cumsum([0, len(own), len(head.positions)])
    faces = np.concatenate([skin_faces, head.faces[is_hair] + starts[1], below + starts[2]])
    template = np.concatenate([scans.own_template, head.template_points, shapes.template])
    normals = np.concatenate([vertex_normals(own, skin_faces), head.normals, vertex_normals(head.vertices, below)])
    hair = np.flatnonzero(is_hair)

    def colours(place: Place) -> np.ndarray:
        out = np.zeros((len(place.face), 3))
        hairy = (place.face >= len(skin_faces)) & (place.face < len(skin_faces) + len(hair))
        out[hairy] = head.colours_at(Place(hair[place.face[hairy] - len(skin_faces)], place.weight[hairy]))
        points = (template[faces[place.face[~hairy]]] * place.weight[~hairy][..., None]).sum(1)
        _, face, at = igl.point_mesh_squared_distance(points, head.template_points, head.faces[painted])
        weight = barycentric(at, head.template_points[head.faces[painted[face]]])
        out[~hairy] = head.colours_at(Place(painted[face], weight))
        out[np.flatnonzero(~hairy)[points[:, 2] < COLLAR_DM]] = cloth
        return out

    points = np.concatenate([own, head.positions, head.vertices])
    return Scene(points, faces, normals, template, colours, lambda points: cut_distance(points) < 0)


def seen_points(scene: Scene, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points of the head and their template points [N, 3], evenly spread over what cameras on all sides see."""
    lamps, found = sample_lamps(rng), []
    for pitch in (-0.5, 0.3, 1.0):
        for yaw in np.arange(8) * np.pi / 4:
            camera = look_at(yaw, pitch, 0.0, 12.0, np.zeros(3), 96 * 12 / SIZE_DM, 96)
            seen = scene.seen(camera, lamps)
            y, x = np.nonzero(seen.mask)
            points = camera.lifted(np.stack([x, y], 1), seen.depth[y, x])
            found.append(np.concatenate([points, seen.template[y, x]], 1))
    rows = np.concatenate(found)
    rows = rows[rng.choice(len(rows), SURFACE_POINTS, replace=False)]
    return rows[:, :3], rows[:, 3:]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scans", type=Path, default=Path(".data/heads/scans.npz"))
    parser.add_argument("--out", type=Path, default=Path(".data/heads/scanned"))
    parser.add_argument("--count", type=int, default=24)
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    scans, maker = read_scanned_heads(arguments.scans), make_maker()
    for number in tqdm(range(arguments.count), unit="head"):
        person = make_person(scans, maker, number)
        rng = np.random.default_rng([zlib.crc32(b"images of scanned people"), number])
        surface, template = seen_points(person.scene, rng)
        rows = [image_row(person.scene.seen(sample_camera(surface, rng, yaw), sample_lamps(rng))) for yaw in YAWS]
        pictures = HeadImages(*(np.stack(column) for column in zip(*rows, strict=True)))
        columns = {f.name: getattr(pictures, f.name) for f in fields(pictures)}
        np.savez(
            arguments.out / f"scanned-{number:02}.npz", surface=surface.astype(np.float32),
            face=is_face(template), pupils=person.pupils, front=person.front, **columns,
        )  # fmt: skip


if __name__ == "__main__":
    main()
