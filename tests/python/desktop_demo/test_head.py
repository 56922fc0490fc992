"""The desktop demo's view of heads: it forms, is turned, laid over the photo, exported; sentences."""

import shutil

import cv2
import numpy as np
import pytest
from hands import demo
from shown_by_demo import DEMO, ROOT, headless, show

pytestmark = [
    pytest.mark.skipif(not DEMO.exists(), reason="maquette-demo is not built (scripts/install-packages.sh desktop)"),
    pytest.mark.skipif(shutil.which("Xvfb") is None, reason="no Xvfb (scripts/install-packages.sh test)"),
]

PHOTO = ROOT / "tests/media/photo.jpg"
BACKGROUND = (20, 18, 18)  # BGR, behind the head


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("head")
    over = ["--compare", "slider"]
    normals = ["--shading", "normals"]
    options = {"colour": [], "normals": normals, "over": over, "normals_over": over + normals}
    return {
        name: show(folder, PHOTO, "--head", "--fit-seconds", "0.2", "--frames", 5, *of) for name, of in options.items()
    }


def head_mask(picture) -> np.ndarray:
    """Where something is drawn on the background: bool [height, width]."""
    return np.abs(picture.rectangle("picture_px").astype(int) - BACKGROUND).max(-1) > 12


def test_a_head_stands_beside_its_photo(shown):
    picture = shown["colour"]
    head = picture.report["head"]
    assert (picture.report["view"], picture.report["problem"]) == ("head", "")
    assert (head["photos"], head["used_photos"], head["is_over_photo"]) == (1, 1, False)
    assert head["triangles"] > 9_000
    assert 0.04 < head["pupil_distance_m"] < 0.09
    assert 0.08 < head_mask(picture).mean() < 0.6
    # The photo is in the left two fifths.
    left = picture.report["picture_px"][0]
    photo = cv2.imread(str(PHOTO))
    wide = picture.screenshot[:, :left]
    side = min(left, wide.shape[0])
    top = (wide.shape[0] - side) // 2
    expected = cv2.resize(photo, (side, side), interpolation=cv2.INTER_AREA)
    inner = slice(60, side - 60)  # a message may lie over its top
    assert np.abs(wide[top : top + side, :side][inner, inner].astype(int) - expected[inner, inner]).mean() < 6


def test_normals_are_another_image_of_the_same_head(shown):
    colour, normals = shown["colour"], shown["normals"]
    assert normals.report["head"]["shading"] == "normals"
    assert colour.report["picture_px"] == normals.report["picture_px"]
    assert (head_mask(colour) != head_mask(normals)).mean() < 0.02
    both = head_mask(colour) & head_mask(normals)
    towards_camera = normals.rectangle("picture_px")[both][:, 0]
    assert np.median(towards_camera) > 190
    assert np.median(colour.rectangle("picture_px")[both][:, 0]) < 150


def test_over_the_photo_one_half_is_the_photo_and_the_other_has_the_head_on_it(shown):
    differences = {}
    for name in ("over", "normals_over"):
        picture = shown[name]
        assert picture.report["head"]["is_over_photo"]
        seen = picture.rectangle("picture_px").astype(int)
        photo = cv2.resize(cv2.imread(str(PHOTO)), seen.shape[1::-1], interpolation=cv2.INTER_LINEAR).astype(int)
        difference = np.abs(seen - photo).mean(-1)
        middle, edge = seen.shape[1] // 2, seen.shape[0] // 10
        assert (difference[edge:, : middle - 4] > 30).mean() < 0.01  # a message may lie over its top
        # The head is in the middle of the photo's upper third.
        differences[name] = difference[edge : seen.shape[0] // 3, middle + 4 : middle + seen.shape[1] // 16]
    # Its texture is the photo, but for the light: near it, not the same.
    assert (differences["normals_over"] > 30).mean() > 0.6
    assert 3 < np.median(differences["over"]) < 30


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ((PHOTO, "--head", "--heads-bundle", "missing-bundle"), "missing-bundle"),
        ((PHOTO, "--head", "--edges"), "--edges"),
        ((PHOTO, "--head", "--shading", "x-ray"), "x-ray"),
    ],
    ids=["bundle", "edges", "shading"],
)
def test_what_cannot_be_shown_is_said_in_a_sentence(options, word):
    ran = headless(*options, "--frames", 5, timeout_s=60)
    assert 0 < ran.returncode < 126
    assert word in ran.stderr
    assert len(ran.stderr.split()) >= 4


def test_keys_make_a_head_turn_it_export_it_and_lead_back(tmp_path):
    with demo(PHOTO, "--fit-seconds", "0.5", "--out", tmp_path) as hands:
        hands.until(lambda: (hands.see()[:, :900, 0] > 40).mean() > 0.3, "the photo")
        people = hands.see()[100:700, 100:850].astype(int)
        hands.press("g")
        hands.until(lambda: np.abs(hands.see()[100:700, 100:850].astype(int) - people).mean() > 20, "the view of heads")

        def exported():
            hands.press("e")
            return next(iter(tmp_path.glob("*.maqh")), None)

        hands.until(exported, "an exported head")
        before = hands.see()[100:700, 450:900].astype(int)
        hands.press("3")
        hands.until(lambda: np.abs(hands.see()[100:700, 450:900].astype(int) - before).mean() > 5, "normals")
        hands.press("x")
        hands.until(lambda: np.abs(hands.see()[100:700, 100:850].astype(int) - people).mean() < 10, "people again")
    assert next(tmp_path.glob("*.glb")).read_bytes()[:4] == b"glTF"
