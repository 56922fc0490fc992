"""A transformer that loses layers keeps the others as they are, loses idle ones first and learns from the whole one."""

import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")

import numpy as np
import torch

from export.prediction import shorten_transformer
from export.prediction.codes import CodedClips, write_codes
from export.prediction.config import TransformerShape
from export.prediction.sampling import drawn_codes
from export.prediction.shorten_transformer import Kept, Shortening, cheapest, shortened
from export.prediction.train_transformer import Examples, load_transformer
from export.prediction.transformer import LatentTransformer
from export.training import seed_step

SHAPE = TransformerShape(width=16, layers=3, heads=2, head_width=8, hidden=32, embedding=8, slices=2, entries=8)


def random_codes(*shape, seed=1):
    return torch.randint(0, 8, shape, generator=torch.Generator().manual_seed(seed))


def clips_of(count=3, frames=6):
    codes = random_codes(count, frames, 2, 16, 16).short()
    return CodedClips(codes, torch.full((count,), 10.0), [f"noise/{k}" for k in range(count)])


@pytest.fixture
def whole():
    """Returns a transformer with an idle first layer of the context and second layer of the slices."""
    torch.manual_seed(0)
    net = LatentTransformer(SHAPE).eval()
    with torch.no_grad():
        for parameter in net.parameters():  # heads and biases begin at zero
            parameter.add_(0.2 * torch.randn_like(parameter))
        for layer in (net.context.layers[0], net.slices.layers[1]):
            for part in (layer.project, layer.network[-1]):
                part.weight.zero_()
                part.bias.zero_()
    return net


def batch_of(clips):
    return Examples(clips.codes[:, 0:3].long(), clips.codes[:, 3].long(), clips.fps)


@torch.no_grad()
def logits_of(net, clips):
    one = batch_of(clips)
    return net(one.before, one.codes, one.fps)


def test_layers_that_do_nothing_are_left_out_first_and_change_nothing(whole):
    clips = clips_of(2, 4)
    one = batch_of(clips)
    clips.codes[:, 3] = drawn_codes(whole, one.before, one.fps, 0.0, torch.Generator())  # so that its layers count
    kept = cheapest(whole, clips, (2, 2), frames=2)
    assert kept == Kept((1, 2), (0, 2))
    short = shortened(whole, kept)
    assert (short.shape.layers, short.shape.layers_of_slices) == (2, 2)
    assert torch.equal(logits_of(short, clips), logits_of(whole, clips))
    assert (logits_of(shortened(whole, Kept((1,), (0, 2))), clips) - logits_of(whole, clips)).abs().max() > 0.01
    short.context.layers[0].rows.data += 1
    assert not torch.equal(short.context.layers[0].rows, whole.context.layers[1].rows), "it is a copy"


def test_it_learns_what_the_whole_one_says(whole):
    clips = clips_of()
    training = Shortening(whole, Kept((2,), (2,)))
    before = {name: value.clone() for name, value in whole.state_dict().items()}
    apart = []
    for step in range(40):
        seed_step(0, step)
        apart.append(training.advance(clips, 4, 3e-3)["bits_from_whole"].item())
    assert np.mean(apart[-5:]) < 0.6 * np.mean(apart[:3])
    assert all(torch.equal(value, before[name]) for name, value in whole.state_dict().items()), "the teacher stays"
    assert float(training.loss(batch_of(clips))[1]) > 0
    assert float(Shortening(whole, Kept((1, 2), (0, 2))).loss(batch_of(clips))[1]) == pytest.approx(0, abs=1e-5)


def test_the_command_writes_weights_that_load_with_their_sizes(whole, tmp_path):
    for split in ("train", "val"):
        write_codes(clips_of(), tmp_path / f"codes-{split}.npz")
    state = {"shape": vars(SHAPE), "net": whole.state_dict()}
    torch.save(state, tmp_path / "whole.pt")
    words = f"--whole {tmp_path}/whole.pt --codes {tmp_path} --out {tmp_path}/short --left 2 1 --steps 2 --batch 2"
    shorten_transformer.train(shorten_transformer.parsed([*words.split(), "--threads", "1", "--device", "cpu"]))
    net = load_transformer(tmp_path / "short" / "weights.pt")
    assert (net.shape.layers, net.shape.layers_of_slices) == (2, 1)
    assert (len(net.context.layers), len(net.slices.layers)) == (2, 1)
