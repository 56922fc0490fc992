"""Logs results to a viewer of `rerun`, in metres and in the convention of OpenCV (x right, y down, z forward).

rerun.init("maquette", spawn=True)
for frame in camera:
    log_people("camera", frame, people.run(frame))
"""

from __future__ import annotations

import numpy as np
import rerun

from maquette.densepose import DensePoseResult, part_colours, part_name
from maquette.edges import Curves
from maquette.frames import Frame, Intrinsics
from maquette.heads import HeadMesh
from maquette.scenes import PinholeCamera


def log_frame(path: str, frame: Frame) -> None:
    """The image, or the depth in metres, at the frame's time on the timeline "media"."""
    rerun.set_time("media", duration=frame.timestamp_ns / 1e9)
    pixels = np.asarray(frame)
    rerun.log(path, rerun.Image(pixels) if pixels.dtype == np.uint8 else rerun.DepthImage(pixels, meter=1.0))
    if frame.intrinsics is not None:
        log_intrinsics(path, frame.intrinsics)


def log_people(path: str, frame: Frame, result: DensePoseResult) -> None:
    """The image, the body parts in their colours, and the boxes with ids and scores."""
    log_frame(path, frame)
    parts = [(part, part_name(part), colour.tolist()) for part, colour in enumerate(part_colours())]
    rerun.log(path, rerun.AnnotationContext(parts), static=True)
    rerun.log(f"{path}/parts", rerun.SegmentationImage(result.part, opacity=0.6))
    boxes = np.array([person.box_px for person in result.people], np.float32).reshape(-1, 4)
    labels = [f"#{person.id} {person.score:.2f}" for person in result.people]
    rerun.log(f"{path}/people", rerun.Boxes2D(array=boxes, array_format=rerun.Box2DFormat.XYXY, labels=labels))


def log_curves(path: str, curves: Curves) -> None:
    """Curves (creases yellow, boundaries white), corners red, and boxes with their sizes."""
    colours = [(255, 210, 60) if curve.kind == "crease" else (255, 255, 255) for curve in curves.curves]
    rerun.log(f"{path}/curves", rerun.LineStrips3D([curve.points_m for curve in curves.curves], colors=colours))
    rerun.log(f"{path}/corners", rerun.Points3D(curves.corners_m, colors=(230, 50, 40)))
    boxes = curves.boxes
    turns = [rerun.Quaternion(xyzw=_quaternion(box.axes.T)) for box in boxes]
    half_sizes, centres = [box.size_m / 2 for box in boxes], [box.centre_m for box in boxes]
    labels = [repr(box)[5:-1] for box in boxes]
    rerun.log(f"{path}/boxes", rerun.Boxes3D(half_sizes=half_sizes, centers=centres, quaternions=turns, labels=labels))


def log_head(path: str, mesh: HeadMesh) -> None:
    """The mesh with its colours; y up."""
    surface = rerun.Mesh3D(
        vertex_positions=mesh.positions_m, vertex_normals=mesh.normals, vertex_colors=mesh.colours,
        triangle_indices=mesh.triangles,
    )  # fmt: skip
    rerun.log(path, rerun.ViewCoordinates.RIGHT_HAND_Y_UP, static=True)
    rerun.log(path, surface)


def log_camera(path: str, camera: PinholeCamera) -> None:
    """A camera and its pose."""
    rerun.log(path, rerun.Transform3D(mat3x3=np.transpose(camera.rotation), translation=np.asarray(camera.centre)))
    log_intrinsics(path, camera.intrinsics)


def log_intrinsics(path: str, k: Intrinsics) -> None:
    focal, middle, size = (k.fx_px, k.fy_px), (k.cx_px, k.cy_px), (k.width_px, k.height_px)
    axes = rerun.ViewCoordinates.RDF
    rerun.log(path, rerun.Pinhole(focal_length=focal, principal_point=middle, resolution=size, camera_xyz=axes))


def _quaternion(rotation: np.ndarray) -> np.ndarray:
    """x, y, z, w of a rotation [3, 3]; a reflection is turned into one first."""
    matrix = rotation * np.sign(np.linalg.det(rotation))
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = matrix
    symmetric = [[xx - yy - zz, 0, 0, 0], [yx + xy, yy - xx - zz, 0, 0], [zx + xz, zy + yz, zz - xx - yy, 0],
                 [zy - yz, xz - zx, yx - xy, xx + yy + zz]]  # fmt: skip
    return np.linalg.eigh(np.array(symmetric) / 3)[1][:, -1]  # eigh reads the lower triangle
