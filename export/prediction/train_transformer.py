"""Trains the transformer on the codes of clips; goes on where it was stopped.

    python -m export.prediction.codes                            # first: codes of the clips
    python -m export.prediction.train_transformer --minutes 480

Writes checkpoint.pt, weights.pt, log.json and curves.png to --out, and with --autoencoder sample.png: rows of the last
frame seen, the next by its true codes, the likeliest, and two drawn. Metrics are bits a code on held-out clips:
`transformer`, beside `table` (the code that the cell had before) and `frequency`, on the same frames.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import torch
from torch import Tensor
from torch.nn import functional as F

from export.prediction import run
from export.prediction.autoencoder import Autoencoder
from export.prediction.codes import CodedClips, read_codes
from export.prediction.config import TRANSFORMERS, TransformerShape
from export.prediction.sampling import drawn_codes
from export.prediction.table import CodeTable, bits_by_frequency, bits_by_table
from export.prediction.train_autoencoder import load_autoencoder
from export.prediction.transformer import UNSEEN, LatentTransformer

_NO_MOTION = 0.1  # of the examples are without the image that motion predicts
_DISTURBED = 0.5  # of the examples have some codes before replaced, at most this fraction of them
_REPLACED = 0.05


@dataclass(frozen=True, eq=False)
class Examples:
    """before int64 [B, seen, slices, 16, 16]; codes int64 [B, slices, 16, 16]; fps [B]."""

    before: Tensor
    codes: Tensor
    fps: Tensor


def examples(clips: CodedClips, clip: Tensor, t: Tensor, shape: TransformerShape) -> Examples:
    """Frames number t [B] of clips number `clip` [B], with the frames before them; UNSEEN before a clip's first."""
    now = t - 1
    at = now[:, None] + torch.arange(1 - shape.frames, 1, device=t.device)
    before = torch.where((at < 0)[..., None, None, None], UNSEEN, clips.codes[clip[:, None], at.clamp(min=0)].long())
    if shape.motion:
        by_motion = torch.full_like(before[:, :1], UNSEEN)
        if clips.motion is not None:
            known = (now >= 0)[:, None, None, None]
            by_motion[:, 0] = torch.where(known, clips.motion[clip, now.clamp(min=0), 0].long(), UNSEEN)
        before = torch.cat([before, by_motion], 1)
    return Examples(before, clips.codes[clip, t].long(), clips.fps[clip])


def disturbed(before: Tensor, shape: TransformerShape) -> Tensor:
    """The same with some codes replaced by others, as a prediction from predictions has them, or without motion's."""
    device, count = before.device, len(before)
    share = _REPLACED * torch.rand(count, 1, 1, 1, 1, device=device)
    share = share * (torch.rand(count, 1, 1, 1, 1, device=device) < _DISTURBED)
    replaced = (torch.rand(before.shape, device=device) < share) & (before != UNSEEN)
    before = torch.where(replaced, torch.randint_like(before, shape.entries), before)
    if shape.motion:
        without = torch.rand(count, device=device) < _NO_MOTION
        before[without, -1] = UNSEEN
    return before


def halves(names: Sequence[str]) -> Tensor:
    """0 or 1 for each clip, the same for a clip and its mirror image: int64 [N]."""
    numbers: dict[str, int] = {}
    plain = [name.removesuffix(" mirrored") for name in names]
    return torch.tensor([numbers.setdefault(name, len(numbers)) % 2 for name in plain])


class Training(run.Training):
    """With the tables of codes of the clips that it trains on."""

    def __init__(
        self,
        shape: TransformerShape,
        clips: CodedClips,
        use_table: bool = True,
        bf16: bool = False,
        device: str = "cpu",
    ) -> None:
        net = LatentTransformer(shape).train().to(device)
        super().__init__(net, torch.optim.AdamW(net.parameters(), betas=(0.9, 0.95), weight_decay=0.01), bf16)
        # A clip gets the table counted on the other half of the clips: a table is better on clips that it was counted
        # on than on new ones, and the network would learn to trust it too much.
        self.half = halves(clips.names).to(device)
        self.tables: Tensor | None = None
        if use_table:
            net.table.copy_(CodeTable.counted(clips.codes, shape.entries).stacked())
            others = [clips.codes[self.half != half] for half in (0, 1)] if len(set(clips.names)) > 1 else []
            tables = [CodeTable.counted(own, shape.entries).stacked() for own in others if len(own)]
            self.tables = torch.stack(tables) if len(tables) == 2 else net.table[None].expand(2, -1, -1, -1)

    def loss(self, batch: Examples, half: Tensor) -> Tensor:
        """Nats a code; half [B]: of each example's clip."""
        with self.autocast():
            logits = self.net(batch.before, batch.codes, batch.fps, self.tables, half)
        return F.cross_entropy(logits.flatten(0, 2), batch.codes.flatten())

    def advance(self, clips: CodedClips, count: int, rate: float) -> dict[str, Tensor]:
        """One step on `count` frames at random, at that learning rate."""
        device = self.device
        clip = torch.randint(len(clips), (count,), device=device)
        batch = examples(clips, clip, torch.randint(1, clips.codes.shape[1], (count,), device=device), self.net.shape)
        seen = Examples(disturbed(batch.before, self.net.shape), batch.codes, batch.fps)
        loss = self.loss(seen, self.half[clip])
        self.descend(loss, rate, largest_gradient=1.0)
        return {"bits": loss.detach() / math.log(2)}


def held_out_frames(clips: CodedClips, count: int) -> tuple[Tensor, Tensor]:
    """Numbers of clips and of frames, spread evenly over all that have three before them."""
    times = clips.codes.shape[1] - 3
    chosen = torch.linspace(0, len(clips) * times - 1, min(count, len(clips) * times)).long().to(clips.codes.device)
    return chosen // times, 3 + chosen % times


@torch.no_grad()
def transformer_bits(net: LatentTransformer, clips: CodedClips, clip: Tensor, t: Tensor, batch: int = 8) -> Tensor:
    """A code, of each of these frames given those before: float32 [B]."""
    out = []
    for which, when in zip(clip.split(batch), t.split(batch), strict=True):
        one = examples(clips, which, when, net.shape)
        logits = net(one.before, one.codes, one.fps).flatten(0, 2)
        bits = F.cross_entropy(logits, one.codes.flatten(), reduction="none") / math.log(2)
        out.append(bits.view(len(which), -1).mean(1))
    return torch.cat(out)


def bits_of(net: LatentTransformer, table: CodeTable, clips: CodedClips, count: int) -> dict[str, float]:
    """A code, on the same frames of held-out clips."""
    clip, t = held_out_frames(clips, count)
    return {
        "transformer": float(transformer_bits(net, clips, clip, t).mean()),
        "table": float(bits_by_table(table, clips.codes)[clip, t - 1].mean()),
        "frequency": float(bits_by_frequency(table, clips.codes)[clip, t - 1].mean()),
    }


@torch.no_grad()
def sample_image(net: LatentTransformer, autoencoder: Autoencoder, clips: CodedClips, count: int = 3) -> Tensor:
    """Rows of five frames of 64 x 64: last seen (decoded), next by its true codes, likeliest, and two drawn at
    temperature 1; uint8 [count * 64, 5 * 64, 3]."""
    net.eval()
    clip, t = held_out_frames(clips, count)
    one = examples(clips, clip, t, net.shape)
    generator = torch.Generator(clips.codes.device).manual_seed(0)
    rows = [one.before[:, net.shape.frames - 1], one.codes]
    rows += [drawn_codes(net, one.before, one.fps, temperature, generator) for temperature in (0.0, 1.0, 1.0)]
    pictures = [autoencoder.decode(codes).clamp(0, 255).round().to(torch.uint8) for codes in rows]
    return torch.cat([torch.cat(list(column), 0) for column in pictures], 1)


def load_transformer(path: Path) -> LatentTransformer:
    """Weights as `train_transformer` writes them."""
    stored = torch.load(path, weights_only=True)
    net = LatentTransformer(TransformerShape(**stored["shape"]))
    net.load_state_dict(stored["net"])
    return net.eval()


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--codes", type=Path, default=Path(".data/prediction"), help="folder of codes-*.npz")
    parser.add_argument("--out", type=Path, default=Path(".data/runs/prediction-transformer"))
    parser.add_argument("--size", choices=TRANSFORMERS, default="light")
    parser.add_argument(
        "--autoencoder", type=Path, help="its weights: draws sample.png at the end (256 passes a frame)"
    )
    parser.add_argument("--no-table", action="store_true", help="start from even probabilities, to compare")
    parser.add_argument("--no-motion", action="store_true", help="without the image that motion predicts, to compare")
    parser.add_argument("--validate-frames", type=int, default=128, help="held-out frames (default %(default)s)")
    run.add_arguments(parser, minutes=480, batch=8, rate=5e-4)
    return parser.parse_args()


def shape_for(clips: CodedClips, size: str, motion: bool) -> TransformerShape:
    """The shape of that size that these codes fit into."""
    shape = TRANSFORMERS[size]
    slices, entries = clips.codes.shape[2], max(shape.entries, int(clips.codes.max()) + 1)
    seen = motion and shape.motion and clips.motion is not None
    return TransformerShape(**(asdict(shape) | {"slices": slices, "entries": entries, "motion": seen}))


def train(arguments: argparse.Namespace) -> None:
    """Runs or resumes a training."""
    run.begin(arguments)
    device = torch.device(arguments.device)
    clips, held_out = (read_codes(arguments.codes, split).on(device) for split in ("train", "val"))
    shape = shape_for(clips, arguments.size, not arguments.no_motion)
    training = Training(shape, clips, not arguments.no_table, arguments.bf16, arguments.device)
    count = sum(p.numel() for p in training.net.parameters())
    print(f"{len(clips)} clips to train on, {len(held_out)} held out, {count / 1e6:.1f} M parameters", flush=True)
    table = CodeTable.counted(clips.codes, shape.entries)
    run.run(
        training, arguments, lambda rate: training.advance(clips, arguments.batch, rate),
        lambda: bits_of(training.net, table, held_out, arguments.validate_frames), "bits a code, held out",
    )  # fmt: skip
    if arguments.autoencoder:
        picture = sample_image(training.net, load_autoencoder(arguments.autoencoder).to(device), held_out)
        cv2.imwrite(str(arguments.out / "sample.png"), picture.cpu().numpy()[..., ::-1])


def main() -> None:
    train(parsed())


if __name__ == "__main__":
    main()
