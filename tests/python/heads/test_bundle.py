"""Bundles for heads: what is written, and what is refused before it is."""

import hashlib
from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper
from small_prior import small_prior
from small_template import small_template

from export.bundle import BundleInfo, read_manifest
from export.heads import bundle
from export.heads.bundle import TEMPLATE_DATA, TRAINING_DATA, add_template, write_bundle, write_manifest
from export.heads.prior import PriorError
from export.heads.prior_file import read_prior
from export.heads.template_file import write_template

TINY = Path("tests/native/data/tiny_head/bundle")


def write_graph(path: Path, image: list, cells: list, names: tuple[str, str] = ("image", "cells")) -> Path:
    """A graph with these shapes, which need not run."""
    graph = helper.make_graph(
        [helper.make_node("Identity", [names[0]], [names[1]])],
        "encoder",
        [helper.make_tensor_value_info(names[0], TensorProto.FLOAT, image)],
        [helper.make_tensor_value_info(names[1], TensorProto.FLOAT, cells)],
    )
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)]), path)
    return path


def test_the_tiny_manifest_is_what_its_writer_writes(tmp_path):
    manifest = read_manifest(TINY)
    info = BundleInfo(manifest["name"], manifest["precision"])
    write_bundle(tmp_path, TINY / "encoder.onnx", small_prior(), info, face=None)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["encoder.onnx", "manifest.json", "prior.maqp"]
    for path in tmp_path.iterdir():
        assert path.read_bytes() == (TINY / path.name).read_bytes(), path.name


def test_a_manifest_says_what_the_encoder_sees_and_what_all_is_made_from(tmp_path):
    encoder = write_graph(tmp_path / "made.onnx", [1, 192, 192, 3], [1, 48, 48, 8])
    info = BundleInfo("heads", "fp32", training_data=TRAINING_DATA)
    manifest = write_bundle(tmp_path / "bundle", encoder, small_prior(), info, bases="float32", constant="float32")
    assert (manifest["task"], manifest["licence"]) == ("heads", "Apache-2.0")
    face = {"center_dm": [0.0, -1.24, -0.35], "radius_dm": 0.95, "crop_sides": 1.3}
    assert manifest["encoder"] == {"crop_px": 192, "cell_px": 4, "crop_sides": 1.6, "face": face}
    assert manifest["prior"] == {"file": "prior.maqp"}
    digest = hashlib.sha256((tmp_path / "bundle" / "prior.maqp").read_bytes()).hexdigest()
    assert manifest["files"]["prior.maqp"]["sha256"] == digest
    assert all(entry["licence"] for entry in manifest["training_data"])
    np.testing.assert_array_equal(
        read_prior(tmp_path / "bundle" / "prior.maqp").shape_bases[0].weights, small_prior().shape_bases[0].weights
    )


def test_a_template_is_added_to_a_bundle_and_named_with_its_licence(tmp_path):
    encoder = write_graph(tmp_path / "made.onnx", [1, 192, 192, 3], [1, 48, 48, 8])
    info = BundleInfo("heads", "fp32", training_data=TRAINING_DATA, measured={"found": 1})
    before = write_bundle(tmp_path / "bundle", encoder, small_prior(), info)
    assert "template" not in before
    write_template(small_template(), tmp_path / "a.maqt")
    after = add_template(tmp_path / "bundle", tmp_path / "a.maqt")
    assert after == read_manifest(tmp_path / "bundle")
    assert after["template"] == {"file": "template.maqt"}
    assert set(after["files"]) == {"encoder.onnx", "prior.maqp", "template.maqt"}
    assert after["training_data"] == [*before["training_data"], TEMPLATE_DATA]
    assert after["measured"] == {"found": 1}
    with pytest.raises(PriorError, match="is not a template head"):
        add_template(tmp_path / "bundle", tmp_path / "bundle" / "prior.maqp")
    assert read_manifest(tmp_path / "bundle") == after


@pytest.mark.parametrize(
    ("image", "cells", "names"),
    [
        ([1, 192, 192, 3], [1, 48, 48, 7], ("image", "cells")),
        ([1, 192, 192, 1], [1, 48, 48, 8], ("image", "cells")),
        ([1, 192, 160, 3], [1, 48, 48, 8], ("image", "cells")),
        ([1, 190, 190, 3], [1, 48, 48, 8], ("image", "cells")),
        ([1, 192, 192, 3], [48, 48, 8], ("image", "cells")),
        (["batch", 192, 192, 3], [1, 48, 48, 8], ("image", "cells")),
        ([1, 192, 192, 3], [1, 48, 48, 8], ("photo", "cells")),
    ],
)
def test_graphs_that_are_no_encoder_are_refused(tmp_path, image, cells, names):
    encoder = write_graph(tmp_path / "made.onnx", image, cells, names)
    with pytest.raises(ValueError, match="the format asks for image"):
        write_bundle(tmp_path / "bundle", encoder, small_prior(), BundleInfo("heads", "fp32"))
    assert not (tmp_path / "bundle" / "manifest.json").exists()


def test_a_prior_that_is_damaged_gets_no_manifest(tmp_path):
    write_bundle(tmp_path, TINY / "encoder.onnx", small_prior(), BundleInfo("heads", "fp32"))
    (tmp_path / "manifest.json").unlink()
    data = (tmp_path / "prior.maqp").read_bytes()
    (tmp_path / "prior.maqp").write_bytes(data[:-1])
    with pytest.raises(PriorError, match="cut off or damaged"):
        write_manifest(tmp_path, BundleInfo("heads", "fp32"))


def test_the_command_writes_a_bundle_and_tells_what_int8_loses(tmp_path, monkeypatch, capsys):
    words = ["bundle", "--encoder", str(TINY / "encoder.onnx"), "--prior", str(TINY.parent / "priors/float32.maqp")]
    monkeypatch.setattr("sys.argv", [*words, "--out", str(tmp_path / "heads-fp32")])
    bundle.main()
    manifest = read_manifest(tmp_path / "heads-fp32")
    assert (manifest["name"], manifest["training_data"]) == ("heads-fp32", list(TRAINING_DATA))
    printed = capsys.readouterr().out
    assert "layer 0: int8 bases are 0." in printed
    assert "encoder.onnx 0.00 MB" in printed
