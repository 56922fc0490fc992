"""The transformer does not see what it must predict, starts from the table, learns and resumes to the same numbers."""

import math

import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")

import numpy as np
import torch

from export.prediction import run, train_transformer
from export.prediction.codes import CodedClips, read_codes, write_codes
from export.prediction.config import TRANSFORMERS, TransformerShape
from export.prediction.sampling import drawn_codes
from export.prediction.table import CodeTable, bits_by_frequency, bits_by_table
from export.prediction.train_transformer import Training, examples, held_out_frames, transformer_bits
from export.prediction.transformer import UNSEEN, LatentTransformer, unreachable_parameters
from export.training import seed_step

SMALL = TransformerShape(width=16, layers=2, heads=2, head_width=8, hidden=32, embedding=8, slices=2, entries=8)


def random_net(seed=0):
    """With heads and biases that are not zero, as they are in the beginning."""
    torch.manual_seed(seed)
    net = LatentTransformer(SMALL).eval()
    for parameter in net.parameters():
        if not parameter.any():
            torch.nn.init.normal_(parameter, std=0.3)
    return net


def random_codes(*shape, entries=8, seed=1):
    return torch.randint(0, entries, shape, generator=torch.Generator().manual_seed(seed))


def moving_clips(count=4, frames=6, seed=0):
    """Codes that move one place to the right from frame to frame."""
    first = random_codes(count, 2, 16, 16, seed=seed)
    codes = torch.stack([first.roll(t, -1) for t in range(frames)], 1)
    return CodedClips(codes.short(), torch.full((count,), 10.0), [f"moving/{k}" for k in range(count)])


def test_the_papers_size_is_that_of_the_paper():
    shape = TRANSFORMERS["paper"]
    net = LatentTransformer(shape)
    assert sum(p.numel() for p in net.parameters()) + unreachable_parameters(shape) == pytest.approx(49.9e6, rel=0.02)


def test_the_light_size_has_about_six_million():
    assert sum(p.numel() for p in LatentTransformer(TRANSFORMERS["light"]).parameters()) == pytest.approx(6e6, rel=0.15)


@pytest.mark.parametrize("place", [0, 1, 16, 37, 130, 255])
@pytest.mark.parametrize("k", range(2))
def test_a_code_changes_no_logit_before_it_and_some_after_it(place, k):
    net = random_net()
    before, codes, fps = random_codes(1, 3, 2, 16, 16), random_codes(1, 2, 16, 16, seed=2), torch.tensor([10.0])
    changed = codes.clone()
    changed[0, k, place // 16, place % 16] = (changed[0, k, place // 16, place % 16] + 3) % 8
    with torch.no_grad():
        difference = (net(before, codes, fps) - net(before, changed, fps)).abs().amax(-1)[0]  # [slices, 256]
    assert difference[:, :place].max() == 0 if place else True
    assert difference[: k + 1, place].max() == 0
    assert difference[k + 1 :, place].min() > 0 if k == 0 else True
    if place < 255:
        assert difference[:, place + 1 :].max() > 0


def test_every_frame_before_and_the_frame_rate_matter():
    net = random_net()
    before, codes = random_codes(1, 3, 2, 16, 16), random_codes(1, 2, 16, 16, seed=2)
    with torch.no_grad():
        logits = net(before, codes, torch.tensor([10.0]))
        for frame in range(3):
            changed = before.clone()
            changed[0, frame] = UNSEEN
            assert (net(changed, codes, torch.tensor([10.0])) - logits).abs().max() > 1e-4
        assert (net(before, codes, torch.tensor([30.0])) - logits).abs().max() > 1e-4


def test_unseen_codes_are_zeros():
    context = random_net().context
    assert not context.rows.weight[context.rows.padding_idx].any()


def test_a_table_counts_what_follows_what():
    clips = moving_clips(2, 4)
    still = CodedClips(clips.codes[:, :1].expand(-1, 4, -1, -1, -1).contiguous(), clips.fps, clips.names)
    table = CodeTable.counted(still.codes, 8)
    assert torch.allclose(table.after.exp().sum(-1), torch.ones(2, 8), atol=1e-5)
    assert torch.allclose(table.frequency.exp().sum(-1), torch.ones(2), atol=1e-5)
    assert bits_by_table(table, still.codes).mean() < 0.1
    assert bits_by_frequency(table, still.codes).mean() == pytest.approx(3, abs=0.1)
    moving = CodeTable.counted(clips.codes, 8)
    assert bits_by_table(moving, random_codes(2, 4, 2, 16, 16)).mean() > 2.5


def test_a_new_network_needs_as_many_bits_as_the_table():
    clips = moving_clips()
    training = Training(SMALL, clips)
    table = CodeTable.counted(clips.codes, 8)
    clip, t = held_out_frames(clips, 12)
    bits = transformer_bits(training.net.eval(), clips, clip, t)
    assert torch.allclose(bits, bits_by_table(table, clips.codes)[clip, t - 1], atol=1e-4)
    even = Training(SMALL, clips, use_table=False)
    assert transformer_bits(even.net.eval(), clips, clip, t).mean() == pytest.approx(math.log2(8), abs=1e-4)


def test_codes_that_move_are_learnt_far_below_the_table():
    """Each code is that of its left neighbour in the frame before: the table of a place alone cannot know."""
    clips = moving_clips(2, 5)
    torch.manual_seed(0)
    shape = TransformerShape(width=32, layers=1, heads=2, head_width=16, hidden=64, embedding=32, slices=2, entries=8)
    training = Training(shape, clips)
    bits = []
    for step in range(60):
        seed_step(0, step)
        bits.append(training.advance(clips, 4, 5e-3)["bits"].item())
    assert np.mean(bits[:3]) > 2.7
    assert np.mean(bits[-5:]) < 0.5 * np.mean(bits[:3])


def test_frames_before_the_first_are_unseen():
    clips = moving_clips()
    one = examples(clips, torch.tensor([2, 0]), torch.tensor([1, 4]), SMALL)
    assert (one.before[0, :2] == UNSEEN).all()
    assert torch.equal(one.before[0, 2], clips.codes[2, 0])
    assert torch.equal(one.before[1], clips.codes[0, 1:4])
    assert torch.equal(one.codes[1], clips.codes[0, 4])


def test_drawn_codes_are_the_likeliest_given_themselves():
    net = random_net()
    before, fps = random_codes(1, 3, 2, 16, 16), torch.tensor([10.0])
    codes = drawn_codes(net, before, fps, 0.0, torch.Generator())
    with torch.no_grad():
        assert torch.equal(net(before, codes, fps).argmax(-1).view(1, 2, 16, 16), codes)
    draws = [drawn_codes(net, before, fps, 1.0, torch.Generator().manual_seed(seed)) for seed in (3, 3)]
    assert torch.equal(draws[0], draws[1])
    assert not torch.equal(draws[0], codes)


def test_a_stopped_training_goes_on_to_the_same_weights(tmp_path, monkeypatch):
    monkeypatch.setitem(train_transformer.TRANSFORMERS, "light", SMALL)
    for split, seed in (("train", 0), ("val", 9)):
        write_codes(moving_clips(seed=seed), tmp_path / f"codes-{split}.npz")
    assert torch.equal(read_codes(tmp_path, "val").codes, moving_clips(seed=9).codes)

    def arguments(out):
        words = ["train", "--codes", str(tmp_path), "--out", str(out), "--threads", "1", "--steps", "6", "--batch", "2"]
        monkeypatch.setattr("sys.argv", words)
        return train_transformer.parsed()

    whole, halves = tmp_path / "whole", tmp_path / "halves"
    train_transformer.train(arguments(whole))
    stops = iter([False] * 3 + [True] * 9)
    with monkeypatch.context() as patched:
        stop = type("Stop", (), {"__bool__": lambda self: next(stops)})
        patched.setattr(run, "StopSignal", stop)
        train_transformer.train(arguments(halves))
    assert torch.load(halves / "checkpoint.pt", weights_only=True)["step"] == 3
    train_transformer.train(arguments(halves))
    a, b = (train_transformer.load_transformer(folder / "weights.pt").state_dict() for folder in (whole, halves))
    assert all(torch.equal(a[name], b[name]) for name in a)
