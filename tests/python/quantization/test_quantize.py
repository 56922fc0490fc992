"""Int8 graphs stay close to their float originals, and what must stay float does."""

import cv2
import numpy as np
import onnx
import onnxruntime
import pytest
import torch
from rectangle_people import picture

from export.bundle import BundleInfo
from export.densepose import bundle, export_onnx
from export.densepose.config import DecodeConfig, NetworkConfig
from export.densepose.graphs import open_bundle
from export.densepose.network import MobileParsingRCNN
from export.shards import Record
from quantization.analysis.errors import float_nodes_left, output_sqnr, sqnr_db
from quantization.graphs.simplify import drop_unused_constants, fold_scalar_products, share_scales
from quantization.quantize import equal_sizes, matching_nodes, quantize_graph
from quantization.samples import collect, spread
from quantization.settings import DENSEPOSE, DensePoseSettings, GraphSettings, read_settings

WIDTH = 16
pytestmark = pytest.mark.usefixtures("one_thread")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    torch.manual_seed(0)
    folder = tmp_path_factory.mktemp("bundle")
    net = MobileParsingRCNN(NetworkConfig(width=WIDTH, keypoints=33)).train()
    for norm in (m for m in net.modules() if isinstance(m, torch.nn.BatchNorm2d)):
        norm.momentum = None  # one pass sets the statistics, so that activations do not fade from layer to layer
    with torch.no_grad():
        net.detector(torch.randn(4, 3, 96, 96))
    net.eval()
    torch.nn.init.normal_(net.box_head.logits.weight)
    export_onnx.export_graphs(net, folder)
    return folder


def rois(count: int, pool: int, loud: float = 1) -> list[dict[str, np.ndarray]]:
    rng = np.random.default_rng(count)
    arrays = [loud * np.abs(rng.standard_normal((2, pool, pool, WIDTH))) for _ in range(count)]
    return [{"rois": array.astype(np.float32)} for array in arrays]


def test_the_int8_dense_head_is_small_and_close(folder, tmp_path):
    source, target = folder / "dense_head.onnx", tmp_path / "dense_head.onnx"
    quantize_graph(source, target, rois(6, 32), GraphSettings())
    quality = output_sqnr(source, target, rois(2, 32))
    assert min(quality.values()) > 20
    assert target.stat().st_size < 0.7 * source.stat().st_size
    assert float_nodes_left(target) == []
    names = [output.name for output in onnx.load(target).graph.output]
    assert names == ["labels", "surface"]


def test_biases_need_no_zero_points(folder, tmp_path):
    quantize_graph(folder / "box_head.onnx", tmp_path / "box_head.onnx", rois(2, 7), GraphSettings())
    graph = onnx.load(tmp_path / "box_head.onnx").graph
    kinds = {value.name: value.data_type for value in graph.initializer}
    read = [
        n for n in graph.node if n.op_type == "DequantizeLinear" and kinds.get(n.input[0]) == onnx.TensorProto.INT32
    ]
    assert read
    assert all(len(node.input) == 2 for node in read)
    others = [n for n in graph.node if n.op_type == "DequantizeLinear" and n not in read]
    assert all(len(node.input) == 3 for node in others)


def test_named_nodes_stay_float(folder, tmp_path):
    settings = GraphSettings(float_nodes=("/predict/*",))
    quantize_graph(folder / "box_head.onnx", tmp_path / "box_head.onnx", rois(4, 7), settings)
    assert float_nodes_left(tmp_path / "box_head.onnx") == ["/predict/Gemm"]


def test_reduced_weights_use_seven_bits(folder, tmp_path):
    largest = {}
    for reduced in (True, False):
        target = tmp_path / f"{reduced}.onnx"
        quantize_graph(folder / "box_head.onnx", target, rois(2, 7), GraphSettings(reduce_range=reduced))
        arrays = [onnx.numpy_helper.to_array(value) for value in onnx.load(target).graph.initializer]
        largest[reduced] = max(int(np.abs(a.astype(int)).max()) for a in arrays if a.dtype == np.int8)
    assert largest[True] <= 64
    assert largest[False] > 100


def test_a_name_that_matches_nothing_is_an_error(folder):
    graph = onnx.load(folder / "box_head.onnx").graph
    assert matching_nodes(graph, ("/predict/*", "/Flatten")) == ["/Flatten", "/predict/Gemm"]
    with pytest.raises(ValueError, match="/scores/"):
        matching_nodes(graph, ("/scores/*",))


def test_no_person_to_calibrate_with_is_an_error(folder, tmp_path):
    with pytest.raises(ValueError, match="no person"):
        quantize_graph(folder / "dense_head.onnx", tmp_path / "x.onnx", [], GraphSettings())


def test_the_shipped_settings_name_every_graph():
    settings = read_settings(DENSEPOSE, DensePoseSettings)
    assert set(settings.graphs) == {*bundle.GRAPHS, bundle.KEYPOINTS, *bundle.CROP_GRAPHS}


@pytest.mark.parametrize("text", ["[trunk]\nmethod = 'magic'", "[trunk]\nbits = 4", "images = 3"])
def test_wrong_settings_are_errors(tmp_path, text):
    path = tmp_path / "settings.toml"
    path.write_text(
        f"calibration_images = 1\ncalibration_photos = 1\nheld_out_images = 1\npeople_per_image = 1\n{text}"
    )
    with pytest.raises(ValueError, match=str(path)):
        read_settings(path, DensePoseSettings)


def test_crops_of_labelled_people_calibrate_the_networks_of_crops(tmp_path):
    torch.manual_seed(0)
    net, crop_net = (MobileParsingRCNN(NetworkConfig(width=WIDTH)).eval() for _ in range(2))
    export_onnx.export_graphs(net, tmp_path, crop_net)
    bundle.write_manifest(tmp_path, BundleInfo("full", "fp32"), net.config, DecodeConfig(), crops=True)
    image, label = picture(np.random.default_rng(0), people=2)
    record = Record(*(cv2.imencode(".png", array)[1].tobytes() for array in (image, label)))
    samples = collect(open_bundle(tmp_path), [record] * 3, people=4)
    assert set(samples) == {*bundle.GRAPHS, *bundle.CROP_GRAPHS}
    assert [s["image"].shape for s in samples["crop_trunk"]] == [(1, 3, 192, 192)] * 6  # of each person
    assert [s["rois"].shape for s in samples["crop_dense_head"]] == [(1, 32, 32, WIDTH)] * 6
    image = samples["crop_trunk"][0]["image"]
    with torch.no_grad():
        features = crop_net.finest(torch.from_numpy(image)).numpy()
    assert samples["crop_dense_head"][0]["rois"].max() <= 1.001 * features.max(), "of the network of crops"


def test_signal_to_noise_in_decibels():
    assert sqnr_db(100.0, 1.0) == pytest.approx(20.0)
    assert sqnr_db(1.0, 0.0) == float("inf")


def test_calibration_images_are_spread_over_the_shards():
    assert spread(list(range(100)), 5) == [0, 20, 40, 60, 80]
    assert spread([1, 2], 5) == [1, 2]


def test_images_of_both_orientations_calibrate_together(folder, tmp_path):
    rng = np.random.default_rng(0)
    samples = [{"image": rng.standard_normal(s).astype(np.float32)} for s in ((1, 3, 64, 96), (1, 3, 96, 64))]
    padded = [sample["image"] for sample in equal_sizes(samples)]
    assert [array.shape for array in padded] == [(1, 3, 96, 96)] * 2
    assert np.array_equal(padded[0][..., :64, :], samples[0]["image"])
    assert not padded[0][..., 64:, :].any()
    settings = GraphSettings(method="percentile")
    quantize_graph(folder / "trunk.onnx", tmp_path / "trunk.onnx", samples, settings)
    assert float_nodes_left(tmp_path / "trunk.onnx") == []


def test_levels_of_the_pyramid_keep_their_own_sizes():
    samples = [{"p3": np.ones((1, h, 8, 2), np.float32), "p4": np.ones((1, h // 2, 4, 2), np.float32)} for h in (4, 8)]
    first, _ = equal_sizes(samples)
    assert first["p3"].shape == (1, 8, 8, 2)
    assert first["p4"].shape == (1, 4, 4, 2)
    assert first["p4"].sum() == 2 * 2 * 4


def test_people_calibrate_one_by_one():
    people = np.arange(2 * 4 * 7 * 7, dtype=np.float32).reshape(2, 4, 7, 7)
    singles = equal_sizes([{"rois": people}, {"rois": people[:1]}])
    assert np.array_equal(np.concatenate([single["rois"] for single in singles]), people[[0, 1, 0]])


def test_ranges_come_from_all_samples_not_only_the_last_ones(folder, tmp_path):
    loud, quiet = rois(1, 7, loud=10), rois(40, 7)
    quantize_graph(folder / "box_head.onnx", tmp_path / "box_head.onnx", [*loud, *quiet], GraphSettings())
    graph = onnx.load(tmp_path / "box_head.onnx").graph
    constants = {c.name: onnx.numpy_helper.to_array(c) for c in graph.initializer}
    first = next(n for n in graph.node if n.op_type == "QuantizeLinear")  # of the RoIs, in whichever layout
    assert 255 * constants[first.input[1]] == pytest.approx(loud[0]["rois"].max(), rel=0.02)


def quantized_sum() -> onnx.ModelProto:
    """y = quantized(0.25 x) + quantized(0.5 x), the products quantized too, and a constant that nobody reads."""
    make, value = onnx.helper.make_node, onnx.helper.make_tensor_value_info

    def constant(name: str, number: float, kind: type = np.float32) -> onnx.TensorProto:
        return onnx.numpy_helper.from_array(np.array(number, kind), name)

    nodes = [
        make("QuantizeLinear", ["x", "s", "z"], ["xq"], "xq"), make("DequantizeLinear", ["xq", "s", "z"], ["xd"], "xd")
    ]  # fmt: skip
    for name in ("a", "b"):
        nodes += [
            make("Mul", ["xd", f"{name}.factor"], [f"{name}.product"], f"{name}.mul"),
            make("QuantizeLinear", [f"{name}.product", f"{name}.s", "z"], [f"{name}.q"], f"{name}.q"),
            make("DequantizeLinear", [f"{name}.q", f"{name}.s", "z"], [f"{name}.d"], f"{name}.d"),
        ]
    nodes.append(make("Add", ["a.d", "b.d"], ["y"], "add"))
    constants = [constant("s", 0.1), constant("z", 10, np.uint8), constant("idle", 3)]
    constants += [constant("a.factor", 0.25), constant("b.factor", 0.5), constant("a.s", 0.03), constant("b.s", 0.06)]
    sides = [value("x", 1, [8])], [value("y", 1, [8])]
    graph = onnx.helper.make_graph(nodes, "sum", *sides, constants)
    return onnx.helper.make_model(graph, opset_imports=[onnx.helper.make_opsetid("", 17)], ir_version=8)


def evaluate(model: onnx.ModelProto, **feed: np.ndarray) -> np.ndarray:
    return onnxruntime.InferenceSession(model.SerializeToString()).run(None, feed)[0]


def test_products_with_a_number_cost_no_operation_and_no_rounding():
    model = quantized_sum()
    x = np.linspace(-1, 20, 8, dtype=np.float32)
    assert fold_scalar_products(model) == 2
    assert drop_unused_constants(model) == 5  # two factors, two scales, and one that was idle before
    onnx.checker.check_model(model, full_check=True)
    assert [node.op_type for node in model.graph.node].count("Mul") == 0
    rounded = 0.1 * (np.clip(np.round(x / np.float32(0.1)) + 10, 0, 255) - 10)
    assert evaluate(model, x=x) == pytest.approx(0.75 * rounded, abs=1e-5)


@pytest.mark.parametrize("factor", [0.0, -2.0])
def test_products_that_no_scale_can_say_are_left_alone(factor):
    model = quantized_sum()
    for value in model.graph.initializer:
        if value.name == "a.factor":
            value.CopyFrom(onnx.numpy_helper.from_array(np.array(factor, np.float32), value.name))
    assert fold_scalar_products(model) == 1
    assert [node.name for node in model.graph.node if node.op_type == "Mul"] == ["a.mul"]


def test_maps_that_are_joined_share_the_scale_of_the_whole(folder, tmp_path):
    target = tmp_path / "dense_head.onnx"
    quantize_graph(folder / "dense_head.onnx", target, rois(4, 32), GraphSettings())
    model = onnx.load(target)
    made = {name: node for node in model.graph.node for name in node.output}
    joined = [node for node in model.graph.node if node.op_type == "Concat"]
    assert len(joined) == 2  # the branches of the ASPP, and the phases of the labels
    for node in joined:
        (reader,) = (n for n in model.graph.node if node.output[0] in n.input)
        assert {tuple(made[name].input[1:]) for name in node.input} == {tuple(reader.input[1:])}
    assert share_scales(model) == 4 + 4  # again, to no effect
