"""Compares new views of a head fitted to one photo with images of the true head, in the photo's light.

Metrics: PSNR and a distance by features, inside both silhouettes. The baseline is the mean head with the photo
projected onto it by the true camera. Fitted and mean head are aligned with the true head (rigid and scale). Where the
photo does not see the mean head, or only at a flat angle, it has the colour of the nearest point that the photo sees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch
from scipy.spatial import cKDTree

from benchmarks.heads import drawing
from benchmarks.heads.distances import MM_PER_DM, Similarity, Triangles
from benchmarks.heads.drawing import GREY, DrawnMesh
from benchmarks.heads.photos import Photo
from benchmarks.heads.visible import seen_from
from export.camera import Camera
from export.heads.shapes import vertex_normals
from export.heads.surface import HeadMaker, Place
from export.scenes.perceptual import Perceptual

TURNS_DEG = (-60.0, -45.0, -30.0, 30.0, 45.0, 60.0)  # degrees around the head's axis, from the photo's camera
SIDE_PX = 160
MIN_COSINE = 0.3  # degrees to the ray; at flatter angles the photo gives no colour


@dataclass(frozen=True, eq=False)
class View:
    """A true image: camera in dm of the true head's frame, rgb uint8 [H, W, 3] before grey, mask bool [H, W]."""

    camera: Camera
    rgb: np.ndarray
    mask: np.ndarray


def true_views(maker: HeadMaker, name: str, number: int, camera: Camera) -> list[View]:
    """Returns new views of a synthetic head around the camera of its image `number`, in that image's light."""
    views, lamps = drawing.made_head(maker, name, number)
    found = []
    for turn in TURNS_DEG:
        seen = views.seen(drawing.beside(camera, turn, SIDE_PX), lamps)
        rgb = np.where(seen.mask[..., None], seen.rgb, GREY)
        found.append(View(seen.camera, rgb.round().astype(np.uint8), seen.mask))
    return found


def moved(camera: Camera, to_mesh: Similarity) -> Camera:
    """Returns the same camera in the frame of a mesh; `to_mesh` (mm) maps the true head to it."""
    return replace(
        camera,
        rotation=camera.rotation @ to_mesh.rotation.T,
        centre=to_mesh(camera.centre[None] * MM_PER_DM)[0] / MM_PER_DM,
    )


def view_errors(
    drawn: DrawnMesh, to_mesh: Similarity, views: Sequence[View], perceptual: Perceptual | None = None
) -> dict[str, float]:
    """Returns means over the views, over pixels that either head covers: psnr_db, and distance (lower is better) if
    there is a network for it."""
    psnr, distance = [], []
    for view in views:
        rgb, present = drawn.shown(moved(view.camera, to_mesh))
        either = present | view.mask
        error = (rgb[either].astype(np.float64) - view.rgb[either]) ** 2
        psnr.append(10 * np.log10(255**2 / max(error.mean(), 1e-9)))
        if perceptual:
            with torch.inference_mode():
                distance.append(float(perceptual(_tensor(rgb), _tensor(view.rgb), _tensor(255 * either[..., None]))))
    return {"psnr_db": float(np.mean(psnr))} | ({"distance": float(np.mean(distance))} if perceptual else {})


def _tensor(picture: np.ndarray) -> torch.Tensor:
    """Converts [H, W, C] in 0..255 to float32 [1, C, H, W] in 0..1."""
    return torch.from_numpy(np.ascontiguousarray(picture)).permute(2, 0, 1)[None].float() / 255


def with_photo(mesh: Triangles, to_mesh: Similarity, photo: Photo) -> DrawnMesh:
    """A mesh (mm) with the photo projected onto it."""
    camera = moved(photo.camera, to_mesh)
    points = mesh.points / MM_PER_DM
    normals = vertex_normals(points, mesh.faces)

    def is_seen(at: np.ndarray, outwards: np.ndarray) -> np.ndarray:
        towards = camera.centre - at
        towards /= np.linalg.norm(towards, axis=1, keepdims=True)
        steep = (outwards * towards).sum(1) > MIN_COSINE
        return steep & seen_from(points, mesh.faces, at, outwards, camera.centre[None])

    def sampled(at: np.ndarray) -> np.ndarray:
        if not len(at):
            return np.zeros((0, 3))
        pixel = camera.projected(at)[0].astype(np.float32)
        flat = cv2.remap(
            photo.rgb, np.ascontiguousarray(pixel[:, :1]), np.ascontiguousarray(pixel[:, 1:]), cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )  # fmt: skip
        return flat[:, 0].astype(np.float64)

    known = points[is_seen(points, normals)]
    nearest, of_known = cKDTree(known), sampled(known)

    def colours(place: Place) -> np.ndarray:
        at, outwards = (
            (values[mesh.faces[place.face]] * place.weight[..., None]).sum(1) for values in (points, normals)
        )
        outwards /= np.maximum(np.linalg.norm(outwards, axis=1, keepdims=True), 1e-9)
        out, seen = of_known[nearest.query(at)[1]], is_seen(at, outwards)
        out[seen] = sampled(at[seen])
        return out

    return DrawnMesh.coloured(points, mesh.faces, normals, colours)
