"""Measures the peak rates of this machine, and the fraction of them that the networks reach.

Each convolution and matrix product takes at least its multiply-adds over the peak rate of its number format, and at
least its bytes over the bandwidth. The sum of the larger of the two over a graph is a lower bound of its time (the
roofline model of Williams, Waterman and Patterson, 2009, layer by layer). The fraction is this bound divided by the
measured time. The bandwidth is measured within the caches, where the networks' maps lie.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper

from benchmarks.graphs import Work

SIZES = (768, 1024, 1536)  # sizes of the square products with which the peak is measured
COPIED_BYTES = 1 << 20  # fits the second-level cache, read and written


def best_seconds(work: Callable[[], object], repeats: int = 9) -> float:
    """Returns the median of several runs after two warm-up runs."""
    work(), work()
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds)


def product_session(size: int, integer: bool, threads: int) -> tuple[onnxruntime.InferenceSession, dict]:
    """Builds one matrix product of ONNX Runtime: float32, or uint8 by int8 with constant weights."""
    kinds = (TensorProto.UINT8, TensorProto.INT32) if integer else (TensorProto.FLOAT, TensorProto.FLOAT)
    rng = np.random.default_rng(0)
    weight = rng.integers(-64, 64, (size, size)).astype(np.int8 if integer else np.float32)
    given = rng.integers(0, 255, (size, size)).astype(np.uint8 if integer else np.float32)
    node = helper.make_node("MatMulInteger" if integer else "MatMul", ["x", "w"], ["y"])
    value = helper.make_tensor_value_info
    graph = helper.make_graph(
        [node],
        "product",
        [value("x", kinds[0], [size, size])],
        [value("y", kinds[1], [size, size])],
        [onnx.numpy_helper.from_array(weight, "w")],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    return onnxruntime.InferenceSession(model.SerializeToString(), options), {"x": given}


def peak_rate(integer: bool, threads: int) -> float:
    """Returns multiply-adds a second of the fastest product of ONNX Runtime and PyTorch."""
    import torch

    torch.set_num_threads(threads)
    rates = []
    for size in SIZES:
        session, feed = product_session(size, integer, threads)
        works: list[Callable[[], object]] = [lambda session=session, feed=feed: session.run(None, feed)]
        if integer:
            a, b = (torch.randint(-64, 64, (size, size), dtype=torch.int8) for _ in range(2))
            works.append(lambda a=a, b=b: torch._int_mm(a, b))
        else:
            a, b = (torch.rand(size, size) for _ in range(2))
            works.append(lambda a=a, b=b: a @ b)
        rates += [size**3 / best_seconds(work) for work in works]
    return max(rates)


def bandwidth(threads: int) -> float:
    """Returns bytes a second, read and written, of copies within the caches."""
    import torch

    torch.set_num_threads(threads)
    source = torch.ones(COPIED_BYTES // 8, dtype=torch.float32)
    target = torch.empty_like(source)
    copies = 200
    return 2 * copies * source.nbytes / best_seconds(lambda: [target.copy_(source) for _ in range(copies)])


def min_seconds(work: list[Work], float_rate: float, integer_rate: float, byte_rate: float) -> float:
    return sum(max(w.macs / (integer_rate if w.integer else float_rate), w.bytes / byte_rate) for w in work)


def measure(work: dict[str, list[Work]], ms: dict[str, float], threads: int = 2) -> dict[str, object]:
    """work, ms: operations of each graph and its measured time in milliseconds."""
    rates = {"float32_macs_s": peak_rate(False, threads), "int8_macs_s": peak_rate(True, threads)}
    rates["bytes_s"] = bandwidth(threads)
    graphs = {}
    for name, operations in work.items():
        least = 1e3 * min_seconds(operations, *rates.values())
        graphs[name] = {
            "macs": sum(w.macs for w in operations),
            "int8_macs": sum(w.macs for w in operations if w.integer),
            "bytes": sum(w.bytes for w in operations),
            "min_ms": round(least, 4),
            "fraction": round(least / ms[name], 4),
        }
    least = sum(graph["min_ms"] for graph in graphs.values())
    return {"threads": threads, **rates, "graphs": graphs, "fraction": round(least / sum(ms.values()), 4)}
