"""Labels from teachers are kept where the teachers agree. The teachers here are stand-ins: no model is fetched."""

import subprocess
import sys

import numpy as np
import pytest

from export import keypoints, surface
from export.teachers import detector
from export.teachers.coarse import SOMEWHERE, coarse_labels
from export.teachers.label import PhotoLabels, agrees, draw, label_photo, whole_bodies
from export.teachers.landmarks import SIDE, LandmarkNetwork, Landmarks
from export.teachers.matte import MatteNetwork

IMAGE = np.full((120, 200, 3), 128, np.uint8)
BOXES = np.array([[20, 10, 60, 110], [100, 10, 150, 110], [160, 20, 190, 100]], np.float32)


def person(box, shrink=0) -> Landmarks:
    mask = np.zeros(IMAGE.shape[:2], np.float32)
    x0, y0, x1, y1 = np.asarray(box, int)
    mask[y0 + shrink : y1 - shrink, x0:x1] = 0.9
    point = np.full((33, 2), [x0 + 1, y0 + 1], np.float32)
    return Landmarks(point, np.zeros(33), np.ones(33), np.zeros((33, 3)), 0.9, mask)


def filled(box) -> np.ndarray:
    return person(box).mask > 0.5


def labelled(find, outline=lambda image, box: filled(box), boxes=BOXES) -> PhotoLabels:
    scores = np.linspace(0.9, 0.7, len(boxes)).astype(np.float32)
    return label_photo(IMAGE, lambda image: (boxes, scores), find, outline)


def test_people_on_whom_the_teachers_agree_are_sure():
    found = labelled(lambda image, box: person(box) if box[0] < 150 else None)
    assert found.sure.tolist() == [True, True, False]
    assert found.outlined.tolist() == [True, True, True]
    assert found.mask.sum((1, 2)).tolist() == [4000, 5000, 2400]
    assert found.point[1, 0].tolist() == [101, 11]
    assert not found.doubt.any()


def test_of_somebody_alone_the_matte_is_the_mask_and_where_the_other_mask_differs_there_is_doubt():
    found = labelled(lambda image, box: person(box, shrink=10))
    assert found.mask.sum((1, 2)).tolist() == [4000, 5000, 2400]
    assert found.doubt.sum((1, 2)).tolist() == [800, 1000, 600]


def test_landmarks_whose_mask_is_another_one_are_not_taken():
    found = labelled(lambda image, box: person(box, shrink=16))
    assert not found.sure.any()
    assert found.outlined.all()


def test_landmarks_off_the_mask_are_not_taken():
    def find(image, box):
        found = person(box)
        found.point[:10] = 0
        return found

    assert not labelled(find).sure.any()


def test_in_company_the_matte_does_not_count():
    close = np.array([[20, 10, 60, 110], [40, 10, 80, 110]], np.float32)

    def outline(image, box):
        raise AssertionError("it cannot tell these two apart")

    found = labelled(lambda image, box: person(box), outline, close)
    assert found.sure.all()
    assert not labelled(lambda image, box: None, outline, close).outlined.any()


def test_a_mask_of_the_neighbour_or_a_fragment_is_not_taken():
    assert agrees(filled(BOXES[0]), BOXES[0])
    assert not agrees(filled(BOXES[1]), BOXES[0])
    assert not agrees(person(BOXES[0], shrink=40).mask > 0.5, BOXES[0])
    assert not agrees(filled([0, 0, 0, 0]), BOXES[0])


def test_the_same_person_is_taken_once():
    twice = np.array([[20, 10, 60, 110], [22, 10, 62, 110]], np.float32)
    found = labelled(lambda image, box: person(BOXES[0]), boxes=twice)
    assert found.sure.tolist() == found.outlined.tolist() == [True, False]


def test_somebody_cut_by_the_lower_border_is_looked_for_below_it_too():
    """The network takes a head for a whole body; what agrees with the matte is taken."""
    cut = np.array([[20, 40, 80, 120]], np.float32)
    asked = []

    def find(image, box):
        asked.append(box[3])
        return person(cut[0], shrink=0 if box[3] > 200 else 20)

    found = labelled(find, boxes=cut)
    assert len(asked) == len(whole_bodies(cut[0], 120)) == 4
    assert asked[0] == 120 < asked[1] < asked[2] < asked[3]
    assert found.sure.all()
    assert not found.doubt.any()
    assert len(whole_bodies(np.array([20, 0, 80, 100]), 120)) == 1


class FakeMatte:
    """A person in the left half of the crop, with a hole, and a speck far from it."""

    def set_tensor(self, index, value):
        assert value.shape == (1, 256, 256, 3)
        assert value.min() >= 0
        assert value.max() <= 1

    def invoke(self):
        pass

    def get_tensor(self, index):
        out = np.zeros((1, 256, 256, 1), np.float32)
        out[:, :, :128] = 1
        out[:, 60:64, 60:64] = 0
        out[:, 20:30, 220:230] = 1
        return out


def test_the_matte_lies_in_pixels_of_the_photo_without_specks_and_holes():
    made = MatteNetwork.__new__(MatteNetwork)
    made._net, made._input, made._output = FakeMatte(), 0, 0
    mask = made.find(IMAGE, np.array([80, 40, 120, 80], np.float32))
    y, x = np.nonzero(mask)
    assert (x.min(), x.max() + 1, y.min(), y.max() + 1) == (74, 100, 34, 86)
    assert mask[34:86, 74:100].all()


def test_a_photo_without_people_has_empty_labels_that_can_be_kept(tmp_path):
    nobody = label_photo(IMAGE, lambda image: (np.zeros((0, 4), np.float32), np.zeros(0, np.float32)), None, None)
    nobody.save(tmp_path / "a.npz")
    kept = PhotoLabels.load(tmp_path / "a.npz")
    assert kept.mask.shape == (0, 120, 200)
    assert kept.point.shape == (0, 33, 2)
    assert np.array_equal(draw(IMAGE, kept), IMAGE)


def test_labels_come_back_as_they_were_saved(tmp_path):
    found = labelled(lambda image, box: person(box))
    found.save(tmp_path / "deep" / "a.npz")
    kept = PhotoLabels.load(tmp_path / "deep" / "a.npz")
    for name, value in found.__dict__.items():
        assert np.array_equal(value, getattr(kept, name)), name
    assert list((tmp_path / "deep").iterdir()) == [tmp_path / "deep" / "a.npz"]


class FakeTflite:
    """Answers with landmarks in the middle of the crop and a mask of its right half."""

    def __init__(self, up=(0.0, -64.0)) -> None:
        self.up, self.crops = np.array(up), []

    def set_tensor(self, index, value):
        self.crops.append(value[0])

    def invoke(self):
        pass

    def get_tensor(self, index):
        rows = np.zeros((39, 5), np.float32)
        rows[:, :2] = SIDE / 2
        rows[34, :2] += self.up
        mask = np.full((SIDE, SIDE, 1), -20.0, np.float32)
        mask[:, SIDE // 2 :] = 20
        world = np.tile([0.0, -1.0, 0.0], 39).astype(np.float32)
        return [rows.reshape(1, -1), np.ones((1, 1)), mask[None], world[None]][index]


def network(fake) -> LandmarkNetwork:
    made = LandmarkNetwork.__new__(LandmarkNetwork)
    made._net, made._input, made._outputs = fake, 0, [0, 1, 2, 3]
    return made


def test_landmarks_and_mask_lie_in_pixels_of_the_photo():
    found = network(FakeTflite()).find(IMAGE, np.array([80, 20, 120, 100]), passes=1)
    assert np.allclose(found.point, [100, 60])
    assert found.mask[60, 110] > 0.99
    assert found.mask[60, 90] < 0.01


def test_a_lying_person_is_asked_about_upright():
    """The second pass turns the crop so that the person's head is up, and turns its answers back."""
    fake = FakeTflite(up=(64.0, 0.0))  # the head lies to the right
    image = IMAGE.copy()
    image[:, 110:] = 255
    found = network(fake).find(image, np.array([80, 20, 120, 100]))
    top, bottom = fake.crops[1][SIDE // 4, SIDE // 2], fake.crops[1][3 * SIDE // 4, SIDE // 2]
    assert top.mean() > 0.9 > bottom.mean() > 0.4
    assert np.allclose(found.world[0], [1, 0, 0], atol=1e-5)  # up in the crop is right in the photo


def test_a_crop_without_a_person_gives_none():
    fake = FakeTflite()
    answer = fake.get_tensor
    fake.get_tensor = lambda index: np.zeros((1, 1)) if index == 1 else answer(index)
    assert network(fake).find(IMAGE, np.array([80, 20, 120, 100])) is None


class FakeSsd:
    """Sees one person over the whole of every window, and one chair."""

    def setInput(self, blob):
        assert blob.shape == (1, 3, 300, 300)

    def forward(self):
        rows = [[0, 1, 0.8, 0.1, 0.2, 0.9, 0.8], [0, 62, 0.9, 0, 0, 1, 1], [0, 1, 0.1, 0, 0, 1, 1]]
        return np.array([[rows]], np.float32)


@pytest.mark.parametrize(("shape", "windows"), [((120, 200), 1), ((600, 1000), 5)])
def test_large_photos_are_also_asked_in_quarters(shape, windows):
    made = detector.PersonDetector.__new__(detector.PersonDetector)
    made._net = FakeSsd()
    boxes, scores = made.detect(np.zeros((*shape, 3), np.uint8))
    assert len(boxes) == windows
    assert np.allclose(scores, 0.8)
    whole = np.array([0.1, 0.2, 0.9, 0.8]) * [shape[1], shape[0], shape[1], shape[0]]
    assert np.abs(boxes - whole).max(1).min() < 1e-3
    assert (boxes[:, 2:] <= [shape[1], shape[0]]).all()


def test_each_landmark_has_a_name():
    assert len(set(keypoints.NAMES)) == 33


def standing() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Landmarks, visibility and mask of somebody who stands facing us; the person's left is on our right."""
    place = {
        "nose": (100, 30), "shoulder": (25, 60), "elbow": (40, 100), "wrist": (45, 140), "index finger": (46, 155),
        "little finger": (48, 155), "hip": (15, 140), "knee": (18, 200), "ankle": (20, 260), "heel": (20, 268),
        "toe": (24, 272),
    }  # fmt: skip
    point = np.full((33, 2), [100.0, 30.0], np.float32)
    for k, name in enumerate(keypoints.NAMES):
        side, _, joint = name.partition(" ")
        if joint in place:
            x, y = place[joint]
            point[k] = 100 + x * (1 if side == "left" else -1), y
    mask = np.zeros((290, 200), bool)
    mask[10:280, 40:160] = True
    return point, np.ones(33, np.float32), mask


def test_pixels_near_a_bone_get_its_region_and_doubtful_ones_none():
    point, visible, mask = standing()
    label = coarse_labels(point, visible, mask)
    expected = {
        (30, 100): 14, (90, 100): 1, (230, 119): 9, (230, 81): 8, (175, 117): 7, (175, 83): 6, (120, 143): 12,
        (120, 57): 13, (150, 147): 3, (150, 53): 2, (272, 124): 4, (272, 76): 5, (80, 134): 10, (80, 66): 11,
    }  # fmt: skip
    assert {at: int(label[at]) for at in expected} == expected
    assert label[200, 100] == SOMEWHERE  # between the knees
    assert label[285, 100] == label[100, 20] == 0
    assert ((label > 0) == mask).all()


def test_labels_of_the_mirrored_person_are_mirrored():
    point, visible, mask = standing()
    other = [keypoints.NAMES.index(_swapped(name)) for name in keypoints.NAMES]
    label = coarse_labels(point, visible, mask)
    mirrored = coarse_labels((point * [-1, 1] + [200, 0])[other], visible[other], mask[:, ::-1])
    table = np.arange(256, dtype=np.uint8)
    table[: len(surface.MIRROR_COARSE)] = surface.MIRROR_COARSE
    assert np.array_equal(mirrored, table[label[:, ::-1]])


def _swapped(name: str) -> str:
    return " ".join({"left": "right", "right": "left"}.get(word, word) for word in name.split())


def test_limbs_that_are_not_seen_give_no_labels():
    point, visible, mask = standing()
    visible[[keypoints.NAMES.index(f"left {joint}") for joint in ("knee", "ankle", "toe")]] = 0.1
    label = coarse_labels(point, visible, mask)
    assert not np.isin([4, 7, 9], label).any()
    assert np.isin([5, 6, 8], label).all()
    assert not coarse_labels(point, 0 * visible, mask)[mask].min() < SOMEWHERE
    assert not coarse_labels(point, visible, 0 * mask > 0).any()


def test_the_command_labels_in_other_processes_and_names_a_file_that_is_no_photo(tmp_path):
    (tmp_path / "torn.jpg").write_bytes(b"not a photo")
    command = [sys.executable, "-m", "export.teachers", "--processes", "1", "--photos", str(tmp_path), "--out"]
    ended = subprocess.run([*command, str(tmp_path / "labels")], capture_output=True, text=True, timeout=300)
    assert (ended.returncode, ended.stderr.count("torn.jpg is not an image")) == (1, 1), ended.stderr
