"""Graphs as TensorFlow Lite files: they must compute what the ONNX graphs compute."""

from pathlib import Path

import numpy as np
import onnxruntime
import pytest
from onnx import TensorProto, helper

pytest.importorskip("ai_edge_litert", reason="LiteRT is not installed (scripts/make-venv.sh train,bench)")
from ai_edge_litert.interpreter import Interpreter

from benchmarks import tflite
from benchmarks.graphs import feeds_of, four_by_three
from benchmarks.processors.provider_counts import signed
from export.densepose.graphs import open_bundle

BUNDLE = Path("sdk/models/densepose-b-int8")


@pytest.fixture(scope="module")
def feeds():
    return feeds_of(open_bundle(BUNDLE), four_by_three())


def results_of(model, feed):
    interpreter = Interpreter(model_content=model, num_threads=1)
    interpreter.allocate_tensors()
    for place, value in zip(interpreter.get_input_details(), tflite.channels_last(feed), strict=True):
        interpreter.set_tensor(place["index"], value)
    interpreter.invoke()
    return [interpreter.get_tensor(place["index"]) for place in interpreter.get_output_details()]


# int8 layers round sums in another order: over the trunk's fifty some values move by a few steps of 255.
@pytest.mark.parametrize(
    ("name", "limit"), [("trunk", 0.1), ("rpn_coarse", 0.01), ("box_head", 0.01), ("dense_head", 0.01)]
)
def test_each_shipped_graph_gives_the_same_numbers(feeds, name, limit):
    expected = onnxruntime.InferenceSession(BUNDLE / f"{name}.onnx").run(None, feeds[name])
    found = results_of(tflite.from_onnx(BUNDLE / f"{name}.onnx", feeds[name]), feeds[name])
    for ours, theirs in zip(expected, found, strict=True):
        assert ours.shape == theirs.shape
        assert np.abs(ours - theirs).max() <= limit * np.abs(ours).max()
        assert np.abs(ours - theirs).mean() <= limit / 10 * np.abs(ours).max()


def test_signed_activations_are_the_same_numbers(feeds):
    expected = onnxruntime.InferenceSession(BUNDLE / "dense_head.onnx").run(None, feeds["dense_head"])
    model = signed(BUNDLE / "dense_head.onnx")
    assert not [x.name for x in model.graph.initializer if x.data_type == TensorProto.UINT8]
    found = onnxruntime.InferenceSession(model.SerializeToString()).run(None, feeds["dense_head"])
    for ours, theirs in zip(expected, found, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=0.02 * np.abs(ours).max())


def test_an_operator_that_is_not_known_is_named(tmp_path):
    value = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, 2]) for name in "xy"]
    graph = helper.make_graph([helper.make_node("Erf", ["x"], ["y"], name="odd")], "g", value[:1], value[1:])
    path = tmp_path / "odd.onnx"
    path.write_bytes(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)]).SerializeToString())
    with pytest.raises(ValueError, match="odd: Erf is not known"):
        tflite.from_onnx(path, {"x": np.zeros((1, 2), np.float32)})
