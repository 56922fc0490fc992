"""Training of the encoder goes on from weights made for another prior."""

import pytest

pytest.importorskip("torch")
import torch

from export.heads.encoder import HeadEncoder, save_encoder
from export.heads.train_encoder import go_on_from

pytestmark = pytest.mark.usefixtures("one_thread", "fixed_seed")


@pytest.fixture
def stored(lively_encoder, tmp_path):
    encoder = lively_encoder(0)
    save_encoder(encoder, tmp_path / "weights.pt")
    return encoder.eval(), tmp_path / "weights.pt"


def test_the_same_number_of_codes_continues_with_all_weights(stored):
    before, path = stored
    encoder = HeadEncoder(before.codes)
    go_on_from(encoder, path)
    image = torch.rand(1, 192, 192, 3) * 255
    with torch.no_grad():
        for found, expected in zip(encoder.eval()(image), before(image), strict=True):
            assert torch.equal(found, expected)


def test_another_number_of_codes_keeps_the_cells(stored):
    before, path = stored
    encoder = HeadEncoder(before.codes + 32)
    go_on_from(encoder, path)
    image = torch.rand(1, 192, 192, 3) * 255
    with torch.no_grad():
        cells, codes = encoder.eval()(image)
        assert torch.equal(cells, before(image)[0])
    assert codes.shape == (1, before.codes + 32, 2)


def test_parts_that_say_codes_do_not_move_the_cells(stored):
    encoder, _ = stored
    names = [name for name, _ in encoder.named_parameters() if name.startswith(("whole.", "code."))]
    assert names
    assert {id(p) for part in encoder.code_parts for p in part.parameters()} == {
        id(p) for name, p in encoder.named_parameters() if name in names
    }
    cells, _ = encoder(torch.zeros(1, 192, 192, 3))
    for part in encoder.code_parts:
        gradients = torch.autograd.grad(cells.sum(), list(part.parameters()), allow_unused=True, retain_graph=True)
        assert all(gradient is None for gradient in gradients)
