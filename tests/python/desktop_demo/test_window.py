"""The desktop demo in a visible window, used by keys and drops."""

import json

import cv2
import numpy as np
import pytest
from hands import demo
from shown_by_demo import DEMO, MAQUETTE, ROOT, room_of_few_photos, run

pytestmark = pytest.mark.skipif(
    not DEMO.exists(), reason="maquette-demo is not built (scripts/install-packages.sh desktop)"
)

PHOTO = ROOT / "tests/media/photo.jpg"
PEOPLE = "stub:people?count=2&seed=3"  # without an end


def one_of(folder, pattern):
    """Returns what finds the only file of that name, or nothing yet."""
    return lambda: next(iter(folder.glob(pattern)), None)


def has_changed(hands, times):
    """Returns what says whether the window has shown so many pictures one after the other, however fast it is."""
    seen = []

    def is_enough():
        shown = hands.see()[200:600, :900].astype(int)
        if not seen or np.abs(shown - seen[-1]).mean() > 0.2:
            seen.append(shown)
        return len(seen) > times

    return is_enough


def test_views_by_key_and_files_by_drop(tmp_path):
    photo = cv2.imread(str(PHOTO))
    with demo("--source", "stub:pattern?frames=1", "--no-mesh", "--out", tmp_path) as hands:
        hands.press("1")
        hands.drop(PHOTO)
        hands.until(lambda: hands.looks_like(photo), "the photo that was dropped")
        hands.press("4")
        hands.until(lambda: not hands.looks_like(photo, 20), "another view of it, with a dark background")
        hands.press("1")
        hands.until(lambda: hands.looks_like(photo), "the camera's view again")
        # In the try-on view an image is worn instead of opened.
        flat = np.full((300, 200, 3), (40, 220, 60), np.uint8)
        cv2.imwrite(str(tmp_path / "green.png"), flat)
        hands.press("6")
        hands.until(lambda: not hands.looks_like(photo), "the outfit")
        hands.drop(tmp_path / "green.png")
        hands.until(
            lambda: (np.abs(hands.see()[300:700, 300:600].astype(int) - (40, 220, 60)).sum(-1) < 150).mean() > 0.2,
            "the green picture, worn",
        )
        hands.press("1")
        (tmp_path / "room").mkdir()
        hands.drop(room_of_few_photos(tmp_path / "room"))
        hands.until(lambda: hands.see()[:, :950].std() > 30 and not hands.looks_like(photo, 40), "the room", 60)
        hands.press("x")
        hands.until(lambda: hands.looks_like(photo), "the photo, back from the scene")


def test_snapshots_clips_and_recordings_are_whole(tmp_path):
    with demo("--source", PEOPLE, "--view", "parts", "--out", tmp_path) as hands:
        hands.until(lambda: hands.see()[200:600, :900].std() > 20, "the clip")
        hands.press("F2")
        written = hands.until(one_of(tmp_path, "*.json"), "a snapshot")
        hands.press("F3")
        hands.press("F4")
        hands.until(one_of(tmp_path, "*.maqrec"), "a recording")
        hands.until(has_changed(hands, 20), "the 20th other picture")
        hands.press("F4")
        hands.press("F3")
        hands.until(one_of(tmp_path, "*.mp4"), "a clip")

    people = json.loads(written.read_text())["people"]
    stem = written.with_suffix("")
    picture, iuv = cv2.imread(f"{stem}.png"), cv2.imread(f"{stem}_IUV.png")
    person = cv2.imread(f"{stem}_INDS.png", cv2.IMREAD_UNCHANGED)
    assert len(people) >= 1
    assert person.max() == len(people)
    assert ((iuv[..., 0] > 0) == (person > 0)).all()
    assert picture.shape == (712, 950, 3), "the picture alone, without the panel"

    shown = cv2.VideoCapture(str(next(tmp_path.glob("*.mp4"))))
    pictures = [shown.read()[1] for _ in range(int(shown.get(cv2.CAP_PROP_FRAME_COUNT)))]
    assert len(pictures) >= 15
    assert pictures[-1].shape == (712, 950, 3)
    assert np.abs(pictures[0].astype(float) - pictures[-1]).mean() > 1, "people move in it"

    ran = run(MAQUETTE, "densepose", next(tmp_path.glob("*.maqrec")), "--out", tmp_path / "again", "--max-frames", 5)
    assert ran.returncode == 0, ran.stderr


def test_closing_completes_what_is_being_written(tmp_path):
    with demo("--source", PEOPLE, "--out", tmp_path) as hands:
        hands.until(lambda: hands.see()[200:600, :900].std() > 20, "the clip")
        hands.press("F3")
        hands.until(has_changed(hands, 8), "the 8th other picture")
    shown = cv2.VideoCapture(str(next(tmp_path.glob("*.mp4"))))
    assert shown.get(cv2.CAP_PROP_FRAME_COUNT) >= 5
