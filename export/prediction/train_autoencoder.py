"""Trains the autoencoder of frames (VQ-VAE) on clips; goes on where it was stopped.

    python -m export.prediction.train_autoencoder --sets pushing shapes --minutes 90

Writes checkpoint.pt, weights.pt, log.json, curves.png and sample.png (true frames above, rebuilt below) to --out.
Figures are of held-out clips: `psnr` of rebuilt frames, dB; `used` fraction of the codebooks' entries.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path

import cv2
import torch
from torch import Tensor

from export.prediction.autoencoder import Autoencoder, scaled
from export.prediction.codebook import used_fraction
from export.prediction.config import AUTOENCODERS, AutoencoderShape
from export.prediction.data import Clips, drawn_frames, read_clips
from export.prediction.picture_error import psnr_db, rebuilt
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


class Training:
    """Everything of a run that its checkpoint holds."""

    def __init__(self, shape: AutoencoderShape, bf16: bool = False) -> None:
        self.net, self.bf16 = Autoencoder(shape).train(), bf16
        self.optimizer = torch.optim.Adam(self.net.parameters(), betas=(0.9, 0.99))
        self.step, self.spent_s = 0, 0.0
        self.log: list[dict] = []

    def state(self) -> dict:
        return {
            "shape": asdict(self.net.shape), "net": self.net.state_dict(), "optimizer": self.optimizer.state_dict(),
            "step": self.step, "spent_s": self.spent_s, "log": self.log,
        }  # fmt: skip

    def load(self, state: dict) -> None:
        self.net.load_state_dict(state["net"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.step, self.spent_s, self.log = state["step"], state["spent_s"], state["log"]

    def advance(self, frames: Tensor, rate: float) -> dict[str, Tensor]:
        """One step on frames uint8 [B, 64, 64, 3] at that learning rate."""
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        true = scaled(frames)
        with torch.autocast("cpu", torch.bfloat16, enabled=self.bf16):
            made, _, commitment = self.net(true)
        terms = {"picture": (made.float() - true).square().mean(), "commitment": commitment}
        self.optimizer.zero_grad(set_to_none=True)
        sum(terms.values()).backward()
        self.optimizer.step()
        self.step += 1
        return terms


@torch.no_grad()
def figures_of(net: Autoencoder, clips: Clips) -> tuple[dict[str, float], Tensor]:
    """Of every fifth frame of held-out clips; and some true frames above what became of them, uint8 [128, W, 3]."""
    net.eval()
    frames = clips.frames[:, ::5].flatten(0, 1)
    made, codes = rebuilt(net, frames)
    net.train()
    chosen = torch.linspace(0, len(frames) - 1, min(12, len(frames))).long()
    picture = torch.cat([torch.cat(list(p[chosen].float()), 1) for p in (frames, made)])
    figures = {"psnr": float(psnr_db(made, frames).mean()), "used": used_fraction(codes, net.shape.entries)}
    return figures, picture.clamp(0, 255).round().to(torch.uint8)


def load_autoencoder(path: Path) -> Autoencoder:
    """Weights as `train_autoencoder` writes them."""
    stored = torch.load(path, weights_only=True)
    shape = stored["shape"] | {"widths": tuple(stored["shape"]["widths"])}
    net = Autoencoder(AutoencoderShape(**shape))
    net.load_state_dict(stored["net"])
    return net.eval()


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--sets", nargs="+", default=["pushing", "shapes"], help="default %(default)s")
    parser.add_argument("--out", type=Path, default=Path(".data/runs/prediction-autoencoder"))
    parser.add_argument("--size", choices=AUTOENCODERS, default="light")
    parser.add_argument("--slices", type=int, help="codes a place (default 4)")
    parser.add_argument("--entries", type=int, help="of each codebook (default 512)")
    parser.add_argument("--minutes", type=float, default=90, help="of the whole schedule, over resumes")
    parser.add_argument("--steps", type=int, help="length of the schedule in steps instead of minutes")
    parser.add_argument("--batch", type=int, default=32)
    parser.add_argument("--rate", type=float, default=1e-3, help="default %(default)s; the paper's is 3e-4")
    parser.add_argument("--bf16", action="store_true", help="where the processor has it (AVX-512 BF16)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, help="default: one a core")
    parser.add_argument("--validate-minutes", type=float, default=5)
    return parser.parse_args()


def train(arguments: argparse.Namespace) -> None:
    """Runs or resumes a training."""
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    torch.manual_seed(arguments.seed)
    clips, held_out = (read_clips(arguments.data, arguments.sets, split) for split in ("train", "val"))
    print(f"{len(clips)} clips to train on, {len(held_out)} held out", flush=True)
    changed = {name: value for name in ("slices", "entries") if (value := getattr(arguments, name))}
    shape = AutoencoderShape(**(asdict(AUTOENCODERS[arguments.size]) | changed))
    training = Training(shape, arguments.bf16)
    path = arguments.out / "checkpoint.pt"
    arguments.out.mkdir(parents=True, exist_ok=True)
    if path.exists():
        training.load(torch.load(path, weights_only=True))
    schedule, stop = Schedule(arguments.minutes, arguments.steps), StopSignal()
    clock, smoothed = Stopwatch(training.spent_s), SmoothedTerms()
    save, validate = Interval(SAVE_EVERY_S), Interval(arguments.validate_minutes * 60)
    bar = schedule.bar(training.step, training.spent_s)

    def validated() -> None:
        figures, picture = figures_of(training.net, held_out)
        row = {"step": training.step, "spent": training.spent_s} | figures
        training.log.append(row)
        write_log(training.log, arguments.out, ["psnr"], "spent", "held-out frames, dB")
        cv2.imwrite(str(arguments.out / "sample.png"), picture.numpy()[..., ::-1])
        bar.write(" ".join(f"{k}={v:.4g}" for k, v in row.items()))

    while not schedule.finished(training.step, training.spent_s) and not stop:
        seed_step(arguments.seed, training.step)
        rate = rate_at(training.step, schedule.fraction(training.step, training.spent_s), arguments.rate)
        smoothed.update(training.advance(drawn_frames(clips, arguments.batch), rate))
        clock.lap()
        training.spent_s = clock.spent_s
        schedule.advance(bar, training.step, training.spent_s)
        if training.step % 50 == 0:
            training.log.append({"step": training.step, "loss": smoothed.loss, "terms": dict(smoothed.values)})
            bar.set_postfix(step=training.step, picture=f"{smoothed.values['picture']:.4f}", refresh=False)
        if save.due():
            save_atomically(training.state(), path)
            save.restart()
        if validate.due():
            validated()
            validate.restart()
            clock.skip()
    validated()
    save_atomically(training.state(), path)
    save_atomically({"shape": asdict(shape), "net": training.net.state_dict()}, arguments.out / "weights.pt")
    bar.close()


def main() -> None:
    train(parsed())


if __name__ == "__main__":
    main()
