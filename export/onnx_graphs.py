"""Functions that all exports of ONNX graphs share: writing and checking a graph, folding batch normalisation,
layouts."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import onnx
import torch
from torch import Tensor, nn
from torch.nn import functional as F
from torch.nn.utils.fusion import fuse_conv_bn_eval

from export.bundle import OPSET


def channels_last(x: Tensor) -> Tensor:
    """[N, C, h, w] as [N, h, w, C]: the layout at the graphs' borders, which int8 kernels and RoIAlign work in."""
    return x.permute(0, 2, 3, 1).contiguous()


def channels_first(x: Tensor) -> Tensor:
    return x.permute(0, 3, 1, 2)


class Doubled(torch.autograd.Function):
    """Nearest upsampling of [N, C, h, w] by two to the size of `like`, by writing cells and rows twice.

    ONNX Runtime's Resize takes ten times as long on channels-last bytes.
    """

    @staticmethod
    def forward(ctx: object, x: Tensor, like: Tensor) -> Tensor:
        return F.interpolate(x, size=like.shape[2:], mode="nearest")

    @staticmethod
    def symbolic(g: object, x: object, like: object) -> object:
        cells = g.op("Transpose", x, perm_i=[0, 2, 3, 1])
        line = g.op("Constant", value_t=torch.tensor([0, 0, 1, -1]))
        rows = g.op("Reshape", g.op("Concat", cells, cells, axis_i=3), line)
        shape = g.op("Shape", g.op("Transpose", like, perm_i=[0, 2, 3, 1]))
        twice = g.op("Reshape", g.op("Concat", rows, rows, axis_i=2), shape)
        return g.op("Transpose", twice, perm_i=[0, 3, 1, 2])


def doubled(x: Tensor, like: Tensor) -> Tensor:
    return Doubled.apply(x, like) if torch.onnx.is_in_onnx_export() else Doubled.forward(None, x, like)


def fold_batch_norm(net: nn.Module) -> None:
    """Takes the batch normalisations of a network in evaluation mode into the convolutions before them, in place.

    Raises ValueError where one has no convolution before it in its nn.Sequential.
    """
    for layers in [module for module in net.modules() if isinstance(module, nn.Sequential)]:
        children = list(layers.named_children())
        for (name, conv), (norm_name, norm) in itertools.pairwise(children):
            if isinstance(conv, nn.Conv2d) and isinstance(norm, nn.BatchNorm2d):
                setattr(layers, name, fuse_conv_bn_eval(conv, norm))
                setattr(layers, norm_name, nn.Identity())
    left = [name for name, module in net.named_modules() if isinstance(module, nn.BatchNorm2d)]
    if left:
        raise ValueError(f"batch normalisation without a convolution before it: {', '.join(left)}")


def joined(*layers: nn.Module) -> nn.Linear:
    """One matrix that gives the outputs of all layers (nn.Linear, or nn.Conv2d of kernel 1), in their order."""
    weight = torch.cat([layer.weight.detach().flatten(1) for layer in layers])
    linear = nn.Linear(weight.shape[1], weight.shape[0])
    linear.weight.data, linear.bias.data = weight, torch.cat([layer.bias.detach() for layer in layers])
    return linear


def write_graph(
    module: nn.Module,
    given: Sequence[Tensor],
    path: Path,
    inputs: Sequence[str],
    outputs: Sequence[str],
    axes: Mapping[str, Mapping[int, str]] | None = None,
) -> None:
    """Writes a module, traced on what is given, as the graph `path.stem`, checked. axes: the sizes that stay open, by
    the names of inputs and outputs."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the exporter that knows our own operations is called deprecated
        torch.onnx.export(
            module.eval(),
            tuple(given),
            path,
            input_names=list(inputs),
            output_names=list(outputs),
            dynamic_axes=axes,
            opset_version=OPSET,
            dynamo=False,
        )
    model = onnx.load(path)
    model.graph.name = path.stem
    _take_out_identities(model.graph)
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, path)


def _take_out_identities(graph: onnx.GraphProto) -> None:
    """The exporter shares equal constants by Identity nodes."""
    answers = {value.name for value in graph.output}
    idle = {n.output[0]: n.input[0] for n in graph.node if n.op_type == "Identity" and n.output[0] not in answers}
    kept = [node for node in graph.node if not idle.keys() & set(node.output)]
    for node in kept:
        for k, tensor in enumerate(node.input):
            while tensor in idle:
                tensor = idle[tensor]
            node.input[k] = tensor
    del graph.node[:]
    graph.node.extend(kept)


def largest_difference(expected: np.ndarray, found: np.ndarray) -> float:
    """Largest |found - expected|, relative to the largest |expected|; NaN where a number is one."""
    return float(np.abs(found - expected).max() / max(np.abs(expected).max(), 1e-9))
