"""Files of bodies: what is written is read; damage is refused; decimation keeps vertices."""

import numpy as np
import pytest

from export.body.body_file import BodyFileError, body_bytes, body_from_bytes, whole_fractions
from export.body.body_model import NOWHERE, nearest_on_triangles
from export.body.decimation import decimated
from export.body.pose_prior import mirrored
from tests.python.support.small_body import small_body


def test_a_body_is_read_as_it_was_written():
    body = small_body()
    read = body_from_bytes(body_bytes(body))
    assert read.joints == body.joints
    assert (read.parents == body.parents).all()
    for name in ("joint_rest", "joint_basis", "rest", "basis"):
        assert np.allclose(getattr(read, name), getattr(body, name), atol=5e-5), name
    assert np.allclose(read.weights, body.weights, atol=1 / 255)
    assert np.allclose(read.weights.sum(1), 1)
    assert (read.triangles == body.triangles).all()
    assert (read.surface_triangle == body.surface_triangle).all()
    assert (read.surface_triangle == NOWHERE).any()
    assert np.allclose(read.prior.precision, body.prior.precision)


@pytest.mark.parametrize("cut", [0, 10, 63, 64, 500, -1])
def test_cut_and_changed_bytes_are_refused(cut):
    data = body_bytes(small_body())
    with pytest.raises(BodyFileError):
        body_from_bytes(data[:cut])
    changed = bytearray(data)
    changed[cut] ^= 1
    with pytest.raises(BodyFileError):
        body_from_bytes(bytes(changed))


def test_fractions_become_whole_numbers_that_sum_to_255():
    fractions = np.random.default_rng(1).dirichlet([0.3] * 4, 500)
    whole = whole_fractions(fractions).astype(int)
    assert (whole.sum(1) == 255).all()
    assert (abs(whole - 255 * fractions) < 1).all()


def test_decimation_keeps_vertices_of_the_mesh_that_its_faces_use():
    side = 12
    u, v = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    angle, height = 2 * np.pi * u / side, np.pi * (v + 0.5) / side
    points = np.stack([np.cos(angle) * np.sin(height), np.sin(angle) * np.sin(height), np.cos(height)], -1)
    faces = [
        face
        for i in range(side)
        for j in range(side - 1)
        for a, b, c, d in [(i * side + j, i * side + j + 1, (i + 1) % side * side + j + 1, (i + 1) % side * side + j)]
        for face in ((a, b, c), (a, c, d))
    ]
    kept, triangles = decimated(points.reshape(-1, 3), np.array(faces), 90)
    assert 90 <= len(kept) < 144
    assert triangles.max() == len(kept) - 1
    assert set(triangles.ravel()) == set(range(len(kept)))


def test_the_nearest_point_of_triangles_is_inside_or_on_an_edge():
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]])
    points = np.array([[0.25, 0.25, 1], [2, 0, 0], [1, 1, 0], [-1, -1, 0.0]])
    _, fractions, distance = nearest_on_triangles(points, corners)
    assert np.allclose(fractions @ corners[0], [[0.25, 0.25, 0], [1, 0, 0], [0.5, 0.5, 0], [0, 0, 0]])
    assert np.allclose(distance, [1, 1, np.sqrt(0.5), np.sqrt(2)])


def test_mirroring_a_pose_twice_gives_it_back():
    pose = np.random.default_rng(2).normal(size=(3, 54))
    assert np.allclose(mirrored(mirrored(pose)), pose)
    assert not np.allclose(mirrored(pose), pose)
