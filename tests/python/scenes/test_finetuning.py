"""Scene files in numpy, and fine-tuning: on a made-up room, with random networks."""

import json
import subprocess
import sys

import numpy as np
import pytest
import torch
from box_scene import write_capture
from scipy.spatial import cKDTree
from small_scene import scene_of

from benchmarks.frame_time import PROGRAM
from export.bundle import BundleInfo
from export.scenes import finetune
from export.scenes.bundle import identity, write_manifest
from export.scenes.captures import Capture, read_capture
from export.scenes.config import SIZES
from export.scenes.export_onnx import export
from export.scenes.fitting import Options, fitted_to_views, render
from export.scenes.image_quality import psnr_db
from export.scenes.losses import LossWeights
from export.scenes.networks.feature_scale import scaled
from export.scenes.networks.system import Networks, load_networks, save_networks
from export.scenes.scene_file import HEAD, SceneFileError, read_scene_file, write_scene_file
from export.scenes.tuning import Rates, TunedScene, Tuning
from export.xxh3 import xxh3

pytestmark = pytest.mark.usefixtures("one_thread", "fixed_seed")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A room of 8 photos, 2 held out; weights.pt; a bundle with scaled features; a scene of 8-bit numbers."""
    folder = tmp_path_factory.mktemp("tuning")
    write_capture(folder / "room", 3)
    path = folder / "room" / "transforms.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"test_filenames": ["2.png", "5.png"]}))
    torch.manual_seed(1)
    save_networks(Networks(SIZES["tiny"]), folder / "weights.pt")
    networks = scaled(load_networks(folder / "weights.pt").eval(), torch.tensor([0.5, 2.0, 0.1, 1.0, 0.3]))
    export(networks, folder / "bundle")
    manifest = write_manifest(folder / "bundle", BundleInfo("b", "fp32"))
    capture = read_capture(folder / "room")
    views = [capture.view(k) for k in capture.sources()]
    with torch.no_grad():
        model = fitted_to_views(torch.from_numpy(capture.cloud.positions), views, networks, Options())
    for kind, name in enumerate(("float", "16-bit", "8-bit")):
        write_scene_file(scene_of(model, identity(manifest), kind, min(kind, 1)), folder / f"{name}.maqs")
    return folder


def arguments(place, *more):
    given = ("--scene", place / "8-bit.maqs", "--networks", place / "bundle", "--weights", place / "weights.pt")
    return ["finetune", *map(str, (place / "room", *given, *more))]


# Files


def test_the_check_is_that_of_xxh3():
    # Hash of no bytes, seed 0, from the tests of xxHash.
    assert xxh3(b"") == 0x2D06800538D394C2


@pytest.mark.parametrize("name", ["float", "16-bit", "8-bit"])
def test_a_scene_file_is_written_as_it_was_read(place, tmp_path, name):
    path = place / f"{name}.maqs"
    write_scene_file(read_scene_file(path), tmp_path / "again.maqs")
    assert (tmp_path / "again.maqs").read_bytes() == path.read_bytes()


@pytest.mark.parametrize(("name", "steps"), [("float", 0), ("16-bit", 32767), ("8-bit", 127)])
def test_looks_are_stored_to_half_a_step(place, name, steps):
    scene = read_scene_file(place / f"{name}.maqs")
    rng = np.random.default_rng(0)
    means = rng.uniform(-1, 2, scene.means.shape).astype(np.float32)
    slopes = rng.normal(0, 0.1, scene.slopes.shape).astype(np.float32)
    found = scene.with_descriptors(means, slopes).descriptors()
    if not steps:
        np.testing.assert_array_equal(found[0], means)
        np.testing.assert_array_equal(found[1], slopes)
        return
    assert 0 < np.abs(found[0] - means).max() <= 1.5 / steps * 0.501 + 3e-7
    assert 0 < np.abs(found[1] - slopes).max() <= np.abs(slopes).max() / steps * 0.501 + 3e-7


def test_every_varying_point_has_its_own_slopes(place):
    scene = read_scene_file(place / "8-bit.maqs")
    rows = scene.slope_rows()
    assert sorted(rows[rows >= 0]) == list(range(len(scene.slopes)))
    for block in scene.blocks:
        of_block = rows[block["first"] : block["first"] + block["count"]]
        assert (of_block[: block["varying"]] >= 0).all()
        assert (of_block[block["varying"] :] == -1).all()


def test_a_damaged_file_is_refused_whatever_byte_it_is(place, tmp_path):
    whole = (place / "8-bit.maqs").read_bytes()
    for at in [*range(0, HEAD.itemsize, 17), *range(HEAD.itemsize, len(whole), 7999)]:
        damaged = bytearray(whole)
        damaged[at] ^= 0x10
        (tmp_path / "bad.maqs").write_bytes(damaged)
        with pytest.raises(SceneFileError, match=r"bad\.maqs"):
            read_scene_file(tmp_path / "bad.maqs")
    for length in (0, 10, HEAD.itemsize, len(whole) // 2, len(whole) - 1):
        (tmp_path / "bad.maqs").write_bytes(whole[:length])
        with pytest.raises(SceneFileError, match=r"not a scene|cut off"):
            read_scene_file(tmp_path / "bad.maqs")


@pytest.mark.parametrize("field", ["points", "varying", "blocks", "coefficient_kind"])
def test_a_head_that_lies_is_refused_though_its_check_is_right(place, tmp_path, field):
    whole = bytearray((place / "8-bit.maqs").read_bytes())
    head = np.frombuffer(bytes(whole[: HEAD.itemsize]), HEAD)[0].copy()
    head[field] = head[field] + 3
    head["head_check"] = xxh3(head.tobytes()[HEAD.fields["file_bytes"][1] :])
    whole[: HEAD.itemsize] = head.tobytes()
    (tmp_path / "bad.maqs").write_bytes(whole)
    with pytest.raises(SceneFileError, match=r"bad\.maqs"):
        read_scene_file(tmp_path / "bad.maqs")


# Tuning


def test_a_scene_is_drawn_as_the_model_that_it_was_made_of(place):
    """Turned cameras too: the room's are held by hand."""
    capture, scene = read_capture(place / "room"), read_scene_file(place / "float.maqs")
    view = capture.view(capture.sources()[0])
    networks = finetune.networks_of_bundle(place / "weights.pt", place / "bundle", view, scene.up)
    tuned = TunedScene(scene, networks, torch.device("cpu"))
    views = [capture.view(k) for k in capture.sources()]
    model = fitted_to_views(torch.from_numpy(capture.cloud.positions), views, networks, Options())
    slopes = np.zeros((len(model.positions), 48), np.float32)
    rows = scene.slope_rows()
    # The scene has its points in another order, and a third of them without slopes: give the model the same.
    _, nearest = cKDTree(model.positions.numpy()).query(scene.positions())
    slopes[nearest[rows >= 0]] = scene.descriptors()[1][rows[rows >= 0]]
    with torch.no_grad():
        model.fit.slope.copy_(torch.from_numpy(slopes).view(-1, 6, 8))
    for k in (1, 2):
        camera = capture.view(k).camera
        assert psnr_db(tuned.rendered(camera), render(model, camera, networks, Options())) > 45


def test_the_loss_falls(place):
    capture, scene = read_capture(place / "room"), read_scene_file(place / "8-bit.maqs")
    views = [capture.view(k) for k in capture.sources()]
    networks = finetune.networks_of_bundle(place / "weights.pt", place / "bundle", views[0], scene.up)
    model = TunedScene(scene, networks, torch.device("cpu"))
    tuning = Tuning(model, views, Rates(3e-2, 1e-3), LossWeights())
    refiner = [p.clone() for p in model.networks.refiner.parameters()]
    before = finetune.measured(model, views)
    first = np.mean([tuning.step() for _ in range(len(views))])
    for _ in range(4 * len(views)):
        tuning.step()
    last = np.mean([tuning.step(0.1) for _ in range(len(views))])
    assert last < 0.8 * first
    assert finetune.measured(model, views) > before + 0.5
    assert all(torch.equal(a, b) for a, b in zip(refiner, model.networks.refiner.parameters(), strict=True))


def test_weights_of_other_networks_are_refused(place, tmp_path):
    torch.manual_seed(7)
    save_networks(Networks(SIZES["tiny"]), tmp_path / "others.pt")
    view = read_capture(place / "room").view(0)
    with pytest.raises(ValueError, match="exported from"):
        finetune.networks_of_bundle(tmp_path / "others.pt", place / "bundle", view, (0, 1, 0))
    mixed = load_networks(place / "weights.pt")
    mixed.extractor = Networks(SIZES["tiny"]).extractor
    save_networks(mixed, tmp_path / "mixed.pt")
    with pytest.raises(ValueError, match="do not belong together"):
        finetune.networks_of_bundle(tmp_path / "mixed.pt", place / "bundle", view, (0, 1, 0))


@pytest.mark.parametrize(
    ("saves", "spent", "share"), [([10], 0, 1), ([10], 5, 0.55), ([10], 11, 0.1), ([1, 9], 5, 0.55)]
)
def test_rates_fall_towards_every_save(saves, spent, share):
    assert finetune.rate_fraction(spent, saves) == pytest.approx(share)


def test_held_out_photos_are_never_decoded_while_tuning(place, tmp_path, monkeypatch, capsys):
    seen, view = [], Capture.view
    monkeypatch.setattr(Capture, "view", lambda self, k, *more: seen.append(k) or view(self, k, *more))
    more = ("--seconds", "0.5", "--out", tmp_path / "tuned.maqs", "--unmeasured")
    monkeypatch.setattr(sys, "argv", arguments(place, *more))
    finetune.main()
    assert set(seen) == {0, 1, 3, 4, 6, 7}
    assert "held-out" not in capsys.readouterr().out


def test_a_tuned_scene_differs_in_its_descriptors_alone(place, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", arguments(place, "--save-at", "0.5", "1", "--out", tmp_path / "room"))
    finetune.main()
    before = read_scene_file(place / "8-bit.maqs")
    for name in ("0.5s", "1s"):
        after = read_scene_file(tmp_path / "room" / f"{name}.maqs")
        np.testing.assert_array_equal(after.stored_positions, before.stored_positions)
        np.testing.assert_array_equal(after.slope_rows(), before.slope_rows())
        assert after.networks_sha256 == before.networks_sha256
        assert (after.means != before.means).any()
        assert (tmp_path / "room" / f"{name}.maqs").stat().st_size == (place / "8-bit.maqs").stat().st_size
    said = capsys.readouterr().out
    assert "before: " in said
    assert "after 1 s: " in said


def test_a_scene_of_other_networks_is_refused(place, tmp_path, monkeypatch):
    write_scene_file(read_scene_file(place / "8-bit.maqs").with_networks("ab" * 32), tmp_path / "other.maqs")
    given = arguments(place, "--out", tmp_path / "tuned.maqs")
    given[given.index("--scene") + 1] = str(tmp_path / "other.maqs")
    monkeypatch.setattr(sys, "argv", given)
    with pytest.raises(SystemExit, match="was built with other networks"):
        finetune.main()


@pytest.mark.skipif(not PROGRAM.exists(), reason="the program is not built: make build")
@pytest.mark.parametrize("name", ["float", "16-bit", "8-bit"])
def test_the_sdk_opens_a_tuned_scene(place, tmp_path, name):
    scene = read_scene_file(place / f"{name}.maqs")
    rng = np.random.default_rng(0)
    means, slopes = (x + rng.normal(0, 0.05, x.shape).astype(np.float32) for x in scene.descriptors())
    write_scene_file(scene.with_descriptors(means, slopes), tmp_path / "tuned.maqs")
    made = subprocess.run(
        [PROGRAM, "scene", "info", tmp_path / "tuned.maqs", "--json", tmp_path / "info.json"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert made.returncode == 0, made.stderr
    said = json.loads((tmp_path / "info.json").read_text())
    assert (said["points"], said["view_dependent_points"]) == (len(scene.means), len(scene.slopes))
