"""The loop of the trainings of this folder: length, learning rate, checkpoints, validation, curves. A run goes on where
it was stopped."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

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

_SHOW_EVERY = 20  # steps
Figures = dict[str, float]


class Training:
    """Everything of a run that its checkpoint holds. net has a `shape`, a dataclass; bf16: compute in bfloat16."""

    def __init__(self, net: nn.Module, optimizer: torch.optim.Optimizer, bf16: bool = False) -> None:
        self.net, self.optimizer, self.bf16 = net, optimizer, bf16
        self.step, self.spent_s = 0, 0.0
        self.log: list[dict] = []

    @property
    def device(self) -> torch.device:
        return next(self.net.parameters()).device

    def autocast(self) -> torch.autocast:
        return torch.autocast(self.device.type, torch.bfloat16, enabled=self.bf16)

    def descend(self, loss: Tensor, rate: float, largest_gradient: float | None = None) -> None:
        """One step down the gradient of the loss at that learning rate."""
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        if largest_gradient is not None:
            torch.nn.utils.clip_grad_norm_(self.net.parameters(), largest_gradient)
        self.optimizer.step()
        self.step += 1

    def state(self) -> dict:
        return {
            "shape": asdict(self.net.shape), "net": self.net.state_dict(), "optimizer": self.optimizer.state_dict(),
            "step": self.step, "spent_s": self.spent_s, "log": self.log,
        }  # fmt: skip

    def load(self, state: dict) -> None:
        self.net.load_state_dict(state["net"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.step, self.spent_s, self.log = state["step"], state["spent_s"], state["log"]

    def weights(self) -> dict:
        """On the CPU, whatever they were trained on."""
        return {"shape": asdict(self.net.shape), "net": {k: v.cpu() for k, v in self.net.state_dict().items()}}


def add_arguments(parser: argparse.ArgumentParser, minutes: float, batch: int, rate: float, warm_up: int = 200) -> None:
    """Adds the options of all trainings, with these defaults."""
    parser.add_argument("--minutes", type=float, default=minutes, help="of the whole schedule, over resumes")
    parser.add_argument("--steps", type=int, help="length of the schedule in steps instead of minutes")
    parser.add_argument("--batch", type=int, default=batch, help="frames a step (default %(default)s)")
    parser.add_argument("--rate", type=float, default=rate, help="of learning (default %(default)s)")
    parser.add_argument("--warm-up", type=int, default=warm_up, help="steps until then (default %(default)s)")
    parser.add_argument("--bf16", action="store_true", help="on GPUs, and processors that have it (AVX-512 BF16)")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu", help="default %(default)s")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, help="default: one a core")
    parser.add_argument("--validate-minutes", type=float, default=10, help="between validations (default %(default)s)")


def begin(arguments: argparse.Namespace) -> None:
    """Threads and random numbers, before the network is made."""
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    torch.manual_seed(arguments.seed)


def run(
    training: Training,
    arguments: argparse.Namespace,
    advance: Callable[[float], dict[str, Tensor]],
    validate: Callable[[], Figures],
    label: str,
) -> None:
    """Trains to the end of the schedule, or to a signal; writes checkpoint.pt, weights.pt, log.json and curves.png.

    advance: a step at that learning rate -> terms of the loss; validate: -> metrics to draw, with `label`.
    """
    folder: Path = arguments.out
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "checkpoint.pt"
    if path.exists():
        training.load(torch.load(path, map_location=training.device, weights_only=True))
    schedule, stop = Schedule(arguments.minutes, arguments.steps), StopSignal()
    clock, smoothed = Stopwatch(training.spent_s), SmoothedTerms()
    save, validation = Interval(SAVE_EVERY_S), Interval(arguments.validate_minutes * 60)
    bar = schedule.bar(training.step, training.spent_s)

    def validated() -> None:
        training.net.eval()
        figures = validate()
        training.net.train()
        row: dict[str, Any] = {"step": training.step, "spent": training.spent_s} | figures
        training.log.append(row)
        write_log(training.log, folder, list(figures), "spent", label)
        bar.write(" ".join(f"{k}={v:.4g}" for k, v in row.items()))

    while not schedule.finished(training.step, training.spent_s) and not stop:
        seed_step(arguments.seed, training.step)
        fraction = schedule.fraction(training.step, training.spent_s)
        terms = advance(rate_at(training.step, fraction, arguments.rate, arguments.warm_up))
        if training.step % _SHOW_EVERY == 0:  # reading a GPU's numbers waits for it
            smoothed.update(terms)
            training.log.append({"step": training.step, "loss": smoothed.loss, "terms": dict(smoothed.values)})
            bar.set_postfix(
                {k: f"{v:.4f}" for k, v in smoothed.values.items()} | {"step": training.step}, refresh=False
            )
        clock.lap()
        training.spent_s = clock.spent_s
        schedule.advance(bar, training.step, training.spent_s)
        if save.due():
            save_atomically(training.state(), path)
            save.restart()
        if validation.due():
            validated()
            validation.restart()
            clock.skip()
    validated()
    save_atomically(training.state(), path)
    save_atomically(training.weights(), folder / "weights.pt")
    bar.close()
