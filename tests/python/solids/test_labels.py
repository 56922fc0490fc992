"""Distances to sharp curves against what can be written down: polyhedra, cylinders, roundings; hidden sides, patch."""

import numpy as np
import pytest

pytest.importorskip("OCP", reason="OpenCascade is not installed: scripts/make-venv.sh dev,solids")

from export.camera import Camera
from export.solids import shapes as s
from export.solids.brep import solid_of
from export.solids.curves import corners
from export.solids.labels import Labeller
from export.solids.recipe import looking
from export.solids.records import BOUNDARY, CONCAVE, CONVEX, LIMIT_R, NONE
from export.solids.views import Seen

FINE = 1e-5  # metres, of meshes about 1 m large
FOCAL, WIDE = 300.0, 150.0


def seen_from(shape, centre, target=(0, 0, 0.5), focal=FOCAL, size=(160, 120), deviation=FINE):
    """View, labels and labeller of a shape."""
    centre, target = np.array(centre, float), np.array(target, float)
    camera = Camera.centred(*size, focal, looking(target - centre), centre)
    seen = Seen(solid_of(shape, deviation), camera)
    view, labeller = seen.rendered(camera), Labeller(seen)
    return view, labeller.of(view), labeller


def world(view):
    """World points [H, W, 3]."""
    return view.point @ view.camera.rotation + view.camera.centre


def ridge(degrees):
    """A roof whose slopes meet at that angle between normals, along y at the top."""
    a = np.radians(degrees / 2)
    points = np.array([(-1, 0), (1, 0), (1, 1), (0, 1 + np.tan(a)), (-1, 1)])
    return s.moved(s.prism(points, 4), np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), (0, 2, 0))


def test_on_a_unit_box_the_distance_is_that_to_the_side_of_the_face():
    view, labels, labeller = seen_from(s.box((1, 1, 1)), (2.1, -2.6, 2.2), focal=WIDE)
    p = world(view)
    inside = view.depth > 0
    to_side = np.sort(np.minimum(np.abs(p - [-0.5, -0.5, 0]), np.abs(p - [0.5, 0.5, 1])), axis=2)
    assert to_side[inside][:, 0].max() < 1e-9  # a point lies on a face; next comes the nearest side of it
    expected = np.minimum(to_side[..., 1] / view.footprint.clip(1e-9), LIMIT_R)
    assert inside.sum() > 2000  # all of the box is in the frame
    np.testing.assert_allclose(labels.distance[inside], expected[inside], atol=1e-6)
    assert len(labels.pieces) == 9
    assert len(corners(labeller, labels.pieces)) == 7


@pytest.mark.parametrize("sides", [3, 5])
def test_on_a_prism_the_distance_is_that_to_the_faces_outline(sides):
    angle = np.arange(sides) * 2 * np.pi / sides + 0.3
    outline = np.stack([np.cos(angle), np.sin(angle)], 1) * 0.6
    view, labels, _ = seen_from(s.prism(outline, 0.8), (1.7, 2.4, 2.0), focal=WIDE)
    p = world(view)[view.depth > 0]
    normal = np.stack([np.cos(angle + np.pi / sides), np.sin(angle + np.pi / sides)], 1)
    reach = 0.6 * np.cos(np.pi / sides)
    wall = reach - p[:, :2] @ normal.T  # distance to each wall's plane
    end = np.minimum(p[:, 2], 0.8 - p[:, 2])
    along = np.abs(p[:, :2] @ np.stack([-normal[:, 1], normal[:, 0]]))
    half = 0.6 * np.sin(np.pi / sides)
    own = wall.argmin(1)
    on_wall = wall.min(1) < 1e-9
    to_side = np.where(on_wall, np.minimum(end, half - along[np.arange(len(p)), own]), wall.min(1))
    expected = np.minimum(to_side / view.footprint[view.depth > 0], LIMIT_R)
    np.testing.assert_allclose(labels.distance[view.depth > 0], expected, atol=1e-6)


def test_a_cylinder_has_its_rims_and_no_silhouette():
    view, labels, _ = seen_from(s.cylinder(0.5, 1.6), (2.2, -2.2, 2.4), focal=WIDE, deviation=3e-4)
    p = world(view)[view.depth > 0]
    r, distance = view.footprint[view.depth > 0], labels.distance[view.depth > 0]
    out = np.hypot(p[:, 0], p[:, 1])
    top = p[:, 2] > 1.6 - 1e-9
    expected = np.minimum(np.where(top, 0.5 - out, np.minimum(1.6 - p[:, 2], p[:, 2])) / r, LIMIT_R)
    np.testing.assert_allclose(distance, expected, atol=1e-6)
    between = ~top & (np.abs(p[:, 2] - 0.8) < 0.2)  # up to the silhouette
    assert between.sum() > 100
    assert (distance[between] == LIMIT_R).all()
    assert set(np.unique(labels.kind[view.depth > 0])) <= {NONE, CONVEX, BOUNDARY}


@pytest.mark.parametrize(
    ("shape", "ring", "tube"),
    [(lambda: s.sphere(0.5, (0, 0, 0.5)), 0.0, 0.5), (lambda: s.torus(0.5, 0.2, (0, 0, 0.5)), 0.5, 0.2)],
    ids=["sphere", "torus"],
)
def test_smooth_solids_have_no_edge(shape, ring, tube):
    view, labels, _ = seen_from(shape(), (2, -2, 2), deviation=1e-3)
    p = world(view)
    assert (view.depth > 0).sum() > 500
    assert (labels.distance == LIMIT_R).all()
    assert (labels.kind == NONE).all()
    assert not labels.ignore.any()
    assert not labels.pieces
    off = np.hypot(np.hypot(p[..., 0], p[..., 1]) - ring, p[..., 2] - 0.5) - tube
    off = np.abs(off[view.depth > 0])
    assert np.quantile(off, 0.95) < 1e-9  # depth is the surface's, and the triangles' only at the silhouette
    assert off.max() < 1e-3


@pytest.mark.parametrize(("degrees", "is_sharp"), [(5, False), (17, False), (19, True), (45, True), (120, True)])
def test_faces_that_turn_by_more_than_18_degrees_meet_in_a_sharp_curve(degrees, is_sharp):
    top = 1 + np.tan(np.radians(degrees / 2))
    view, labels, _ = seen_from(ridge(degrees), (0.3, -0.2, top + 2.5), (0, 0, top))
    p = world(view)
    near = (np.abs(p[..., 0]) < 0.03) & (view.depth > 0)
    assert near.sum() > 100
    assert (labels.distance[near] < LIMIT_R).all() == is_sharp
    assert (labels.kind[near] == (CONVEX if is_sharp else NONE)).all()
    assert (np.unique(labels.patch[near]).size == 2) == is_sharp


def test_what_lies_between_two_boxes_and_the_ground_is_concave():
    shape = s.fused([s.box((6, 6, 0.2), (0, 0, -0.2)), s.box((1, 1, 1))])
    view, labels, _ = seen_from(shape, (2.1, -2.6, 2.2))
    p = world(view)
    on_ground = (np.abs(p[..., 2]) < 1e-9) & (view.depth > 0)
    before = on_ground & (np.abs(p[..., 0]) < 0.4) & (p[..., 1] < -0.5) & (p[..., 1] > -0.55)
    assert before.sum() > 50
    assert (labels.kind[before] == CONCAVE).all()
    np.testing.assert_allclose(labels.distance[before], (-0.5 - p[before][:, 1]) / view.footprint[before], atol=1e-6)
    around = on_ground & (np.abs(p[..., :2]).max(2) < 1) & (labels.distance < LIMIT_R)
    assert (labels.kind[around] == CONCAVE).all()  # beyond the hidden corners, too
    top = (p[..., 2] > 1 - 1e-9) & (p[..., 1] > 0.45) & (np.abs(p[..., 0]) < 0.4)
    assert top.sum() > 10
    assert (labels.kind[top] == BOUNDARY).all()  # the far side of the box is not seen


def test_a_curve_that_is_hidden_does_not_count():
    """Ground seen over a wall: the wall's foot behind is hidden, so that ground has no edge near."""
    shape = s.fused([s.box((9, 9, 0.2), (0, 0, -0.2)), s.box((3, 0.1, 0.2))])
    view, labels, _ = seen_from(shape, (0, -1.5, 3), (0, 0.2, 0))
    p = world(view)
    behind = (np.abs(p[..., 2]) < 1e-9) & (p[..., 1] > 0.05) & (np.abs(p[..., 0]) < 1) & (view.depth > 0)
    near = behind & ((p[..., 1] - 0.05) / view.footprint.clip(1e-9) < LIMIT_R - 1)
    assert near.sum() > 100
    assert (labels.distance[near] == LIMIT_R).all()


def test_a_pixel_knows_only_curves_of_its_own_patch():
    """A plate hovers 3 r above the ground: its edges are near ground that they do not border."""
    r = 3.0 / FOCAL
    shape = s.fused([s.box((9, 9, 0.2), (0, 0, -0.2)), s.box((0.6, 0.6, 0.3), (0, 0, 3 * r))])
    assert len(s.faces(shape)) == 12
    view, labels, _ = seen_from(shape, (0.2, -1.2, 2.8), (0, 0, 0))
    p = world(view)
    ground = (np.abs(p[..., 2]) < 1e-9) & (view.depth > 0)
    beside = ground & (p[..., 1] < -0.3) & (p[..., 1] > -0.3 - 6 * r) & (np.abs(p[..., 0]) < 0.25)
    assert beside.sum() > 50
    assert (labels.distance[beside] == LIMIT_R).all()


@pytest.mark.parametrize(("radius_r", "expected"), [(0.6, "sharp"), (2.0, "ignored"), (6.0, "smooth")])
def test_what_a_rounding_is_depends_on_how_near_it_is_seen(radius_r, expected):
    """The same fillet, from three distances. Its edge runs along y; x > 0 is a wall, z = 1 the top."""
    radius = 0.02
    block = s.box((1, 1, 1))
    edge = [e for e in s.edges(block) if np.allclose(s.bounds(e)[:, [0, 2]], [[0.5, 1], [0.5, 1]], atol=1e-3)]
    assert len(edge) == 1
    away = radius * FOCAL / radius_r
    centre = np.array([0.5, 0, 1]) + away * np.array([1, 0, 1]) / np.sqrt(2)
    view, labels, _ = seen_from(s.filleted(block, edge, radius), centre, (0.5, 0, 1))
    p = world(view)
    near = (view.depth > 0) & (np.abs(p[..., 1]) < 0.1) & (p[..., 0] < 0.5) & (p[..., 2] > 1 - 1e-9)
    to_edge = (0.5 - p[..., 0]) / view.footprint.clip(1e-9)
    near &= to_edge < 8
    assert near.sum() > 30
    if expected == "sharp":
        assert not labels.ignore[near].any()
        assert np.abs(labels.distance - to_edge)[near].max() < 0.5
        assert (labels.kind[near] == CONVEX).all()
    elif expected == "ignored":
        assert labels.ignore[near].all()
        far = (view.depth > 0) & (to_edge > 20) & (p[..., 2] > 1 - 1e-9) & (np.abs(p[..., 1]) < 0.1)
        assert not labels.ignore[far].any()
    else:
        assert not labels.ignore[near].any()
        assert (labels.distance[near] == LIMIT_R).all()


def test_scale_changes_nothing():
    """The same box 100 times larger, seen from 100 times as far."""
    small = seen_from(s.box((1, 1, 1)), (2.1, -2.6, 2.2))[1]
    large = seen_from(s.box((100, 100, 100)), (210, -260, 220), (0, 0, 50), deviation=1e-3)[1]
    np.testing.assert_allclose(small.distance, large.distance, atol=1e-6)
    assert (small.kind == large.kind).all()
