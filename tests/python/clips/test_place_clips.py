"""Clips of places: cameras and people move as motion says; splits share nothing."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("moderngl", reason="moderngl is not installed: scripts/make-venv.sh train,dev")

from export.clips import flights
from export.clips.clip import LARGE_PX
from export.clips.film import filmed
from export.clips.handheld_motion import sway
from export.clips.motion import fetched_from_next
from export.clips.place_film import PlaceFilm, PlaceMoment
from export.clips.walkers import steps_of, times_in
from export.people import assets
from export.people.motion import LIMBS, MotionClip
from export.people.props import box
from export.places.assets import furniture_folder
from export.places.cameras import Lens, looking
from export.places.furnish import about_z
from export.places.geometry_only import PlainStock
from export.places.mesh import Material, part_of
from export.places.render import Lighting, Renderer

needs_packages = pytest.mark.skipif(
    not (assets.UNPACKED / "0ad").exists() or not furniture_folder().exists(),
    reason="packages are not unpacked: run `python -m export.people.assets` and `python -m export.places.assets`",
)


def relative_error(frames, t):
    """Error of the frame fetched from the next one along the motion, as a part of that without motion, where things
    move by half a pixel or more and can be seen; None where little moves."""
    now, motion = frames.rgb[t].astype(np.float32), frames.motion[t]
    counted = frames.visible[t] & (np.hypot(motion[..., 0], motion[..., 1]) > 0.5)
    if counted.mean() < 0.005:
        return None
    then = frames.rgb[t + 1].astype(np.float32)
    with_motion = np.abs(fetched_from_next(then, motion) - now)[counted].mean()
    return with_motion / np.abs(then - now)[counted].mean()


def textured(seed, side):
    image = np.random.default_rng(seed).integers(40, 230, (side, side, 3), dtype=np.uint8)
    return Material(np.kron(image, np.ones((8, 8, 1), np.uint8)))


def test_a_part_that_turns_before_a_moving_camera_in_the_open_has_exact_motion():
    ground = part_of(box((6, 6, 0.1), (0, 0, -0.05)), textured(0, 12), repeats=0.2)
    thing = part_of(box((0.6, 0.6, 0.6)), textured(1, 4), repeats=1.5)
    around = np.random.default_rng(2).uniform(0.2, 1, (16, 32, 3)).astype(np.float32).repeat(8, 0).repeat(8, 1)
    lighting = Lighting(((np.array([0.0, 0, 1, 0]), np.zeros(3)),), np.ones(3), np.ones(3), around)
    lens, moments = Lens(*LARGE_PX, 60), []
    for t in range(3):
        camera = looking(lens, np.array([0.04 * t, -2.2, 1.2]), np.array([0.06 * t, 0, 0.8]))
        moments.append(PlaceMoment(camera, (thing.moved(about_z(0.12 * t), (0.05 * t, 0, 0.4 + 0.03 * t)),)))
    with Renderer([ground, *moments[0].moving], lighting) as renderer:
        film = PlaceFilm(renderer, 1.0, [2])
        small, large = filmed(film, moments, large=True)
        labels = film.labels(moments[0], moments[1], LARGE_PX)
    assert set(np.unique(labels.thing)) == {0, 1, 2}  # what lies behind, the ground, the thing
    for frames, limit in ((small, 0.5), (large, 0.25)):
        for t in range(2):
            assert relative_error(frames, t) < limit
    for number, least in ((0, 0.2), (2, 0.03)):
        assert (labels.thing == number).mean() > least
        of_thing = replace(large, visible=large.visible & (labels.thing == number))
        assert relative_error(of_thing, 0) < 0.3
    corner = np.array([[-0.3, -0.3, 0.3]])
    at = [m.camera.projected(corner @ about_z(0.12 * t).T + [0.05 * t, 0, 0.4 + 0.03 * t])[0][0]
          for t, m in enumerate(moments[:2])]  # fmt: skip
    x, y = np.round(at[0] + [2, 2]).astype(int)
    assert labels.thing[y, x] == 2
    assert large.motion[0, y, x] == pytest.approx(at[1] - at[0], abs=0.3)


@pytest.fixture
def plain(monkeypatch):
    monkeypatch.setattr(flights, "stock_of", PlainStock)
    monkeypatch.setattr(flights, "FRAMES", 6)


def test_a_flight_depends_on_its_number_alone_and_its_motion_is_exact(plain):
    clip, other, again = (flights.flights_clip("val", number, large=number == 1) for number in (1, 2, 1))
    assert np.array_equal(clip.small.rgb, again.small.rgb)
    assert np.array_equal(clip.large.motion, again.large.motion)
    assert clip.small.rgb.shape == (6, 64, 64, 3)
    assert other.large is None
    assert not np.array_equal(clip.small.rgb, other.small.rgb)
    errors = [e for t in range(5) if (e := relative_error(clip.large, t)) is not None]
    assert errors, "nothing moves"
    assert np.median(errors) < 0.5
    with pytest.raises(ValueError, match="other"):
        flights.flights_clip("other", 0, False)


def test_who_stands_on_one_foot_after_the_other_goes_on_while_the_feet_stay():
    # Two feet that slide back below hips that stand still, one after the other; in the air the pace is kept.
    at = np.zeros((8, 2, 3))
    for t in range(8):
        standing = 0 if t < 4 else 1
        at[t, standing, 1] = 0.1 * (t % 4)
        at[t, 1 - standing, 2] = 0.2
    way = steps_of(at)
    assert way[3] == pytest.approx([0, -0.3])
    assert way[-1, 1] < -0.6
    assert np.abs(np.diff(way, axis=0)).max() < 0.11


def test_a_motion_goes_back_and_forth_unless_its_ends_meet():
    turn = np.eye(3)[None].repeat(31, 0)
    limbs = np.zeros((31, len(LIMBS), 3))
    open_ended = limbs + np.linspace(0, 1, 31)[:, None, None]
    seconds = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    around = times_in(MotionClip("a", 30.0, turn, turn, limbs, False), seconds)
    back = times_in(MotionClip("b", 30.0, turn, turn, open_ended, False), seconds)
    assert around == pytest.approx([0, 0.5, 0, 0.5, 0])
    assert back == pytest.approx([0, 0.5, 1, 0.5, 0])


def test_sway_has_the_size_that_is_asked_for():
    rng = np.random.default_rng(0)
    found = np.stack([sway(rng, np.arange(60) / 10, 2.0, 3) for _ in range(200)])
    assert found.std() == pytest.approx(2.0, rel=0.15)
    assert not sway(rng, np.arange(5.0), 0.0).any()


@needs_packages
def test_a_clip_of_people_depends_on_its_number_alone_and_names_its_motions(monkeypatch):
    from export.clips import people

    monkeypatch.setattr(people, "FRAMES", 4)
    clip, again = (people.people_clip("val", 2, large=False) for _ in range(2))
    assert np.array_equal(clip.small.rgb, again.small.rgb)
    assert np.array_equal(clip.small.motion, again.small.motion)
    assert clip.facts["motions"]
    assert all(asset["licence"] for asset in clip.facts["assets"])


@needs_packages
def test_splits_of_people_share_no_motion():
    from export.people.motion import load_motion_clips

    names = [{clip.name for clip in load_motion_clips(split)} for split in ("train", "val", "test")]
    assert all(names)
    assert not names[0] & names[1] | names[0] & names[2] | names[1] & names[2]
