"""Comparisons count what they say: every place once, no code before it is known, bits of all codes of a frame."""

import math

import numpy as np
import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")

import torch
from torch.nn import functional as F

from export.prediction.ablation import compare_codes
from export.prediction.ablation.decoding_order import PASSES, Decoder, decoded, fixed_groups, surest
from export.prediction.autoencoder import Autoencoder
from export.prediction.config import AutoencoderShape, TransformerShape
from export.prediction.data import Clips
from export.prediction.parallel import ParallelTransformer, times_ahead

SHAPE = TransformerShape(width=16, layers=1, heads=2, head_width=8, hidden=16, embedding=8, slices=2, entries=8)


@pytest.fixture(scope="module")
def net():
    torch.manual_seed(0)
    net = ParallelTransformer(SHAPE).eval()
    for layer in net.heads.out:  # new ones say that all codes are as likely
        torch.nn.init.normal_(layer.weight, std=1.0)
    return net


@pytest.fixture(scope="module")
def given():
    torch.manual_seed(1)
    before, true = torch.randint(8, (2, 3, 2, 16, 16)), torch.randint(8, (2, 2, 16, 16))
    return before, times_ahead(torch.tensor([10.0, 30]), torch.tensor([1.0, 4])), true


@pytest.mark.parametrize("order", ["raster", "subscaling"])
@pytest.mark.parametrize("passes", PASSES)
def test_each_place_is_known_after_one_pass_of_an_order(order, passes):
    groups = fixed_groups(order, passes)
    assert len(groups) == passes
    assert np.array_equal(np.sort(np.concatenate(groups)), np.arange(256))


def test_subscaling_takes_no_neighbours_in_one_pass_and_other_names_are_refused():
    row, column = np.divmod(fixed_groups("subscaling", 4)[1], 16)
    assert set(row % 2) == {1}
    assert set(column % 2) == {1}
    with pytest.raises(ValueError, match="spiral"):
        fixed_groups("spiral", 4)


def test_the_surest_places_that_are_not_known_come_next():
    sure, known = torch.tensor([[-1.0, -3, -2, -4]]), torch.tensor([[True, False, False, False]])
    assert surest(sure, known, 3).tolist() == [[False, False, True, False]]
    assert surest(sure, known, 1).tolist() == [[False, True, True, True]]


def test_bits_of_one_pass_are_those_of_codes_with_nothing_known(net, given):
    before, times, true = given
    codes, bits = decoded(net, before, times, "raster", 1, true=true)
    assert torch.equal(codes, true)
    with torch.no_grad():
        logits = net(before, true, torch.zeros(2, 16, 16, dtype=torch.bool), times)
    nats = F.cross_entropy(logits.flatten(0, 2), true.flatten(), reduction="none").view(2, -1).mean(1)
    assert bits.tolist() == pytest.approx((nats / math.log(2)).tolist(), rel=1e-5)


@torch.no_grad()
def test_codes_that_are_not_known_are_not_seen(net, given):
    before, times, true = given
    known = torch.zeros(2, 256, dtype=torch.bool)
    known[:, :100] = True
    decoder, codes = Decoder(net, before, times), true.flatten(2)
    hidden, shown = codes.clone(), codes.clone()
    hidden[:, :, 100:] = (hidden[:, :, 100:] + 1) % 8
    shown[:, :, :100] = (shown[:, :, :100] + 1) % 8
    features = decoder.features(codes, known)
    assert torch.equal(decoder.features(hidden, known), features)
    assert not torch.allclose(decoder.features(shown, known), features)


@pytest.mark.parametrize("order", ["confidence", "raster", "subscaling"])
def test_a_frame_that_was_decoded_has_the_bits_of_its_own_codes(net, given, order):
    before, times, _ = given
    codes, bits = decoded(net, before, times, order, 4)
    if order != "confidence":  # whose order is that of the codes chosen, not of given ones
        again = decoded(net, before, times, order, 4, true=codes)
        assert torch.equal(again[0], codes)
        assert again[1].tolist() == pytest.approx(bits.tolist(), rel=1e-5)
    assert codes.unique().numel() > 1
    assert (bits < math.log2(8)).all()


def test_autoencoders_of_any_number_of_codes_have_a_row():
    torch.manual_seed(0)
    frames = torch.randint(0, 256, (2, 6, 64, 64, 3), dtype=torch.uint8)
    clips = Clips(frames, torch.tensor([10.0, 30]), ["a", "b"])
    shape = AutoencoderShape(widths=(4, 8), residual=4, blocks=1, slices=2, entries=16, side=8)
    cells, decibels = compare_codes.row_of(Autoencoder(shape).eval(), clips, clips, {"film": frames[0]})
    assert len(cells) == len(compare_codes.HEAD)
    assert cells[:3] == ["2", "16", "8 x 8"]
    bits = [float(cell) for cell in cells[5:7]]
    assert 0 < bits[1] <= 2 * 64 * 6
    assert len(decibels) == 2
