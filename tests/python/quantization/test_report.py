"""The quantization report names every tensor, sees a broken scale, and finds layers that overflow 16 bits."""

import functools
import hashlib
import json
import shutil

import numpy as np
import onnx
import pytest
import torch
from onnx import helper, numpy_helper

from export.densepose.bundle import GRAPHS
from quantization import check, report, report_files
from quantization.analysis.comparison import TensorError, activation_errors, pair_errors, weight_errors, worst_first
from quantization.analysis.errors import output_sqnr
from quantization.analysis.saturation import bound, columns, count, layers, saturation
from quantization.graphs import qdq, rounding
from quantization.graphs.bias_correction import correct_biases
from quantization.graphs.prepare import prepare
from quantization.quantize import quantize_graph
from quantization.settings import GraphSettings

pytestmark = pytest.mark.usefixtures("one_thread")
SHIPPED = report.agreement.INT8_BUNDLE
RNG = np.random.default_rng(0)


def small_graph(path, first=None):
    """Convolution, ReLU6, depthwise convolution, ReLU; the last one shares its bias with a third, 1x1."""
    weights = {
        "a.weight": RNG.normal(size=(8, 4, 3, 3)) if first is None else first,
        "b.weight": RNG.normal(size=(8, 1, 3, 3)) + 0.2,
        "c.weight": RNG.normal(size=(8, 8, 1, 1)),
        "a.bias": RNG.normal(size=8),
        "b.bias": RNG.normal(size=8),
    }
    values = [numpy_helper.from_array(array.astype(np.float32), name) for name, array in weights.items()]
    values += [numpy_helper.from_array(np.float32(x), name) for name, x in (("low", 0), ("high", 6))]
    nodes = [
        helper.make_node("Conv", ["x", "a.weight", "a.bias"], ["a"], "/a/Conv", kernel_shape=[3, 3], pads=[1] * 4),
        helper.make_node("Clip", ["a", "low", "high"], ["clipped"], "/a/Clip"),
        helper.make_node(
            "Conv", ["clipped", "b.weight", "b.bias"], ["b"], "/b/Conv", kernel_shape=[3, 3], pads=[1] * 4, group=8
        ),
        helper.make_node("Relu", ["b"], ["positive"], "/b/Relu"),
        helper.make_node("Conv", ["positive", "c.weight", "b.bias"], ["y"], "/c/Conv", kernel_shape=[1, 1]),
    ]
    value = helper.make_tensor_value_info
    graph = helper.make_graph(
        nodes, "small", [value("x", 1, [1, 4, "h", "w"])], [value("y", 1, [1, 8, "h", "w"])], values
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, path)


def samples(count):
    return [{"x": RNG.normal(size=(1, 4, 12, 16)).astype(np.float32)} for _ in range(count)]


@pytest.fixture(scope="module")
def quantized(tmp_path_factory):
    """(prepared float model, path of the int8 graph, samples)"""
    folder = tmp_path_factory.mktemp("small")
    small_graph(folder / "float.onnx")
    given = samples(4)
    quantize_graph(folder / "float.onnx", folder / "int8.onnx", given, GraphSettings())
    return prepare(folder / "float.onnx", folder / "prepared.onnx"), folder / "int8.onnx", given


def test_every_integer_tensor_is_in_the_report_once(quantized):
    reference, path, given = quantized
    model = onnx.load(path)
    found = [*weight_errors("small", reference, model), *activation_errors("small", reference, model, given)]
    integers = {c.name for c in model.graph.initializer if c.data_type in (2, 3, 6) and "zero_point" not in c.name}
    assert {f"{e.name}_quantized" for e in found if e.kind != "activation"} == integers
    made = {n.input[0].removesuffix("_QuantizeLinear_Input") for n in model.graph.node if n.op_type == "QuantizeLinear"}
    assert {e.name for e in found if e.kind == "activation" and e.here is not None} == made
    assert {e.name for e in found if e.kind == "weight"} == {"a.weight", "b.weight", "c.weight"}
    assert sum(e.kind == "bias" for e in found) == 3  # the shared one has a copy for each reader
    assert len({(e.kind, e.name) for e in found}) == len(found)


def test_errors_are_those_of_rounding_and_gather_along_the_graph(quantized):
    reference, path, given = quantized
    model = onnx.load(path)
    found = {e.name: e for e in activation_errors("small", reference, model, given)}
    assert found["x"].here == found["x"].gathered
    assert found["y"].gathered < found["y"].here
    assert found["y"].jump == pytest.approx(found["positive"].gathered - found["y"].gathered)
    assert found["y"].gathered == pytest.approx(output_sqnr(path.with_name("float.onnx"), path, given)["y"], abs=0.5)
    quick = {e.name: e.here for e in pair_errors("small", reference, model, given)}
    assert quick == pytest.approx({name: e.here for name, e in found.items()})
    weights = {e.name: e for e in weight_errors("small", reference, model)}
    assert 25 < weights["a.weight"].worst_channel <= weights["a.weight"].here + 3 < 45
    assert weights["a.weight"].bits == 7


def test_the_worst_come_first():
    errors = [
        TensorError("g", n, "weight", "", "", here=h, worst_channel=w) for n, h, w in (("a", 30, 25), ("b", 40, 9))
    ]
    errors += [TensorError("g", "c", "activation", "", "", here=None, gathered=20)]
    errors += [TensorError("g", "d", "bias", "", "", here=60, worst_channel=0)]
    assert [e.name for e in worst_first(errors)] == ["b", "c", "a", "d"]


def test_weights_of_another_float_graph_are_an_error(quantized):
    reference, path, _ = quantized
    other = onnx.ModelProto.FromString(reference.SerializeToString())
    del other.graph.node[0]
    with pytest.raises(ValueError, match="other weights"):
        weight_errors("small", other, onnx.load(path))


def break_scale(path, tensor, factor=4.0, channel=None):
    """Multiplies the scale of an integer tensor by hand."""
    model = onnx.load(path)
    (value,) = [c for c in model.graph.initializer if c.name == f"{tensor}_scale"]
    scale = numpy_helper.to_array(value).copy()
    if channel is None:
        scale *= np.float32(factor)
    else:
        scale[channel] *= np.float32(factor)
    value.CopyFrom(numpy_helper.from_array(scale, value.name))
    onnx.save(model, path)


@pytest.fixture(scope="module")
def rebuilt(tmp_path_factory):
    """Prepared fp32 graphs from the weights of this repository, and what they see on its images."""
    folder = tmp_path_factory.mktemp("fp32")
    source = check.fp32_bundle(check.WEIGHTS, folder / "bundle")
    return check.prepared_graphs(source.folder, folder / "prepared"), check.media_samples(source)


def complaints(rebuilt, bundle, graphs=GRAPHS):
    """A report of some graphs: a broken tensor changes no other graph's numbers."""
    expected = json.loads(report.JSON.read_text())["check"]
    expected = {name: metrics for name, metrics in expected.items() if name.split(":")[0] in graphs}
    reference = {name: rebuilt[0][name] for name in graphs}
    return check.complaints(expected, check.own_errors(reference, bundle, rebuilt[1]))


def test_the_shipped_bundle_is_the_one_in_the_report_and_passes_its_check(rebuilt):
    document = json.loads(report.JSON.read_text())
    assert document["schema"] == report.SCHEMA
    assert document["fingerprint"] == report.fingerprint(SHIPPED), "run python -m quantization.report"
    assert complaints(rebuilt, SHIPPED) == []


BROKEN = (
    ("trunk", "/backbone/blocks.7/depthwise/Clip_output_0", None),
    ("trunk", "/backbone/blocks.12/expand/Clip_output_0", None),
    ("trunk", "backbone.blocks.9.project.conv.weight", 3),
    ("dense_head", "/body/body.2/body.2.2/Relu_output_0", None),
    ("box_head", "convs.2.weight", 0),
)


@pytest.fixture(scope="module")
def complaints_about(rebuilt, tmp_path_factory):
    """Complaints about a graph in which all of its tensors in BROKEN are; each tensor's own error is found apart."""

    @functools.cache
    def found(graph: str, factor: float) -> list[str]:
        bundle = shutil.copytree(SHIPPED, tmp_path_factory.mktemp("broken") / "bundle")
        for _, tensor, channel in (row for row in BROKEN if row[0] == graph):
            break_scale(bundle / f"{graph}.onnx", tensor, factor, channel)
        return complaints(rebuilt, bundle, (graph,))

    return found


@pytest.mark.parametrize(("graph", "tensor", "channel"), BROKEN)
@pytest.mark.parametrize("factor", [4.0, 0.25])
def test_a_scale_broken_by_hand_is_named(complaints_about, graph, tensor, channel, factor):
    found = complaints_about(graph, factor)
    assert len(found) == sum(row[0] == graph for row in BROKEN)
    assert sum(sentence.startswith(f"{graph}: {tensor} has") for sentence in found) == 1


def test_missing_and_new_tensors_are_named():
    error = TensorError("g", "new", "activation", "", "", here=40.0)
    assert check.complaints({"g: old": [40.0, None]}, [error]) == [
        "g: new is quantized, but unknown",
        "g: old is no longer quantized, or is gone",
    ]
    assert check.complaints({"g: new": [40.4, None]}, [error]) == []
    assert "no noise" in check.complaints({"g: new": [None, None]}, [error])[0]


def test_the_bound_is_of_the_two_largest_weights_of_one_sign():
    assert bound(np.array([[100, -90, 28, 5]])) == 255 * 128
    assert bound(np.array([[100, 29, 3], [-64, -64, 60]])) == 255 * 129
    assert bound(np.array([[64, 64, 64, -64]])) <= 32767


def test_overflows_are_counted_as_the_instruction_makes_them():
    rows = np.array([[255, 255, 255, 0, 255], [1, 1, 1, 1, 1]], np.uint8)
    weights = np.array([[127, 127, 127, 127, 127], [127, -127, 1, 1, 1], [-127, -127, 0, 0, 0]])
    pairs, clamped, worst = count(rows, weights)
    assert pairs == 2 * 2 * 3
    assert clamped == 2
    assert worst == 2 * 255 * 127 - 32767
    assert count(rows, weights // 2)[1] == 0


def test_columns_times_weights_are_the_convolution(quantized, monkeypatch):
    monkeypatch.setattr("quantization.analysis.saturation.ROWS", 10**6)
    reference, path, given = quantized
    (layer, depthwise, _) = layers(reference, onnx.load(path))
    assert depthwise.depthwise
    assert not layer.depthwise
    (rows,) = columns(layer, given[0]["x"])
    found = (rows.astype(np.int64) - layer.pair.zero_point) @ layer.weights.T.astype(np.int64)
    stored = layer.pair.applied(given[0]["x"])
    kernel = torch.from_numpy((layer.weights.reshape(8, 3, 3, 4).transpose(0, 3, 1, 2)).astype(np.float32))
    expected = torch.nn.functional.conv2d(torch.from_numpy(stored / layer.pair.scale), kernel, padding=1)[0]
    assert np.allclose(found.reshape(12, 16, 8).transpose(2, 0, 1), expected.numpy(), atol=0.05)


def test_a_saturating_layer_is_found_and_seven_bits_are_silent(tmp_path):
    loud = np.full((8, 4, 3, 3), 0.5)
    loud[0] *= -1
    small_graph(tmp_path / "float.onnx", loud)
    given = [{"x": np.abs(sample["x"])} for sample in samples(3)]
    reference = prepare(tmp_path / "float.onnx", tmp_path / "prepared.onnx")
    for reduced in (True, False):
        quantize_graph(tmp_path / "float.onnx", tmp_path / "int8.onnx", given, GraphSettings(reduce_range=reduced))
        found = {x.layer: x for x in saturation("small", reference, onnx.load(tmp_path / "int8.onnx"), given)}
        assert found["/b/Conv"].exempt
        assert found["/a/Conv"].safe == reduced
        assert (found["/a/Conv"].clamped > 0) == (not reduced)
        assert (found["/a/Conv"].worst_error > 0) == (not reduced)
    again = {x.layer: x for x in saturation("small", reference, onnx.load(tmp_path / "int8.onnx"), given, bits=7)}
    assert all(x.safe and x.clamped == 0 for x in again.values())


def test_no_layer_of_the_shipped_bundle_can_overflow_16_bits(rebuilt):
    found = report.saturation_report(rebuilt[0], SHIPPED, {name: [] for name in rebuilt[0]})
    assert len(found) > 50
    assert [x.layer for x in found if not x.safe] == []


def test_depthwise_layers_keep_eight_bits_when_asked(tmp_path):
    small_graph(tmp_path / "float.onnx")
    settings = GraphSettings(depthwise_8_bit=True)
    quantize_graph(tmp_path / "float.onnx", tmp_path / "int8.onnx", samples(2), settings)
    reference = prepare(tmp_path / "float.onnx", tmp_path / "prepared.onnx")
    held = qdq.weights(onnx.load(tmp_path / "int8.onnx").graph, reference.graph)
    largest = {w.name: int(np.abs(w.stored.astype(int)).max()) for w in held if w.slot == 1}
    assert largest["b.weight"] > 120
    assert largest["a.weight"] <= 64
    assert largest["c.weight"] <= 64
    assert all(w.scale.size == 8 for w in held if w.slot == 1)


def test_bias_correction_takes_the_mean_error_out(tmp_path):
    small_graph(tmp_path / "float.onnx")
    given = [{"x": np.abs(sample["x"])} for sample in samples(4)]
    reference = prepare(tmp_path / "float.onnx", tmp_path / "prepared.onnx")
    gaps = []
    for corrected in (False, True):
        quantize_graph(tmp_path / "float.onnx", tmp_path / "int8.onnx", given, GraphSettings())
        if corrected:
            assert correct_biases(tmp_path / "prepared.onnx", tmp_path / "int8.onnx", given) == 3
        run = [report_session(model) for model in (reference, onnx.load(tmp_path / "int8.onnx"))]
        means = [np.mean([r.run(["y"], s)[0].mean((0, 2, 3)) for s in given], 0) for r in run]
        gaps.append(np.abs(means[0] - means[1]).mean())
    assert gaps[1] < 0.7 * gaps[0]


def test_weights_rounded_together_lose_less_than_each_by_itself():
    chance = np.random.default_rng(3)
    inputs = np.maximum(chance.normal(1, 1, (24, 4000)) + chance.normal(0, 1, (1, 4000)), 0)  # alike, never negative
    moment = inputs @ inputs.T / 4000
    weights = chance.normal(0, 1, (16, 24))
    scale = np.abs(weights).max(1) / 64
    alone = np.clip(np.rint(weights / scale[:, None]), -64, 64)
    together = rounding.rounded(weights, moment, scale, 64)
    assert np.array_equal(together, np.rint(together))
    assert np.abs(together).max() <= 64

    def loss(integers):
        error = integers * scale[:, None] - weights
        return np.einsum("oi,ij,oj->", error, moment, error)

    assert loss(together) < 0.5 * loss(alone)


def test_weights_of_independent_inputs_are_rounded_to_the_nearest():
    weights = np.random.default_rng(4).normal(0, 1, (5, 9))
    scale = np.abs(weights).max(1) / 64
    together = rounding.rounded(weights, np.diag(np.arange(1.0, 10.0)), scale, 64)
    assert np.array_equal(together, np.rint(weights / scale[:, None]))


def test_rounding_together_changes_integers_alone_and_helps_the_graph(tmp_path):
    small_graph(tmp_path / "float.onnx")
    # Channels that are alike, as those of real features are: there is something to make up for.
    shared = RNG.random((1, 1, 12, 16)).astype(np.float32)
    given = [{"x": 0.05 * sample["x"] + shared} for sample in samples(4)]
    reference = prepare(tmp_path / "float.onnx", tmp_path / "prepared.onnx")
    held, quality = [], []
    for together in (False, True):
        settings = GraphSettings(round_together=together, bias_correction=True)
        quantize_graph(tmp_path / "float.onnx", tmp_path / "int8.onnx", given, settings)
        held.append({w.name: w for w in qdq.weights(onnx.load(tmp_path / "int8.onnx").graph, reference.graph)})
        quality.append(output_sqnr(tmp_path / "prepared.onnx", tmp_path / "int8.onnx", given)["y"])
    for name, weight in held[0].items():
        assert np.array_equal(weight.scale, held[1][name].scale)
    assert not np.array_equal(held[0]["a.weight"].stored, held[1]["a.weight"].stored)
    assert np.array_equal(held[0]["b.weight"].stored, held[1]["b.weight"].stored), "depthwise layers stay"
    assert quality[1] > quality[0] + 0.2


def test_a_mixed_bundle_is_whole_and_has_the_graphs_asked_for(tmp_path):
    (tmp_path / "trunk.onnx").write_bytes(b"in float")
    folder = report.agreement.mixed(tmp_path, SHIPPED, ["trunk"], tmp_path / "mixed")
    assert (folder / "trunk.onnx").read_bytes() == b"in float"
    assert (folder / "box_head.onnx").read_bytes() == (SHIPPED / "box_head.onnx").read_bytes()
    manifest = json.loads((folder / "manifest.json").read_text())
    for name, entry in manifest["files"].items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == entry["sha256"], name
    with pytest.raises(ValueError, match="not one of the graphs"):
        report.agreement.mixed(tmp_path, SHIPPED, ["head"], tmp_path / "other")


def report_session(model):
    from quantization.graphs.activations import float_session

    return float_session(model)


def test_the_generated_part_of_the_page_is_replaced_and_the_rest_kept(tmp_path):
    document = json.loads(report.JSON.read_text())
    path = tmp_path / "page.md"
    path.write_text(f"# Title\n\nmine\n\n{report_files.BEGIN}\nold\n{report_files.END}\n\nlast\n")
    report_files.write_markdown(path, document)
    text = path.read_text()
    assert text.startswith("# Title\n\nmine\n")
    assert text.endswith("last\n")
    assert "\nold\n" not in text
    assert document["fingerprint"] in text


def test_the_report_lists_all_tensors_of_the_shipped_bundle():
    document = json.loads(report.JSON.read_text())
    listed = {(t["graph"], t["name"]) for t in document["tensors"]}
    for name in GRAPHS:
        graph = onnx.load(SHIPPED / f"{name}.onnx").graph
        assert {(name, pair.name) for pair in qdq.pairs(graph)} <= listed
        stored = {c.name for c in graph.initializer if c.name.endswith("_quantized")}
        assert {(name, s.removesuffix("_quantized")) for s in stored} <= listed
