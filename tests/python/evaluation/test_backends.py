"""The same bundle through ONNX Runtime in Python and through libmaquette gives the same people."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import maquette
import numpy as np
import pytest
from maquette.native import Native

from export.bundle import read_manifest
from export.evaluation.backends import CApiBackend, OnnxBackend

BUNDLE = Path("tests/native/data/tiny_bundle")

needs_library = pytest.mark.skipif(
    not maquette.library_path().exists(), reason=f"{maquette.library_path()} is not built: run `make build`"
)


def picture(width=320, height=256):
    """Black, with the coloured cells that tests/native/generate/make_tiny_bundle.py takes for people."""
    image = np.zeros((height, width, 3), np.uint8)
    image[64:68, 80:84, 0] = 255  # 32 px
    image[128:136, 200:208, 1] = 255  # 64 px
    image[176:192, 64:80, 2] = 255  # 128 px
    return image


@needs_library
def test_the_c_api_finds_the_people_of_the_tiny_bundle():
    image = picture()
    model = CApiBackend(BUNDLE, 0.05)
    found, none = model.predict(image), model.predict(np.zeros_like(image))
    assert found.box.shape == (3, 4)
    sides = sorted(np.round(found.box[:, 2] - found.box[:, 0]).tolist())
    assert sides == [32, 64, 128]
    assert set(np.unique(found.iuv[..., 0])) == {0, 3, 7}
    assert set(np.unique(found.inds)) == {0, 1, 2, 3}
    assert none.box.shape == (0, 4)
    assert not none.iuv.any()


@needs_library
def test_a_model_card_beside_the_manifest_does_no_harm(tmp_path):
    bundle = shutil.copytree(BUNDLE, tmp_path / "bundle")
    (bundle / "MODEL_CARD.md").write_text("# Model card\n")
    assert len(maquette.DensePose(bundle).run(picture()).people) == 3


@needs_library
def test_rows_with_padding_and_views_are_read_right():
    image, model = picture(), maquette.DensePose(BUNDLE)
    whole, view = model.run(image), model.run(np.flip(np.flip(image, 1).copy(), 1))
    assert np.array_equal(whole.part, view.part)
    assert np.array_equal(whole.person, view.person)


@needs_library
def test_a_missing_library_is_explained():
    with pytest.raises(maquette.MaquetteError, match="make build"):
        Native(Path("nothing.so"))


@pytest.fixture
def bundle_without_ties(tmp_path):
    """The tiny bundle with as many proposals as it has people: all others score the same, in no set order."""
    copy = tmp_path / "bundle"
    shutil.copytree(BUNDLE, copy)
    manifest = read_manifest(copy)
    manifest["rpn"]["post_nms_top_k"] = 3
    (copy / "manifest.json").write_text(json.dumps(manifest))
    return copy


def from_left_to_right(found):
    """The same people in another order: scores of the tiny bundle differ by rounding alone."""
    order = np.argsort(found.box[:, 0])
    number = np.concatenate([[0], 1 + np.argsort(order)]).astype(np.uint8)
    keypoint = found.keypoint[order]
    return replace(found, box=found.box[order], score=found.score[order], inds=number[found.inds], keypoint=keypoint)


@needs_library
@pytest.mark.parametrize("size", [(320, 256), (256, 320), (331, 207), (640, 512)])
def test_both_ways_give_the_same_people_and_the_same_image(size, bundle_without_ties, monkeypatch):
    pytest.importorskip("torch", reason="the reference of decoding needs torch: scripts/make-venv.sh train,dev")
    from export.densepose import decode

    given = read_manifest(BUNDLE)["input"]
    monkeypatch.setattr(decode, "MEAN", np.array(given["mean"], np.float32))
    monkeypatch.setattr(decode, "STD", np.array(given["std"], np.float32))
    image = picture(*size)
    long_side_px = given["long_side_px"]  # the reference has one size
    api = CApiBackend(bundle_without_ties, 0.05, long_side_px=long_side_px, has_keypoints=1).predict(image)
    onnx = OnnxBackend(bundle_without_ties, 0.05).predict(image)
    assert len(api.box) == len(onnx.box) == 3
    api, onnx = from_left_to_right(api), from_left_to_right(onnx)
    assert np.allclose(api.box, onnx.box, atol=0.01)
    # The library does not round to bytes between resizing and normalising.
    assert np.allclose(api.score, onnx.score, atol=1e-4 if size == (320, 256) else 1e-3)
    assert np.allclose(api.keypoint, onnx.keypoint, atol=0.02)
    assert (api.inds == onnx.inds).mean() > 0.999
    assert (api.iuv[..., 0] == onnx.iuv[..., 0]).mean() > 0.999
    assert np.abs(api.iuv.astype(int) - onnx.iuv).max(-1)[api.iuv[..., 0] == onnx.iuv[..., 0]].max() <= 1


def test_people_above_a_threshold_are_a_prefix_of_all():
    from export.evaluation.backends import Prediction

    inds = np.array([[0, 1, 2]], np.uint8)
    iuv = np.full((1, 3, 3), 9, np.uint8)
    shown = Prediction(np.zeros((2, 4)), np.array([0.9, 0.4]), iuv, inds).above(0.5)
    assert shown.inds.tolist() == [[0, 1, 0]]
    assert shown.iuv[0, :, 0].tolist() == [9, 9, 0]
    assert len(shown.box) == 1
