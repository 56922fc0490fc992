"""The graphs of the transformer, with kept keys and values around them, give the logits and codes of torch."""

import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")

import numpy as np
import torch

from export.prediction.config import TransformerShape
from export.prediction.export_transformer import export_transformer
from export.prediction.graphs.graph_runtime import GraphRuntime
from export.prediction.graphs.transformer_file import TransformerTables
from export.prediction.sampling import drawn_codes
from export.prediction.transformer import UNSEEN, LatentTransformer

SHAPE = TransformerShape(
    width=32, layers=2, heads=2, head_width=8, hidden=16, embedding=8, slices=3, entries=16, slice_layers=1
)
FPS = 15.0


@pytest.fixture(scope="module")
def net():
    torch.manual_seed(3)
    net = LatentTransformer(SHAPE).eval()
    with torch.no_grad():
        for parameter in net.parameters():  # heads and biases begin at zero
            parameter.add_(0.2 * torch.randn_like(parameter))
        net.context.rows.weight[-1] = 0
        net.table.copy_(torch.randn_like(net.table))
    return net


@pytest.fixture(scope="module")
def runtime(net, tmp_path_factory):
    folder = tmp_path_factory.mktemp("graphs")
    assert export_transformer(net, folder) < 1e-4
    return GraphRuntime(folder, TransformerTables.of(net), net.table.numpy())


@pytest.fixture(params=["all frames known", "none before the last"])
def before(request):
    codes = torch.randint(16, (1, 3, 3, 16, 16), generator=torch.Generator().manual_seed(1))
    if request.param != "all frames known":
        codes[:, :2] = UNSEEN
    return codes


def test_logits_of_a_whole_frame_are_those_of_torch(net, runtime, before):
    codes = torch.randint(16, (1, 3, 16, 16), generator=torch.Generator().manual_seed(2))
    with torch.no_grad():
        expected = net(before, codes, torch.tensor([FPS]))[0].numpy()
    runtime.begin(before[0].numpy(), FPS)
    found = runtime.logits(codes[0].numpy())
    assert np.abs(expected).max() > 2
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_place_after_place_gives_the_same_logits_and_codes(net, runtime, before):
    runtime.begin(before[0].numpy(), FPS)
    steps = {}

    def likeliest(k, place, logits):
        steps[k, place] = logits
        return int(logits.argmax())

    codes = runtime.chosen(likeliest)
    whole = runtime.logits(codes)
    by_step = np.stack([[steps[k, place] for place in range(256)] for k in range(3)])
    np.testing.assert_allclose(by_step, whole, atol=1e-4)
    expected = drawn_codes(net, before, torch.tensor([FPS]), 0, torch.Generator())[0].numpy()
    assert (codes == expected).mean() > 0.99, "equal but for near ties"
