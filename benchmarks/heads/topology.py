"""How well the template head lies on fitted heads: from its vertices to the surface, to their template points, and to
the same places on the true heads.

    python -m benchmarks.heads.topology --heads 20 --seconds 0

In: as benchmarks.heads.quality, made heads of the split test. Out: a table in mm.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np
import torch
from maquette import Head, HeadBuilder, MaquetteError
from scipy.spatial import cKDTree

from benchmarks.heads.distances import MM_PER_DM
from benchmarks.heads.photos import PhotoBackgrounds, TrueHead, generator, photo_of, read_made_heads
from benchmarks.heads.quality import BACKGROUNDS, BUNDLE, DATA
from export.heads.field import geometry, surface
from export.heads.head_file import StoredHead, read_head
from export.heads.head_shards import is_face
from export.heads.shapes import HeadShapes
from export.heads.template_file import Kind, Template, read_template

STORED_WITHIN_DM = 2e-4  # points of the file


@dataclass(frozen=True)
class Figures:
    """All in mm. distance: of the vertices of the surface from it, in the field. residual: of the template points that
    the field has there from the wanted ones. place: of vertices of the face from the true head's, after alignment with
    scale; template_place: the same of the template head itself."""

    mean_distance: float
    largest_distance: float
    mean_residual: float
    largest_residual: float
    place: float
    template_place: float


def moved_onto(points: np.ndarray, onto: np.ndarray) -> np.ndarray:
    """Points [N, 3] by the similarity that brings them nearest to `onto` (Umeyama, 1991)."""
    middle, goal = points.mean(0), onto.mean(0)
    u, size, vt = np.linalg.svd((onto - goal).T @ (points - middle))
    sign = np.array([1, 1, np.sign(np.linalg.det(u @ vt))])
    scale = (size * sign).sum() / np.square(points - middle).sum()
    return scale * (points - middle) @ (u * sign @ vt).T + goal


def in_field(head: StoredHead, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances [N] to first order and template points [N, 3] of the head's field at points [N, 3], dm."""
    weights = [torch.from_numpy(np.concatenate([w.weights, w.bias[:, None]], 1)) for w in head.layers]
    at = torch.from_numpy(points.astype(np.float32)).requires_grad_()
    out = geometry(head.shape, weights, at)
    (slope,) = torch.autograd.grad(out[:, 0].sum(), at)
    _, template = surface(head.shape, weights, at, out)
    distance = out[:, 0].abs() / slope.norm(dim=1)
    return distance.detach().numpy(), template.detach().numpy()


def stored(head: Head) -> StoredHead:
    """What the library writes of it: the C API does not give the field."""
    with tempfile.TemporaryDirectory() as folder:
        head.save(Path(folder) / "head.maqh")
        return read_head(Path(folder) / "head.maqh")


def figures_of(fitted: Head, true: np.ndarray, template: Template, same: np.ndarray) -> Figures:
    """true [V, 3]: vertices of the true head, dm; same [P]: which of them each point of the template is, or -1."""
    file = stored(fitted)
    points = np.zeros_like(template.points)
    points[template.vertex_points] = fitted.mesh(topology="template").positions_m / file.metres_per_unit
    skin = template.kinds == Kind.SURFACE
    distance, found = in_field(file, points[skin])
    residual = np.linalg.norm(found - template.points[skin], axis=1)
    face = skin & (same >= 0) & is_face(template.points)
    goal = true[same[face]]
    places = [np.linalg.norm(moved_onto(some[face], goal) - goal, axis=1).mean() for some in (points, template.points)]
    return Figures(*(float(v * MM_PER_DM) for v in (
        distance.mean(), distance.max(), residual.mean(), residual.max(), *places
    )))  # fmt: skip


def same_vertices(template: Template) -> np.ndarray:
    """Which vertex of made heads each point of the template is [P]; -1 for none."""
    shapes = HeadShapes()
    vertices = shapes.template[: shapes.head_vertices]
    away, number = cKDTree(vertices).query(template.points)
    return np.where(away < STORED_WITHIN_DM, number, -1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bundle", type=Path, default=BUNDLE)
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--backgrounds", type=Path, default=BACKGROUNDS)
    parser.add_argument("--heads", type=int, default=20, help="how many (default 20)")
    parser.add_argument("--seconds", type=float, default=0, help="of fitting (default 0: the encoder's head)")
    options = parser.parse_args()
    template = read_template(options.bundle / "template.maqt")
    same, backgrounds = same_vertices(template), PhotoBackgrounds(options.backgrounds)
    rows: list[Figures] = []
    heads: list[TrueHead] = read_made_heads(options.data, options.heads)
    with HeadBuilder(options.bundle) as builder:
        for head in heads:
            k = head.front()
            if k is None:
                continue
            photo = photo_of(head.pictures, k, backgrounds, generator(head.name, k))
            true = np.load(options.data / "points" / "test" / f"{head.name}.npz")["vertices"]
            builder.clear()
            try:
                builder.add_photo(photo.rgb, photo.box)
                with builder.fit(options.seconds) as fitted:
                    rows.append(figures_of(fitted, true, template, same))
            except MaquetteError as error:
                print(f"{head.name}: {error}")
                continue
            print(f"{head.name}: " + ", ".join(f"{k} {v:.3f}" for k, v in asdict(rows[-1]).items()), flush=True)
    if not rows:
        raise SystemExit("No head was found.")
    print(f"| mm, {len(rows)} heads | mean of heads | largest |\n| --- | --- | --- |")
    for field in fields(Figures):
        values = [getattr(row, field.name) for row in rows]
        print(f"| {field.name} | {np.mean(values):.3f} | {np.max(values):.3f} |")


if __name__ == "__main__":
    main()
