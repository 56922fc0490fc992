"""The networks of scenes: their sizes as published, their shapes, and their graphs against torch."""

import numpy as np
import pytest
import torch
from torch.nn import functional as F

from export.scenes.config import SIZES, ExtractorConfig, RefinerConfig, SceneConfig
from export.scenes.export_onnx import (
    ExtractorGraph,
    RefinerGraph,
    export,
    export_extractor,
    export_refiner,
    parity,
    raster_shapes,
)
from export.scenes.networks.basis import Basis, directions, encoded
from export.scenes.networks.extractor import Extractor
from export.scenes.networks.feature_scale import measured, scaled
from export.scenes.networks.light_refiner import LightRefiner, depth_to_space, space_to_depth
from export.scenes.networks.system import Networks, load_networks, save_networks

pytestmark = pytest.mark.usefixtures("one_thread", "fixed_seed")

LIGHT = RefinerConfig(widths=(8, 8, 12))


def parameters(module: torch.nn.Module) -> int:
    return sum(p.numel() for p in module.parameters())


def rasters(height: int, width: int, levels: int = 5) -> list[torch.Tensor]:
    return [torch.randn(1, 9, height >> k, width >> k) for k in range(levels)]


def test_the_basis_has_the_papers_parameters():
    assert parameters(Basis()) == 678


def test_extractor_and_light_refiner_fit_into_the_bundle():
    networks = Networks(SceneConfig())
    # One byte a weight when quantized; the bundle should stay below two megabytes.
    assert parameters(networks.extractor) + parameters(networks.refiner) < 2_000_000


@pytest.mark.parametrize("name", SIZES)
def test_a_system_of_every_size_makes_features_and_an_image(name):
    networks = Networks(SIZES[name]).eval()
    with torch.no_grad():
        assert networks.extractor(torch.rand(1, 3, 64, 96)).shape == (1, 8, 64, 96)
        assert networks.refiner(rasters(48, 32)).shape == (1, 3, 48, 32)


@pytest.mark.parametrize("widths", [(), (8,) * 5, (8, 0)])
def test_a_refiner_that_cannot_be_is_refused(widths):
    with pytest.raises(ValueError, match=r"refiner"):
        RefinerConfig(widths)


def test_folding_puts_whole_pixels_one_after_the_other():
    picture = torch.arange(2 * 4 * 6).reshape(1, 2, 4, 6)
    cell = space_to_depth(picture)[0, :, 1, 2]
    assert cell.tolist() == [picture[0, c, y, x] for y, x in ((2, 4), (2, 5), (3, 4), (3, 5)) for c in range(2)]
    assert torch.equal(depth_to_space(space_to_depth(picture)), picture)


def test_a_light_refiner_sees_every_raster_that_it_reads():
    net = LightRefiner(LIGHT)
    given = [r.requires_grad_() for r in rasters(32, 32, LIGHT.levels)]
    net(given).square().sum().backward()
    assert all(r.grad.abs().sum() > 0 for r in given)
    assert all(p.grad is not None for p in net.parameters())


def test_the_extractors_norms_stand_still_while_it_trains():
    net = Extractor(ExtractorConfig((16, 16, 16, 16, 16))).train()
    before = net.trunk.stem.bn.running_mean.clone()
    net(torch.rand(1, 3, 64, 64)).sum().backward()
    assert torch.equal(net.trunk.stem.bn.running_mean, before)
    assert net.trunk.stem.conv.weight.grad.abs().sum() > 0


def test_directions_are_encoded_as_their_page_says():
    points, centre = torch.tensor([[1.0, 2, 4], [3, 3, 3]]).double(), torch.tensor([3.0, 3, 3]).double()
    found = directions(points, centre)
    np.testing.assert_allclose(found[0], np.array([-2, -1, 1]) / np.sqrt(6), rtol=1e-6)
    assert torch.equal(found[1], torch.zeros(3).double())  # a camera in the point: no direction, but a number
    values = encoded(found)[0].numpy()
    d = found[0].numpy()
    expected = [f(w * d) for w in (np.pi / 2, np.pi, 2 * np.pi) for f in (np.sin, np.cos)]
    np.testing.assert_allclose(values, np.concatenate(expected), rtol=1e-6)


def test_the_extractors_graph_is_the_network_at_any_size(tmp_path):
    net = Extractor(ExtractorConfig((32, 24, 16, 16, 16))).eval()
    for module in net.trunk.modules():  # as after training: statistics that fold to something
        if isinstance(module, torch.nn.BatchNorm2d):
            torch.nn.init.uniform_(module.running_mean, -0.1, 0.1)
            torch.nn.init.uniform_(module.running_var, 0.5, 1.5)
    path = tmp_path / "extractor.onnx"
    export_extractor(net, path)
    for height, width in ((64, 96), (160, 32)):
        image = np.random.default_rng(0).random((1, height, width, 3), np.float32)
        assert parity(ExtractorGraph(net), path, {"image": image}) <= 1e-5
        # And the graph's module is the network itself.
        tensor = torch.from_numpy(image)
        expected = net(tensor.permute(0, 3, 1, 2)).permute(0, 2, 3, 1)
        torch.testing.assert_close(ExtractorGraph(net)(tensor), expected, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("config", [LIGHT, RefinerConfig((8, 12))])
def test_a_refiners_graph_is_the_network_at_any_size(tmp_path, config):
    net, path = LightRefiner(config).eval(), tmp_path / "refiner.onnx"
    export_refiner(net, path)
    for height, width in ((48, 80), (112, 32), (16, 16)):
        shapes = raster_shapes(net, height, width)
        given = {name: np.random.default_rng(1).standard_normal(shape, np.float32) for name, shape in shapes.items()}
        assert parity(RefinerGraph(net), path, given) <= 1e-5


def test_the_graph_of_a_folded_refiner_takes_and_gives_folded_images():
    net = LightRefiner(LIGHT).eval()
    given = rasters(32, 48, LIGHT.levels)
    first = space_to_depth(given[0]).permute(0, 2, 3, 1)
    found = RefinerGraph(net)(first, *(r.permute(0, 2, 3, 1) for r in given[1:]))
    torch.testing.assert_close(depth_to_space(found.permute(0, 3, 1, 2)), net(given))


def test_weights_and_sizes_survive_the_way_through_a_file(tmp_path):
    config = SceneConfig(ExtractorConfig((16, 16, 16, 16, 16)), LIGHT)
    networks = Networks(config).eval()
    save_networks(networks, tmp_path / "weights.pt")
    loaded = load_networks(tmp_path / "weights.pt").eval()
    assert loaded.config == config
    given = rasters(32, 32)
    torch.testing.assert_close(loaded.refiner(given), networks.refiner(given), rtol=1e-2, atol=1e-2)
    worst = export(loaded, tmp_path)
    assert max(worst.values()) <= 1e-5
    basis = np.fromfile(tmp_path / "basis.bin", "<f4")
    assert len(basis) == 678
    # Layer by layer by hand, as another program would do it.
    view = F.normalize(torch.randn(5, 3), dim=1)
    x, start = encoded(view).numpy(), 0
    for outputs, inputs in ((16, 18), (16, 16), (6, 16)):
        weight = basis[start : start + outputs * inputs].reshape(outputs, inputs)
        start += outputs * inputs + outputs
        x = x @ weight.T + basis[start - outputs : start]
        x = np.where(x > 0, x, 0.01 * x) if outputs == 16 else x
    np.testing.assert_allclose(x, loaded.basis(view).detach().numpy(), rtol=1e-4, atol=1e-5)


def test_another_file_is_not_taken_for_weights(tmp_path):
    torch.save({"ema": {}}, tmp_path / "weights.pt")
    with pytest.raises(ValueError, match="holds no networks"):
        load_networks(tmp_path / "weights.pt")


def test_features_of_another_scale_make_the_same_image():
    networks = Networks(SceneConfig(SIZES["tiny"].extractor, LIGHT)).eval()
    torch.nn.init.normal_(networks.refiner.final.weight)
    photo = torch.rand(1, 3, 64, 96)
    factors = measured(networks, [photo])
    other = scaled(networks, factors)
    with torch.no_grad():
        features, changed = networks.extractor(photo), other.extractor(photo)
        torch.testing.assert_close(changed[:, :3], features[:, :3])
        torch.testing.assert_close(changed[:, 3:], features[:, 3:] * factors[:, None, None], rtol=1e-4, atol=1e-6)
        assert changed[:, 3:].abs().flatten(2).quantile(0.999, dim=2).allclose(torch.tensor(0.5), rtol=1e-3)
        there = [raster[:, 8:] > 0 for raster in rasters(64, 96)]
        made = []
        for net, maps in ((networks, features), (other, changed)):
            given = [torch.cat([F.avg_pool2d(maps, 2**k), there[k].float()], 1) * there[k] for k in range(5)]
            made.append(net.refiner(given))
    torch.testing.assert_close(made[1], made[0], rtol=1e-4, atol=1e-4)
