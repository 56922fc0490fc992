"""The benchmark of scenes, with a stand-in for the command line: what it measures, says, and says to be missing."""

import json

import cv2
import numpy as np
import pytest
import torch
from box_scene import BoxScene, ring, write_ply
from fake_maquette import install

from benchmarks import __main__ as benchmark
from benchmarks import frame_time, gates
from benchmarks.scenes import command as scene_command
from benchmarks.scenes import measure as scenes
from benchmarks.scenes import pictures as scene_pictures
from benchmarks.scenes import quality as scene_quality
from benchmarks.scenes import speed as scene_speed
from benchmarks.scenes.settings import FLOAT, SHIPPED, Sources, settings, sources
from export.densepose.network import MobileNetV2
from export.places.place import load_place
from export.scenes.perceptual import Perceptual
from export.scenes.picture_quality import psnr_db

VIEWS, WIDTH, HEIGHT = 6, 64, 48


def write_place(folder, seed=0):
    """A rendered place as docs/formats.md has it: photos, depth in millimetres, cloud; two photos held out."""
    box, cameras, frames = BoxScene(seed), ring(VIEWS, WIDTH, HEIGHT, seed), []
    for name in ("images", "depth"):
        (folder / name).mkdir(parents=True)
    for k, camera in enumerate(cameras):
        image, depth = box.photo(camera)
        names = {"file_path": f"images/{k:03d}.png", "depth_file_path": f"depth/{k:03d}.png"}
        cv2.imwrite(str(folder / names["file_path"]), np.rint(image[..., ::-1] * 255).astype(np.uint8))
        cv2.imwrite(str(folder / names["depth_file_path"]), np.rint(depth * 1000).astype(np.uint16))
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = camera.rotation.T * (1, -1, -1), camera.centre
        sizes = {"w": WIDTH, "h": HEIGHT, "fl_x": camera.fx_px, "fl_y": camera.fy_px}
        centre = {"cx": camera.cx_px + 0.5, "cy": camera.cy_px + 0.5}
        frames.append(names | sizes | centre | {"transform_matrix": matrix.tolist()})
    paths = [frame["file_path"] for frame in frames]
    held_out = [paths[1], paths[4]]
    table = {"frames": frames, "ply_file_path": "cloud.ply", "test_filenames": held_out,
             "train_filenames": [path for path in paths if path not in held_out],
             "maquette": {"format": "maquette-place-1", "kind": "room", "up_axis": [0, 1, 0],
                          "depth_unit_m": 0.001}}  # fmt: skip
    (folder / "transforms.json").write_text(json.dumps(table))
    write_ply(folder / "cloud.ply", *box.cloud(cameras, every=3))


@pytest.fixture(scope="module")
def places(tmp_path_factory):
    folder = tmp_path_factory.mktemp("places")
    for k in range(2):
        write_place(folder / f"place-{k}", seed=k)
    write_place(folder.parent / "real-room", seed=5)
    return folder


@pytest.fixture
def given(places, tmp_path, monkeypatch):
    monkeypatch.setattr(frame_time, "PROGRAM", install(tmp_path))
    small, whole, large = ((WIDTH * k // 2, HEIGHT * k // 2) for k in (1, 2, 4))
    for module in (scene_speed, scene_pictures):
        monkeypatch.setattr(module, "GATE_SIZE", whole)
    constants = {"CLOUDS": (500, 1000, 2000), "QUICK_CLOUDS": (500, 1000), "GATE_POINTS": 1000, "SMALL_POINTS": 500,
                 "SMALL_SIZE": small, "SIZES": (small, whole, large), "VIEWS": 3}  # fmt: skip
    for name, value in constants.items():
        monkeypatch.setattr(scene_speed, name, value)
    bundles = [tmp_path / name for name in ("int8", "fp32", "wide")]
    for bundle in bundles:
        bundle.mkdir()
        (bundle / "manifest.json").write_text(json.dumps({"name": f"scenes-{bundle.name}"}))
    return sources(places, [places.parent / "real-room"], *bundles[:2], bundles[2:], None)


def only(*names):
    return [setting for setting in settings(["scenes-wide"]) if setting.name in names]


def by_setting(rows):
    return {row["setting"]: row for row in rows}


def test_pictures_are_compared_with_the_photos_of_their_names(given):
    wanted = only("as shipped", "means alone", "half the size", "scenes-wide")
    rows, places, shown = scene_quality.measure(given, wanted, None, quick=True)
    found = by_setting(rows)
    assert [(place["name"], place["real"]) for place in places] == [("place-0", False), ("place-1", False),
                                                                     ("real-room", True)]  # fmt: skip
    figures = found["as shipped"]["rendered"]
    noise = 0.02 + 0.002 + 20 / figures["points"]
    # The stand-in's noise, of which a little is cut at black and white.
    assert figures["psnr_db"] == pytest.approx(-20 * np.log10(noise), abs=0.3)
    assert found["means alone"]["rendered"]["psnr_db"] < figures["psnr_db"] - 2
    assert found["means alone"]["rendered"]["view_dependent_points"] == 0
    assert found["half the size"]["rendered"]["frame_ms"] < figures["frame_ms"]
    assert found["scenes-wide"]["rendered"] is not None
    assert figures["first_image_s"] > figures["build_s"] > 0
    assert figures["bytes_a_point"] == pytest.approx(6 + 8 + 24)
    assert len(shown) == 3
    assert set(shown[0]["pictures"]) == set(scene_quality.SHOWN)
    shipped = found["as shipped"]["places"]["place-0"]
    assert psnr_db(shown[0]["pictures"]["as shipped"], shown[0]["photo"]) == pytest.approx(shipped["shown_psnr_db"])


def test_baselines_need_no_program(given, monkeypatch, tmp_path):
    monkeypatch.setattr(frame_time, "PROGRAM", install(tmp_path))
    rows, _, _ = scene_quality.measure(given, [], None, quick=True)
    found = by_setting(rows)
    assert set(found) == set(scene_quality.BASELINES)
    psnr = {name: row["rendered"]["psnr_db"] for name, row in found.items()}
    assert psnr["pyramid of points"] > psnr["plain points"]
    assert all(0 < row["rendered"]["first_image_s"] < 30 for row in rows)


def test_an_option_that_the_program_does_not_know_is_missing_and_nothing_else(given, monkeypatch, tmp_path):
    monkeypatch.setattr(frame_time, "PROGRAM", install(tmp_path, refused=("--without", "--threads")))
    wanted = only("as shipped", "no block is culled")
    rows, _, _ = scene_quality.measure(given, wanted, None, quick=True)
    found = by_setting(rows)
    assert found["no block is culled"]["rendered"] is None
    assert "--without culling" in found["no block is culled"]["missing"]["place-0"]
    assert found["as shipped"]["rendered"] is not None
    speed, why = scene_speed.measure(given.places, given.bundles[SHIPPED], 2, quick=False)
    assert why == ""
    assert "--threads 1" in speed["missing"]["64 x 48, threads: 1"]
    assert {row["threads"] for row in speed["frames"]} == {2}


def test_without_networks_or_fine_tuned_scenes_the_reason_is_said(given, tmp_path):
    bundles = given.bundles | {FLOAT: tmp_path / "nowhere"}
    wanted = only("as shipped", "fp32 networks", "fine-tuned 1 min")
    broken = Sources(given.places, [], bundles, tmp_path / "tuned")
    rows, _, _ = scene_quality.measure(broken, wanted, None, quick=True)
    found = by_setting(rows)
    assert found["fp32 networks"]["missing"]["place-0"] == f"no networks in {tmp_path / 'nowhere'}"
    assert f"no fine-tuned scene {tmp_path}/tuned/place-0/60s.maqs" in found["fine-tuned 1 min"]["missing"]["place-0"]
    assert found["as shipped"]["rendered"] is not None
    assert found["as shipped"]["real"] is None


def test_a_fine_tuned_scene_counts_the_time_it_took(given, tmp_path):
    for folder in given.places:
        target = tmp_path / "tuned" / folder.name / "10s.maqs"
        target.parent.mkdir(parents=True)
        scene_command.build(folder, target, given.bundles[SHIPPED])
    tuned = Sources(given.places, [], given.bundles, tmp_path / "tuned")
    wanted = only("as shipped", "fine-tuned 10 s", "fine-tuned 1 min")
    rows, _, _ = scene_quality.measure(tuned, wanted, None, quick=True)
    found = by_setting(rows)
    made = found["fine-tuned 10 s"]["rendered"]
    assert made["build_s"] == pytest.approx(found["as shipped"]["rendered"]["build_s"] + 10)
    assert found["fine-tuned 1 min"]["rendered"] is None


@pytest.mark.parametrize(
    ("text", "says"),
    [("{}", "KeyError"), ("[]", "no table"), ("{", "no JSON"), ('{"views": []}', "IndexError"),
     ('{"views": [{"name": "a", "ms": {"total": NaN}}]}', "no number")],
)  # fmt: skip
def test_json_that_is_not_as_agreed_is_told(given, tmp_path, text, says):
    program = tmp_path / "maquette"
    program.write_text(f"#!/bin/sh\nfor last; do :; done\necho '{text}' > $last\n")
    with pytest.raises(scene_command.SceneCommandError, match=says):
        scene_command.render(tmp_path / "a.maqs", tmp_path, tmp_path, tmp_path / "out")


def test_a_program_that_fails_is_quoted(given, tmp_path):
    (tmp_path / "maquette").write_text("#!/bin/sh\necho 'The cloud is empty.' >&2\nexit 3\n")
    with pytest.raises(scene_command.SceneCommandError, match=r"status 3: The cloud is empty\."):
        scene_command.build(tmp_path, tmp_path / "a.maqs", tmp_path)


def test_a_dense_cloud_lies_on_what_photos_show(places):
    place = load_place(places / "place-0")
    xyz, rgb = scene_speed.dense_cloud(place, 2000)
    assert (xyz.shape, rgb.shape, rgb.dtype) == ((2000, 3), (2000, 3), np.uint8)
    assert len(np.unique(xyz.round(4), axis=0)) > 1990
    # Points of the room's walls and boxes: inside, and as dark as some photo is there.
    assert (np.abs(xyz[:, [0, 2]]) < 3.01).all()
    camera = place.camera(int(place.source[0]))
    pixel, depth = camera.projected(xyz)
    inside = (depth > 0) & (pixel >= 0).all(1) & (pixel <= [WIDTH - 1, HEIGHT - 1]).all(1)
    column, row = np.rint(pixel[inside]).astype(int).T
    near = np.abs(place.depth[int(place.source[0])][row, column] - depth[inside]) < 0.05
    assert near.mean() > 0.7
    same = np.abs(place.images[int(place.source[0])][row, column].astype(int) - rgb[inside]).max(1) < 10
    assert same[near].mean() > 0.7
    with pytest.raises(ValueError, match="too few pixels"):
        scene_speed.dense_cloud(place, 10**6)


def test_gates_take_the_smallest_scene_that_has_enough_points(given):
    speed, _ = scene_speed.measure(given.places, given.bundles[SHIPPED], 2, quick=False)
    assert [row["cloud"] for row in speed["built"]] == [500, 1000, 2000]
    speed["built"].append(speed["built"][-1] | {"cloud": 1_000_000, "peak_memory_mb": 432.0})
    figures, missing = scene_speed.figures_of(speed)
    (at_gate,) = (row for row in speed["frames"] if row["points"] == 1000 and row["size_px"] == [WIDTH, HEIGHT]
                  and row["threads"] == 2)  # fmt: skip
    assert figures["scene_fps_500k"] == pytest.approx(1000 / at_gate["ms"]["total"])
    assert figures["scene_peak_memory_mb"] == 432
    assert missing == {}
    kept_less = speed | {"frames": [row | {"points": 999} for row in speed["frames"]]}
    assert "no scene kept 1,000 points" in scene_speed.figures_of(kept_less)[1]["scene_fps_500k"]


def test_memory_a_point_is_the_slope():
    rows = [{"cloud": 100_000, "peak_memory_mb": 150.0}, {"cloud": 1_100_000, "peak_memory_mb": 450.0}]
    assert scene_speed.memory_a_point({"built": rows}) == pytest.approx(300)
    assert scene_speed.memory_a_point({"built": rows[:1]}) is None


def test_a_mean_over_other_places_is_none():
    row = {"places": {"a": {"psnr_db": 10.0, "stages_ms": {}}, "b": {"psnr_db": 20.0, "stages_ms": {}}}}
    assert scene_quality.mean_figures(row, ["a", "b"]) == {"psnr_db": 15.0}
    assert scene_quality.mean_figures(row, ["a", "b", "c"]) is None
    assert scene_quality.mean_figures(row, []) is None


def test_the_distance_is_nothing_for_the_photo_itself(given):
    torch.manual_seed(0)
    perceptual, place = Perceptual(MobileNetV2()), scene_quality.Place(given.places[0], None, quick=True)
    photos = place.photos[1]
    same = scene_quality.errors_of(photos.images, photos, perceptual)
    worse = scene_quality.errors_of([image[:, ::-1].copy() for image in photos.images], photos, perceptual)
    assert same["distance"] == 0
    assert worse["distance"] > 0.05
    with pytest.raises(scene_command.SceneCommandError, match="pixels, not 64x48"):
        scene_quality.errors_of([image[:-1] for image in photos.images], photos, None)


def arguments(given, out):
    found = ["--places", str(given.places[0].parent), "--out", str(out), "--real", str(given.real[0])]
    found += ["--networks", str(given.bundles[SHIPPED]), "--fp32", str(given.bundles[FLOAT])]
    return [*found, "--other-networks", *(str(path) for name, path in given.bundles.items() if name == "scenes-wide")]


def test_the_report_of_scenes_alone(given, tmp_path, capsys):
    # The stand-in's scenes are larger and slower than none of the gates allows.
    status = benchmark.main(["--only", "scenes", *arguments(given, tmp_path / "out")])
    out = tmp_path / "out"
    document = json.loads((out / "benchmark.json").read_text())
    states = {gate["figure"]: gate["state"] for gate in document["gates"]}
    assert set(states) == set(scenes.FIGURES)
    assert states["scene_gain_db"] == "stretch"
    assert states["scene_bytes_a_point"] == "met"
    assert states["scene_peak_memory_mb"] == "not measured"
    assert status == (1 if "missed" in states.values() else 0)
    rows = by_setting(document["scenes"]["rows"])
    gain = rows["as shipped"]["rendered"]["psnr_db"] - rows["plain points"]["rendered"]["psnr_db"]
    assert document["figures"]["scene_gain_db"] == pytest.approx(gain, abs=1e-3)
    exact = rows["fp32 networks and descriptors, all varying"]["rendered"]["psnr_db"]
    loss = exact - rows["as shipped"]["rendered"]["psnr_db"]
    assert document["figures"]["scene_int8_loss_db"] == pytest.approx(loss, abs=1e-3)
    pyramid = rows["as shipped"]["rendered"]["psnr_db"] - rows["pyramid of points"]["rendered"]["psnr_db"]
    text, page = (out / "report.md").read_text(), (out / "index.html").read_text()
    for said in ("2 rendered places, 8 are wanted", "1 real places, 2 are wanted", "not LPIPS", "On the real scenes",
                 "never stored: 1% of the clouds'", "fine-tuned 10 s, fine-tuned 1 min, fine-tuned 10 min (no folder",
                 "Each point of the cloud adds", f"the networks gain {pyramid:+.2f} dB",
                 "| tiles without points are not refined | 0 | -0.25 | 0 |"):  # fmt: skip
        assert said in text
    assert "tiles without points are not refined" in page
    assert page.count("data:image/png;base64,") == 2
    assert page.count("data:image/jpeg;base64,") == 1
    for name in ("scenes-quality.png", "scenes-frame-time.png", "scenes-sheet.jpg"):
        assert (out / name).stat().st_size > 5000


def test_a_folder_that_is_no_capture_is_left_out_and_named(given, tmp_path):
    (tmp_path / "nothing").mkdir()
    broken = Sources(given.places[:1], [tmp_path / "nothing"], given.bundles)
    rows, places, _ = scene_quality.measure(broken, [], None, quick=True)
    assert rows[0]["rendered"] is not None
    warnings = scenes.warnings_of(places, has_distance=True)
    assert warnings[0].startswith("nothing was left out: ")
    assert warnings[1:] == ["1 rendered places, 8 are wanted", "0 real places, 2 are wanted"]


def test_bundles_of_one_name_cannot_be_told_apart(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "manifest.json").write_text('{"name": "same"}')
    with pytest.raises(ValueError, match="different names"):
        sources(tmp_path, [], tmp_path, tmp_path, [tmp_path / "a", tmp_path / "b"], None)


def test_every_gate_of_scenes_is_in_the_targets():
    found = gates.check(dict.fromkeys(scenes.FIGURES, 1.0), {"architecture": "x"}, {}, only=scenes.FIGURES)
    assert {verdict.figure for verdict in found} == set(scenes.FIGURES)
