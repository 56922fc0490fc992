"""The edge networks: shapes, sizes, losses and decodings, and the ONNX graph against torch."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from box_crops import write_crops

from export.bundle import read_manifest
from export.edges.bundle import write_manifest
from export.edges.config import EPS_R, SIZES, NetworkConfig
from export.edges.data import Batches
from export.edges.export_onnx import BundleInfo, export
from export.edges.graph_field import field_of_planes, slopes_of
from export.edges.interpolate_weights import interpolated, measure_statistics
from export.edges.losses import FieldTarget, LossWeights, bin_centres, decoded, field_terms, histogram_target
from export.edges.network import EdgeNetwork, PublishedNetwork, Residual
from export.edges.validation import field_of
from export.edges.weights import load_network, save_network, start_from

pytestmark = pytest.mark.usefixtures("one_thread", "fixed_seed")
TINY = NetworkConfig((8, 8, 8))


def target(distance: torch.Tensor) -> FieldTarget:
    return FieldTarget(distance, (distance < EPS_R).long(), torch.ones_like(distance, dtype=torch.bool))


def test_the_published_network_has_the_published_number_of_parameters():
    count = sum(p.numel() for p in PublishedNetwork().parameters())
    assert count == pytest.approx(78.63e6, rel=0.02)


def test_the_published_network_answers_at_full_resolution():
    with torch.no_grad():
        assert PublishedNetwork().eval()(torch.zeros(1, 1, 32, 16)).shape == (1, 244, 32, 16)


@pytest.mark.parametrize("size", SIZES)
def test_a_network_answers_for_each_pixel(size):
    config = SIZES[size]
    network = EdgeNetwork(config).eval()
    with torch.no_grad():
        out = network(torch.zeros(1, 12, config.multiple, config.multiple // 2))
    assert out.shape == (1, config.planes, 2 * config.multiple, config.multiple)


@pytest.mark.parametrize(("loss", "bins"), [("l1", 0), ("l2", 0), ("mixed", 0), ("histogram", 16)])
def test_each_loss_is_smallest_at_the_truth(loss, bins):
    distance = torch.tensor([[[0.25, 3.1, 9.0, 16.0]]])
    right = torch.zeros(1, (bins or 2) + 2, 1, 4)
    if bins:
        right[:, :bins] = histogram_target(distance, bins).clamp_min(1e-9).log()
    else:
        right[:, 0] = distance / EPS_R
    weights = LossWeights(spread=0, kind=0)
    smallest = field_terms(right, target(distance), bins, loss, weights)["distance"]
    for _ in range(5):
        other = right + 0.3 * torch.randn_like(right)
        assert field_terms(other, target(distance), bins, loss, weights)["distance"] > smallest


def test_the_mixed_loss_is_absolute_beside_an_edge_and_squared_far_from_it():
    weights = LossWeights(near=0, spread=0, kind=0)

    def loss_of(distance_r, error_r):
        distance = torch.full((1, 1, 1), distance_r)
        planes = torch.zeros(1, 4, 1, 1)
        planes[:, 0] = (distance + error_r) / EPS_R
        return field_terms(planes, target(distance), 0, "mixed", weights)["distance"].item()

    assert loss_of(3.9, 4.0) == pytest.approx(2 * loss_of(3.9, 2.0))
    assert loss_of(4.1, 4.0) == pytest.approx(4 * loss_of(4.1, 2.0))


def test_what_is_beyond_reach_may_be_called_farther():
    distance = torch.full((1, 1, 2), EPS_R)
    planes = torch.zeros(1, 4, 1, 2)
    planes[:, 0] = torch.tensor([1.0, 1.7])
    assert field_terms(planes, target(distance), 0, "l1", LossWeights())["distance"] == 0
    planes[:, 0] = torch.tensor([1.0, 0.7])
    assert field_terms(planes, target(distance), 0, "l1", LossWeights())["distance"] > 0


def test_pixels_that_do_not_count_change_nothing():
    distance = torch.rand(1, 4, 4) * EPS_R
    kind, counts = torch.ones(1, 4, 4, dtype=torch.long), torch.rand(1, 4, 4) < 0.5
    planes = torch.randn(1, 4, 4, 4)
    first = field_terms(planes, FieldTarget(distance, kind, counts), 0, "l1", LossWeights())
    other = torch.where(counts[:, None], planes, torch.randn_like(planes))
    second = field_terms(other, FieldTarget(distance, kind, counts), 0, "l1", LossWeights())
    assert {k: v.item() for k, v in first.items()} == pytest.approx({k: v.item() for k, v in second.items()})


@pytest.mark.parametrize("decoding", ["expectation", "median", "mode"])
def test_a_histogram_is_decoded_to_where_its_mass_lies(decoding):
    bins, distance = 64, torch.tensor([[[4.0, 7.9, 12.3]]])
    logits = histogram_target(distance, bins).clamp_min(1e-12).log()
    found, spread = decoded(torch.cat([logits, torch.zeros(1, 2, 1, 3)], 1), bins, decoding)
    assert (found - distance).abs().max() <= EPS_R / bins / 2 + 1e-4
    assert (spread < 2 * EPS_R / bins).all()
    assert bin_centres(bins, logits)[0] == EPS_R / bins / 2


def test_the_graph_is_what_torch_computes(tmp_path):
    network = EdgeNetwork(TINY).eval()
    assert export(network, tmp_path, TINY.multiple) < 1e-4
    write_manifest(tmp_path, BundleInfo("tiny", "fp32"), TINY.multiple)
    manifest = read_manifest(tmp_path)
    assert manifest["task"] == "edges"
    assert manifest["field"] == {"eps_r": EPS_R, "multiple_px": 8, "output_over_input": 1}
    import onnxruntime

    session = onnxruntime.InferenceSession(tmp_path / "field.onnx", providers=["CPUExecutionProvider"])
    depth = 1 + np.random.default_rng(0).random((16, 24), np.float32)
    field = field_of_planes(session.run(None, {"slopes": slopes_of(depth, 120.0)})[0])
    assert np.abs(field - field_of(network, 0)(depth, 120.0)).max() < 1e-3


def test_a_wider_network_starts_with_the_field_of_the_trained_one(tmp_path):
    narrow = EdgeNetwork(SIZES["xs"])
    for module in narrow.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            torch.nn.init.uniform_(module.weight, 0.5, 1.5)
            module.running_mean.uniform_(-0.2, 0.2)
    save_network(narrow, SIZES["xs"], tmp_path / "weights.pt")
    wide = EdgeNetwork(SIZES["s"])
    start_from(tmp_path / "weights.pt", wide)
    planes = torch.rand(1, 12, 32, 32)
    torch.testing.assert_close(wide.eval()(planes), narrow.eval()(planes), atol=1e-5, rtol=1e-5)
    assert wide.stem[0][0].weight[16:].abs().min() > 0  # new channels can learn


def test_a_deeper_network_starts_with_the_field_of_the_trained_one_and_comes_back_from_its_file(tmp_path):
    trained = EdgeNetwork(TINY)
    save_network(trained, TINY, tmp_path / "weights.pt")
    deeper = replace(TINY, blocks=(1, 2))
    network = EdgeNetwork(deeper)
    start_from(tmp_path / "weights.pt", network)
    planes = torch.rand(1, 12, 32, 32)
    torch.testing.assert_close(network.eval()(planes), trained.eval()(planes))
    for module in network.modules():
        if isinstance(module, Residual):
            torch.nn.init.uniform_(module.second[1].weight, 0.5, 1)
    assert not torch.allclose(network(planes), trained(planes))
    save_network(network, deeper, tmp_path / "deeper.pt")
    again, config = load_network(tmp_path / "deeper.pt")
    assert config == deeper
    torch.testing.assert_close(again(planes), network(planes))
    assert export(network, tmp_path, deeper.multiple) < 1e-4


def test_a_network_between_two_is_either_at_its_ends_and_has_statistics_of_its_own(tmp_path):
    first, deeper = EdgeNetwork(TINY), replace(TINY, blocks=(1, 1))
    save_network(first, TINY, tmp_path / "first.pt")
    second = EdgeNetwork(deeper)
    start_from(tmp_path / "first.pt", second)
    for parameter in second.parameters():
        torch.nn.init.normal_(parameter, std=0.3)
    save_network(second, deeper, tmp_path / "second.pt")
    planes = torch.rand(1, 12, 32, 32)
    at_ends = [interpolated(tmp_path / "first.pt", tmp_path / "second.pt", at)(planes) for at in (0, 1)]
    torch.testing.assert_close(at_ends[0], first.eval()(planes))
    torch.testing.assert_close(at_ends[1], second.eval()(planes))
    middle = interpolated(tmp_path / "first.pt", tmp_path / "second.pt", 0.5)
    torch.testing.assert_close(middle.head.weight, (first.head.weight + second.head.weight) / 2)
    torch.testing.assert_close(middle.deep[0][0].first[0].weight, second.deep[0][0].first[0].weight)
    measure_statistics(middle, Batches(write_crops(tmp_path / "crops", 0, 8), 48, 4, seed=0), 3)
    norm = middle.stem[0][1]
    assert norm.num_batches_tracked == 3
    assert not torch.allclose(norm.running_mean, second.stem[0][1].running_mean)
    assert not any(module.training for module in middle.modules())


def test_a_start_from_another_network_is_refused(tmp_path):
    save_network(EdgeNetwork(SIZES["s"]), SIZES["s"], tmp_path / "weights.pt")
    with pytest.raises(ValueError, match="larger --size"):
        start_from(tmp_path / "weights.pt", EdgeNetwork(SIZES["xs"]))
    with pytest.raises(ValueError, match="other planes"):
        start_from(tmp_path / "weights.pt", EdgeNetwork(replace(SIZES["s"], bins=16)))


def test_the_shipped_int8_graph_has_fine_steps_of_distance():
    import onnxruntime

    path = Path(__file__).parents[3] / "sdk/models/edges-int8/field.onnx"
    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    depth = np.where(np.arange(128) < 60, 1.0, 1.2)[None].repeat(96, 0).astype(np.float32)
    found = field_of_planes(session.run(None, {"slopes": slopes_of(depth, 120.0)})[0])
    assert len(np.unique(found)) > 40
    assert np.diff(np.unique(found)).min() < 0.1  # r
