"""Averages two sets of weights, of which one was trained from the other.

    python -m export.densepose.average export/weights/densepose-b.pt .data/runs/crops/weights.pt \\
        --out .data/runs/crops/half.pt

A short training on other data gains there and loses elsewhere; between its weights and those that it started from lie
weights that keep most of both (Wortsman et al., "Robust fine-tuning of zero-shot models", CVPR 2022). Weights that the
first file does not have are the second's. The evidence of people is trained alone, after everything else: it is left
out where the second file has none.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import torch


def averaged(start: dict, trained: dict, fraction: float) -> dict:
    """The contents of `trained`, with "ema" interpolated between `start` (`fraction` 0) and `trained` (1). Both are
    weights files of `export.densepose.train`. Raises ValueError for networks of different shapes."""
    weights = dict(trained["ema"])
    for name, before in start["ema"].items():
        after = weights.get(name)
        if after is None and name.startswith("evidence."):
            continue
        if after is None or after.shape != before.shape:
            raise ValueError(f"{name} is not in both, or of another shape: was one trained from the other?")
        if after.is_floating_point():
            weights[name] = torch.lerp(before.float(), after.float(), fraction).to(after.dtype)
    return trained | {"ema": weights}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("start", type=Path, help="weights that the training began with")
    parser.add_argument("trained", type=Path, help="its weights.pt")
    parser.add_argument("--fraction", type=float, default=0.5, help="of the trained weights (default %(default)s)")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE")
    options = parser.parse_args()
    start, trained = (torch.load(path, map_location="cpu") for path in (options.start, options.trained))
    torch.save(averaged(start, trained, options.fraction), options.out)
    print(f"Written: {options.out}")


if __name__ == "__main__":
    main()
