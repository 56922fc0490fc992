"""Parts that all trainings share: length and learning rate, signals, checkpoints, averages, curves, processes.

Each system has a loop of its own (`export.densepose.train`, `export.scenes.train`). A run resumes to the same numbers
because step k draws from the seed and k alone (`seed_step`), and its checkpoint holds everything else.
"""

from __future__ import annotations

import copy
import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import torch
from torch import Tensor, nn
from tqdm import tqdm

SAVE_EVERY_S = 180


@dataclass(frozen=True)
class Schedule:
    """Length of a run: `steps`, or where they are None `minutes` of training, over all resumes."""

    minutes: float
    steps: int | None = None

    def fraction(self, step: int, spent_s: float) -> float:
        """How much of the run is done, 0..1."""
        return step / self.steps if self.steps else spent_s / (self.minutes * 60)

    def finished(self, step: int, spent_s: float) -> bool:
        return step >= self.steps if self.steps else spent_s >= self.minutes * 60

    def bar(self, step: int, spent_s: float, disable: bool = False) -> tqdm:
        """A progress bar in steps or in seconds."""
        total, done = (self.steps, step) if self.steps else (round(self.minutes * 60), round(spent_s))
        return tqdm(total=total, initial=done, unit="step" if self.steps else "s", disable=disable, smoothing=0)

    def advance(self, bar: tqdm, step: int, spent_s: float) -> None:
        bar.update((step if self.steps else round(spent_s)) - bar.n)


def rate_at(step: int, fraction: float, rate: float, warm_up_steps: int = 200) -> float:
    """Learning rate after `step` steps and that fraction of the run: a short rise, then a cosine down to a fiftieth."""
    wave = 0.5 * (1 + math.cos(math.pi * min(fraction, 1)))
    return rate * min(1.0, (step + 1) / warm_up_steps) * (0.02 + 0.98 * wave)


def steady_rate_at(step: int, fraction: float, rate: float, decay: float, warm_up_steps: int = 200) -> float:
    """The same with one rate up to the last `decay` of the run, then a straight line down to a fiftieth.

    Up to there it does not depend on the run's length, so that a run can be made longer afterwards.
    """
    left = min(1.0, (1 - min(fraction, 1)) / decay)
    return rate * min(1.0, (step + 1) / warm_up_steps) * (0.02 + 0.98 * left)


def seed_step(seed: int, step: int) -> None:
    """Random numbers of a step are those of a run that never stopped."""
    torch.manual_seed((seed << 32) + step)


class StopSignal:
    """True after SIGTERM or SIGINT: the loop ends its step, saves and leaves."""

    def __init__(self) -> None:
        self._received = False
        for name in (signal.SIGTERM, signal.SIGINT):
            signal.signal(name, self._receive)

    def _receive(self, *_: object) -> None:
        self._received = True

    def __bool__(self) -> bool:
        return self._received


class Stopwatch:
    """Seconds spent on steps; `skip` leaves out what was done since the last `lap`."""

    def __init__(self, spent_s: float) -> None:
        self.spent_s, self._at = spent_s, time.monotonic()

    def lap(self) -> None:
        now = time.monotonic()
        self.spent_s, self._at = self.spent_s + now - self._at, now

    def skip(self) -> None:
        self._at = time.monotonic()


class Interval:
    """`due` every so many seconds, counted from the last `restart`."""

    def __init__(self, seconds: float) -> None:
        self.seconds, self._at = seconds, time.monotonic()

    def due(self) -> bool:
        return time.monotonic() - self._at > self.seconds

    def restart(self) -> None:
        self._at = time.monotonic()


class SmoothedTerms:
    """Exponential means of a loss's terms, each over the steps that have it."""

    def __init__(self) -> None:
        self.values: dict[str, float] = {}

    def update(self, terms: Mapping[str, Tensor]) -> None:
        now = {name: value.item() for name, value in terms.items()}
        mean = {name: 0.95 * self.values.get(name, value) + 0.05 * value for name, value in now.items()}
        self.values = self.values | mean

    @property
    def loss(self) -> float:
        return sum(self.values.values())


class Ema:
    """Exponential mean of weights and BN statistics; what is evaluated and shipped."""

    def __init__(self, net: nn.Module, decay: float) -> None:
        self.net, self.decay = copy.deepcopy(net).eval().requires_grad_(False), decay

    @torch.no_grad()
    def update(self, net: nn.Module, step: int) -> None:
        decay = min(self.decay, (1 + step) / (10 + step))
        for mean, now in zip(self.net.state_dict().values(), net.state_dict().values(), strict=True):
            if mean.dtype.is_floating_point:
                mean.lerp_(now, 1 - decay)
            else:
                mean.copy_(now)


def save_atomically(state: dict, path: Path) -> None:
    temporary = path.with_suffix(".tmp")
    torch.save(state, temporary)
    temporary.rename(path)


def write_log(log: list[dict], folder: Path, figures: Sequence[str], against: str, label: str) -> None:
    """Writes log.json and curves.png."""
    (folder / "log.json").write_text(json.dumps(log))
    draw_curves(log, folder / "curves.png", figures, against, label)


def draw_curves(log: list[dict], path: Path, figures: Sequence[str], against: str, label: str) -> None:
    """Draws the loss's terms over steps, and the validation's `figures` against another column."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 4.5))
    steps = [row for row in log if "loss" in row]
    for name in steps[-1]["terms"] if steps else ():
        rows = [row for row in steps if name in row["terms"]]
        left.plot([row["step"] for row in rows], [row["terms"][name] for row in rows], label=name, lw=1)
    left.plot([row["step"] for row in steps], [row["loss"] for row in steps], "k", label="sum", lw=1.5)
    left.set(xlabel="step", ylabel="weighted loss", yscale="log")
    for name in figures:
        rows = [row for row in log if name in row]
        right.plot([row[against] for row in rows], [row[name] for row in rows], "o-", ms=3, label=name)
    right.set(xlabel=against, ylabel=label)
    for axis in (left, right):
        axis.grid(alpha=0.3)
        axis.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    plt.close(figure)


@dataclass(frozen=True)
class Processes:
    """This process among those that torchrun started (one without it), and where it computes."""

    rank: int
    world: int
    device: torch.device

    @staticmethod
    def join(threads: int | None) -> Processes:
        """threads: of this process; None: the cores divided among the processes."""
        rank, world = int(os.environ.get("RANK", 0)), int(os.environ.get("WORLD_SIZE", 1))
        cuda = torch.cuda.is_available()
        device = torch.device("cuda", int(os.environ.get("LOCAL_RANK", 0))) if cuda else torch.device("cpu")
        if world > 1:
            torch.distributed.init_process_group("nccl" if cuda else "gloo")
        if world > 1 and not cuda and hasattr(os, "sched_setaffinity"):
            # Left to the scheduler, two processes spend a fifth of their time on one core.
            local, beside = int(os.environ["LOCAL_RANK"]), int(os.environ["LOCAL_WORLD_SIZE"])
            cores = sorted(os.sched_getaffinity(0))
            os.sched_setaffinity(0, cores[local % len(cores) :: beside])
        torch.set_num_threads(threads or max(1, (os.cpu_count() or 1) // world))
        return Processes(rank, world, device)


def average_gradients(parameters: list[nn.Parameter], spent: float, stopped: bool, world: int) -> tuple[float, bool]:
    """Means of the gradients over the processes, and one common clock and stop flag, in a single exchange.

    What all processes must decide alike (when to stop) may only depend on what is returned here.
    """
    gradients = [torch.zeros_like(p) if p.grad is None else p.grad for p in parameters]
    flat = torch.cat([*(g.flatten() for g in gradients), gradients[0].new_tensor([spent, float(stopped)])])
    torch.distributed.all_reduce(flat)
    flat /= world
    at = 0
    for parameter, gradient in zip(parameters, gradients, strict=True):
        # In the gradient's own memory: the fused optimiser takes for granted that it is laid out as the parameter.
        parameter.grad = gradient.copy_(flat[at : at + gradient.numel()].view_as(gradient))
        at += gradient.numel()
    return float(flat[-2]), bool(flat[-1] > 0)


_BF16_PROBE = """
import time, torch
torch.set_num_threads(1)
def seconds(kind):
    x, w = torch.ones(4, 64, 32, 32, dtype=kind), torch.ones(64, 64, 3, 3, dtype=kind)
    x @ x
    times = []
    for _ in range(9):
        start = time.perf_counter()
        torch.conv2d(x, w)
        times.append(time.perf_counter() - start)
    return sorted(times)[4]
raise SystemExit(seconds(torch.float32) < 1.4 * seconds(torch.bfloat16))
"""


def bf16_pays() -> bool:
    """Whether this processor convolves clearly faster in bfloat16: 1.9 times with AVX-512's instructions for it, more
    with AMX; slower without either.

    Asked in a process of its own, since oneDNN dies of an illegal instruction where a virtual machine announces AMX
    but not its tiles; `scripts/with-amx.sh` helps there.
    """
    return subprocess.run([sys.executable, "-c", _BF16_PROBE], capture_output=True).returncode == 0
