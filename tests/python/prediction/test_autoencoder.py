"""The autoencoder has the paper's size, learns, revives entries and resumes to the same numbers."""

import dataclasses

import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")

import cv2
import numpy as np
import torch

from export.clips.clip import write_clip
from export.clips.shapes import shapes_clip
from export.prediction import run, train_autoencoder
from export.prediction.autoencoder import Autoencoder
from export.prediction.codebook import Codebook, used_fraction
from export.prediction.config import AUTOENCODERS, AutoencoderShape
from export.prediction.data import read_stills, varied
from export.prediction.image_error import horizon_figures, psnr_db
from export.training import seed_step

SMALL = AutoencoderShape(widths=(8, 16), residual=8, blocks=1, slices=2, entries=16)


def parameters(net):
    return sum(p.numel() for p in net.parameters())


def test_the_papers_size_is_that_of_the_paper():
    net = Autoencoder(AUTOENCODERS["paper"])
    assert parameters(net.encoder) == pytest.approx(1.78e6, rel=0.02)
    assert parameters(net.decoder) == pytest.approx(1.78e6, rel=0.02)
    assert net.codebook.entries.numel() == 4 * 512 * 64


@pytest.mark.parametrize("size", AUTOENCODERS)
def test_frames_become_16_by_16_places_and_frames_again(size):
    net = Autoencoder(AUTOENCODERS[size]).eval()
    frames = torch.randint(0, 256, (2, 64, 64, 3), dtype=torch.uint8)
    codes = net.encode(frames)
    assert codes.shape == (2, 4, 16, 16)
    assert 0 <= codes.min() <= codes.max() < 512
    assert net.decode(codes).shape == (2, 64, 64, 3)


def test_a_frame_of_8_by_8_places_is_as_large_and_other_numbers_are_refused():
    net = Autoencoder(dataclasses.replace(SMALL, side=8)).eval()
    codes = net.encode(torch.zeros(1, 64, 64, 3, dtype=torch.uint8))
    assert codes.shape == (1, 2, 8, 8)
    assert net.decode(codes).shape == (1, 64, 64, 3)
    with pytest.raises(ValueError, match="not 12"):
        Autoencoder(dataclasses.replace(SMALL, side=12))


def test_the_nearest_entry_is_taken_and_the_lowest_of_equals():
    book = Codebook(1, 4, 2)
    book.entries.copy_(torch.tensor([[[0.0, 0], [1, 1], [1, 1], [-1, 0]]]))
    x = torch.tensor([[0.9, 0.8], [0.1, -0.1], [-3, 0]]).T.reshape(1, 2, 1, 3)
    assert book.nearest(x).flatten().tolist() == [1, 0, 3]
    assert torch.equal(book.looked_up(book.nearest(x))[0, :, 0, 2], torch.tensor([-1.0, 0]))


def test_entries_move_to_what_they_stand_for_and_dead_ones_are_revived():
    torch.manual_seed(0)
    book = Codebook(1, 8, 2).train()
    centres = torch.tensor([[-3.0, -3], [3, 3]])
    for step in range(200):
        seed_step(0, step)
        book(centres[torch.randint(2, (256,))].T.reshape(1, 2, 16, 16) + 0.1 * torch.randn(1, 2, 16, 16))
        if step == 0:  # three of the entries where nothing ever falls to them
            book.entries[0, 5:] = 100
            book.sums[0, 5:] = 100 * book.counts[0, 5:, None]
    assert torch.cdist(book.entries[0], centres).min(1).values.max() < 0.5
    codes = book.eval().nearest(centres.T.reshape(1, 2, 1, 2))
    assert used_fraction(codes, 8) == 2 / 8


def test_psnr_is_that_of_the_formula():
    a = torch.zeros(2, 4, 4, 3)
    b = torch.stack([torch.full((4, 4, 3), 25.5), torch.zeros(4, 4, 3)])
    assert psnr_db(a, b).tolist() == pytest.approx([20, 50])


def clips_on_disk(folder, train=3, val=1):
    for split, count in (("train", train), ("val", val)):
        (folder / "shapes" / split).mkdir(parents=True)
        for k in range(count):
            write_clip(shapes_clip(split, k, large=False), folder / "shapes" / split / f"clip-{k:05d}.npz")
    return folder


def arguments(monkeypatch, data, out, *more):
    monkeypatch.setattr(
        "sys.argv",
        ["train", "--data", str(data), "--sets", "shapes", "--out", str(out), "--threads", "1", "--batch", "8", *more],
    )
    return train_autoencoder.parsed()


def test_a_few_frames_are_learnt(tmp_path):
    frames = torch.from_numpy(np.concatenate([shapes_clip("train", k, False).small.rgb[:4] for k in range(2)]))
    torch.manual_seed(0)
    training = train_autoencoder.Training(SMALL)
    losses = []
    for step in range(120):
        seed_step(0, step)
        losses.append(training.advance(frames, frames, 3e-3)["picture"].item())
    assert np.mean(losses[-10:]) < 0.3 * np.mean(losses[:3])
    figures = horizon_figures(training.net.eval(), frames.unflatten(0, (1, 8))[:, [0, 1, 2, 3, 4, 5, 6, 7, 0, 1]])
    assert {f"{name} {k}" for name in ("last", "plain", "difference") for k in (1, 3, 8)} == figures.keys()


def test_a_varied_frame_differs_from_its_target_by_noise_alone():
    torch.manual_seed(0)
    frames = torch.full((64, 64, 64, 3), 128, dtype=torch.uint8)
    frames[:, :, :32] = 100
    seen, true = varied(frames)
    noise = seen - true
    assert noise.mean().abs() < 0.1
    assert 0.5 < noise.std() < 5
    levels = true.flatten(1, 2)
    assert (levels.amax(1) - levels.amin(1) > 10).all()
    assert levels.mean((1, 2)).std() > 5
    brighter_right = true[:, :, 40:].mean((1, 2, 3)) > true[:, :, :20].mean((1, 2, 3))
    assert 0.2 < brighter_right.float().mean() < 0.8


def test_stills_are_crops_of_the_photographs(tmp_path):
    photo = np.zeros((90, 160, 3), np.uint8)
    photo[..., 0] = 200  # blue in the order of OpenCV
    cv2.imwrite(str(tmp_path / "blue.jpg"), photo)
    stills = read_stills(tmp_path, 5)
    assert stills.shape == (5, 64, 64, 3)
    assert (stills[..., 2].float() - 200).abs().max() < 6
    assert stills[..., 0].max() < 6
    with pytest.raises(SystemExit, match="No photographs"):
        read_stills(tmp_path / "none", 5)


def test_a_stopped_training_goes_on_to_the_same_weights(tmp_path, monkeypatch):
    monkeypatch.setitem(train_autoencoder.AUTOENCODERS, "light", SMALL)
    data = clips_on_disk(tmp_path / "clips")
    whole, halves = tmp_path / "whole", tmp_path / "halves"
    train_autoencoder.train(arguments(monkeypatch, data, whole, "--steps", "6"))
    options = arguments(monkeypatch, data, halves, "--steps", "6")
    stops = iter([False] * 3 + [True] * 9)
    with monkeypatch.context() as patched:
        patched.setattr(run, "StopSignal", lambda: type("Stop", (), {"__bool__": lambda self: next(stops)})())
        train_autoencoder.train(options)
    assert torch.load(halves / "checkpoint.pt", weights_only=True)["step"] == 3
    train_autoencoder.train(options)
    a, b = (train_autoencoder.load_autoencoder(folder / "weights.pt").state_dict() for folder in (whole, halves))
    assert all(torch.equal(a[name], b[name]) for name in a)
    assert (whole / "sample.png").exists()
    assert (whole / "curves.png").exists()
