"""The template head: files written and read, what is refused, and what the shipped one has."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_template import small_template

from export.heads.prior import PriorError
from export.heads.template_file import Kind, Template, read_template, template_bytes, template_from_bytes

TINY = Path("tests/native/data/tiny_head/template.maqt")
SHIPPED = Path("sdk/models/heads-int8/template.maqt")
# Facial actions of ARKit's face tracking.
SIDES = ("browDown", "browOuterUp", "cheekSquint", "eyeBlink", "eyeLookDown", "eyeLookIn", "eyeLookOut", "eyeLookUp",
         "eyeSquint", "eyeWide", "mouthDimple", "mouthFrown", "mouthLowerDown", "mouthPress", "mouthSmile",
         "mouthStretch", "mouthUpperUp", "noseSneer")  # fmt: skip
SINGLE = ("browInnerUp", "cheekPuff", "jawForward", "jawLeft", "jawOpen", "jawRight", "mouthClose", "mouthFunnel",
          "mouthLeft", "mouthPucker", "mouthRight", "mouthRollLower", "mouthRollUpper", "mouthShrugLower",
          "mouthShrugUpper", "tongueOut")  # fmt: skip


def test_a_template_is_read_as_it_was_written():
    made = small_template()
    assert TINY.read_bytes() == template_bytes(made)
    found = read_template(TINY)
    assert np.abs(found.points - made.points).max() < 1e-6
    assert np.abs(found.uv - made.uv).max() < 1e-5
    for name in ("kinds", "vertex_points", "triangles"):
        assert np.array_equal(getattr(found, name), getattr(made, name)), name
    assert list(found.actions) == list(made.actions)
    assert np.array_equal(found.actions["jawOpen"][0], [0, 3])
    assert np.abs(found.actions["jawOpen"][1] - made.actions["jawOpen"][1]).max() < 1e-6


def test_damaged_files_are_refused():
    data = template_bytes(small_template())
    for cut in (0, 7, 55, len(data) - 1):
        with pytest.raises(PriorError):
            template_from_bytes(data[:cut])
    for at in range(0, len(data), 3):
        with pytest.raises(PriorError):
            template_from_bytes(data[:at] + bytes([data[at] ^ 16]) + data[at + 1 :])


@pytest.mark.parametrize(
    ("text", "changes"),
    [
        ("does not have", {"triangles": np.array([[0, 1, 6]])}),
        ("does not have", {"vertex_points": np.array([0, 1, 2, 3, 0, 5])}),
        ("kinds that there are not", {"kinds": np.array([0, 0, 0, 0, 7], np.uint8)}),
        ("do not increase", {"actions": {"jawOpen": (np.array([3, 0]), np.zeros((2, 3)))}}),
        ("names have 1 to 64 bytes", {"actions": {"": (np.array([0]), np.zeros((1, 3)))}}),
        ("reaches 9 dm", {"points": np.full((5, 3), 9.0)}),
    ],
)
def test_templates_that_the_sdk_would_refuse_are_not_written(text, changes):
    with pytest.raises(PriorError, match=text):
        template_bytes(replace(small_template(), **changes))


@pytest.fixture(scope="module")
def shipped() -> Template:
    return read_template(SHIPPED)


def test_the_shipped_template_has_the_52_actions_of_arkit(shipped):
    wanted = {*SINGLE, *(f"{name}{side}" for name in SIDES for side in ("Left", "Right"))}
    assert set(shipped.actions) == wanted
    assert len(wanted) == 52
    assert SHIPPED.stat().st_size < 600_000
    for name, (points, moves) in shipped.actions.items():
        assert 10 < len(points) < len(shipped.points), name
        assert 0.02 < np.abs(moves).max() < 0.5, name


def test_its_actions_move_what_their_names_say(shipped):
    def middle(name: str) -> np.ndarray:
        points, moves = shipped.actions[name]
        return np.average(shipped.points[points], axis=0, weights=np.linalg.norm(moves, axis=1))

    for name in SIDES:
        assert middle(f"{name}Left")[0] > 0.05, name  # left is the person's
        assert middle(f"{name}Right")[0] < -0.05, name
    points, moves = shipped.actions["jawOpen"]
    lowest = np.argmin(moves[:, 2])  # the chin goes down by more than 2 cm
    assert moves[lowest][2] < -0.2
    assert shipped.points[points[lowest]][2] < -0.7
    points, moves = shipped.actions["tongueOut"]
    assert (shipped.kinds[points] == Kind.TONGUE).all()
    assert moves[:, 1].min() < -0.1  # to the front


def test_the_mesh_of_the_shipped_template_is_sound(shipped):
    corners = shipped.vertex_points[shipped.triangles]
    used = np.unique(corners)
    assert np.array_equal(used, np.arange(len(shipped.points)))
    a, b, c = (shipped.points[corners[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert (area > 0).mean() > 0.999
    edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), 1)
    counts = np.unique(edges, axis=0, return_counts=True)[1]
    assert counts.max() == 2
    skin = shipped.kinds == Kind.SURFACE
    assert 3000 < skin.sum() < 4000
    # It faces outwards: the front to -y.
    front = skin[corners].all(1) & (a[:, 1] < -0.9)
    assert (np.cross(b - a, c - a)[front, 1] < 0).mean() > 0.9
    assert shipped.uv.min() >= 0
    assert shipped.uv.max() <= 1
