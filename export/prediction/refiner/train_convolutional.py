"""Trains the convolutional network that predicts frames without codes; goes on where it was stopped.

    python -m export.prediction.refiner.train_convolutional --sets pushing shapes --minutes 120
    python -m export.prediction.refiner.auto_predictions    # first, for the one that refines the SDK's predictions:
    python -m export.prediction.refiner.train_convolutional --predictions .data/prediction/auto \\
        --sets pushing collages --out .data/runs/prediction-refiner

Writes checkpoint.pt, weights.pt, log.json and curves.png to --out. Metrics are PSNR of held-out clips, dB, by frames
ahead: `network H`, beside the image that it changes (the last frame, or the prediction), `base H`.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import torch
from torch import Tensor

from export.prediction import run
from export.prediction.data import Clips, read_clips
from export.prediction.motion_images import HORIZONS
from export.prediction.refiner.auto_predictions import read_predictions
from export.prediction.refiner.convolutional import ConvolutionalNet, ConvolutionalShape, times_ahead
from export.prediction.refiner.image_error import psnr_db

_BATCH = 64  # held-out frames at once
_GAIN, _OFFSET = 0.15, 8.0  # standard deviations: natural logarithm, and grey levels
_NOISE = 1.0  # squared grey levels: errors below this count little


class Training(run.Training):
    def __init__(self, shape: ConvolutionalShape, bf16: bool = False, device: str = "cpu") -> None:
        net = ConvolutionalNet(shape).train().to(device, memory_format=torch.channels_last)  # faster by a third
        super().__init__(net, torch.optim.AdamW(net.parameters(), betas=(0.9, 0.99), weight_decay=0.01), bf16)

    def advance(self, clips: Clips, predictions: Tensor | None, count: int, rate: float) -> dict[str, Tensor]:
        """One step on `count` frames at random, at that learning rate. predictions uint8 [N, T, horizons, 64, 64, 3]:
        they are changed, instead of the last frame, where the network sees them.

        The loss is the squared error by that of the image that is changed: hard clips and far times would have nearly
        all of a plain one.
        """
        device, total = self.device, clips.frames.shape[1]
        horizon = torch.randint(len(HORIZONS), (count,), device=device)
        ahead = torch.randint(1, HORIZONS[-1] + 1, (count,), device=device)
        if predictions is not None:
            ahead = torch.tensor(HORIZONS, device=device)[horizon]
        clip = torch.randint(len(clips), (count,), device=device)
        now = 1 + (torch.rand(count, device=device) * (total - 1 - ahead)).long()
        before, truth = frames_of(clips, clip, now, self.net.shape.frames), clips.frames[clip, now + ahead]
        if predictions is not None:
            before = torch.cat([before, predictions[clip, now, horizon][:, None]], 1)
        before, truth = as_elsewhere(before, truth)
        with self.autocast():
            made = self.net.predicted(before, times_ahead(clips.fps[clip], ahead.float()))
        own, base = ((p - truth).square().mean((1, 2, 3)) for p in (made, before[:, -1]))
        loss = (own / (base + _NOISE)).mean()
        self.descend(loss, rate, largest_gradient=1.0)
        return {"picture": loss.detach()}


def as_elsewhere(before: Tensor, truth: Tensor) -> tuple[Tensor, Tensor]:
    """As another camera would show them: half of them mirrored, brighter or darker. uint8 [B, seen, 64, 64, 3] and
    [B, 64, 64, 3] -> the same as float32, 0..255."""
    pictures = torch.cat([before, truth[:, None]], 1).float()
    mirrored = torch.rand(len(pictures), 1, 1, 1, 1, device=pictures.device) < 0.5
    pictures = torch.where(mirrored, pictures.flip(3), pictures)
    gain, offset = torch.randn(2, len(pictures), 1, 1, 1, 1, device=pictures.device)
    pictures = (pictures * (_GAIN * gain).exp() + _OFFSET * offset).clamp(0, 255)
    return pictures[:, :-1], pictures[:, -1]


def frames_of(clips: Clips, clip: Tensor, now: Tensor, count: int) -> Tensor:
    """The frames seen when frame `now` [B] of clips number `clip` [B] has come, the first repeated where there are
    fewer: uint8 [B, count, 64, 64, 3]."""
    at = now[:, None] + torch.arange(1 - count, 1, device=now.device)
    return clips.frames[clip[:, None], at.clamp(min=0)]


@torch.no_grad()
def figures_of(net: ConvolutionalNet, clips: Clips, predictions: Tensor | None, frames: int) -> dict[str, float]:
    """PSNR on held-out clips: `frames` frames for each time ahead, spread evenly over clips and times."""
    figures: dict[str, float] = {}
    device, seen = clips.frames.device, net.shape.frames
    for h, ahead in enumerate(HORIZONS):
        times = clips.frames.shape[1] - ahead - seen
        chosen = torch.linspace(0, len(clips) * times - 1, min(frames, len(clips) * times), device=device).long()
        network, base = [], []
        for some in chosen.split(_BATCH):
            clip, now = some // times, seen + some % times
            before, truth = frames_of(clips, clip, now, seen), clips.frames[clip, now + ahead]
            told = times_ahead(clips.fps[clip], torch.full((len(some),), float(ahead), device=device))
            shown = before if predictions is None else torch.cat([before, predictions[clip, now, h][:, None]], 1)
            network.append(psnr_db(net.predicted(shown, told), truth))
            base.append(psnr_db(shown[:, -1], truth))
        figures[f"network {ahead}"] = float(torch.cat(network).mean())
        figures[f"base {ahead}"] = float(torch.cat(base).mean())
    return figures


def load_convolutional(path: Path) -> ConvolutionalNet:
    """Weights as `train_convolutional` writes them."""
    stored = torch.load(path, weights_only=True)
    net = ConvolutionalNet(ConvolutionalShape(**(stored["shape"] | {"widths": tuple(stored["shape"]["widths"])})))
    net.load_state_dict(stored["net"])
    return net.eval()


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--sets", nargs="+", default=["pushing", "shapes"], help="default %(default)s")
    parser.add_argument("--out", type=Path, default=Path(".data/runs/prediction-convolutional"))
    parser.add_argument(
        "--predictions", type=Path, nargs="+", help="what auto_predictions wrote, instead of --data: refines these"
    )
    parser.add_argument("--validate-sets", nargs="+", help="default: as --sets")
    parser.add_argument("--init", type=Path, help="weights to begin from, with or without the prediction")
    parser.add_argument("--validate-frames", type=int, default=256, help="a time ahead (default %(default)s)")
    run.add_arguments(parser, minutes=120, batch=16, rate=1e-3)
    return parser.parse_args()


def train(arguments: argparse.Namespace) -> None:
    """Runs or resumes a training."""
    run.begin(arguments)
    device = torch.device(arguments.device)
    held_out_sets = arguments.validate_sets or arguments.sets
    predictions = held_out_predictions = None
    if arguments.predictions:
        train, val = (
            read_predictions(arguments.predictions, sets, split).on(device)
            for sets, split in ((arguments.sets, "train"), (held_out_sets, "val"))
        )
        (clips, predictions), (held_out, held_out_predictions) = ((of.clips, of.pictures) for of in (train, val))
    else:
        clips = read_clips(arguments.data, arguments.sets, "train").on(device)
        held_out = read_clips(arguments.data, held_out_sets, "val").on(device)
    training = Training(ConvolutionalShape(motion=predictions is not None), arguments.bf16, arguments.device)
    if arguments.init:
        training.net.begin_with(load_convolutional(arguments.init))
    run.run(
        training, arguments, lambda rate: training.advance(clips, predictions, arguments.batch, rate),
        lambda: figures_of(training.net, held_out, held_out_predictions, arguments.validate_frames),
        "held out: PSNR, dB",
    )  # fmt: skip


def main() -> None:
    train(parsed())


if __name__ == "__main__":
    main()
