"""Makes a transformer with fewer layers of a trained one: leaves out those that cost the fewest bits, then teaches what
is left to say what the whole one says. Goes on where it was stopped.

    python -m export.prediction.shorten_transformer --minutes 40          # keeps 3 layers of context, 1 of slices
    python -m export.prediction.shorten_transformer --minutes 40 --context 0 2 5 --slices 4

Writes what train_transformer writes, to --out. Without --context and --slices it says which layers it keeps: greedily,
by bits of frames of the training clips.
"""

from __future__ import annotations

import argparse
import copy
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export.prediction import run
from export.prediction.codes import CodedClips, read_codes
from export.prediction.config import TransformerShape
from export.prediction.table import CodeTable
from export.prediction.train_transformer import (
    Examples,
    bits_of,
    disturbed,
    examples,
    held_out_frames,
    load_transformer,
    transformer_bits,
)
from export.prediction.transformer import LatentTransformer, times_of

_TRUTH, _FEATURES = 0.3, 0.1  # weights of the true codes, and of features like the teacher's, in the loss


@dataclass(frozen=True)
class Kept:
    """Numbers of the layers that stay, of the context and of the slice network."""

    context: tuple[int, ...]
    slices: tuple[int, ...]

    def without(self, network: str, layer: int) -> Kept:
        layers = {"context": self.context, "slices": self.slices}
        layers[network] = tuple(own for own in layers[network] if own != layer)
        return Kept(**layers)


def shortened(whole: LatentTransformer, kept: Kept) -> LatentTransformer:
    """A copy with these layers of it."""
    sizes = {"layers": len(kept.context), "slice_layers": len(kept.slices)}
    net = LatentTransformer(TransformerShape(**(asdict(whole.shape) | sizes)))
    left = copy.deepcopy(whole)
    for part, layers in ((left.context, kept.context), (left.slices, kept.slices)):
        part.layers = nn.Sequential(*(part.layers[k] for k in layers))
    net.load_state_dict(left.state_dict())
    return net.to(whole.table.device)


def cheapest(whole: LatentTransformer, clips: CodedClips, count: tuple[int, int], frames: int) -> Kept:
    """Which layers to keep, so many of the context and of the slice network: again and again the one goes without which
    `frames` of the clips cost the fewest bits."""
    clip, t = held_out_frames(clips, frames)

    def bits(kept: Kept) -> float:
        return float(transformer_bits(shortened(whole, kept).eval(), clips, clip, t).mean())

    kept = Kept(tuple(range(whole.shape.layers)), tuple(range(whole.shape.layers_of_slices)))
    while (len(kept.context), len(kept.slices)) != count:
        networks = [("context", kept.context, count[0]), ("slices", kept.slices, count[1])]
        fewer = [kept.without(name, k) for name, layers, wanted in networks if len(layers) > wanted for k in layers]
        kept = min(fewer, key=bits)
        print(f"context {kept.context}, slices {kept.slices}: {bits(kept):.3f} bits", flush=True)
    return kept


class Shortening(run.Training):
    """Teaches a network with layers of `whole` what that says, for codes that are disturbed as in its own training."""

    def __init__(self, whole: LatentTransformer, kept: Kept, bf16: bool = False) -> None:
        net = shortened(whole, kept).train()
        super().__init__(net, torch.optim.AdamW(net.parameters(), betas=(0.9, 0.95), weight_decay=0.01), bf16)
        self.whole = whole.eval()

    def loss(self, batch: Examples) -> tuple[Tensor, Tensor]:
        """The loss, and the divergence in bits from the predictions of the whole transformer."""
        prior = self.whole.prior_logits(batch.before)
        found = []
        for net in (self.whole, self.net):
            with self.autocast(), torch.set_grad_enabled(net is self.net):
                context = net.context(batch.before, times_of(batch.fps))
                features = net.slices(context, batch.codes)
                logits = net.heads(features, batch.codes.flatten(2)).float() + prior
            found.append(([context.float(), features.float()], logits.log_softmax(-1)))
        (taught, expected), (seen, likely) = found
        apart = (expected.exp() * (expected - likely)).sum(-1).mean()
        true = F.nll_loss(likely.flatten(0, 2), batch.codes.flatten())
        like = sum(F.mse_loss(own, other) / other.var() for own, other in zip(seen, taught, strict=True))
        return (1 - _TRUTH) * apart + _TRUTH * true + _FEATURES * like, apart.detach() / math.log(2)

    def advance(self, clips: CodedClips, count: int, rate: float) -> dict[str, Tensor]:
        """One step on `count` frames at random, at that learning rate."""
        device = self.device
        clip = torch.randint(len(clips), (count,), device=device)
        batch = examples(clips, clip, torch.randint(1, clips.codes.shape[1], (count,), device=device), self.net.shape)
        loss, apart = self.loss(Examples(disturbed(batch.before, self.net.shape), batch.codes, batch.fps))
        self.descend(loss, rate, largest_gradient=1.0)
        return {"bits_from_whole": apart}


def parsed(words: Sequence[str] | None = None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--whole", type=Path, default=Path(".data/runs/prediction-transformer/weights.pt"))
    parser.add_argument("--codes", type=Path, default=Path(".data/prediction"), help="folder of codes-*.npz")
    parser.add_argument("--out", type=Path, default=Path(".data/runs/prediction-short"))
    parser.add_argument("--left", type=int, nargs=2, default=(3, 1), help="layers of context and slices to keep")
    parser.add_argument("--context", type=int, nargs="+", help="numbers of those of the context network")
    parser.add_argument("--slices", type=int, nargs="+", help="numbers of those of the slice network")
    parser.add_argument("--search-frames", type=int, default=24, help="to find which may go (default %(default)s)")
    parser.add_argument("--validate-frames", type=int, default=96, help="held-out frames (default %(default)s)")
    run.add_arguments(parser, minutes=40, batch=8, rate=4e-4, warm_up=20)
    return parser.parse_args(words)


def train(arguments: argparse.Namespace) -> None:
    """Runs or resumes."""
    run.begin(arguments)
    device = torch.device(arguments.device)
    clips, held_out = (read_codes(arguments.codes, split).on(device) for split in ("train", "val"))
    whole = load_transformer(arguments.whole).float().to(device)
    if arguments.context and arguments.slices:
        kept = Kept(tuple(arguments.context), tuple(arguments.slices))
    else:
        kept = cheapest(whole, clips, tuple(arguments.left), arguments.search_frames)
    training = Shortening(whole, kept, arguments.bf16)
    print(f"{sum(p.numel() for p in training.net.parameters()) / 1e6:.2f} M parameters", flush=True)
    table = CodeTable.counted(clips.codes, whole.shape.entries)
    run.run(
        training, arguments, lambda rate: training.advance(clips, arguments.batch, rate),
        lambda: bits_of(training.net, table, held_out, arguments.validate_frames), "bits a code, held out",
    )  # fmt: skip


if __name__ == "__main__":
    train(parsed())
