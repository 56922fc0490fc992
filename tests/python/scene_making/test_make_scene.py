"""make_scene: a scene from rendered photos whose cameras are known, going on after an interruption at each stage, and
sentences that say what to film instead."""

import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import ClassVar

import maquette
import numpy as np
import pytest
from maquette.scene_making import cameras, make
from maquette.scene_making.command import run
from maquette.scene_making.work_folder import WorkFolder
from moving_pictures import SIZE, texture, window, write_film

ROOT = Path(__file__).parents[3]
ROOM = ROOT / "tests/media/room"
CHOSEN = range(10, 17)
needs_pycolmap = pytest.mark.skipif(
    not __import__("importlib.util").util.find_spec("pycolmap"), reason="pycolmap is not installed: maquette[scenes]"
)


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    """Seven neighbouring photos of the bundled room, at half their size."""
    folder = tmp_path_factory.mktemp("room")
    for k in CHOSEN:
        frame = maquette.Frame.open(ROOM / f"images/{k:03d}.jpg").resized(*SIZE)
        frame.save(folder / f"IMG_{k}.jpg")
    return folder


@pytest.fixture
def sparse_cloud(monkeypatch):
    """The sparse points in place of dense ones: depth has tests of its own."""
    monkeypatch.setattr(make, "dense_cloud", lambda _, sparse, *__: (sparse, np.full(sparse.shape, 128, np.uint8)))


def similarity(found: np.ndarray, true: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The rotation of the similarity that takes points [N, 3] to others, and the distances left (Umeyama 1991)."""
    a, b = found - found.mean(0), true - true.mean(0)
    left, sizes, right = np.linalg.svd(b.T @ a)
    sign = np.diag([1, 1, np.sign(np.linalg.det(left @ right))])
    turn, scale = left @ sign @ right, (sizes * np.diag(sign)).sum() / (a**2).sum()
    return turn, np.linalg.norm(scale * a @ turn.T - b, axis=1)


@needs_pycolmap
def test_photos_of_a_room_become_a_scene_with_its_cameras(room, sparse_cloud, tmp_path):
    told = []
    report = maquette.make_scene(room, tmp_path / "out/room.maqs", lambda *step: told.append(step), threads=1)
    assert (report.found, report.used, report.posed) == (7, 7, 7)
    assert report.left_out == []
    assert report.reprojection_error_px < 1
    assert maquette.Scene.open(report.scene).point_count == report.scene_points > 200
    truth = {view.name.split("/")[-1]: view.camera for view in maquette.Capture(ROOM).views}
    capture = maquette.Capture(report.capture)
    origins = [
        frame["origin"] for frame in json.loads((Path(report.capture) / "transforms.json").read_text())["frames"]
    ]
    assert origins == [f"IMG_{k}.jpg" for k in CHOSEN]
    true = [truth[f"{k:03d}.jpg"] for k in CHOSEN]
    centres = np.stack([camera.centre for camera in true])
    turn, away = similarity(np.stack([view.camera.centre for view in capture.views]), centres)
    assert away.max() < 0.02 * np.linalg.norm(np.ptp(centres, axis=0))
    assert (turn @ [0, 0, 1])[2] > np.cos(np.radians(3))  # up is up
    for view, camera in zip(capture.views, true, strict=True):
        angle = np.arccos(np.clip((np.trace(view.camera.rotation @ turn.T @ camera.rotation.T) - 1) / 2, -1, 1))
        assert np.degrees(angle) < 2
    assert [view.held_out for view in capture.views].count(True) == len(report.compared) == 1
    # The report says it all, as text and as JSON.
    written = json.loads((tmp_path / "out/room-report.json").read_text())
    assert written["psnr_db"] == pytest.approx(report.psnr_db)
    assert written["seconds"].keys() == {"photos", "cameras", "depth", "scene", "preview"}
    text = (tmp_path / "out/room-report.txt").read_text()
    assert "7 with a camera" in text
    assert "do not tell metres" in text
    sheet = maquette.Frame.open(report.preview).shape
    assert sheet == (SIZE[1], 2 * SIZE[0] + 6)
    steps = [done for done, _ in told]
    assert steps == sorted(steps)
    assert steps[-1] == pytest.approx(1)
    assert sorted(path.name for path in Path(tmp_path / "out/room-work").iterdir()) == [
        ".lock",
        "capture",
        "stages.json",
    ]


@needs_pycolmap
def test_after_an_interruption_at_any_stage_the_same_call_goes_on(room, sparse_cloud, tmp_path, monkeypatch):
    ran = []
    for name in ("_photos", "_cameras", "_depth", "_scene", "_preview"):
        stage = getattr(make._Job, name)

        def recorded(self, *given, stage=stage, name=name):
            ran.append(name)
            return stage(self, *given)

        monkeypatch.setattr(make._Job, name, recorded)
    seen = []

    def interrupt_at_a_new_stage(done, what):
        if what not in seen and what != "done":
            seen.append(what)
            raise KeyboardInterrupt

    out = tmp_path / "room.maqs"
    for _ in range(12):
        try:
            report = maquette.make_scene(room, out, interrupt_at_a_new_stage, threads=1)
            break
        except KeyboardInterrupt:
            assert not out.exists() or seen[-1] == "rendering the preview"
    assert report.posed == 7
    assert {"reading photos", "finding features", "matching photos", "finding cameras", "building the scene"} <= set(
        seen
    )
    assert ran.count("_photos") == 2  # once until it was interrupted, and once to its end
    assert ran.count("_cameras") == 4
    assert ran.count("_scene") == 2
    # A result that was deleted is made again, from what is kept.
    ran.clear()
    Path(report.preview).unlink()
    assert maquette.make_scene(room, out, threads=1).psnr_db == pytest.approx(report.psnr_db)
    assert ran == ["_preview"]
    # Splats of the same photos need a scene and a preview of their own, and nothing else.
    ran.clear()
    monkeypatch.setattr(make, "SPLAT_FIT_S", 2)
    splats = maquette.make_scene(room, out.with_suffix(".spz"), threads=1)
    assert ran == ["_scene", "_preview"]
    assert maquette.Scene.open(splats.scene).point_count == splats.scene_points > 1_000
    assert splats.psnr_db > 12


@needs_pycolmap
def test_progress_can_cancel(room, tmp_path):
    with pytest.raises(maquette.MaquetteError, match="cancelled") as caught:
        maquette.make_scene(room, tmp_path / "room.maqs", lambda *_: False)
    assert caught.value.status == "MAQ_CANCELLED"


@needs_pycolmap
def test_a_photo_of_another_place_is_left_out_by_name(room, sparse_cloud, tmp_path):
    folder = tmp_path / "photos"
    shutil.copytree(room, folder)
    maquette.Frame(window(texture(3), 50)).save(folder / "IMG_99.jpg")
    report = maquette.make_scene(folder, tmp_path / "room.maqs", threads=1)
    assert [(entry.name, entry.reason.split(":")[0]) for entry in report.left_out] == [
        ("IMG_99.jpg", "shows nothing that another photo shows")
    ]
    assert "IMG_99.jpg" in report.text()


@needs_pycolmap
def test_upright_and_level_photos_of_one_camera_get_the_same_focal_length(room, sparse_cloud, tmp_path):
    folder = tmp_path / "photos"
    folder.mkdir()
    for k, file in enumerate(sorted(room.iterdir())):
        image = np.asarray(maquette.Frame.open(file))
        maquette.Frame(np.ascontiguousarray(image[:, 60:260] if k % 2 else image)).save(folder / file.name)
    report = maquette.make_scene(folder, tmp_path / "room.maqs", threads=1)
    assert report.posed == 7
    shapes = [view.camera.intrinsics for view in maquette.Capture(report.capture).views]
    assert [shape.width_px for shape in shapes] == [320, 200] * 3 + [320]
    assert np.ptp([shape.fx_px for shape in shapes]) < 0.03 * shapes[0].fx_px


@needs_pycolmap
def test_photos_that_share_nothing_end_with_advice(tmp_path):
    folder = tmp_path / "photos"
    folder.mkdir()
    for k in range(4):
        maquette.Frame(window(texture(k), 50)).save(folder / f"{k}.png")
    with pytest.raises(maquette.MaquetteError, match=r"overlap by two thirds"):
        maquette.make_scene(folder, tmp_path / "a.maqs", threads=1)
    assert not (tmp_path / "a.maqs").exists()


@pytest.mark.parametrize("count", [1, 2])
def test_one_or_two_photos_are_too_few(count, tmp_path, monkeypatch):
    monkeypatch.setattr(make, "require_pycolmap", lambda: None)
    folder = tmp_path / "photos"
    folder.mkdir()
    for k in range(count):
        maquette.Frame(window(texture(k), 50)).save(folder / f"{k}.png")
    with pytest.raises(maquette.MaquetteError, match=rf"gives {count} photo.* at least 3"):
        maquette.make_scene(folder, tmp_path / "a.maqs")


def test_photos_that_are_all_the_same_are_one_photo(tmp_path, monkeypatch):
    monkeypatch.setattr(make, "require_pycolmap", lambda: None)
    folder = tmp_path / "photos"
    folder.mkdir()
    for k in range(5):
        maquette.Frame(window(texture(1), 50)).save(folder / f"{k}.png")
    with pytest.raises(maquette.MaquetteError, match="gives 1 photo"):
        maquette.make_scene(folder, tmp_path / "a.maqs")


def test_what_is_no_film_and_no_folder_of_photos_is_refused(tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    (tmp_path / "phone").mkdir()
    (tmp_path / "phone/a.heic").write_bytes(b"heic")
    (tmp_path / "notes.txt").write_text("no film")
    for name, word in (("empty", "has no photos"), ("phone", "HEIC is not read: export it as JPEG"),
                       ("notes.txt", "neither a film"), ("nowhere.mp4", "does not exist")):  # fmt: skip
        assert run([str(tmp_path / name), "--out", str(tmp_path / "a.maqs")]) == 1
        assert word in capsys.readouterr().err
    with pytest.raises(ValueError, match="at least 3"):
        maquette.make_scene(tmp_path / "phone", tmp_path / "a.maqs", max_photos=2)


def test_without_pycolmap_the_error_says_what_to_install(tmp_path, monkeypatch):
    folder = tmp_path / "photos"
    folder.mkdir()
    maquette.Frame(window(texture(1), 50)).save(folder / "a.png")
    monkeypatch.setitem(sys.modules, "pycolmap", None)
    with pytest.raises(maquette.MaquetteError, match=r"pip install 'maquette\[scenes\]'"):
        maquette.make_scene(folder, tmp_path / "a.maqs")


def test_a_full_disk_is_said_before_and_during_the_work(tmp_path, monkeypatch):
    monkeypatch.setattr(make, "require_pycolmap", lambda: None)
    film = write_film(tmp_path / "film.avi", [window(texture(), 8 * k) for k in range(4)])
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(make.shutil, "disk_usage", lambda _: usage._replace(free=10))
    with pytest.raises(maquette.MaquetteError, match=r"disk of .* is full"):
        maquette.make_scene(film, tmp_path / "a.maqs")
    monkeypatch.undo()
    monkeypatch.setattr(make, "require_pycolmap", lambda: None)

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(WorkFolder, "finish", full)
    with pytest.raises(maquette.MaquetteError, match=r"disk of .* is full"):
        maquette.make_scene(film, tmp_path / "a.maqs")


def test_an_error_of_colmap_is_a_sentence_and_on_a_full_disk_says_so(room, tmp_path, monkeypatch):
    def fails(*_):
        raise RuntimeError("database disk image is malformed")

    monkeypatch.setattr(make, "require_pycolmap", lambda: None)
    monkeypatch.setattr(make, "pose", fails)
    with pytest.raises(maquette.MaquetteError, match="COLMAP ended with an error: database disk image"):
        maquette.make_scene(room, tmp_path / "a.maqs")
    usage = shutil.disk_usage(tmp_path)
    free = iter((10**9, 0))
    monkeypatch.setattr(make.shutil, "disk_usage", lambda _: usage._replace(free=next(free)))
    with pytest.raises(maquette.MaquetteError, match=r"disk of .* is full"):
        maquette.make_scene(room, tmp_path / "a.maqs")


def test_ctrl_c_ends_the_command_and_says_how_to_go_on(tmp_path):
    if not __import__("importlib.util").util.find_spec("pycolmap"):
        pytest.skip("pycolmap is not installed: maquette[scenes]")
    wall = texture()
    film = write_film(tmp_path / "film.avi", [window(wall, 4 * k) for k in range(120)])
    command = [sys.executable, "-m", "maquette", "scene", "make", film, "--out", tmp_path / "a.maqs"]
    # Shells start programs in the background with Ctrl-C ignored, and children inherit it.
    listening = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)}
    environment = {"PYTHONPATH": str(ROOT / "python")}
    child = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment, **listening)
    assert "choosing frames" in child.stderr.readline()
    time.sleep(0.3)
    child.send_signal(signal.SIGINT)
    said = child.communicate(timeout=60)[1]
    assert child.returncode == 130
    assert "The same command goes on where it was" in said
    assert "Traceback" not in said


def test_reasons_are_told_apart():
    """Without a mapper: what the database says about photos that have no camera."""

    class Database:
        keypoints: ClassVar = [900, 900, 900, 20, 900, 900, 900, 900]
        inliers: ClassVar = {(0, 1): 300, (1, 2): 300, (2, 5): 40, (6, 7): 200}
        groups = cameras.Matches.groups
        best_partner = cameras.Matches.best_partner

    class Posed:
        has_pose = True

        def __init__(self, name):
            self.name = name

    class Model:
        images: ClassVar = {k: Posed(f"{k}.jpg") for k in range(3)}

    photos = [cameras.Photo(f"{k}.jpg", f"photo {k}", 10, 10, "") for k in range(8)]
    reasons = {entry.name: entry.reason for entry in cameras._reasons(photos, Database(), Model())}
    assert reasons.keys() == {f"photo {k}" for k in range(3, 8)}
    for k, word in (
        (3, "too little to recognise"),
        (4, "nothing that another"),
        (5, "only 40 points"),
        (6, "another place"),
    ):
        assert word in reasons[f"photo {k}"]


def test_a_camera_that_only_turns_is_told_from_one_that_passes_a_wall():
    """Homographies of a rotation, and of a plane seen by a camera that moves; the focal length is not known."""
    camera = np.array([[700, 0, 480], [0, 700, 270], [0, 0, 1.0]])
    photos = [cameras.Photo("a.jpg", "a", 960, 540, "")]

    def homography(angle: float, shift: float) -> np.ndarray:
        turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
        return 1.7 * camera @ (turn + np.outer([shift, 0, 0.1 * shift], [0, 0, 1])) @ np.linalg.inv(camera)

    class Pairs:
        def __init__(self, shift: float, others: int = 0) -> None:
            self.homographies = [(0, homography(0.05 * k, shift * k)) for k in range(1, 6)]
            self.inliers = dict.fromkeys(range(len(self.homographies) + others), 100)

    assert cameras.turns_on_the_spot(Pairs(0), photos)
    assert not cameras.turns_on_the_spot(Pairs(0.05), photos)
    assert not cameras.turns_on_the_spot(Pairs(0, others=5), photos)
