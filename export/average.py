"""Averages two sets of weights, of which one was trained from the other.

    python -m export.average export/weights/densepose-b.pt .data/runs/crops/weights.pt --out .data/runs/crops/half.pt

A short training on other data gains there and loses elsewhere; between its weights and those that it started from lie
weights that keep most of both (Wortsman et al., "Robust fine-tuning of zero-shot models", CVPR 2022). Weights that the
first file does not have are the second's. The evidence of people is trained alone, after everything else: it is left
out where the second file has none.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import torch

KEYS = ("ema", "networks")  # of the weights in files of dense pose and of scenes


def averaged(start: dict, trained: dict, fraction: float) -> dict:
    """Returns the contents of `trained`. Each weight is a mean of both: `start` at `fraction` 0, `trained` at 1.

    Both are weights files of `export.densepose.train` or of `export.scenes.train`. Raises ValueError for other files
    and for networks of different shapes.
    """
    key = next((key for key in KEYS if key in start and key in trained), None)
    if key is None:
        raise ValueError("these are not two files of weights of one kind of network")
    weights = dict(trained[key])
    for name, before in start[key].items():
        after = weights.get(name)
        if after is None and name.startswith("evidence."):
            continue
        if after is None or after.shape != before.shape:
            raise ValueError(f"{name} is not in both, or of another shape: was one trained from the other?")
        if after.is_floating_point():
            weights[name] = torch.lerp(before.float(), after.float(), fraction).to(after.dtype)
    return trained | {key: weights}


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
