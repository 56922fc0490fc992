"""The refiner of the SDK's predictions, as an ONNX graph.

`mended.onnx`: images float32 [1, 64, 64, seen * 3], R, G, B in 0..255 of each frame before, oldest first, and last of
what motion predicts; times [1, 2] of `times_ahead` -> image [1, 64, 64, 3].
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from export.clips.clip import SIDE_PX
from export.densepose.graphs import session
from export.onnx_graphs import largest_difference, write_graph
from export.prediction.refiner.convolutional import ConvolutionalNet, times_ahead

REFINED = "mended"
TOLERANCE = 1e-4  # largest |ONNX - torch|, relative to the largest number


class RefinedGraph(nn.Module):
    def __init__(self, net: ConvolutionalNet) -> None:
        super().__init__()
        self.net = net

    def forward(self, pictures: Tensor, times: Tensor) -> Tensor:
        before = pictures.permute(0, 3, 1, 2).unflatten(1, (-1, 3)) / 127.5 - 1
        return (self.net(before, times).permute(0, 2, 3, 1) + 1) * 127.5


@torch.no_grad()
def export_refined(net: ConvolutionalNet, folder: Path) -> float:
    """Writes the graph; returns how far it is from torch. Raises ValueError where that is too far, and for a network
    that is not shown motion."""
    if not net.shape.motion:
        raise ValueError("The network is not shown what motion predicts: train it with --motion.")
    net = net.eval().float()
    rng = np.random.default_rng(0)
    pictures = torch.from_numpy(rng.uniform(0, 255, (1, SIDE_PX, SIDE_PX, net.shape.seen * 3)).astype(np.float32))
    times = times_ahead(torch.tensor([15.0]), torch.tensor([4.0]))
    path = folder / f"{REFINED}.onnx"
    write_graph(RefinedGraph(net), [pictures, times], path, ["pictures", "times"], ["picture"])
    (made,) = session(path).run(None, {"pictures": pictures.numpy(), "times": times.numpy()})
    frames = pictures.unflatten(3, (-1, 3)).permute(0, 3, 1, 2, 4)
    error = largest_difference(net.predicted(frames, times).numpy(), made)
    if not error <= TOLERANCE:
        raise ValueError(f"{path} differs from torch by {error:.1e} of its largest value.")
    return error
