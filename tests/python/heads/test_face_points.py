"""The template points of the face points, and faces of photographs with them as sparse labels."""

import numpy as np
import pytest

from export.heads.head_shards import POINT_SCALE, HeadImages
from export.heads.photos import face_points
from export.heads.photos.face_points import FacePoints, median_points, on_template, read_face_points, write_face_points
from export.heads.photos.faces import HEAD, NOTHING, UNKNOWN, FacePose, matte_of, photo_faces, pose_of, weights_of
from export.teachers.faces import POINTS, Face
from export.teachers.label import PhotoLabels

NOSE_TIP, CHIN, RIGHT_EYE, LEFT_EYE, RIGHT_MOUTH, LEFT_MOUTH = 1, 152, 33, 263, 61, 291


def test_points_of_the_file_lie_where_their_names_say():
    """Person's left is x > 0, up is z > 0, the face looks to -y; and the two halves mirror each other."""
    points = read_face_points()
    place = points.template
    assert place.shape == (POINTS, 3)
    for right, left in ((RIGHT_EYE, LEFT_EYE), (RIGHT_MOUTH, LEFT_MOUTH)):
        assert place[right, 0] < -0.15
        assert place[left, 0] > 0.15
        assert np.abs(place[right] * [-1, 1, 1] - place[left]).max() < 0.05
    assert place[NOSE_TIP, 1] == pytest.approx(place[:, 1].min(), abs=0.05)
    assert place[RIGHT_EYE, 2] > place[NOSE_TIP, 2] > place[RIGHT_MOUTH, 2] > place[CHIN, 2]
    assert abs(place[[NOSE_TIP, CHIN], 0]).max() < 0.02
    assert points.normal[NOSE_TIP, 1] < -0.8
    assert np.allclose(np.linalg.norm(points.normal, axis=1), 1, atol=1e-3)


def test_points_of_the_outline_wander_and_are_left_out():
    points = read_face_points()
    outline = [234, 454, 93, 323, 132, 361, 58, 288]  # cheeks, from the ears to the jaw
    inner = [NOSE_TIP, RIGHT_EYE, LEFT_EYE, RIGHT_MOUTH, LEFT_MOUTH, 4, 6, 9, 13, 14]
    assert points.used[inner].all()
    assert not points.used[outline].any()
    assert 300 < points.used.sum() < 450


def test_the_file_comes_back_as_it_was_written(tmp_path):
    points = read_face_points()
    write_face_points(points, {"pictures": 1}, tmp_path / "a.json")
    for name, value in read_face_points(tmp_path / "a.json").__dict__.items():
        assert np.allclose(value, getattr(points, name)), name
    (tmp_path / "b.json").write_text('{"points": []}')
    with pytest.raises(ValueError, match="other columns"):
        read_face_points(tmp_path / "b.json")
    assert face_points.FILE.stat().st_size < 60_000


def flat_images() -> HeadImages:
    """A wall at y = -1 whose template point is (column / 100, -1, -row / 100), in the left half of 256 px."""
    rows, columns = np.mgrid[:256:2, :256:2]
    template = np.stack([columns / 100, np.full(rows.shape, -1.0), -rows / 100], -1)
    normal = np.zeros((1, 128, 128, 3), np.int8)
    normal[:, :, :64] = [0, 0, -127]  # towards the camera
    template[:, 50:] += [0, 1, 0]  # from column 100 on something behind is seen
    masks = np.zeros((1, 256, 256), np.uint8)
    masks[:, :, :128] = 255
    rotation = np.array([[[1, 0, 0], [0, 0, -1], [0, 1, 0]]], np.float64)  # the head's y is the camera's z
    return HeadImages(
        np.zeros((1, 256, 256, 3), np.uint8), masks, np.round(template * POINT_SCALE).astype(np.int16)[None], normal,
        rotation, np.array([[0, 0, 10.0]]), np.array([[400, 127.5, 127.5]]),
    )  # fmt: skip


def test_template_points_are_read_between_the_stored_pixels_and_nowhere_off_the_head():
    place, normal = on_template(
        flat_images(), 0, np.array([[51.0, 40.5], [200.0, 40.0], [-5.0, 3.0], [126.9, 9.0], [98.8, 9.0]])
    )
    assert np.allclose(place[0], [0.51, -1, -0.405], atol=2e-4)
    assert np.allclose(normal[0], [0, -1, 0], atol=1e-6)
    assert np.isnan(place[1:3]).all()
    assert place[3, 0] == pytest.approx(1.26, abs=0.01)  # what lies beyond the border is not mixed in
    assert place[4, 1] == pytest.approx(-1)  # nor what lies behind an edge


def test_the_middle_over_heads_is_not_led_astray_and_wandering_points_are_not_used():
    rng = np.random.default_rng(0)
    place = np.zeros((50, 2, 3))
    place[:, 0] = [0.1, -1, 0.2] + rng.normal(0, 0.01, (50, 3))
    place[:, 1] = rng.normal(0, 0.2, (50, 3))
    place[:5, 0] = 1.0
    normal = np.tile([0.0, -2.0, 0.0], (50, 2, 1))
    points = median_points(place, normal)
    assert np.allclose(points.template[0], [0.1, -1, 0.2], atol=0.01)
    assert points.used.tolist() == [True, False]
    assert np.allclose(points.normal, [0, -1, 0])
    place[:30, 0] = np.nan
    assert not median_points(place, normal).used.any()


def turned(yaw: float, scale: float = 40.0) -> FacePose:
    c, s = np.cos(yaw), np.sin(yaw)
    facing = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], np.float64)
    rotation = facing @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return FacePose(rotation, scale, np.array([150.0, 120.0]), 0.0)


def seen(points: FacePoints, pose: FacePose) -> Face:
    return Face(pose.pixels(points.template), np.zeros(POINTS), np.full(POINTS, 0.1), 0.95)


@pytest.mark.parametrize("yaw", [-0.8, 0.0, 0.5])
def test_the_pose_of_a_face_is_found_from_its_points(yaw):
    points, true = read_face_points(), turned(yaw)
    pose = pose_of(points.template, true.pixels(points.template))
    assert np.allclose(pose.rotation, true.rotation, atol=1e-6)
    assert (pose.scale, pose.residual) == (pytest.approx(40), pytest.approx(0, abs=1e-6))
    assert pose.yaw == pytest.approx(yaw)
    far = pose.pixels(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.5]]))
    assert np.allclose(pose.up(far), [1.0, -1.5])
    assert np.allclose(pose.aside(pose.pixels(np.array([[0.0, -0.1, 0.7]]))), 0, atol=1e-6)


def test_hidden_and_unsteady_points_weigh_nothing():
    points = read_face_points()
    left, right = LEFT_EYE, RIGHT_EYE
    face = seen(points, turned(0.0))
    even = weights_of(face, points, turned(0.0))
    assert even[left] > 0.3
    assert even[right] > 0.3
    assert not even[~points.used].any()
    aside = weights_of(face, points, turned(1.0))  # looks to the person's left: the right cheek is towards the camera
    assert aside[right] > 0.3
    assert aside[left] < 0.05
    face.spread[right] = 0.05 * face.size
    assert weights_of(face, points, turned(1.0))[right] < 0.01


def labelled(shape=(300, 300)) -> PhotoLabels:
    """One person: head and body in the middle, over the lower border."""
    mask = np.zeros((1, *shape), bool)
    mask[0, 60:190, 110:190] = True
    mask[0, 190:, 60:240] = True
    return PhotoLabels(
        box=np.array([[60, 60, 240, 300]], np.float32), score=np.ones(1, np.float32), outlined=np.ones(1, bool),
        sure=np.ones(1, bool), point=np.full((1, 33, 2), -999.0, np.float32), visible=np.ones((1, 33), np.float32),
        world=np.zeros((1, 33, 3), np.float32), mask=mask, doubt=np.zeros((1, *shape), bool),
    )  # fmt: skip


def test_a_matte_knows_head_surroundings_and_body_and_leaves_the_neck_open():
    points, pose, labels = read_face_points(), turned(0.0), labelled()
    matte = matte_of(seen(points, pose), pose, labels, (300, 300))
    assert matte[100, 150] == HEAD
    assert matte[100, 50] == NOTHING
    assert matte[250, 150] == NOTHING
    assert matte[180, 150] == UNKNOWN  # 1.5 dm below the middle
    assert matte[60:190, 110][30] == UNKNOWN  # the border of the mask
    labels.point[0, 15] = [150, 100]  # a wrist before the face
    assert matte_of(seen(points, pose), pose, labels, (300, 300))[100, 150] == UNKNOWN


def test_of_a_mask_too_wide_for_a_head_none_is_head():
    points, pose, labels = read_face_points(), turned(0.0), labelled()
    labels.mask[0, 60:190, 60:240] = True
    matte = matte_of(seen(points, pose), pose, labels, (300, 300))
    assert not (matte == HEAD).any()
    assert matte[100, 50] == NOTHING


def test_without_a_mask_of_this_person_nothing_is_known():
    points, pose, labels = read_face_points(), turned(0.0), labelled()
    assert (matte_of(seen(points, pose), pose, None, (300, 300)) == UNKNOWN).all()
    labels.mask[:] = False
    labels.mask[0, :20, :20] = True
    assert (matte_of(seen(points, pose), pose, labels, (300, 300)) == UNKNOWN).all()


class OneFace:
    def __init__(self, face):
        self.face = face

    def squares(self, image):
        return [None]

    def find(self, image, square):
        return self.face


def test_points_of_a_crop_show_the_pixels_of_the_photo():
    points, pose = read_face_points(), turned(0.2)
    face = seen(points, pose)
    image = np.zeros((300, 300, 3), np.uint8)
    nose = np.round(face.point[NOSE_TIP]).astype(int)
    image[nose[1] - 2 : nose[1] + 3, nose[0] - 2 : nose[0] + 3] = [0, 0, 255]  # BGR
    made = OneFace(face)
    faces, fates = photo_faces(image, None, points, (made, made))
    assert fates == [""]
    y, x = np.nonzero(faces.rgb[0, ..., 0] > 128)
    assert np.abs(faces.pixel[0, NOSE_TIP] - [x.mean(), y.mean()]).max() < 1.2
    assert faces.rgb.shape == (1, 512, 512, 3)
    assert faces.weight[0, NOSE_TIP] > 0.5


@pytest.mark.parametrize(
    ("change", "why"),
    [({"presence": 0.6}, "unsure"), ({"spread": np.full(POINTS, 9.0)}, "unsteady"), ({"yaw": 1.3}, "profile"),
     ({"scale": 10.0}, "small")],
)  # fmt: skip
def test_bad_faces_are_refused_by_rule(change, why):
    points = read_face_points()
    face = seen(points, turned(change.get("yaw", 0.0), change.get("scale", 40.0)))
    face = Face(face.point, face.depth, change.get("spread", face.spread), change.get("presence", face.presence))
    made = OneFace(face)
    assert photo_faces(np.zeros((300, 300, 3), np.uint8), None, points, (made, made)) == (None, [why])


def test_of_a_face_at_the_border_only_what_the_photo_shows_counts():
    points, pose = read_face_points(), turned(0.0)
    face = seen(points, pose)
    made = OneFace(face)
    right = int(np.quantile(face.point[points.used, 0], 0.9))
    faces, _ = photo_faces(np.zeros((300, right, 3), np.uint8), None, points, (made, made))
    outside = face.point[:, 0] > right - 1
    assert not faces.weight[0, outside].any()
    assert faces.weight[0, ~outside].any()
    half = int(np.median(face.point[:, 0]))
    assert photo_faces(np.zeros((300, half, 3), np.uint8), None, points, (made, made)) == (None, ["cut"])
