"""Equal points of the surface lie on each other's epipolar lines where labels are right."""

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from export.evaluation import views
from export.evaluation.backends import Prediction

SIZE = (180, 320)


def calibrated(yaw_degrees: float) -> views.CalibratedCamera:
    """3 m from the origin, looking at it."""
    rotation = Rotation.from_euler("y", yaw_degrees, degrees=True).as_matrix()
    inner = np.array([[300.0, 0, 90], [0, 300, 160], [0, 0, 1]])
    return views.CalibratedCamera(inner, np.array([0.02, 0, 0, 0.001]), SIZE, rotation, np.array([0, 0, 3.0]))


def surface(camera: views.CalibratedCamera) -> np.ndarray:
    """Labels [320, 180, 3] of a curved patch: U and V are its own coordinates."""
    u, v = np.meshgrid(np.linspace(0, 1, 500), np.linspace(0, 1, 900))
    points = np.stack([0.8 * (u - 0.5), 1.4 * (v - 0.5), 0.3 * np.sin(3 * u)], -1).reshape(-1, 3)
    rotation, _ = cv2.Rodrigues(camera.rotation)
    pixel, _ = cv2.projectPoints(points, rotation, camera.shift, camera.intrinsics, camera.distortion)
    x, y = np.round(pixel[:, 0]).astype(int).T
    label = np.zeros((*SIZE[::-1], 3), np.uint8)
    inside = (x >= 0) & (x < SIZE[0]) & (y >= 0) & (y < SIZE[1])
    label[y[inside], x[inside]] = np.stack([np.full(u.size, 2), 255 * u.ravel(), 255 * v.ravel()], 1)[inside]
    return label


CAMERAS = [calibrated(0), calibrated(25), calibrated(-30)]


def test_right_labels_lie_on_their_epipolar_lines_and_wrong_ones_do_not():
    labels = {"a": {k: surface(camera) for k, camera in enumerate(CAMERAS)}}
    right = views.judge_views(labels, CAMERAS)
    assert right.pairs == 6
    assert right.matched > 0.9
    assert right.median_px < 2
    assert right.gain > 0.9
    labels["a"][1][..., 2] = np.where(labels["a"][1][..., 0] > 0, 255 - labels["a"][1][..., 2], 0)  # upside down
    assert views.judge_views(labels, CAMERAS).median_px > 10 * right.median_px


def test_nothing_is_said_without_two_views_of_somebody():
    labels = {"a": {0: surface(CAMERAS[0]), 1: np.zeros((*SIZE[::-1], 3), np.uint8)}}
    assert np.isnan(views.judge_views(labels, CAMERAS).median_px)


def test_a_smaller_image_gives_the_same_rays():
    full = CAMERAS[0].rays(np.array([[40, 80]]), SIZE[::-1])
    # The middle of the pixel twice as large that covers it lies half a pixel farther.
    half = CAMERAS[0].rays(np.array([[20, 40]]), (160, 90))
    assert np.abs(full - half).max() < 1 / 300
    assert CAMERAS[0].focal_px((160, 90)) == 150


def test_the_person_with_most_pixels_is_judged():
    inds = np.zeros((6, 6), np.uint8)
    inds[0], inds[2:] = 1, 2
    label = views.largest_person(Prediction(np.zeros((2, 4)), np.ones(2), np.full((6, 6, 3), 7, np.uint8), inds))
    assert (label[..., 0] > 0).tolist() == (inds == 2).tolist()


def test_a_qualisys_file_gives_cameras_that_look_along_their_own_minus_z():
    text = """<calibration><cameras><camera><fov_video left="0" top="0" right="1087" bottom="1919"/>
      <transform r11="1" r12="0" r13="0" r21="0" r22="0" r23="1" r31="0" r32="-1" r33="0" x="0" y="0" z="5000"/>
      <intrinsic focalLengthU="64000" focalLengthV="64000" centerPointU="34816" centerPointV="61440"
        radialDistortion1="0.1" radialDistortion2="0" tangentalDistortion1="0" tangentalDistortion2="0"/>
      </camera></cameras></calibration>"""
    (camera,) = views.read_cameras(text)
    assert camera.size_px == (1088, 1920)
    assert camera.intrinsics.tolist() == [[1000, 0, 544], [0, 1000, 960], [0, 0, 1]]
    assert (camera.rotation @ [0, 3.0, 5.0] + camera.shift).tolist() == pytest.approx([0, 0, 3])
    assert np.linalg.det(camera.rotation) == pytest.approx(1)
