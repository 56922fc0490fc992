"""The desktop demo's view of depth and edges: curves where the command line finds them, switches, sentences."""

import json
import shutil
from functools import cache
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from hands import demo
from shown_by_demo import DEMO, MAQUETTE, ROOT, headless, run, show

pytestmark = [
    pytest.mark.skipif(not DEMO.exists(), reason="maquette-demo is not built (scripts/install-packages.sh desktop)"),
    pytest.mark.skipif(shutil.which("Xvfb") is None, reason="no Xvfb (scripts/install-packages.sh test)"),
]

SOLIDS, FRAMES = "stub:solids?scene=shelf&seed=2&size=640x480", 3
BOX = json.loads((ROOT / "tests/media/box_depth.json").read_text())
COLOURS = {"convex": (60, 235, 255), "concave": (90, 255, 90), "boundary": (255, 255, 255)}  # BGR
CORNER, BOX_LINE = (80, 80, 255), (255, 120, 255)


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("edges")

    @cache
    def of(*options, source=SOLIDS, frames=FRAMES):
        found = show(folder, "--edges", source, "--frames", frames, *options)
        assert (found.report["view"], found.report["problem"]) == ("edges", "")
        return found

    return of


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The same frame's curves by the command line, and the field's camera."""
    folder = tmp_path_factory.mktemp("found")
    ran = run(MAQUETTE, "edges", SOLIDS, "--out", folder, "--format", "json", "--max-frames", FRAMES)
    assert ran.returncode == 0, ran.stderr
    curves = json.loads(sorted(folder.glob("*_curves.json"))[-1].read_text())
    return curves, json.loads(sorted(folder.glob("*_edges.json"))[-1].read_text())["intrinsics"]


def on_screen(picture, camera, points) -> np.ndarray:
    """Where points in metres, [n, 3], are seen in the screenshot: [n, 2]."""
    points = np.asarray(points, float).reshape(-1, 3)
    x = camera["fx_px"] * points[:, 0] / points[:, 2] + camera["cx_px"]
    y = camera["fy_px"] * points[:, 1] / points[:, 2] + camera["cy_px"]
    left, top, wide, tall = picture.report["picture_px"]
    width, height = picture.report["frame_px"]
    return np.stack([left + (x + 0.5) * wide / width, top + (y + 0.5) * tall / height], 1)


def near(picture, colour, error: int = 24) -> np.ndarray:
    """Pixels of that colour: bool [height, width] of the shown image."""
    return np.abs(picture.rectangle("picture_px").astype(int) - colour).max(-1) < error


def without_legend(mask: np.ndarray) -> np.ndarray:
    mask = mask.copy()
    mask[-90:, :220] = False
    return mask


def colour_of(curve) -> tuple[int, int, int]:
    if curve["kind"] == "boundary":
        return COLOURS["boundary"]
    return COLOURS["concave" if curve["bend"] == "concave" else "convex"]


def test_curves_are_drawn_where_the_command_line_finds_them_in_the_colour_of_their_kind(shown, found):
    picture, (curves, camera) = shown("--no-boxes"), found
    assert picture.report["edges"]["curves"] == len(curves["curves"]) > 5
    assert picture.report["edges"]["corners"] == len(curves["corners"])
    right = total = 0
    for curve in curves["curves"]:
        points = np.asarray(curve["points"], float).reshape(-1, 3)
        for a, b in pairwise(points):
            start, end = on_screen(picture, camera, [a, b])
            length_px = np.linalg.norm(end - start)  # an arc of a few pixels has dozens of points
            for x, y in np.round(on_screen(picture, camera, [0.5 * (a + b)])).astype(int):
                patch = picture.screenshot[y - 1 : y + 2, x - 1 : x + 2].astype(int)
                right += length_px * bool((np.abs(patch - colour_of(curve)).max(-1) < 40).any())
                total += length_px
    assert total > 500
    assert right / total > 0.9  # where two cross, one is above


def test_without_curves_their_colours_are_gone(shown):
    with_curves, without = shown("--layer", "plain", "--no-boxes"), shown("--layer", "plain", "--no-curves")
    assert without.report["edges"]["curves"] == 0
    for name in ("convex", "concave"):
        assert without_legend(near(with_curves, COLOURS[name])).sum() > 50, name
        assert near(without, COLOURS[name]).sum() == 0, name
    assert without_legend(near(with_curves, CORNER)).sum() > 20
    assert near(without, CORNER).sum() == 0


def test_the_plain_layer_is_grey_and_depth_and_distance_are_in_colours(shown):
    def coloured(layer):
        picture = shown("--layer", layer, "--no-curves").rectangle("picture_px").astype(int)
        return float((picture.max(-1) - picture.min(-1) > 40).mean())

    assert coloured("plain") < 0.001
    assert coloured("depth") > 0.6
    assert coloured("distance") > 0.1
    depth, distance = (
        shown("--layer", layer, "--no-curves").rectangle("picture_px") for layer in ("depth", "distance")
    )
    assert np.abs(depth.astype(int) - distance).mean() > 20


def test_a_box_has_its_three_lengths(shown):
    picture = shown(source=BOX["source"], frames=1)
    boxes = picture.report["edges"]["boxes"]
    assert len(boxes) == 1
    assert boxes[0]["size_m"] == pytest.approx(BOX["size_m"], abs=0.02)
    assert min(boxes[0]["size_tolerance_m"]) > 0
    without = shown("--no-boxes", source=BOX["source"], frames=1)
    assert without.report["edges"]["boxes"] == []
    assert near(picture, BOX_LINE).sum() > 300
    assert near(without, BOX_LINE).sum() == 0


def test_planes_are_skipped(shown):
    wall = "stub:solids?scene=wall"
    assert shown("--skip-planes", source=wall, frames=1).report["edges"]["network_pixels"] == 0
    assert shown(source=wall, frames=1).report["edges"]["network_pixels"] == 320 * 240


def test_without_a_source_solids_are_shown(tmp_path):
    report = show(tmp_path, "--edges", "--frames", 2).report
    assert report["source"] == "stub:solids"
    assert report["frame_px"] == [320, 240]
    assert report["edges"]["curves"] > 0


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ((ROOT / "tests/media/photo.jpg",), "without depth"),
        ((f"image:{ROOT}/tests/media/box_depth.png?depth_unit=0.001",), "fov=60"),
        (("--source", "stub:solids?unplug@3"), "solids"),
        (("--edges-bundle", "missing-bundle"), "missing-bundle"),
        (("--layer", "x-ray"), "x-ray"),
    ],
    ids=lambda value: str(value)[-30:],
)
def test_what_cannot_be_shown_is_said_in_a_sentence(options, word):
    ran = headless("--edges", *options, "--frames", 50, timeout_s=60)
    assert 0 < ran.returncode < 126, ran.stderr
    assert "maquette-demo: " in ran.stderr or "--layer" in ran.stderr
    assert word in ran.stderr
    assert len(ran.stderr.split()) >= 5


def test_keys_switch_curves_and_views_and_a_snapshot_has_the_files(tmp_path):
    def curves_are_seen():
        seen = hands.see()[:600, :900].astype(int)
        return (np.abs(seen - COLOURS["convex"]).max(-1) < 24).sum() > 50

    with demo("--edges", BOX["source"], "--layer", "plain", "--no-boxes", "--out", tmp_path) as hands:
        hands.until(curves_are_seen, "curves")
        hands.press("F2")
        hands.until(lambda: next(iter(tmp_path.glob("*_curves.step")), None), "a snapshot with its curves")
        hands.press("c")
        hands.until(lambda: not curves_are_seen(), "the picture without curves")
        hands.press("c")
        hands.until(curves_are_seen, "curves again")
        grey = hands.see()[200:600, 200:700].astype(int)
        hands.press("1")
        hands.until(lambda: np.abs(hands.see()[200:600, 200:700].astype(int) - grey).mean() > 20, "depth in colours")
        hands.press("F5")
        hands.until(lambda: not curves_are_seen(), "people")
        hands.press("F5")
        hands.until(curves_are_seen, "edges again")
    stem = str(next(tmp_path.glob("*_curves.step"))).removesuffix("_curves.step")
    assert cv2.imread(f"{stem}.png") is not None
    assert cv2.imread(f"{stem}_distance.png", cv2.IMREAD_UNCHANGED).dtype == np.uint16
    assert json.loads(Path(f"{stem}_edges.json").read_text())["width"] == cv2.imread(f"{stem}_kind.png").shape[1]


def test_the_edge_at_the_pointer_is_named_with_its_length_and_the_corner_is_marked(shown, tmp_path):
    ran = run(MAQUETTE, "edges", BOX["source"], "--out", tmp_path, "--format", "json")
    assert ran.returncode == 0, ran.stderr
    curves = json.loads(next(tmp_path.glob("*_curves.json")).read_text())
    camera = json.loads(next(tmp_path.glob("*_edges.json")).read_text())["intrinsics"]
    x, y, z = curves["corners"][0]["point"]
    at = camera["fx_px"] * x / z + camera["cx_px"] + 2, camera["fy_px"] * y / z + camera["cy_px"] + 1
    picture = shown("--no-boxes", "--pointer", f"{at[0]:.2f},{at[1]:.2f}", source=BOX["source"], frames=1)
    found = picture.report["edges"]["at_pointer"]
    assert found["snap"] == "corner"
    assert found["point_m"] == pytest.approx([x, y, z])
    assert 0 in curves["curves"][found["curve"]]["corners"]
    assert found["length_m"] == pytest.approx(curves["curves"][found["curve"]]["length_m"], abs=1e-6)
    before = shown("--no-boxes", source=BOX["source"], frames=1)
    assert before.report["edges"]["at_pointer"] is None
    px, py = np.round(on_screen(picture, camera, [[x, y, z]])[0]).astype(int)
    around = slice(py - 9, py + 10), slice(px - 9, px + 10)
    marked = (picture.screenshot[around].min(-1) > 240).sum() - (before.screenshot[around].min(-1) > 240).sum()
    assert marked > 40


def test_the_pointer_of_the_window_is_followed():
    with demo("--edges", BOX["source"], "--layer", "plain", "--no-boxes") as hands:
        hands.until(lambda: (hands.see()[:, :900, 0] > 0).mean() > 0.1, "the picture")
        hands.point(1, 1)
        before = hands.see()[60:700, :900].astype(int)
        hands.point(475, 415)  # the corner of the carton that is nearest
        hands.until(
            lambda: (np.abs(hands.see()[60:700, :900].astype(int) - before).max(-1) > 100).sum() > 200,
            "a text beside the pointer",
        )
