"""The desktop demo as a program: scenes, lost cameras, bad input, its report, memory, installation."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest
from shown_by_demo import DEMO, MAQUETTE, ROOT, headless, psnr_db, room_of_few_photos, run, show

WITH_SANITIZERS = ROOT / "build/asan/stage/bin/maquette-demo"

pytestmark = [
    pytest.mark.skipif(not DEMO.exists(), reason="maquette-demo is not built (scripts/install-packages.sh desktop)"),
    pytest.mark.skipif(shutil.which("Xvfb") is None, reason="no Xvfb (scripts/install-packages.sh test)"),
]


# --- scenes -----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    return room_of_few_photos(tmp_path_factory.mktemp("photos"))


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory, room):
    path = tmp_path_factory.mktemp("scene") / "room.maqs"
    ran = run(MAQUETTE, "scene", "build", room, "--out", path)
    assert ran.returncode == 0, ran.stderr
    return path


@pytest.fixture(scope="module")
def scenes(tmp_path_factory, room, scene_file):
    """The room with each way to compare, once made of its photos by the demo; ends where one of them was taken."""
    folder = tmp_path_factory.mktemp("room")
    files = {"none": [room], "slider": [scene_file, "--capture", room], "error": [scene_file, "--capture", room]}
    return {way: show(folder, *paths, "--compare", way, "--frames", 3) for way, paths in files.items()}


def photo_of(shown) -> np.ndarray:
    """As large as the image of the demo."""
    photo = ROOT / "tests/media/room" / shown.report["scene"]["photo"].removesuffix(" (held out)")
    return cv2.resize(cv2.imread(str(photo)), shown.report["picture_px"][2:], interpolation=cv2.INTER_LINEAR)


def test_a_capture_is_shown_like_the_photo_from_the_same_place(scenes):
    shown = scenes["none"]
    scene = shown.report["scene"]
    assert scene["points"] > 100_000
    photo, picture = photo_of(shown), shown.rectangle("picture_px")
    assert psnr_db(picture, photo) > 22
    assert psnr_db(picture, photo) > psnr_db(picture, photo[:, ::-1]) + 6
    assert scene["psnr_db"] == pytest.approx(psnr_db(picture, photo), abs=3)


def test_the_slider_has_the_photo_on_one_side_and_the_rendering_on_the_other(scenes):
    shown = scenes["slider"]
    assert shown.report["scene"]["photo"] == scenes["none"].report["scene"]["photo"]
    photo, picture, rendered = photo_of(shown), shown.rectangle("picture_px"), scenes["none"].rectangle("picture_px")
    below_labels, width = slice(60, None), photo.shape[1]
    left, right = slice(0, width // 2 - 8), slice(width // 2 + 8, None)
    assert psnr_db(picture[below_labels, left], photo[below_labels, left]) > 32
    assert psnr_db(picture[below_labels, right], rendered[below_labels, right]) > 32
    assert psnr_db(rendered[below_labels, left], photo[below_labels, left]) < 32


def test_the_error_image_is_dark_where_photo_and_rendering_agree(scenes):
    shown = scenes["error"]
    error = shown.rectangle("picture_px").max(-1).astype(float)
    wanted = np.abs(scenes["none"].rectangle("picture_px").astype(float) - photo_of(shown)).max(-1)
    error, wanted = cv2.blur(error, (9, 9)), cv2.blur(wanted, (9, 9))
    alike, unlike = wanted < np.quantile(wanted, 0.3), wanted > np.quantile(wanted, 0.95)
    assert error[unlike].mean() > 2 * error[alike].mean()
    assert np.corrcoef(error.ravel(), wanted.ravel())[0, 1] > 0.5


def test_a_scene_file_is_shown_without_its_photos(scene_file, tmp_path):
    shown = show(tmp_path, scene_file, "--frames", "2")
    assert shown.report["scene"]["points"] > 100_000
    assert shown.report["scene"]["photo"] is None
    assert shown.rectangle("picture_px").std() > 15


# --- cameras ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def lost_camera(tmp_path_factory):
    """A long run, with a camera that is lost and comes back."""
    folder = tmp_path_factory.mktemp("lost_camera")
    return show(folder, "--source", "stub:people?count=2&seed=7&unplug=1s@2s", "--frames", 75)


def test_a_camera_that_is_lost_and_comes_back_goes_on(lost_camera):
    shown = lost_camera
    assert shown.report["frames"] == 75
    assert shown.report["problem"] == ""
    states = shown.report["states"]
    assert "running" in states[states.index("reconnecting") :]
    assert shown.rectangle("picture_px").std() > 15


def test_a_camera_that_stays_away_ends_with_a_sentence():
    # By 5 s the networks are loaded, also where the machine is busy.
    ran = headless("--source", "stub:people?unplug@5s", "--frames", 1000, timeout_s=60)
    assert_refused(ran)
    report = json.loads(ran.stdout)
    states = report["states"]
    assert states.index("running") < states.index("reconnecting") < states.index("failed")
    assert "running" not in states[states.index("reconnecting") :]
    assert 0 < report["frames"] < 1000
    assert len(report["problem"]) > 20


def test_lost_frames_are_counted(tmp_path):
    report = show(tmp_path, "--source", "stub:people?drop=0.3", "--frames", 30).report
    assert report["dropped_frames"] >= 5


# --- bad input --------------------------------------------------------------------------------------------------------


def assert_refused(ran: subprocess.CompletedProcess, *words: str) -> None:
    """It says why in a sentence, and does not crash."""
    assert 0 < ran.returncode < 126, f"{ran.returncode}: {ran.stderr}"  # above: ended by a signal
    lines = [line for line in ran.stderr.splitlines() if line.strip()]
    assert 1 <= len(lines) <= 2, ran.stderr
    assert "terminate called" not in ran.stderr
    assert len(ran.stderr.split()) >= 5
    for word in words:
        assert word in ran.stderr


def test_files_that_are_not_what_they_should_be_are_refused(tmp_path, scene_file):
    (tmp_path / "text.jpg").write_text("This is no photo.")
    (tmp_path / "empty.mp4").write_bytes(b"")
    whole = scene_file.read_bytes()
    (tmp_path / "short.maqs").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "changed.maqs").write_bytes(whole[:5000] + b"x" * 64 + whole[5064:])
    (tmp_path / "no_capture").mkdir()
    for name in ("missing.jpg", "text.jpg", "empty.mp4", "short.maqs", "changed.maqs", "no_capture", "missing.maqs"):
        assert_refused(headless(tmp_path / name, "--frames", "2"), name.split(".")[0])


@pytest.mark.parametrize(
    "options",
    [
        ("--view", "x-ray"),
        ("--size", "0x0"),
        ("--size", "wide"),
        ("--frames", "-3"),
        ("--threads", "many"),
        ("--compare", "both"),
        ("--source", "no-such-scheme:0"),
        ("--source", "stub:people?unplug=often"),
        ("--texture", "missing.png", "--view", "try-on", "--source", "stub:people", "--frames", "2"),
        ("--bundle", "missing-bundle", "--source", "stub:people", "--frames", "2"),
        ("--screenshot", "missing/folder/out.png", "--source", "stub:people", "--frames", "2"),
        ("--unknown-option",),
        ("one.jpg", "two.jpg"),
    ],
    ids=" ".join,
)
def test_wrong_options_are_refused(options):
    assert_refused(headless(*options))


def test_without_a_display_it_says_so():
    env = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    assert_refused(run(DEMO, "--headless", "--frames", 2, "--source", "stub:people", env=env))


def test_without_opengl_3_3_it_says_so():
    env = os.environ | {"MESA_GL_VERSION_OVERRIDE": "2.1"}
    assert_refused(headless("--frames", 2, "--source", "stub:people", env=env), "OpenGL")


def test_help_teaches_every_option():
    ran = run(DEMO, "--help")
    assert ran.returncode == 0
    for word in ("--view", "--mesh", "--texture", "--compare", "--key-frames", "--headless", "try-on", "xvfb-run",
                 "--edges", "--layer", "--no-curves", "--skip-planes"):  # fmt: skip
        assert word in ran.stdout


# --- report, memory, size ---------------------------------------------------------------------------------------------


def test_the_times_of_the_windows_frames_are_reported(lost_camera):
    """How short they are is a figure (scripts/desktop-demo-images.py prints it), not a test."""
    ui = lost_camera.report["ui"]
    assert ui["frames"] >= 20
    assert 0 < ui["p99_ms"] <= ui["longest_ms"]
    assert ui["start_ms"] > 0


def test_nothing_is_left_in_the_folder_that_it_is_started_in(tmp_path):
    ran = headless("--frames", 2, "--source", "stub:people", cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.asan_build
@pytest.mark.skipif(not WITH_SANITIZERS.exists(), reason="build/asan has no maquette-demo")
def test_60_frames_leak_nothing(tmp_path):
    # Drivers and X libraries are unloaded before leaks are looked for, and what only their variables point to would
    # count as leaked, with no name left to tell it by. So they stay.
    (tmp_path / "stay.c").write_text("int dlclose(void* library) { return library == 0; }")
    assert run("cc", "-shared", "-fPIC", tmp_path / "stay.c", "-o", tmp_path / "stay.so").returncode == 0
    options = "detect_leaks=1:verify_asan_link_order=0:intercept_tls_get_addr=0"  # tests/native/CMakeLists.txt says why
    env = {"ASAN_OPTIONS": options, "LD_PRELOAD": str(tmp_path / "stay.so")}
    options = ("--source", "stub:people?count=2&seed=7", "--frames", 60, "--view", "try-on", "--mesh")
    ran = headless(*options, program=WITH_SANITIZERS, env=env, timeout_s=900)
    assert "Sanitizer" not in ran.stderr, ran.stderr[-3000:]
    assert ran.returncode == 0, ran.stderr[-3000:]
    assert json.loads(ran.stdout)["frames"] == 60


def test_its_own_code_stays_short():
    files = sorted((ROOT / "desktop_demo/src").rglob("*.*"))
    lines = [line.strip() for path in files for line in path.read_text().splitlines()]
    code = [line for line in lines if line and not line.startswith("//")]
    print(f"{len(code)} lines of code, {len(lines)} with blank lines and those of comment alone")
    assert len(code) <= 2650  # people, scenes, edges, heads, what comes next, surprise


# --- installation -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    prefix = tmp_path_factory.mktemp("prefix")
    ran = run("cmake", "--install", ROOT / "build/release", "--prefix", prefix)
    assert ran.returncode == 0, ran.stderr
    return prefix


def assert_shows_people(program: Path, folder: Path) -> None:
    screenshot = folder / "shown.png"
    ran = headless("--frames", 3, "--source", "stub:people?count=2&seed=7", "--view", "try-on", "--screenshot",
                   screenshot, program=program)  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    assert len(json.loads(ran.stdout)["people"]) == 2
    assert screenshot.exists()


def test_an_installation_has_program_outfit_icon_and_desktop_entry(installed, tmp_path):
    entry = installed / "share/applications/maquette-demo.desktop"
    assert "Exec=maquette-demo %f" in entry.read_text().splitlines()
    if shutil.which("desktop-file-validate"):
        assert run("desktop-file-validate", entry).stdout == ""
    assert "<svg" in (installed / "share/icons/hicolor/scalable/apps/maquette-demo.svg").read_text()
    shipped = (ROOT / "desktop_demo/assets/outfit.png").read_bytes()
    assert (installed / "share/maquette/demo/outfit.png").read_bytes() == shipped
    assert_shows_people(installed / "bin/maquette-demo", tmp_path)


@pytest.mark.slow
def test_it_is_built_with_the_app_helpers_alone_against_an_installed_sdk(installed, tmp_path):
    for folder in ("desktop_demo", "sdk/app"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    # That it compiles and runs is asked, not how fast: optimisation would be most of the time.
    quick = ["-DCMAKE_BUILD_TYPE=Debug", "-DCMAKE_CXX_FLAGS_DEBUG=-O0"]
    if shutil.which("ccache"):
        quick.append("-DCMAKE_CXX_COMPILER_LAUNCHER=ccache")
    env = os.environ | {"CCACHE_BASEDIR": str(tmp_path.parent), "CCACHE_NOHASHDIR": "1"}
    source, build = tmp_path / "desktop_demo", tmp_path / "build"
    for command in (
        ("cmake", "-S", source, "-B", build, f"-DCMAKE_PREFIX_PATH={installed}", *quick),
        ("cmake", "--build", build, "-j", "2"),
    ):
        ran = run(*command, env=env, timeout_s=900)
        assert ran.returncode == 0, ran.stdout + ran.stderr
    assert_shows_people(build / "stage/bin/maquette-demo", tmp_path)
