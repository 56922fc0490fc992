"""The desktop demo's view of predictions: they differ from now while things move and are marked. Novel cells are red
in the image and in the curve."""

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

PEOPLE = "stub:people?count=2&seed=3&size=320x240"
# Long enough that the last predicted frame, which stays on the screen, is seen.
STALLS = "stub:people?count=2&seed=3&size=320x240&fps=10&stall=6s@3s"
MAGENTA = (255, 0, 255)


def is_magenta(picture) -> np.ndarray:
    return np.abs(picture.astype(int) - MAGENTA).max(-1) < 8


def has_border(picture) -> bool:
    """At the middle of each side, some pixels inwards."""
    mask = is_magenta(picture)
    height, width = mask.shape
    rows, columns = slice(height // 2 - 5, height // 2 + 5), slice(width // 2 - 5, width // 2 + 5)
    return bool(mask[rows, 1:3].all() and mask[rows, -3:-1].all() and mask[1:3, columns].all())


def inside(picture) -> np.ndarray:
    """Without border and caption."""
    return picture[10:-60, 10:-10].astype(int)


def difference(shown) -> float:
    return float(np.abs(inside(shown.rectangle("now_px")) - inside(shown.rectangle("next_px"))).mean())


def test_what_comes_differs_from_now_while_things_move_and_is_marked(tmp_path):
    moved = show(tmp_path, "--predict", PEOPLE, "--method", "motion", "--ahead", 400, "--frames", 20)
    assert (moved.report["view"], moved.report["problem"], moved.report["frames"]) == ("prediction", "", 20)
    prediction = moved.report["prediction"]
    assert (prediction["method"], prediction["ahead_ms"]) == ("motion", 400)
    assert prediction["push_ms"] > 0
    assert prediction["predict_ms"] > 0
    assert has_border(moved.rectangle("next_px"))
    assert not has_border(moved.rectangle("now_px"))
    assert difference(moved) > 0.5
    nearer = show(tmp_path, "--predict", PEOPLE, "--method", "motion", "--ahead", 33, "--frames", 20)
    assert np.array_equal(inside(nearer.rectangle("now_px")), inside(moved.rectangle("now_px")))
    assert difference(nearer) < 0.6 * difference(moved)


def test_the_last_frame_is_now(tmp_path):
    shown = show(tmp_path, "--predict", PEOPLE, "--method", "last", "--frames", 20)
    assert shown.report["prediction"]["method"] == "last"
    assert difference(shown) < 0.05
    assert has_border(shown.rectangle("next_px"))


def test_auto_says_how_much_of_the_image_is_motions(tmp_path):
    shown = show(tmp_path, "--predict", PEOPLE, "--ahead", 100, "--frames", 20)
    fraction = shown.report["prediction"]["motion_fraction"]
    assert shown.report["prediction"]["method"] == ("last" if fraction == 0 else "motion" if fraction == 1 else "auto")
    assert (difference(shown) > 0.2) == (fraction > 0)


def test_of_a_photo_nothing_else_comes(tmp_path):
    shown = show(tmp_path, "--predict", ROOT / "tests/media/photo.jpg", "--frames", 5)
    assert shown.report["states"][-1] == "ended"
    assert shown.report["frames"] == 1
    assert difference(shown) < 0.05


def test_a_stall_is_filled_with_frames_that_are_counted(tmp_path):
    shown = show(tmp_path, "--predict", "--conceal", STALLS.replace("6s@3s", "1s@2s"), "--frames", 30)
    prediction = shown.report["prediction"]
    assert prediction["conceals_gaps"]
    assert prediction["concealed_frames"] >= 1
    assert 0 < prediction["latest_gap_ms"] <= 310
    assert not prediction["now_is_predicted"]
    without = show(tmp_path, "--predict", STALLS.replace("6s@3s", "1s@2s") + "&live=1", "--frames", 30)
    assert without.report["prediction"]["concealed_frames"] == 0


def test_a_predicted_frame_has_a_border_and_the_switch_is_a_key():
    def now(hands):
        """The upper of the two images; the demo's window is 1280 x 800 and the panel 330 wide."""
        return hands.see()[0:400, 208:741]

    def shows_people(hands):
        return inside(now(hands)).std() > 10

    with demo("--predict", "--conceal", STALLS) as hands:
        hands.until(lambda: shows_people(hands) and not has_border(now(hands)), "a captured frame")
        hands.until(lambda: has_border(now(hands)), "a predicted frame with its border")
        hands.until(lambda: not has_border(now(hands)), "the camera again")
    with demo("--predict", STALLS) as hands:
        hands.until(lambda: shows_people(hands), "a picture")
        hands.press("b")
        hands.until(lambda: has_border(now(hands)), "a predicted frame with its border")


def redness(picture) -> np.ndarray:
    return picture[..., 2].astype(int) - picture[..., :2].max(-1)


def clip_with_a_cut(path, frames=20):
    """People who walk, and from `frames` on as many frames of a checkerboard."""
    clip = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), 20, (320, 240))
    source = cv2.VideoCapture(str(ROOT / "tests/media/clip.mp4"))
    for _ in range(frames):
        clip.write(cv2.resize(source.read()[1], (320, 240)))
    board = np.kron(np.indices((15, 20)).sum(0) % 2, np.ones((16, 16)))[..., None] * np.uint8([200, 220, 240])
    for _ in range(frames):
        clip.write(board.astype(np.uint8))
    clip.release()
    return path


def test_a_cut_is_an_event_in_the_curve_and_red_in_the_image(tmp_path):
    clip = clip_with_a_cut(tmp_path / "cut.mp4")
    after = show(tmp_path, "--predict", "--health", clip, "--frames", 22)
    assert after.report["health"]["events"] == [{"kind": "cut", "time_s": pytest.approx(1.05, abs=0.03)}]
    event = redness(after.rectangle("curve_px")).max(0) > 100
    assert event[-5:].any()
    at_the_cut = show(tmp_path, "--predict", "--health", clip, "--frames", 21)
    assert np.median(redness(inside(at_the_cut.rectangle("now_px")))) > 60
    before = show(tmp_path, "--predict", "--health", clip, "--frames", 20)
    assert before.report["health"]["events"] == []
    assert redness(before.rectangle("curve_px")).max() < 20
    off = show(tmp_path, "--predict", clip, "--frames", 21)
    assert off.report["health"]["frames"] == 0
    assert np.median(redness(inside(off.rectangle("now_px")))) < 20


def test_camera_health_is_switched_by_a_key():
    def curve(hands):
        """The lowest rows of the window where the images are."""
        return hands.see()[770:795, 208:741].astype(int)

    with demo("--predict", PEOPLE) as hands:
        hands.until(lambda: hands.see()[100:400, 208:741].astype(int).std() > 10, "people")
        without = curve(hands).std()
        hands.press("s")
        hands.until(lambda: curve(hands).std() < 30 and abs(curve(hands).std() - without) > 2, "the curve")


def test_uncertain_cells_are_red_and_have_an_age(tmp_path):
    sampled = show(tmp_path, "--predict", "--entropy", "--sample", PEOPLE, "--ahead", 100, "--frames", 6)
    assert sampled.report["problem"] == ""
    assert sampled.report["sample"]["number"] == 6
    assert sampled.report["sample"]["age_ms"] == 0
    assert sampled.report["sample"]["bits"] > 0.2
    red = redness(inside(sampled.rectangle("next_px")))
    assert np.percentile(red, 99) > 80
    assert np.median(red) < 40
    assert has_border(sampled.rectangle("sample_px"))
    assert inside(sampled.rectangle("sample_px")).std() > 10
    off = show(tmp_path, "--predict", PEOPLE, "--ahead", 100, "--frames", 6)
    assert np.percentile(redness(inside(off.rectangle("next_px"))), 99) < 80
    assert off.report["sample"]["number"] == 0
    without = headless("--predict", "--entropy", "--prediction-bundle", ROOT / "tests", PEOPLE, "--frames", 3)
    assert without.returncode == 0, without.stderr
    assert "manifest.json" in without.stdout


def test_entropy_and_a_sample_are_switched_by_keys():
    bundle = ROOT / "tests/native/data/tiny_transformer/bundle"
    with demo("--predict", "--prediction-bundle", bundle, PEOPLE) as hands:

        def magenta_px():
            """Counts the pixels of borders and captions of predicted images."""
            return int(is_magenta(hands.see()[:, :940]).sum())

        hands.until(lambda: magenta_px() > 1000, "what comes")
        one = magenta_px()
        hands.press("u")
        hands.until(lambda: magenta_px() > 1.2 * one, "the age of the entropy")
        hands.press("u")
        hands.until(lambda: magenta_px() < 1.1 * one, "what comes alone")
        hands.press("d")
        hands.until(lambda: magenta_px() > 1.3 * one, "a third picture")


def test_f7_goes_from_people_to_what_comes_and_back_with_the_same_source():
    with demo(PEOPLE, "--view", "camera", "--no-mesh") as hands:

        def marks():
            return int(is_magenta(hands.see()[:, :900]).sum())

        hands.until(lambda: hands.see()[100:700, :900].astype(int).std() > 10, "people")
        assert marks() == 0
        hands.press("F7")
        hands.until(lambda: marks() > 1000, "the border of what comes")
        hands.press("F7")
        hands.until(lambda: marks() == 0 and hands.see()[100:700, :900].astype(int).std() > 10, "people again")
        hands.press("F5")
        hands.press("F7")
        hands.until(lambda: marks() > 1000, "what comes, from edges")


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (("missing.mp4",), "missing.mp4"),
        ((f"image:{ROOT}/tests/media/box_depth.png?depth_unit=0.001&fov=60",), "depth"),
        (("--ahead", 2000), "--ahead"),
        (("--method", "latent"), "latent"),
        (("--edges",), "--edges"),
    ],
    ids=lambda value: str(value)[-30:],
)
def test_what_cannot_be_shown_is_said_in_a_sentence(options, word):
    ran = headless("--predict", *options, "--frames", 5, timeout_s=60)
    assert 0 < ran.returncode < 126, ran.stderr
    assert word in ran.stderr.lower()
