"""Int8 graphs stay close to their float originals, and what must stay float does."""

import numpy as np
import onnx
import pytest
import torch

from export.densepose import export_onnx
from export.densepose.config import NetworkConfig
from export.densepose.network import MobileParsingRCNN
from quantization import transposed_convolution
from quantization.errors import float_nodes_left, output_sqnr, sqnr_db
from quantization.quantize import equal_sizes, matching_nodes, quantise_graph, spread
from quantization.settings import GraphSettings, read_settings

WIDTH = 16
torch.set_num_threads(1)  # the graphs are small


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    torch.manual_seed(0)
    folder = tmp_path_factory.mktemp("bundle")
    net = MobileParsingRCNN(NetworkConfig(width=WIDTH)).train()
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
    arrays = [loud * np.abs(rng.standard_normal((2, WIDTH, pool, pool))) for _ in range(count)]
    return [{"rois": array.astype(np.float32)} for array in arrays]


def test_transposed_convolutions_become_plain_ones_with_the_same_result(folder, tmp_path):
    model = onnx.load(folder / "dense_head.onnx")
    assert transposed_convolution.rewrite(model) == 2
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, tmp_path / "dense_head.onnx")
    quality = output_sqnr(folder / "dense_head.onnx", tmp_path / "dense_head.onnx", rois(1, 32))
    assert min(quality.values()) > 110
    assert "ConvTranspose" not in {node.op_type for node in model.graph.node}


def test_transposed_convolutions_of_another_shape_are_left_alone():
    weight = onnx.numpy_helper.from_array(np.ones((2, 3, 2, 2), np.float32), "w")
    node = onnx.helper.make_node("ConvTranspose", ["x", "w"], ["y"], kernel_shape=[2, 2], strides=[2, 2])
    value = onnx.helper.make_tensor_value_info
    graph = onnx.helper.make_graph([node], "g", [value("x", 1, [1, 2, 4, 4])], [value("y", 1, [1, 3, 8, 8])], [weight])
    model = onnx.helper.make_model(graph)
    assert transposed_convolution.rewrite(model) == 0
    assert model.graph.node[0].op_type == "ConvTranspose"


def test_the_int8_dense_head_is_small_and_close(folder, tmp_path):
    source, target = folder / "dense_head.onnx", tmp_path / "dense_head.onnx"
    quantise_graph(source, target, rois(6, 32), GraphSettings())
    quality = output_sqnr(source, target, rois(2, 32))
    assert min(quality.values()) > 20
    assert target.stat().st_size < 0.7 * source.stat().st_size
    assert float_nodes_left(target) == []
    names = [output.name for output in onnx.load(target).graph.output]
    assert names == ["coarse", "index", "surface"]


def test_named_nodes_stay_float(folder, tmp_path):
    settings = GraphSettings(float_nodes=("/logits/*",))
    quantise_graph(folder / "box_head.onnx", tmp_path / "box_head.onnx", rois(4, 7), settings)
    assert float_nodes_left(tmp_path / "box_head.onnx") == ["/logits/Gemm"]


def test_reduced_weights_use_seven_bits(folder, tmp_path):
    largest = {}
    for reduced in (True, False):
        target = tmp_path / f"{reduced}.onnx"
        quantise_graph(folder / "box_head.onnx", target, rois(2, 7), GraphSettings(reduce_range=reduced))
        arrays = [onnx.numpy_helper.to_array(value) for value in onnx.load(target).graph.initializer]
        largest[reduced] = max(int(np.abs(a.astype(int)).max()) for a in arrays if a.dtype == np.int8)
    assert largest[True] <= 64
    assert largest[False] > 100


def test_a_name_that_matches_nothing_is_an_error(folder):
    graph = onnx.load(folder / "box_head.onnx").graph
    assert matching_nodes(graph, ("/logits/*", "/deltas/Gemm")) == ["/logits/Gemm", "/deltas/Gemm"]
    with pytest.raises(ValueError, match="/scores/"):
        matching_nodes(graph, ("/scores/*",))


def test_nobody_to_calibrate_with_is_an_error(folder, tmp_path):
    with pytest.raises(ValueError, match="nobody"):
        quantise_graph(folder / "dense_head.onnx", tmp_path / "x.onnx", [], GraphSettings())


def test_the_shipped_settings_name_every_graph():
    settings = read_settings(export_onnx.Path("quantization/densepose.toml"))
    assert set(settings.graphs) == {"trunk", "rpn_fine", "rpn_coarse", "box_head", "dense_head"}


@pytest.mark.parametrize("text", ["[trunk]\nmethod = 'magic'", "[trunk]\nbits = 4", "images = 3"])
def test_wrong_settings_are_errors(tmp_path, text):
    path = tmp_path / "settings.toml"
    path.write_text(
        f"calibration_images = 1\ncalibration_photos = 1\nheld_out_images = 1\npeople_per_image = 1\n{text}"
    )
    with pytest.raises(ValueError, match=str(path)):
        read_settings(path)


def test_signal_to_noise_in_decibels():
    assert sqnr_db(100.0, 1.0) == pytest.approx(20.0)
    assert sqnr_db(1.0, 0.0) == float("inf")


def test_calibration_pictures_are_spread_over_the_shards():
    assert spread(list(range(100)), 5) == [0, 20, 40, 60, 80]
    assert spread([1, 2], 5) == [1, 2]


def test_pictures_of_both_orientations_calibrate_together(folder, tmp_path):
    rng = np.random.default_rng(0)
    samples = [{"image": rng.standard_normal(s).astype(np.float32)} for s in ((1, 3, 64, 96), (1, 3, 96, 64))]
    padded = [sample["image"] for sample in equal_sizes(samples)]
    assert [array.shape for array in padded] == [(1, 3, 96, 96)] * 2
    assert np.array_equal(padded[0][..., :64, :], samples[0]["image"])
    assert not padded[0][..., 64:, :].any()
    settings = GraphSettings(method="percentile")
    quantise_graph(folder / "trunk.onnx", tmp_path / "trunk.onnx", samples, settings)
    assert float_nodes_left(tmp_path / "trunk.onnx") == []


def test_levels_of_the_pyramid_keep_their_own_sizes():
    samples = [{"p3": np.ones((1, 2, h, 8), np.float32), "p4": np.ones((1, 2, h // 2, 4), np.float32)} for h in (4, 8)]
    first, _ = equal_sizes(samples)
    assert first["p3"].shape == (1, 2, 8, 8)
    assert first["p4"].shape == (1, 2, 4, 4)
    assert first["p4"].sum() == 2 * 2 * 4


def test_people_calibrate_one_by_one():
    people = np.arange(2 * 4 * 7 * 7, dtype=np.float32).reshape(2, 4, 7, 7)
    singles = equal_sizes([{"rois": people}, {"rois": people[:1]}])
    assert np.array_equal(np.concatenate([single["rois"] for single in singles]), people[[0, 1, 0]])


def test_ranges_come_from_all_samples_not_only_the_last_ones(folder, tmp_path):
    loud, quiet = rois(1, 7, loud=10), rois(40, 7)
    quantise_graph(folder / "box_head.onnx", tmp_path / "box_head.onnx", [*loud, *quiet], GraphSettings())
    graph = onnx.load(tmp_path / "box_head.onnx").graph
    constants = {c.name: onnx.numpy_helper.to_array(c) for c in graph.initializer}
    (first,) = (n for n in graph.node if n.op_type == "QuantizeLinear" and n.input[0] == "rois")
    assert 255 * constants[first.input[1]] == pytest.approx(loud[0]["rois"].max(), rel=0.02)
