"""Measures real photographs that training did not see: points and silhouette of the fitted head.

Points are compared with MediaPipe's face network, the silhouette with the person's mask. The fit gets neither. The
network's points are landmarks on the template head (`export.heads.photos`), and so is each vertex of a fitted mesh. The
baseline is the mean head, posed by the same encoder's template points, with the same camera model.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import igl
import numpy as np
from maquette import Frame, HeadBuilder, MaquetteError
from tqdm import tqdm

from benchmarks.heads.drawing import DrawnMesh, framed
from benchmarks.heads.fitted import DM_PER_M, cameras_of, z_up
from benchmarks.heads.mean_head import MM_PER_DM, mesh_of, template_points
from export.camera import Camera
from export.heads.fitting.anchor_fit import fit_anchors, observations_of
from export.heads.fitting.photo import Encoder, look_at
from export.heads.head_shards import CROP_SIDES
from export.heads.photos.faces import HEAD, UNKNOWN, PhotoFaces
from export.heads.prior_file import read_prior
from export.heads.shapes import vertex_normals
from export.teachers.faces import LEFT_EYE, RIGHT_EYE

SPLITS = ("val", "test")  # no training of the encoder saw these; val decided when to end it


@dataclass(frozen=True, eq=False)
class RealFace:
    """rgb: the photo, uint8 [H, W, 3]; box: of the head; square: middle x, y and side of its crop, photo pixels; pixel
    [P, 2] of the template points [P, 3] (dm) in the photo, valid if weight [P] is above 0; matte: as in `PhotoFaces`;
    eyes_px: distance of the outer corners of the eyes."""

    name: str
    split: str
    rgb: np.ndarray
    box: np.ndarray
    square: np.ndarray
    pixel: np.ndarray
    template: np.ndarray
    weight: np.ndarray
    matte: np.ndarray
    eyes_px: float


@dataclass(frozen=True, eq=False)
class PosedMesh:
    """A mesh in front of a photo's camera: points, template [V, 3] dm, faces [F, 3]."""

    points: np.ndarray
    template: np.ndarray
    faces: np.ndarray
    camera: Camera

    def at(self, template: np.ndarray) -> np.ndarray:
        """Returns its points [N, 3] at the given template points, or nearest to them on the template."""
        _, face, near = igl.point_mesh_squared_distance(
            np.ascontiguousarray(template, np.float64), self.template, self.faces
        )
        corners = (np.ascontiguousarray(self.template[self.faces[face, k]]) for k in range(3))
        weight = igl.barycentric_coordinates(np.ascontiguousarray(near), *corners)
        # A triangle that is degenerate on the template has no such coordinates.
        weight = np.where(np.isfinite(weight).all(1, keepdims=True), weight, 1 / 3)
        return (self.points[self.faces[face]] * weight[..., None]).sum(1)


def real_faces(photos: Path, faces: Path, splits: Sequence[str] = SPLITS) -> Iterator[RealFace]:
    """photos: of `export.photos people`; faces: of `export.heads.photos.faces`."""
    for split in splits:
        for path in sorted((faces / split).glob("*.npz")):
            picture = next((p for p in (photos / split).glob(f"{path.stem}.*") if p.suffix in (".jpg", ".png")), None)
            if picture is None:
                continue
            found = PhotoFaces.load(path)
            with Frame.decode(picture.read_bytes()) as frame:
                rgb = frame.pixels()
            for k, (x, y, side) in enumerate(found.square.astype(np.float64)):
                half = side / CROP_SIDES / 2
                pixel = [x, y] + ((found.pixel[k].astype(np.float64) + 0.5) / found.rgb.shape[1] - 0.5) * side
                yield RealFace(
                    f"{path.stem}/{k}", split, rgb, np.array([x, y, x, y]) + 0.5 + half * np.array([-1, -1, 1, 1]),
                    found.square[k], pixel, found.template.astype(np.float64), found.weight[k], found.matte[k],
                    float(np.linalg.norm(pixel[LEFT_EYE] - pixel[RIGHT_EYE])),
                )  # fmt: skip


def metrics_of(face: RealFace, mesh: PosedMesh) -> dict:
    """points_px: mean distance of its points from the network's points; points: the same relative to the eye distance;
    matte_iou: None if the person's mask does not cover the head."""
    used = face.weight > 0
    away = np.linalg.norm(mesh.camera.projected(mesh.at(face.template[used]))[0] - face.pixel[used], axis=1)
    points_px = float(np.average(away, weights=face.weight[used]))
    return {"points_px": points_px, "points": points_px / face.eyes_px, "matte_iou": matte_iou(face, mesh)}


def matte_iou(face: RealFace, mesh: PosedMesh) -> float | None:
    x, y, side = face.square
    square = np.array([x, y, x, y]) + 0.5 + side / 2 * np.array([-1, -1, 1, 1])
    camera, _ = framed(mesh.camera, square, 1.0, len(face.matte))
    normals = vertex_normals(mesh.points, mesh.faces)
    grey = DrawnMesh.coloured(mesh.points, mesh.faces, normals, lambda place: np.full((len(place.face), 3), 127.0))
    drawn, head, known = grey.shown(camera)[1], face.matte == HEAD, face.matte != UNKNOWN
    if not head.any():
        return None
    return float((drawn & head).sum() / ((drawn | head) & known).sum())


class MeanHeads:
    """The mean head of a bundle, posed in photos by its encoder's output."""

    def __init__(self, bundle: Path) -> None:
        self._encoder, self._prior = Encoder(bundle), read_prior(bundle / "prior.maqp")
        mesh = mesh_of(self._prior)
        self._points, self._faces = mesh.points / MM_PER_DM, mesh.faces
        self._template = template_points(self._prior, self._points)

    def posed(self, rgb: np.ndarray, box: np.ndarray) -> PosedMesh:
        """Returns the posed mean head. Raises ValueError if the encoder finds no head."""
        seen = observations_of(look_at(self._encoder, rgb[..., ::-1], tuple(box)))
        found = fit_anchors(self._prior, seen, moves_codes=False).pose.camera()
        height, width = rgb.shape[:2]
        centre = -found.rotation.T @ found.shift
        camera = Camera.centred(width, height, found.focal_px, found.rotation, centre)
        return PosedMesh(self._points, self._template, self._faces, camera)


def fitted_mesh(builder: HeadBuilder, face: RealFace, seconds: float) -> PosedMesh:
    """Returns the fitted head. Raises MaquetteError."""
    builder.clear()
    builder.add_photo(face.rgb, face.box)
    with builder.fit(seconds) as head:
        mesh, camera = head.mesh("all"), cameras_of(head)[0]
    points, template = (z_up(a) * DM_PER_M for a in (mesh.positions_m, mesh.template_points_m))
    return PosedMesh(points, template, mesh.triangles.astype(np.int64), camera)


def measure_real(
    bundle: Path, photos: Path, faces: Path, seconds: Sequence[float], count: int | None = None, threads: int = 0
) -> list[dict]:
    """Returns one row for each face and time of fitting, at most `count` faces; none without photographs."""
    found, rows = list(real_faces(photos, faces))[:count], []
    if not found:
        return rows
    mean = MeanHeads(bundle)
    with HeadBuilder(bundle, texture=False, threads=threads) as builder:
        for face in tqdm(found, desc="real photographs", unit="face", disable=None):
            about = {"face": face.name, "split": face.split, "eyes_px": face.eyes_px}
            try:
                before = {
                    f"mean_{key}": value for key, value in metrics_of(face, mean.posed(face.rgb, face.box)).items()
                }
                for asked in seconds:
                    rows.append(
                        about | before | {"asked_s": asked} | metrics_of(face, fitted_mesh(builder, face, asked))
                    )
            except (MaquetteError, ValueError) as error:
                rows += [about | {"asked_s": asked, "missing": str(error)} for asked in seconds]
    return rows
