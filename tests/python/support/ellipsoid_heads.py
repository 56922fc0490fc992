"""Ellipsoids that stand for heads in tests of their report: meshes, true points, pictures."""

import cv2
import igl
import numpy as np

from benchmarks.heads.distances import MM_PER_DM, Triangles, TruePoints
from benchmarks.heads.mean_head import outwards
from benchmarks.heads.photos import TrueHead
from export.camera import Camera
from export.heads.head_shards import HeadPictures
from export.heads.sampling import look_at

RADII_MM = np.array([80.0, 100.0, 130.0])


def ball_points(count, seed=0):
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def ellipsoid(cells=40, radii=RADII_MM):
    """A closed mesh, counter-clockwise from outside, in mm."""
    axis = np.linspace(-1.2, 1.2, cells)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    at = np.stack([x, y, z], -1).reshape(-1, 3)
    points, faces, _ = igl.marching_cubes(np.linalg.norm(at, axis=1) - 1, at, cells, cells, cells, 0.0)
    mesh = Triangles(points * radii, np.asarray(faces, np.int64))
    return Triangles(mesh.points, outwards(mesh.points, mesh.faces))


def true_ellipsoid(count=3000):
    points = ball_points(count)
    normals = points / RADII_MM
    return TruePoints(points * RADII_MM, points[:, 1] < -0.7, normals / np.linalg.norm(normals, axis=1, keepdims=True))


def pictures_of_ellipsoid(yaws_deg, distance_dm=6.0, shift_px=0.0):
    """Pictures of 256 px, as `export.heads.view_shards` stores them: a white ellipsoid above a red bust."""
    points = ball_points(60000) * RADII_MM / MM_PER_DM
    rows = []
    for yaw in np.radians(yaws_deg):
        camera = look_at(yaw, 0.1, 0.0, distance_dm, np.zeros(3), 60.0 * distance_dm, 256)
        intrinsics = camera.intrinsics + [[0, 0, shift_px], [0, 0, -shift_px], [0, 0, 0]]
        camera = Camera.of_intrinsics(256, 256, intrinsics, camera.rotation, camera.centre)
        pixel = np.round(camera.projected(points)[0]).astype(int)
        masks = np.zeros((256, 256), np.uint8)
        masks[190:, 40:220] = 128
        masks[pixel[:, 1], pixel[:, 0]] = 255
        masks = np.maximum(masks, cv2.morphologyEx(masks, cv2.MORPH_CLOSE, np.ones((3, 3))))
        rgb = np.where(masks[..., None] == 255, [255, 255, 255], np.where(masks[..., None] == 128, [200, 0, 0], 0))
        rows.append(
            (rgb.astype(np.uint8), masks, np.zeros((128, 128, 3), np.int16), np.zeros((128, 128, 3), np.int8),
             camera.rotation, camera.world_to_camera[:, 3], np.array([camera.fx_px, camera.cx_px, camera.cy_px]))
        )  # fmt: skip
    return HeadPictures(*(np.stack(column) for column in zip(*rows, strict=True)))


def true_head(yaws_deg, name="head-00000", **settings):
    return TrueHead(name, pictures_of_ellipsoid(yaws_deg, **settings), true_ellipsoid())
