"""Exports the transformer over codes as fp32 ONNX graphs, and compares them with torch.

    python -m export.prediction.export_transformer --weights .data/runs/prediction-transformer/weights.pt

The graphs are those of `graphs/transformer_graphs.py`; what a runtime does around them is in `graphs/graph_runtime.py`.
`export_onnx --transformer` puts them into a bundle.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import torch

from export.onnx_graphs import largest_difference
from export.prediction.config import CODE_SIDE
from export.prediction.graphs.graph_runtime import GraphRuntime
from export.prediction.graphs.transformer_file import TransformerTables
from export.prediction.graphs.transformer_graphs import write_transformer_graphs
from export.prediction.train_transformer import load_transformer
from export.prediction.transformer import LatentTransformer

TOLERANCE = 1e-4  # largest |ONNX - torch|, relative to the largest logit
_FPS = 15.0


@torch.no_grad()
def export_transformer(net: LatentTransformer, folder: Path) -> float:
    """Writes the graphs; returns how far their logits are from torch. Raises ValueError where that is too far."""
    shape = net.eval().float().shape
    write_transformer_graphs(net, folder)
    tables = TransformerTables.of(net)
    rng = np.random.default_rng(0)
    codes = rng.integers(shape.entries, size=(shape.seen + 1, shape.slices, CODE_SIDE, CODE_SIDE))
    before, own = torch.from_numpy(codes[None, :-1]), torch.from_numpy(codes[None, -1])
    expected = net(before, own, torch.tensor([_FPS]))[0].numpy()
    runtime = GraphRuntime(folder, tables, net.table.numpy())
    runtime.begin(codes[:-1], _FPS)
    error = largest_difference(expected, runtime.logits(codes[-1]))
    if not error <= TOLERANCE:
        raise ValueError(f"The graphs in {folder} differ from torch by {error:.1e} of the largest logit.")
    return error


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--weights", type=Path, default=Path(".data/runs/prediction-transformer/weights.pt"))
    parser.add_argument("--out", type=Path, default=Path(".data/graphs/prediction-transformer"))
    options = parser.parse_args()
    if not options.weights.exists():
        parser.error(f"{options.weights} does not exist. Train it: python -m export.prediction.train_transformer")
    error = export_transformer(load_transformer(options.weights), options.out)
    size = sum(path.stat().st_size for path in options.out.glob("*.onnx"))
    print(f"{options.out}: {size / 1e6:.2f} MB, within {error:.1e} of torch")


if __name__ == "__main__":
    main()
