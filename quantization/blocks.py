"""The blocks of a graph that could stay float, and what each gains alone."""

from __future__ import annotations

import fnmatch
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import onnx
from onnxruntime.quantization.calibrate import TensorsData
from tqdm import tqdm

from quantization.analysis.errors import output_sqnr
from quantization.graphs import qdq
from quantization.graphs.activations import Activations
from quantization.quantize import correct, quantize_prepared
from quantization.samples import Sample
from quantization.settings import GraphSettings


@dataclass(frozen=True)
class Candidate:
    """graph; pattern: for float_nodes; gain: drop of noise over signal, mean of the graph's outputs; sqnr: the same as
    the mean of the outputs in dB, before and after; bytes: that the graph grows; macs: multiply-adds of one sample in
    float."""

    graph: str
    pattern: str
    gain: float
    sqnr: tuple[float, float]
    bytes: int
    macs: int

    @property
    def rank(self) -> float:
        """Gain a byte; what costs nothing counts as one byte."""
        return self.gain / max(self.bytes, 1)


@dataclass
class Workpiece:
    """One prepared graph with its ranges: everything that making it int8 needs."""

    name: str
    path: Path
    ranges: TensorsData
    settings: GraphSettings
    calibration: list[Sample]
    held_out: list[Sample]

    def quantize(self, target: Path, extra: tuple[str, ...] = ()) -> None:
        settings = replace(self.settings, float_nodes=self.settings.float_nodes + extra)
        quantize_prepared(self.path, target, self.ranges, settings)
        correct(self.path, target, self.calibration, settings)


def block_of(name: str) -> str:
    """The pattern of the block that a node belongs to: the first two parts of its name, /backbone/blocks.3/*."""
    parts = name.strip("/").split("/")
    return f"/{'/'.join(parts[:2])}/*" if len(parts) > 2 else name


def blocks(graph: onnx.GraphProto, float_nodes: tuple[str, ...]) -> list[str]:
    """Patterns of the blocks with convolutions or matrix products that do not all stay float already."""
    names = [n.name for n in qdq.heavy_nodes(graph)]
    left = [n for n in names if not any(fnmatch.fnmatchcase(n, pattern) for pattern in float_nodes)]
    return list(dict.fromkeys(block_of(name) for name in left))


def relative_noise(sqnr: dict[str, float]) -> float:
    """Mean over outputs of noise over signal."""
    return float(np.mean([10 ** (-value / 10) for value in sqnr.values()]))


def multiply_adds(piece: Workpiece) -> dict[str, int]:
    """Multiply-adds of each convolution and matrix product on the first held-out sample."""
    model = onnx.load(piece.path)
    known = qdq.constants(model.graph)
    heavy = [n for n in qdq.heavy_nodes(model.graph) if n.input[1] in known]
    made = Activations(model, [n.output[0] for n in heavy])(piece.held_out[0])
    counts = {}
    for node in heavy:
        weight = known[node.input[1]]
        transposed = any(a.name == "transB" and a.i for a in node.attribute)
        each = weight[0].size if node.op_type == "Conv" or transposed else weight.shape[0]
        counts[node.name] = int(made[node.output[0]].size * each)
    return counts


def candidates(piece: Workpiece) -> list[Candidate]:
    """Every block of one graph, tried alone; best first."""
    macs = multiply_adds(piece)
    found = []
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "tried.onnx"
        piece.quantize(target)
        before, size = output_sqnr(piece.path, target, piece.held_out), target.stat().st_size
        patterns = blocks(onnx.load(piece.path).graph, piece.settings.float_nodes)
        for pattern in tqdm(patterns, desc=f"blocks of {piece.name}", unit="block", leave=False, disable=None):
            piece.quantize(target, (pattern,))
            after = output_sqnr(piece.path, target, piece.held_out)
            found.append(
                Candidate(
                    piece.name,
                    pattern,
                    relative_noise(before) - relative_noise(after),
                    (float(np.mean(list(before.values()))), float(np.mean(list(after.values())))),
                    target.stat().st_size - size,
                    sum(count for name, count in macs.items() if fnmatch.fnmatchcase(name, pattern)),
                )
            )
    return sorted(found, key=lambda c: -c.rank)
