"""The graphs of heads compute what torch does; the field of a prior is the same in ONNX Runtime, torch and C++."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")
import torch
from small_prior import small_prior

from export.densepose.graphs import session
from export.heads.encoder import HeadEncoder, run_encoder
from export.heads.export_onnx import EncoderGraph, export_encoder, export_field
from export.heads.field import bases_of, geometry, surface
from export.heads.prior import combined
from export.heads.prior_file import read_prior

DATA = Path(__file__).parents[2] / "native" / "data" / "tiny_head"  # written by tests/native/generate/make_tiny_head.py
SHAPE_CODES, COLOUR_CODES = (0.5, -1.25, 2.0), (-0.75, 1.5)
TOLERANCE = 5e-6  # half of what the engine and ONNX Runtime may differ by; dm, and logits

pytestmark = pytest.mark.usefixtures("one_thread", "fixed_seed")


@pytest.fixture(scope="module")
def encoder(lively_encoder):
    return lively_encoder(0)


def test_the_graph_of_the_encoder_is_what_torch_computes(encoder, tmp_path):
    path = tmp_path / "encoder.onnx"
    assert export_encoder(encoder, path) < 1e-4
    graph = session(path)
    signature = [(value.name, value.shape) for value in (*graph.get_inputs(), *graph.get_outputs())]
    assert signature == [("image", [1, 192, 192, 3]), ("cells", [1, 48, 48, 8])]
    crop = np.zeros((192, 192, 3), np.uint8)
    crop[40:90, 100:] = (250, 20, 90)  # borders show whether the mean is beyond them
    (found,) = graph.run(None, {"image": crop[None].astype(np.float32)})
    expected = run_encoder(encoder, crop)
    assert expected.std() > 0.01
    assert np.abs(found[0] - expected).max() < 1e-4 * np.abs(expected).max()


def test_a_graph_of_another_encoder_is_refused(encoder, lively_encoder, tmp_path, monkeypatch):
    other = EncoderGraph(lively_encoder(1))
    monkeypatch.setattr("export.heads.export_onnx.EncoderGraph", lambda _: other)
    with pytest.raises(ValueError, match="differs from torch"):
        export_encoder(encoder, tmp_path / "encoder.onnx")


def test_exporting_leaves_the_encoder_as_it_was(encoder, tmp_path):
    before = {name: value.clone() for name, value in encoder.state_dict().items()}
    export_encoder(encoder, tmp_path / "encoder.onnx")
    for name, value in encoder.state_dict().items():
        assert torch.equal(value, before[name]), name
    assert isinstance(encoder, HeadEncoder)


def test_the_field_of_a_prior_has_its_weights():
    prior = small_prior()
    codes = np.array(SHAPE_CODES), np.array(COLOUR_CODES)
    weights = bases_of(prior).double().combine(*(torch.from_numpy(code) for code in codes))
    for layer, expected in zip(weights, combined(prior, *codes), strict=True):
        np.testing.assert_allclose(layer[:, :-1], expected.weights, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(layer[:, -1], expected.bias, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ["field/usual", "priors/float32", "priors/int8"])
def test_the_field_is_the_same_in_onnx_runtime_and_torch_as_in_the_engine(name, tmp_path):
    """tests/native/head/test_field_parity.cpp compares the engine with the same numbers."""
    prior = read_prior(DATA / f"{name}.maqp")
    numbers = np.fromfile(DATA / "field" / f"{Path(name).name}.f32", "<f4")
    count = len(numbers) // 10
    points, distance, logits, template = np.split(numbers, [3 * count, 4 * count, 7 * count])
    expected = [distance, logits.reshape(-1, 3), template.reshape(-1, 3)]
    points = points.reshape(-1, 3)
    path = tmp_path / "field.onnx"
    assert export_field(prior, path) < 1e-5
    given = {"points": points}
    given |= {f"{kind}_codes": np.float32(codes) for kind, codes in (("shape", SHAPE_CODES), ("colour", COLOUR_CODES))}
    by_runtime = session(path).run(["distance", "colour_logits", "template_point"], given)
    bases = bases_of(prior)
    weights = bases.combine(torch.tensor(SHAPE_CODES), torch.tensor(COLOUR_CODES))
    out = geometry(prior.shape, weights, torch.from_numpy(points))
    (feature,) = session(path).run(["feature"], given)
    assert np.abs(feature - out[:, 1:].numpy()).max() < TOLERANCE
    by_torch = [out[:, 0], *surface(prior.shape, weights, torch.from_numpy(points), out)]
    for right, one, other in zip(expected, by_runtime, by_torch, strict=True):
        assert right.std() > 0.05
        assert np.abs(one - right).max() < TOLERANCE
        assert np.abs(other.numpy() - right).max() < TOLERANCE


def test_the_graph_of_a_field_takes_any_number_of_points(tmp_path):
    prior = small_prior()
    export_field(prior, tmp_path / "field.onnx")
    graph = session(tmp_path / "field.onnx")
    codes = {"shape_codes": np.zeros(3, np.float32), "colour_codes": np.zeros(2, np.float32)}
    many = np.random.default_rng(1).normal(size=(300, 3)).astype(np.float32)
    together = graph.run(None, {"points": many} | codes)
    assert [value.shape for value in together] == [(300,), (300, 5), (300, 3), (300, 3)]
    for k in (0, 299):
        for value, alone in zip(together, graph.run(None, {"points": many[k : k + 1]} | codes), strict=True):
            np.testing.assert_allclose(alone[0], value[k], rtol=1e-5, atol=1e-6)
