"""Trains the transformer on the codes of clips; goes on where it was stopped.

    python -m export.prediction.codes                            # first: codes of the clips
    python -m export.prediction.train_transformer --minutes 480

Writes checkpoint.pt, weights.pt, log.json and curves.png to --out, and with --autoencoder sample.png: rows of the last
frame seen, the next by its true codes, the likeliest, and two drawn. Figures are bits a code on held-out clips:
`transformer`, beside `table` (the code that the place had before) and `frequency`, on the same frames.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import torch
from torch import Tensor
from torch.nn import functional as F

from export.prediction.autoencoder import Autoencoder
from export.prediction.codes import CodedClips, read_codes
from export.prediction.config import TRANSFORMERS, TransformerShape
from export.prediction.sampling import drawn_codes
from export.prediction.table import CodeTable, bits_by_frequency, bits_by_table
from export.prediction.train_autoencoder import load_autoencoder
from export.prediction.transformer import UNSEEN, LatentTransformer
from export.training import (
    SAVE_EVERY_S,
    Interval,
    Schedule,
    SmoothedTerms,
    StopSignal,
    Stopwatch,
    rate_at,
    save_atomically,
    seed_step,
    write_log,
)


@dataclass(frozen=True, eq=False)
class Examples:
    """before int64 [B, frames, slices, 16, 16]; codes int64 [B, slices, 16, 16]; fps [B]; clip int64 [B]: number."""

    before: Tensor
    codes: Tensor
    fps: Tensor
    clip: Tensor


def examples(clips: CodedClips, clip: Tensor, t: Tensor, frames: int) -> Examples:
    """Frames number t [B] of clips number `clip` [B], with those before them; UNSEEN before a clip's first."""
    at = t[:, None] + torch.arange(-frames, 0)
    before = torch.where((at < 0)[..., None, None, None], UNSEEN, clips.codes[clip[:, None], at.clamp(min=0)])
    return Examples(before, clips.codes[clip, t], clips.fps[clip], clip)


class Training:
    """Everything of a run that its checkpoint holds, and the tables of codes of the clips that it trains on."""

    def __init__(self, shape: TransformerShape, clips: CodedClips, use_table: bool = True, bf16: bool = False) -> None:
        self.net, self.bf16 = LatentTransformer(shape).train(), bf16
        self.optimizer = torch.optim.AdamW(self.net.parameters(), betas=(0.9, 0.95), weight_decay=0.01)
        self.step, self.spent_s = 0, 0.0
        self.log: list[dict] = []
        # A clip gets the table counted on the other half of the clips: a table is better on clips that it was counted
        # on than on new ones, and the network would learn to trust it too much.
        self.fold_tables: list[Tensor] | None = None
        if use_table:
            self.net.table.copy_(CodeTable.counted(clips.codes, shape.entries).stacked())
            halves = (clips.codes[1::2], clips.codes[::2]) if len(clips) > 1 else (clips.codes, clips.codes)
            self.fold_tables = [CodeTable.counted(half, shape.entries).stacked() for half in halves]

    def state(self) -> dict:
        return {
            "shape": asdict(self.net.shape), "net": self.net.state_dict(), "optimizer": self.optimizer.state_dict(),
            "step": self.step, "spent_s": self.spent_s, "log": self.log,
        }  # fmt: skip

    def load(self, state: dict) -> None:
        self.net.load_state_dict(state["net"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.step, self.spent_s, self.log = state["step"], state["spent_s"], state["log"]

    def _loss(self, batch: Examples, table: Tensor | None) -> Tensor:
        with torch.autocast("cpu", torch.bfloat16, enabled=self.bf16):
            logits = self.net(batch.before, batch.codes, batch.fps, table)
        return F.cross_entropy(logits.flatten(0, 2), batch.codes.flatten(), reduction="sum")

    def advance(self, clips: CodedClips, count: int, rate: float) -> dict[str, Tensor]:
        """One step on `count` frames at random, at that learning rate."""
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        frames, slices = self.net.shape.frames, self.net.shape.slices
        clip, t = torch.randint(len(clips), (count,)), torch.randint(1, clips.codes.shape[1], (count,))
        self.optimizer.zero_grad(set_to_none=True)
        total = torch.zeros(())
        for fold in (0, 1):
            chosen = clip % 2 == fold
            if chosen.any():
                table = self.fold_tables[fold] if self.fold_tables else None
                loss = self._loss(examples(clips, clip[chosen], t[chosen], frames), table)
                loss = loss / (count * slices * 256)
                loss.backward()
                total = total + loss.detach()
        torch.nn.utils.clip_grad_norm_(self.net.parameters(), 1.0)
        self.optimizer.step()
        self.step += 1
        return {"bits": total / math.log(2)}


def held_out_frames(clips: CodedClips, count: int) -> tuple[Tensor, Tensor]:
    """Numbers of clips and of frames, spread evenly over all that have three before them."""
    times = clips.codes.shape[1] - 3
    chosen = torch.linspace(0, len(clips) * times - 1, min(count, len(clips) * times)).long()
    return chosen // times, 3 + chosen % times


@torch.no_grad()
def transformer_bits(net: LatentTransformer, clips: CodedClips, clip: Tensor, t: Tensor, batch: int = 8) -> Tensor:
    """A code, of each of these frames given those before: float32 [B]."""
    out = []
    for which, when in zip(clip.split(batch), t.split(batch), strict=True):
        one = examples(clips, which, when, net.shape.frames)
        logits = net(one.before, one.codes, one.fps).flatten(0, 2)
        bits = F.cross_entropy(logits, one.codes.flatten(), reduction="none") / math.log(2)
        out.append(bits.view(len(which), -1).mean(1))
    return torch.cat(out)


def bits_of(net: LatentTransformer, table: CodeTable, clips: CodedClips, count: int) -> dict[str, float]:
    """A code, on the same frames of held-out clips."""
    net.eval()
    clip, t = held_out_frames(clips, count)
    figures = {
        "transformer": float(transformer_bits(net, clips, clip, t).mean()),
        "table": float(bits_by_table(table, clips.codes)[clip, t - 1].mean()),
        "frequency": float(bits_by_frequency(table, clips.codes)[clip, t - 1].mean()),
    }
    net.train()
    return figures


@torch.no_grad()
def sample_picture(net: LatentTransformer, autoencoder: Autoencoder, clips: CodedClips, count: int = 3) -> Tensor:
    """Rows of five frames of 64 x 64: last seen (decoded), next by its true codes, likeliest, and two drawn at
    temperature 1; uint8 [count * 64, 5 * 64, 3]."""
    net.eval()
    clip, t = held_out_frames(clips, count)
    one = examples(clips, clip, t, net.shape.frames)
    generator = torch.Generator().manual_seed(0)
    rows = [one.before[:, -1], one.codes]
    rows += [drawn_codes(net, one.before, one.fps, temperature, generator) for temperature in (0.0, 1.0, 1.0)]
    net.train()
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
    parser.add_argument("--minutes", type=float, default=480, help="of the whole schedule, over resumes")
    parser.add_argument("--steps", type=int, help="length of the schedule in steps instead of minutes")
    parser.add_argument("--batch", type=int, default=8, help="frames a step (default %(default)s)")
    parser.add_argument("--rate", type=float, default=5e-4, help="default %(default)s")
    parser.add_argument("--bf16", action="store_true", help="where the processor has it (AVX-512 BF16)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, help="default: one a core")
    parser.add_argument("--validate-minutes", type=float, default=15)
    parser.add_argument("--validate-frames", type=int, default=128, help="held-out frames (default %(default)s)")
    return parser.parse_args()


def train(arguments: argparse.Namespace) -> None:
    """Runs or resumes a training."""
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    torch.manual_seed(arguments.seed)
    clips, held_out = (read_codes(arguments.codes, split) for split in ("train", "val"))
    shape = TRANSFORMERS[arguments.size]
    found = clips.codes.shape[2], int(clips.codes.max())
    if found[0] != shape.slices or found[1] >= shape.entries:
        shape = TransformerShape(**(asdict(shape) | {"slices": found[0], "entries": max(shape.entries, found[1] + 1)}))
    training = Training(shape, clips, not arguments.no_table, arguments.bf16)
    count = sum(p.numel() for p in training.net.parameters())
    print(f"{len(clips)} clips to train on, {len(held_out)} held out, {count / 1e6:.1f} M parameters", flush=True)
    table = CodeTable.counted(clips.codes, shape.entries)
    path = arguments.out / "checkpoint.pt"
    arguments.out.mkdir(parents=True, exist_ok=True)
    if path.exists():
        training.load(torch.load(path, weights_only=True))
    schedule, stop = Schedule(arguments.minutes, arguments.steps), StopSignal()
    clock, smoothed = Stopwatch(training.spent_s), SmoothedTerms()
    save, validate = Interval(SAVE_EVERY_S), Interval(arguments.validate_minutes * 60)
    bar = schedule.bar(training.step, training.spent_s)

    def validated() -> None:
        figures = bits_of(training.net, table, held_out, arguments.validate_frames)
        row = {"step": training.step, "spent": training.spent_s} | figures
        training.log.append(row)
        write_log(training.log, arguments.out, list(figures), "spent", "bits a code, held out")
        bar.write(" ".join(f"{k}={v:.4g}" for k, v in row.items()))

    while not schedule.finished(training.step, training.spent_s) and not stop:
        seed_step(arguments.seed, training.step)
        rate = rate_at(training.step, schedule.fraction(training.step, training.spent_s), arguments.rate)
        smoothed.update(training.advance(clips, arguments.batch, rate))
        clock.lap()
        training.spent_s = clock.spent_s
        schedule.advance(bar, training.step, training.spent_s)
        if training.step % 20 == 0:
            training.log.append({"step": training.step, "loss": smoothed.loss, "terms": dict(smoothed.values)})
            bar.set_postfix(step=training.step, bits=f"{smoothed.values['bits']:.3f}", refresh=False)
        if save.due():
            save_atomically(training.state(), path)
            save.restart()
        if validate.due():
            validated()
            validate.restart()
            clock.skip()
    save_atomically(training.state(), path)
    validated()
    save_atomically(training.state(), path)
    save_atomically({"shape": asdict(shape), "net": training.net.state_dict()}, arguments.out / "weights.pt")
    bar.close()
    if arguments.autoencoder:
        picture = sample_picture(training.net, load_autoencoder(arguments.autoencoder), held_out)
        cv2.imwrite(str(arguments.out / "sample.png"), picture.numpy()[..., ::-1])


def main() -> None:
    train(parsed())


if __name__ == "__main__":
    main()
