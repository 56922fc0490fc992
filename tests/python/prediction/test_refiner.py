"""The network without codes: what it is given, that it begins with what it changes, and that it learns."""

import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")

import maquette
import numpy as np
import torch

from export.clips.clip import write_clip
from export.clips.shapes import shapes_clip
from export.prediction.data import Clips
from export.prediction.motion_images import HORIZONS, is_known
from export.prediction.refiner import auto_predictions, train_convolutional
from export.prediction.refiner.convolutional import ConvolutionalNet, ConvolutionalShape
from export.training import seed_step

BUILT = pytest.mark.skipif(
    not maquette.library_path().exists(), reason=f"{maquette.library_path()} is not built: run `make build`"
)


def moving_square(count=2, frames=16):
    film = torch.full((count, frames, 64, 64, 3), 60, dtype=torch.uint8)
    for t in range(frames):
        film[:, t, 16:32, 2 * t : 2 * t + 16] = 220
    return Clips(film, torch.full((count,), 10.0), [f"moving/{k}" for k in range(count)])


def learnt(training, clips, pictures, steps):
    """Figures before and after so many steps on these clips."""

    def figures():
        return train_convolutional.figures_of(training.net.eval(), clips, pictures, 8)

    before = figures()
    training.net.train()
    for step in range(steps):
        seed_step(0, step)
        training.advance(clips, pictures, 4, 3e-3)
    return before, figures()


def test_a_new_convolutional_network_repeats_the_last_frame_and_then_learns():
    clips = moving_square()
    torch.manual_seed(0)
    shape = ConvolutionalShape(widths=(8, 16, 32), blocks=2)
    training = train_convolutional.Training(shape)
    before, after = learnt(training, clips, None, 60)
    assert before["network 4"] == pytest.approx(before["base 4"], abs=1e-3)
    assert after["network 8"] > after["base 8"] + 1
    assert ConvolutionalNet(shape).predicted(clips.frames[:1, :3], torch.zeros(1, 2)).shape == (1, 64, 64, 3)


def test_a_refiner_begins_with_half_of_the_prediction_and_learns_where_it_is_wrong():
    clips = moving_square()
    pictures = torch.full((2, 16, len(train_convolutional.HORIZONS), 64, 64, 3), 140, dtype=torch.uint8)
    torch.manual_seed(0)
    training = train_convolutional.Training(ConvolutionalShape(widths=(8, 16, 32), blocks=2, motion=True))
    with torch.no_grad():
        shown = torch.cat([clips.frames[:1, :3], pictures[:1, 5, :1]], 1)
        first = training.net.predicted(shown, torch.zeros(1, 2))
    half = 0.5 * (clips.frames[:1, 2].float() + 140)
    torch.testing.assert_close(first, half, atol=0.01, rtol=0)
    before, after = learnt(training, clips, pictures, 120)
    assert after["network 1"] > before["network 1"] + 5


@BUILT
@pytest.mark.parametrize("large", [True, False])
def test_predictions_of_a_clip_are_of_its_large_frames_if_it_has_some(tmp_path, large):
    clip = shapes_clip("train", 0, large)
    source, path = tmp_path / "clips/shapes/train/clip-00000.npz", tmp_path / "out/shapes/train/clip-00000.npz"
    for folder in (source.parent, path.parent):
        folder.mkdir(parents=True)
    write_clip(clip, source)
    auto_predictions.write_predictions((source, path))
    known = auto_predictions.read_predictions([tmp_path / "out"], ["shapes"], "train")
    frames, pictures = known.clips.frames[0].numpy(), known.pictures[0].numpy()
    assert known.clips.names == ["shapes/clip-00000"]
    assert known.clips.fps.tolist() == [clip.fps]
    assert pictures.shape == (30, len(HORIZONS), 64, 64, 3)
    assert np.array_equal(frames, clip.small.rgb) != large
    with maquette.Predictor(method="auto", threads=1) as predictor:
        for t, frame in enumerate((clip.large or clip.small).rgb[:9]):
            predictor.push(maquette.Frame(np.ascontiguousarray(frame), timestamp_ns=round(t * 1e9 / clip.fps)))
        coming = predictor.predict(HORIZONS[2] / clip.fps).pixels()
    np.testing.assert_array_equal(pictures[8, 2], auto_predictions.squeezed(coming))
    for t in range(30):
        for h, horizon in enumerate(HORIZONS):
            assert pictures[t, h].any() == is_known(t, horizon, 30)


def test_a_training_on_predictions_is_a_command_that_goes_on_from_weights(tmp_path, monkeypatch):
    clips = moving_square()
    for split in ("train", "val"):
        folder = tmp_path / "auto/shapes" / split
        folder.mkdir(parents=True)
        pictures = np.full((16, len(HORIZONS), 64, 64, 3), 140, np.uint8)
        np.savez(folder / "clip-00000.npz", frames=clips.frames[0].numpy(), predictions=pictures, fps=10.0)

    def trained(out, *more):
        words = ["train", "--predictions", str(tmp_path / "auto"), "--sets", "shapes", "--out", str(tmp_path / out),
                 "--steps", "2", "--batch", "2", "--validate-frames", "2", "--device", "cpu", *more]  # fmt: skip
        monkeypatch.setattr("sys.argv", words)
        train_convolutional.main()
        return train_convolutional.load_convolutional(tmp_path / out / "weights.pt")

    first = trained("first")
    assert first.shape == ConvolutionalShape(motion=True)
    again = trained("again", "--init", str(tmp_path / "first/weights.pt"), "--rate", "0")
    for name, own in again.state_dict().items():
        assert torch.equal(own, first.state_dict()[name]), name


def test_missing_predictions_are_named(tmp_path):
    with pytest.raises(SystemExit, match=r"auto_predictions --split val --sets shapes"):
        auto_predictions.read_predictions([tmp_path], ["shapes"], "val")


def test_a_refiner_that_begins_with_another_network_has_half_of_its_image():
    clips = moving_square()
    torch.manual_seed(0)
    alone = ConvolutionalNet(ConvolutionalShape(widths=(8, 16, 32), blocks=2))
    for parameter in alone.out[-1].parameters():
        torch.nn.init.normal_(parameter, std=0.1)
    refiner = ConvolutionalNet(ConvolutionalShape(widths=(8, 16, 32), blocks=2, motion=True))
    refiner.begin_with(alone)
    predicted_image = torch.full((1, 1, 64, 64, 3), 140, dtype=torch.uint8)
    frames, times = clips.frames[:1, 3:6], torch.tensor([[0.3, 0.4]])
    with torch.no_grad():
        own = alone.predicted(frames, times)
        mixed = refiner.predicted(torch.cat([frames, predicted_image], 1), times)
    assert (own - frames[:, -1]).abs().max() > 5
    torch.testing.assert_close(mixed, 0.5 * (own + 140), atol=0.01, rtol=1e-5)
