"""The parallel transformer sees what it may, and learns and resumes."""

import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")

import numpy as np
import torch

from export.prediction import train_parallel
from export.prediction.autoencoder import Autoencoder
from export.prediction.codes import CodedClips, write_codes
from export.prediction.config import AutoencoderShape, TransformerShape
from export.prediction.parallel import ParallelTransformer, times_ahead
from export.training import seed_step

SMALL = TransformerShape(width=32, layers=1, heads=2, head_width=16, hidden=64, embedding=32, slices=2, entries=8)


@pytest.fixture
def net():
    torch.manual_seed(0)
    net = ParallelTransformer(SMALL).eval()
    for parameter in net.parameters():
        if not parameter.any():
            torch.nn.init.normal_(parameter, std=0.3)
    return net


def example(seed=1):
    generator = torch.Generator().manual_seed(seed)
    before = torch.randint(0, 8, (1, 3, 2, 16, 16), generator=generator)
    codes = torch.randint(0, 8, (1, 2, 16, 16), generator=generator)
    return before, codes, times_ahead(torch.tensor([10.0]), torch.tensor([2.0]))


@torch.no_grad()
def test_masked_codes_change_no_logit_of_other_places_and_known_ones_change_all(net):
    before, codes, times = example()
    known = torch.zeros(1, 16, 16, dtype=torch.bool)
    changed = codes.clone()
    changed[0, :, 4, 7] = (changed[0, :, 4, 7] + 3) % 8
    others = torch.arange(256) != 4 * 16 + 7
    difference = (net(before, codes, known, times) - net(before, changed, known, times)).abs().amax(-1)[0]
    assert difference[:, others].max() == 0
    known[0, 4, 7] = True
    difference = (net(before, codes, known, times) - net(before, changed, known, times)).abs().amax(-1)[0]
    assert (difference[:, others] > 0).float().mean() > 0.99


@torch.no_grad()
def test_the_time_ahead_matters(net):
    before, codes, _ = example()
    known, fps = torch.zeros(1, 16, 16, dtype=torch.bool), torch.tensor([10.0])
    near, far = (net(before, codes, known, times_ahead(fps, torch.tensor([h]))) for h in (1.0, 8.0))
    assert (near - far).abs().max() > 1e-3


@torch.no_grad()
def test_expected_chances_are_those_of_the_logits_where_a_slice_is_certain(net):
    before, codes, times = example()
    net.heads.out[0].bias[:] = torch.tensor([0.0, 60, 0, 0, 0, 0, 0, 0])  # slice 0: code 1 everywhere
    codes[:, 0] = 1
    expected = net.expected(before, times)
    logits = net(before, codes, torch.zeros(1, 16, 16, dtype=torch.bool), times)
    for k, chances in enumerate(expected):
        assert torch.allclose(chances, logits[:, k].softmax(-1), atol=1e-5)
        assert torch.allclose(chances.sum(-1), torch.ones(1, 256), atol=1e-5)


def moving_codes(count=2, frames=16):
    first = torch.randint(0, 8, (count, 2, 16, 16), generator=torch.Generator().manual_seed(0))
    codes = torch.stack([first.roll(t, -1) for t in range(frames)], 1)
    return CodedClips(codes.short(), torch.full((count,), 10.0), [f"moving/{k}" for k in range(count)])


def test_a_parallel_training_learns_and_gives_figures(tmp_path, monkeypatch):
    clips = moving_codes()
    torch.manual_seed(0)
    training, bits = train_parallel.Training(SMALL), []
    monkeypatch.setattr(train_parallel, "HORIZONS", (1,))
    for step in range(80):
        seed_step(0, step)
        bits.append(training.advance(clips, 4, 5e-3)["bits"].item())
    assert np.mean(bits[-5:]) < 0.6 * np.mean(bits[:3])
    autoencoder = Autoencoder(AutoencoderShape(widths=(8, 16), residual=8, blocks=1, slices=2, entries=8)).eval()
    figures = train_parallel.figures_of(training.net.eval(), clips, 6, autoencoder)
    assert figures.keys() == {"bits 1", "dB 1", "last 1"}
    assert figures["bits 1"] < 2.5


def test_a_parallel_training_is_a_command(tmp_path, monkeypatch):
    monkeypatch.setitem(train_parallel.TRANSFORMERS, "light", SMALL)
    for split in ("train", "val"):
        write_codes(moving_codes(), tmp_path / f"codes-{split}.npz")
    words = ["train", "--codes", str(tmp_path), "--out", str(tmp_path / "out"), "--steps", "3", "--batch", "2"]
    monkeypatch.setattr("sys.argv", words)
    train_parallel.main()
    assert train_parallel.load_parallel(tmp_path / "out/weights.pt").shape == SMALL
