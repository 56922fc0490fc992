"""Codes of what motion predicts: made by the SDK, at the right frames, and seen by the transformer as a frame more."""

import shutil

import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")

import cv2
import numpy as np
import torch

from export.clips.clip import clip_paths, read_rgb, write_clip
from export.clips.shapes import shapes_clip
from export.jobs import Workers
from export.prediction import pack
from export.prediction.autoencoder import Autoencoder
from export.prediction.codes import coded_clips, read_codes, write_codes
from export.prediction.config import AutoencoderShape, TransformerShape
from export.prediction.data import Clips, read_clips
from export.prediction.motion_images import HORIZONS, MotionJob, is_known, motion_pictures
from export.prediction.train_transformer import disturbed, examples, halves
from export.prediction.transformer import UNSEEN, LatentTransformer

SMALL = AutoencoderShape(widths=(8, 16), residual=8, blocks=1, slices=2, entries=16)
SHAPE = TransformerShape(
    width=16, layers=1, heads=2, head_width=8, hidden=32, embedding=8, slices=2, entries=16, motion=True
)


def square_that_moves(frames=16, step=2):
    """A bright patch on a dark ground, both with soft patterns, `step` pixels to the right a frame."""
    rng = np.random.default_rng(0)
    ground, patch = (
        cv2.resize(rng.integers(*levels, (6, 6, 3)).astype(np.uint8), (64, 64), interpolation=cv2.INTER_CUBIC)
        for levels in ((40, 100), (150, 250))
    )
    film = np.repeat(ground[None], frames, 0)
    for t in range(frames):
        film[t, 16:44, 4 + step * t : 32 + step * t] = patch[:28, :28]
    return film


@pytest.fixture(scope="module")
def clips():
    film = square_that_moves()
    return Clips(torch.from_numpy(np.stack([film, film[::-1].copy()])), torch.tensor([15.0, 15.0]), ["a/0", "a/1"])


@pytest.fixture(scope="module")
def coded(clips):
    torch.manual_seed(0)
    return coded_clips(Autoencoder(SMALL).eval(), clips, mirrored=True, workers=Workers(processes=0))


def test_motion_predicts_a_square_that_moves():
    film = square_that_moves()
    pictures = motion_pictures(MotionJob(0, film, 15.0)).astype(float)
    for h, horizon in enumerate(HORIZONS[:3]):
        t = 6
        moved = np.abs(pictures[t, h] - film[t + horizon]).mean()
        stood = np.abs(film[t].astype(float) - film[t + horizon]).mean()
        assert moved < 0.5 * stood
    assert not pictures[0].any()
    assert not is_known(14, 2, 16)
    assert is_known(13, 2, 16)


def test_codes_are_those_of_the_frames_their_mirror_images_and_what_motion_predicts(clips, coded):
    torch.manual_seed(0)  # the network of `coded`
    net = Autoencoder(SMALL).eval()
    assert coded.names == ["a/0", "a/0 mirrored", "a/1", "a/1 mirrored"]
    assert torch.equal(coded.codes[2].long(), net.encode(clips.frames[1]))
    assert torch.equal(coded.codes[1].long(), net.encode(clips.frames[0].flip(2)))
    pictures = torch.from_numpy(motion_pictures(MotionJob(0, clips.frames[0].numpy(), 15.0)))
    assert torch.equal(coded.motion[0, 5, 1].long(), net.encode(pictures[5, 1:2])[0])
    assert (coded.motion[:, 0] == UNSEEN).all()
    assert (coded.motion[:, -1] == UNSEEN).all()
    assert (coded.motion[:, 1 : 16 - HORIZONS[0], 0] != UNSEEN).all()


def test_codes_are_read_as_they_were_written(coded, tmp_path):
    write_codes(coded, tmp_path / "codes-val.npz")
    again = read_codes(tmp_path, "val")
    assert torch.equal(again.codes, coded.codes)
    assert torch.equal(again.motion, coded.motion)


def test_an_example_has_the_image_that_motion_predicted_for_its_frame(coded):
    one = examples(coded, torch.tensor([0, 3]), torch.tensor([9, 1]), SHAPE)
    assert one.before.shape[1] == SHAPE.seen == 4
    assert torch.equal(one.before[0, 3], coded.motion[0, 8, 0].long())
    assert (one.before[1, 3] == UNSEEN).all(), "only one frame was seen"
    assert torch.equal(one.before[0, 2], coded.codes[0, 8].long())


def test_the_transformer_sees_it_and_the_table_does_not(coded):
    torch.manual_seed(1)
    net = LatentTransformer(SHAPE).eval()
    for parameter in net.parameters():
        if not parameter.any():
            torch.nn.init.normal_(parameter, std=0.3)
    net.table.normal_()
    one = examples(coded, torch.tensor([0]), torch.tensor([9]), SHAPE)
    changed = one.before.clone()
    changed[:, 3] = (changed[:, 3] + 5) % 16
    with torch.no_grad():
        assert (net(one.before, one.codes, one.fps) - net(changed, one.codes, one.fps)).abs().max() > 1e-3
    assert torch.equal(net.prior_logits(one.before), net.prior_logits(changed))


def test_a_clip_and_its_mirror_image_are_in_the_same_half():
    assert halves(["a", "a mirrored", "b", "b mirrored", "c"]).tolist() == [0, 0, 1, 1, 0]


def test_some_codes_are_disturbed_and_unseen_ones_stay_so(coded):
    torch.manual_seed(0)
    one = examples(coded, torch.zeros(64).long(), torch.full((64,), 2), SHAPE)
    changed = disturbed(one.before, SHAPE)
    assert (changed[:, 0] == UNSEEN).all()
    without = (changed[:, 3] == UNSEEN).flatten(1).all(1)
    assert 0 < without.sum() < 20
    differs = (changed[:, 1:3] != one.before[:, 1:3]).float().mean()
    assert 0.001 < differs < 0.05


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed, which packs are written with")
def test_an_opened_pack_gives_the_clips_and_photographs(tmp_path):
    made, opened = tmp_path / "made", tmp_path / "opened"
    for split in ("train", "val"):
        (made / "clips/shapes" / split).mkdir(parents=True)
        for k in (3, 7):
            write_clip(shapes_clip(split, k, large=False), made / "clips/shapes" / split / f"clip-{k:05d}.npz")
    (made / "backgrounds/train").mkdir(parents=True)
    (made / "backgrounds/train/wall.jpg").write_bytes(pack.jpeg(np.full((300, 400, 3), 90, np.uint8)))
    pack.make(tmp_path / "p.pack", made, ["shapes"], quality=10)
    pack.open_pack(tmp_path / "p.pack", opened)
    for split in ("train", "val"):
        pairs = zip(
            clip_paths(made / "clips", "shapes", split), clip_paths(opened / "clips", "shapes", split), strict=True
        )
        for before, after in pairs:
            assert before.name == after.name
            (rgb, fps), (again, fps_again) = read_rgb(before), read_rgb(after)
            assert fps == fps_again
            assert np.square(rgb.astype(float) - again).mean() < 12
    assert len(read_clips(opened / "clips", ["shapes"], "val")) == 2
    assert (opened / "backgrounds/train/wall.jpg").exists()
