"""The float graph that quantization starts from, and that its error is measured against."""

from __future__ import annotations

from pathlib import Path

import onnx
from onnxruntime.quantization.shape_inference import quant_pre_process


def prepare(source: Path, target: Path) -> onnx.ModelProto:
    """Writes `source` with ONNX Runtime's own preparation (shapes, fused constants); returns it. The numbers are
    the same but for rounding, the names those of the int8 graph."""
    quant_pre_process(source, target, skip_symbolic_shape=True)
    return onnx.load(target)
