"""Trains the transformer that gives all codes of a frame at once, any time ahead; goes on where it was stopped.

    python -m export.prediction.codes                            # first: codes of the clips
    python -m export.prediction.train_parallel --minutes 480 --autoencoder .data/runs/prediction-autoencoder/weights.pt

Writes checkpoint.pt, weights.pt, log.json and curves.png to --out. Figures are of held-out clips: `bits H` a code, H
frames ahead, with nothing known of the frame; with --autoencoder also `dB H`, PSNR of the
expected picture against what the true codes give, and `last H`, that of the last frame's codes.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import torch
from torch import Tensor
from torch.nn import functional as F

from export.prediction import run
from export.prediction.autoencoder import Autoencoder
from export.prediction.codes import CodedClips, read_codes
from export.prediction.config import TRANSFORMERS, TransformerShape
from export.prediction.motion_pictures import HORIZONS
from export.prediction.parallel import ParallelTransformer, times_ahead
from export.prediction.pictures.picture_error import psnr_db
from export.prediction.train_autoencoder import load_autoencoder
from export.prediction.train_transformer import Examples, disturbed, examples, shape_for

_ALL_MASKED = 0.5  # of the examples; of the others a fraction at random
_BATCH = 16  # held-out frames at once


class Training(run.Training):
    def __init__(self, shape: TransformerShape, bf16: bool = False, device: str = "cpu") -> None:
        net = ParallelTransformer(shape).train().to(device)
        super().__init__(net, torch.optim.AdamW(net.parameters(), betas=(0.9, 0.95), weight_decay=0.01), bf16)

    def advance(self, clips: CodedClips, count: int, rate: float) -> dict[str, Tensor]:
        """One step on `count` frames at random, at that learning rate."""
        batch, times = drawn(clips, count, self.net.shape)
        device = self.device
        share = torch.rand(count, 1, 1, device=device)
        share = torch.where(torch.rand(count, 1, 1, device=device) < _ALL_MASKED, 0, share)
        known = torch.rand(count, *batch.codes.shape[-2:], device=device) < share
        with self.autocast():
            logits = self.net(disturbed(batch.before, self.net.shape), batch.codes, known, times)
        nats = F.cross_entropy(logits.flatten(0, 2), batch.codes.flatten(), reduction="none")
        masked = (~known).flatten(1)[:, None].expand(-1, batch.codes.shape[1], -1).flatten()
        loss = (nats * masked).sum() / masked.sum()
        self.descend(loss, rate, largest_gradient=1.0)
        return {"bits": loss.detach() / math.log(2)}


def drawn(clips: CodedClips, count: int, shape: TransformerShape) -> tuple[Examples, Tensor]:
    """Frames at random, some time after the last one seen, and what the network is told of the times."""
    device = clips.codes.device
    horizon = torch.randint(len(HORIZONS), (count,), device=device)
    ahead = torch.tensor(HORIZONS, device=device)[horizon]
    clip = torch.randint(len(clips), (count,), device=device)
    t = ahead + (torch.rand(count, device=device) * (clips.codes.shape[1] - ahead)).long()
    batch = examples(clips, clip, t, shape, horizon)
    return batch, times_ahead(batch.fps, ahead.float())


def expected_picture(net: ParallelTransformer, autoencoder: Autoencoder, before: Tensor, times: Tensor) -> Tensor:
    """The decoder's picture of the expected entries of the codebooks: float32 [B, 64, 64, 3], 0..255."""
    entries = autoencoder.codebook.entries
    mean = torch.cat([chances @ own for chances, own in zip(net.expected(before, times), entries, strict=True)], -1)
    side = before.shape[-1]
    made = autoencoder.decoder(mean.transpose(1, 2).unflatten(2, (side, side)))
    return ((made.float() + 1) * 127.5).permute(0, 2, 3, 1)


@torch.no_grad()
def figures_of(
    net: ParallelTransformer, clips: CodedClips, frames: int, autoencoder: Autoencoder | None
) -> dict[str, float]:
    """Of held-out clips, `frames` of them for each time ahead, spread evenly over clips and times."""
    figures: dict[str, float] = {}
    device = clips.codes.device
    for h, ahead in enumerate(HORIZONS):
        times = clips.codes.shape[1] - ahead - net.shape.frames
        chosen = torch.linspace(0, len(clips) * times - 1, min(frames, len(clips) * times), device=device).long()
        bits, decibels, by_last = [], [], []
        for some in chosen.split(_BATCH):
            clip, t = some // times, net.shape.frames + ahead + some % times
            horizon = torch.full_like(clip, h)
            one = examples(clips, clip, t, net.shape, horizon)
            told = times_ahead(one.fps, torch.full_like(one.fps, ahead))
            nothing = torch.zeros_like(one.codes[:, 0], dtype=torch.bool)
            logits = net(one.before, one.codes, nothing, told)
            bits.append(F.cross_entropy(logits.flatten(0, 2), one.codes.flatten()) * len(some) / math.log(2))
            if autoencoder is not None:
                truth, last = autoencoder.decode(one.codes), autoencoder.decode(one.before[:, net.shape.frames - 1])
                decibels.append(psnr_db(expected_picture(net, autoencoder, one.before, told), truth))
                by_last.append(psnr_db(last, truth))
        figures[f"bits {ahead}"] = float(torch.stack(bits).sum()) / len(chosen)
        if autoencoder is not None:
            figures[f"dB {ahead}"], figures[f"last {ahead}"] = (
                float(torch.cat(own).mean()) for own in (decibels, by_last)
            )
    return figures


def load_parallel(path: Path) -> ParallelTransformer:
    """Weights as `train_parallel` writes them."""
    stored = torch.load(path, weights_only=True)
    net = ParallelTransformer(TransformerShape(**stored["shape"]))
    net.load_state_dict(stored["net"])
    return net.eval()


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--codes", type=Path, default=Path(".data/prediction"), help="folder of codes-*.npz")
    parser.add_argument("--out", type=Path, default=Path(".data/runs/prediction-parallel"))
    parser.add_argument("--size", choices=TRANSFORMERS, default="light")
    parser.add_argument("--autoencoder", type=Path, help="its weights, for figures of pictures")
    parser.add_argument("--no-motion", action="store_true", help="without the picture that motion predicts, to compare")
    parser.add_argument("--validate-frames", type=int, default=64, help="a time ahead (default %(default)s)")
    run.add_arguments(parser, minutes=480, batch=8, rate=5e-4)
    return parser.parse_args()


def train(arguments: argparse.Namespace) -> None:
    """Runs or resumes a training."""
    run.begin(arguments)
    device = torch.device(arguments.device)
    clips, held_out = (read_codes(arguments.codes, split).on(device) for split in ("train", "val"))
    training = Training(shape_for(clips, arguments.size, not arguments.no_motion), arguments.bf16, arguments.device)
    autoencoder = load_autoencoder(arguments.autoencoder).to(device) if arguments.autoencoder else None
    run.run(
        training, arguments, lambda rate: training.advance(clips, arguments.batch, rate),
        lambda: figures_of(training.net, held_out, arguments.validate_frames, autoencoder), "held out: bits a code, dB",
    )  # fmt: skip


def main() -> None:
    train(parsed())


if __name__ == "__main__":
    main()
