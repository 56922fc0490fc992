"""How far a quantized graph is from its float original."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np
import onnx

from export.densepose.graphs import session
from quantization.samples import Sample


def sqnr_db(signal_power: float, noise_power: float) -> float:
    """Signal to quantization noise in decibels; infinite without noise."""
    return float("inf") if noise_power == 0 else float(10 * np.log10(max(signal_power, 1e-30) / noise_power))


def output_sqnr(reference: Path, quantized: Path, samples: list[Sample]) -> dict[str, float]:
    """SQNR in dB of each output over the samples."""
    first, second = session(reference), session(quantized)
    names = [output.name for output in first.get_outputs()]
    signal: dict[str, float] = defaultdict(float)
    noise: dict[str, float] = defaultdict(float)
    for sample in samples:
        pairs = zip(
            names,
            first.run(names, sample),
            second.run(names, sample),
            strict=True,
        )
        for name, expected, actual in pairs:
            signal[name] += float(np.square(expected, dtype=np.float64).sum())
            noise[name] += float(np.square(expected.astype(np.float64) - actual).sum())
    return {name: sqnr_db(signal[name], noise[name]) for name in names}


def float_nodes_left(quantized: Path) -> list[str]:
    """Convolutions and matrix products that do not read quantized weights."""
    graph = onnx.load(quantized).graph
    dequantized = {name for node in graph.node if node.op_type == "DequantizeLinear" for name in node.output}
    heavy = [node for node in graph.node if node.op_type in ("Conv", "ConvTranspose", "Gemm", "MatMul")]
    return [node.name for node in heavy if node.input[1] not in dequantized]
