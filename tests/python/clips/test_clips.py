"""Clips depend on set, split and number alone, and their motion is exact."""

import subprocess
import sys

import cv2
import numpy as np
import pytest

from export.camera import Camera
from export.clips import collages, shapes
from export.clips.clip import ClipError, read_clip, read_rgb, write_clip
from export.clips.collages import collages_clip
from export.clips.motion import fetched_from_next
from export.clips.shapes import shapes_clip

pytest.importorskip("moderngl", reason="moderngl is not installed: scripts/make-venv.sh train,dev")

from export.clips import render
from export.clips.film import filmed


@pytest.fixture(scope="module")
def pushing():
    pytest.importorskip("pybullet", reason="PyBullet is not installed: scripts/make-venv.sh train,dev,clips")
    from export.clips import pushing

    return pushing


def relative_error(frames, t):
    """Error of the frame fetched from the next one along the motion, as a part of that without motion, where things
    move by half a pixel or more and can be seen."""
    now, motion = frames.rgb[t].astype(np.float32), frames.motion[t]
    counted = frames.visible[t] & (np.hypot(motion[..., 0], motion[..., 1]) > 0.5)
    if counted.sum() < 20:
        return None
    then = frames.rgb[t + 1].astype(np.float32)
    with_motion = np.abs(fetched_from_next(then, motion) - now)[counted].mean()
    return with_motion / np.abs(then - now)[counted].mean()


@pytest.mark.parametrize("split", ["train", "test"])
def test_a_clip_of_shapes_depends_on_its_number_alone(split):
    first, again, other = (shapes_clip(split, number, large=False) for number in (3, 3, 4))
    assert np.array_equal(first.small.rgb, again.small.rgb)
    assert np.array_equal(first.small.motion, again.small.motion)
    assert not np.array_equal(first.small.rgb, other.small.rgb)


def test_splits_of_shapes_differ():
    assert not np.array_equal(shapes_clip("train", 0, False).small.rgb, shapes_clip("val", 0, False).small.rgb)


@pytest.mark.parametrize("number", range(3))
def test_shapes_lie_where_their_motion_says(number):
    clip = shapes_clip("val", number, large=True)
    for frames, exact in ((clip.small, True), (clip.large, False)):
        for t in (0, 11, 28):
            moved = fetched_from_next(frames.rgb[t + 1], frames.motion[t]).astype(int)
            error = np.abs(moved - frames.rgb[t])[frames.visible[t]]
            # Whole pixels at 64 x 64: only borders, whose colour mixes with what lies behind, may differ.
            assert np.median(error) == 0
            assert (error > 8).mean() < (0.06 if exact else 0.03)


@pytest.fixture
def photographs(tmp_path, monkeypatch):
    """Three photographs of soft patterns for training, and two others."""
    monkeypatch.setattr(collages, "PHOTOGRAPHS", tmp_path)
    rng = np.random.default_rng(0)
    for split, count in (("train", 3), ("val", 2)):
        (tmp_path / split).mkdir()
        for k in range(count):
            soft = cv2.resize(
                rng.integers(0, 256, (9, 12, 3)).astype(np.uint8), (400, 300), interpolation=cv2.INTER_CUBIC
            )
            cv2.imwrite(str(tmp_path / split / f"{split}-{k}.jpg"), soft)


def test_collages_move_as_their_motion_says_and_take_photographs_of_their_split(photographs):
    errors = []
    for number in range(8):
        clip, again = (collages_clip("train", number, large=False) for _ in range(2))
        assert np.array_equal(clip.small.rgb, again.small.rgb)
        assert all(name.startswith("train-") for name in clip.facts["assets"])
        errors += [error for t in (2, 14, 27) if (error := relative_error(clip.small, t)) is not None]
    assert len(errors) >= 8
    assert np.median(errors) < 0.25
    large = collages_clip("val", 1, large=True).large
    assert large.rgb.shape == (30, 240, 320, 3)
    with pytest.raises(FileNotFoundError, match="photographs"):
        collages_clip("test", 0, large=False)


def test_the_entropy_of_shapes_is_what_their_information_comes_to_on_average():
    clips = [shapes_clip("train", number, large=False) for number in range(25)]
    bits = np.concatenate([clip.bits[2:] for clip in clips])
    information = np.concatenate([clip.surprise_bits[2:] for clip in clips])
    assert np.isnan(clips[0].bits[0])
    error = np.abs(information.mean() - bits.mean())
    assert error < 4 * (information - bits).std() / np.sqrt(len(bits))
    assert 0.5 < bits.mean() < 6


def test_chances_of_a_shape_add_up_and_choices_with_one_result_count_once():
    shape = shapes._Shape("disc", 5, 3, (1, 1, 1))
    for state in ((30, 30, 1, 0), (5, 5, -1, -1), (6, 58, -1, 1)):
        chances = shapes.next_states(state, shape)
        assert sum(chances.values()) == pytest.approx(1)
        places = [after[:2] for after in chances]
        assert len(set(places)) == len(places), "two states that one picture shows would make the entropy too large"
    assert len(shapes.next_states((5, 5, 1, 1), shape)) == 3  # in a corner all eight directions lead to three places


def test_a_turning_box_and_a_moving_camera_have_exact_motion():
    from export.clips.pushing import box
    from export.places.mesh import flat_normals

    surface = render.Surface((0.9, 0.2, 0.1), (0.1, 0.3, 0.8), "grain", 8.0, 0.0)
    ground = render.Surface((0.3, 0.6, 0.4), (0.7, 0.7, 0.2), "grain", 5.0, 0.0)
    things = []
    for corners, material in (
        (box(np.full(3, 0.3), np.zeros(3)), surface),
        (box(np.array([4, 4, 0.1]), np.zeros(3)), ground),
    ):
        things.append(render.Thing(corners, flat_normals(corners), material, casts_shadow=False))
    flat = np.ones(3)
    light = render.Light(flat, flat, 0 * flat, np.array([0, 0, 1.0]), np.zeros(3), 1.0)
    moments = []
    for t in range(3):
        turn = np.eye(4)
        angle = 0.15 * t
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        turn[:3, 3] = [0.05 * t, 0, 0.4]
        forward, right = np.array([0, 1, -0.6]) / np.hypot(1, 0.6), np.array([1.0, 0, 0])
        rotation = np.stack([right, np.cross(forward, right), forward])
        camera = Camera.centred(320, 240, 260, rotation, np.array([0.03 * t, -1.8, 1.4]))
        moments.append(render.Moment(np.stack([turn, np.eye(4)]), camera, {}))
    with render.Renderer(things, light) as renderer:
        small, large = filmed(renderer, moments, large=True)
    for frames, limit in ((small, 0.4), (large, 0.2)):
        for t in range(2):
            assert relative_error(frames, t) < limit
    point = np.array([[0.1, -0.3, 0.1]])  # on the front of the box, in its own coordinates
    at = [m.camera.projected(point @ m.poses[0, :3, :3].T + m.poses[0, :3, 3])[0][0] for m in moments[:2]]
    x, y = np.round(at[0]).astype(int)
    assert large.motion[0, y, x] == pytest.approx(at[1] - at[0], abs=0.1)


def test_hidden_points_are_said_to_be_hidden(pushing):
    frames = pushing.pushing_clip("train", 2, large=False).small
    assert 0.9 < frames.visible.mean() < 1
    assert (~frames.visible).any(axis=(1, 2)).mean() > 0.5


def test_a_clip_of_pushing_depends_on_its_number_alone_and_its_motion_is_exact(pushing):
    clip, _, again = (pushing.pushing_clip("val", number, large=False) for number in (1, 2, 1))
    assert np.array_equal(clip.small.rgb, again.small.rgb)
    assert np.array_equal(clip.small.motion, again.small.motion)
    large = pushing.pushing_clip("val", 1, large=True).large
    errors = [e for t in range(0, 28, 3) if (e := relative_error(large, t)) is not None]
    assert errors, "nothing moves"
    assert np.median(errors) < 0.35


def test_splits_of_pushing_have_no_thing_in_common(pushing):
    train, val, test = (set(pushing.things_of(split)) for split in ("train", "val", "test"))
    assert not train & val | train & test | val & test
    assert len(train) > 700
    assert min(len(val), len(test)) == 99 or min(len(val), len(test)) == 100


def test_a_clip_comes_back_from_its_file(tmp_path):
    clip = shapes_clip("test", 5, large=True)
    path = tmp_path / "clip-00005.npz"
    write_clip(clip, path)
    back = read_clip(path)
    assert np.array_equal(back.large.rgb, clip.large.rgb)
    assert np.array_equal(back.small.visible, clip.small.visible)
    assert np.abs(back.large.motion - clip.large.motion).max() < 0.02
    assert np.array_equal(back.bits, clip.bits, equal_nan=True)
    rgb, fps = read_rgb(path)
    assert np.array_equal(rgb, clip.small.rgb)
    assert fps == clip.fps == 10
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("content", [b"", b"PK\3\4 cut", b"not a clip"])
def test_a_broken_file_is_named(tmp_path, content):
    path = tmp_path / "clip-00000.npz"
    path.write_bytes(content)
    with pytest.raises(ClipError, match=r"clip-00000\.npz"):
        read_clip(path)


def test_a_stopped_run_goes_on_where_it_was(tmp_path):
    command = [sys.executable, "-m", "export.clips.dataset", "shapes", "--processes", "0", "--out", str(tmp_path)]
    subprocess.run([*command, "--clips", "1"], check=True, capture_output=True)
    first = tmp_path / "shapes/train/clip-00000.npz"
    made = first.stat().st_mtime_ns
    subprocess.run([*command, "--clips", "2"], check=True, capture_output=True)
    assert first.stat().st_mtime_ns == made
    assert sorted(p.name for p in first.parent.iterdir()) == ["clip-00000.npz", "clip-00001.npz"]
    assert read_clip(first).facts["number"] == 0
