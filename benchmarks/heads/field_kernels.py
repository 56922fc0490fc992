"""Compares the kernels of the head field with PyTorch: microseconds a point for the same shapes on one thread, and the
reached fraction of the machine's float peak.

    cmake --build --preset release --target measure_head_field && python -m benchmarks.heads.field_kernels

PyTorch computes what the engine does (`export.heads.field`), in batches of the size that suits it best.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import torch

from benchmarks.heads.tables import table
from export.heads.field import FieldBases, geometry, surface
from export.heads.prior import FieldShape

PROGRAM = Path("build/release/benchmarks/native/measure_head_field")
WIDTH = 64
BATCHES = (256, 6144)  # fits the second-level cache; 512 rays of 12 samples
PEAK_SIZES = (192, 256, 384, 512)
SECONDS, ROUNDS = 0.4, 3  # seconds for each metric and round
# Names of measure_head_field.cpp, with the number of times that all multiply-adds of the forward pass are done.
PASSES = {
    "distance": None,
    "forward": 1,
    "forward, back to all weights": 3,
    "all forward, back to all weights": None,
}


def macs_of(shape: FieldShape) -> int:
    """Returns the multiply-adds of a point, forward."""
    return sum(shape.inputs(layer) * shape.outputs(layer) for layer in range(shape.layers))


def torch_works(shape: FieldShape, count: int) -> dict[str, Callable[[], object]]:
    """Returns the work of the kernels for `count` points, in PyTorch."""
    torch.manual_seed(1)
    weights = [w.detach().requires_grad_(True) for w in FieldBases(shape).constant]
    points = torch.randn(count, 3)
    given = torch.full((count, 3), 0.1)

    def forward() -> tuple[torch.Tensor, ...]:
        out = geometry(shape, weights, points)
        return (out, *surface(shape, weights, points, out))

    def backward() -> None:
        out, colour, template = forward()
        loss = 0.1 * out[:, 0].sum() + (colour * given).sum() + (template * given).sum()
        torch.autograd.grad(loss, weights)

    def with_normals() -> None:
        at = points.clone().requires_grad_(True)
        out = geometry(shape, weights, at)
        colour, template = surface(shape, weights, at, out)
        (normal,) = torch.autograd.grad(out[:, 0].sum(), at, create_graph=True)
        loss = 0.1 * out[:, 0].sum() + (colour * given).sum() + ((template + normal) * given).sum()
        torch.autograd.grad(loss, weights)

    def without_gradients(work: Callable[[], object]) -> Callable[[], object]:
        return torch.no_grad()(work)

    works = (
        without_gradients(lambda: geometry(shape, weights, points)),
        without_gradients(forward),
        backward,
        with_normals,
    )
    return dict(zip(PASSES, works, strict=True))


def best_us(work: Callable[[], object], seconds: float = SECONDS) -> float:
    """Returns microseconds of the fastest of many runs."""
    work()
    best, spent = float("inf"), 0.0
    while spent < seconds:
        start = time.perf_counter()
        work()
        took = time.perf_counter() - start
        best, spent = min(best, took), spent + took
    return 1e6 * best


def float_peak() -> float:
    """Returns multiply-adds a second of PyTorch's fastest square matrix product on one thread. Products are small,
    since long runs are interrupted on a machine with other load (`benchmarks.roofline` has large ones)."""
    rates = []
    for size in PEAK_SIZES:
        a, b = torch.rand(size, size), torch.rand(size, size)
        out = torch.empty(size, size)
        rates.append(1e6 * size**3 / best_us(lambda a=a, b=b, out=out: torch.mm(a, b, out=out)))
    return max(rates)


def engine_us(program: Path, width: int) -> dict[tuple[str, str], float]:
    """Returns microseconds a point for each instruction set and kind of work."""
    done = subprocess.run([str(program), str(width)], check=True, capture_output=True, text=True)
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    return {(row["isa"], row["what"]): row["us"] for row in rows}


def measure_kernels(program: Path = PROGRAM, width: int = WIDTH, rounds: int = ROUNDS) -> list[dict]:
    """Returns one row for each kind of work and instruction set; kernels and PyTorch alternate, the fastest run
    counts."""
    shape = FieldShape(width=width, surface_width=width)
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        ours: dict[tuple[str, str], float] = {}
        theirs = dict.fromkeys(PASSES, float("inf"))
        for _ in range(rounds):
            for key, us in engine_us(program, width).items():
                ours[key] = min(us, ours.get(key, us))
            for count in BATCHES:
                for what, work in torch_works(shape, count).items():
                    theirs[what] = min(theirs[what], best_us(work, SECONDS / len(BATCHES)) / count)
        rate = float_peak()
    finally:
        torch.set_num_threads(threads)
    rows = []
    for (isa, what), us in ours.items():
        if what in PASSES:
            passes = PASSES[what]
            fraction = passes * macs_of(shape) / rate * 1e6 / us if passes else None
            rows.append({"isa": isa, "what": what, "us": us, "torch_us": theirs[what], "fraction": fraction})
    return rows


def kernel_table(rows: list[Mapping]) -> str:
    return table(
        ("instruction set", "what", "µs a point", "PyTorch, µs", "by PyTorch", "of the float peak"),
        [
            [r["isa"], r["what"], f"{r['us']:.3f}", f"{r['torch_us']:.3f}", f"{r['us'] / r['torch_us']:.2f}",
             f"{100 * r['fraction']:.0f} %" if r["fraction"] else ""]
            for r in rows
        ],
    )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=Path, default=PROGRAM, help=f"default: {PROGRAM}")
    parser.add_argument("--width", type=int, default=WIDTH, help="width of the hidden layers")
    options = parser.parse_args()
    if not options.program.exists():
        raise SystemExit(f"{options.program} is missing: cmake --build --preset release --target measure_head_field")
    print(kernel_table(measure_kernels(options.program, options.width)))


if __name__ == "__main__":
    main()
