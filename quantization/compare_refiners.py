"""Refiners compared: parameters, multiply-adds and milliseconds under ONNX Runtime, fp32 and int8.

    python -m quantization.compare_refiners                       all candidates at 640 x 480, two threads
    python -m quantization.compare_refiners --only light --json refiners.json

Weights are random and so are the rasters: time does not depend on them. Each figure is the 10th percentile of many
runs; `core ms` is processor time of a run with one thread, which others who use the machine disturb least. Candidates
are measured alternately, so that a busy minute does not hit one of them alone.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from pathlib import Path

import numpy as np
import onnxruntime
import torch
from rich.console import Console
from rich.table import Table
from torch import Tensor, nn
from tqdm import tqdm

from export.scenes.config import RefinerConfig
from export.scenes.export_onnx import RefinerGraph, export_refiner, raster_shapes
from export.scenes.networks.refiner import Refiner, make_refiner
from quantization.quantize import quantize_graph
from quantization.settings import GraphSettings

CANDIDATES = {
    "gated (paper)": RefinerConfig("gated"),
    "plain, paper's widths": RefinerConfig(space_to_depth=False, widths=(16, 32, 48, 64, 80)),
    "plain, full size, narrow": RefinerConfig(space_to_depth=False, widths=(8, 16, 24, 32, 48)),
    "light L": RefinerConfig(widths=(48, 64, 80, 96)),
    "light M": RefinerConfig(widths=(32, 48, 64, 80)),
    "light S": RefinerConfig(widths=(24, 32, 48, 64)),
    "light S, add": RefinerConfig(join="add", widths=(24, 32, 48, 64)),
    "light S, 4 scales": RefinerConfig(widths=(24, 32, 48)),
    "light S, separable": RefinerConfig(block="separable", widths=(24, 32, 48, 64)),
    "light M, separable": RefinerConfig(block="separable", widths=(32, 48, 64, 80)),
    "light XS": RefinerConfig(widths=(16, 24, 32, 48)),
    "light XS, add": RefinerConfig(join="add", widths=(16, 24, 32, 48)),
}


def multiply_adds(module: nn.Module, *given: Tensor) -> int:
    """Multiply-adds of all convolutions."""
    total = 0

    def count(layer: nn.Module, _: tuple, output: Tensor) -> None:
        nonlocal total
        total += output.numel() * layer.weight[0].numel()

    hooks = [m.register_forward_hook(count) for m in module.modules() if isinstance(m, nn.Conv2d)]
    with torch.no_grad():
        module(*given)
    for hook in hooks:
        hook.remove()
    return total


def made_up_rasters(refiner: Refiner, height: int, width: int) -> dict[str, np.ndarray]:
    """Features of points that cover half of the pixels; 0 elsewhere."""
    random, given = np.random.default_rng(0), {}
    for name, shape in raster_shapes(refiner, height, width).items():
        raster = random.standard_normal(shape, np.float32)
        covered = random.random((*shape[:3], 1)) < 0.5
        raster[..., 8::9] = 1
        given[name] = raster * covered.astype(np.float32)
    return given


def open_session(path: Path, threads: int, height: int, width: int) -> onnxruntime.InferenceSession:
    """With the open sizes of the graph fixed."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.log_severity_level = 3
    for k in range(5):
        for name, size in (("height", height), ("width", width)):
            options.add_free_dimension_override_by_name(f"{name}/{1 << k}" if k else name, size >> k)
    return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])


def runs(session: onnxruntime.InferenceSession, given: dict[str, np.ndarray], count: int) -> tuple[list, list]:
    """Milliseconds of wall clock and of processor time, of each run."""
    wall, core = [], []
    session.run(None, given)
    for _ in range(count):
        start, spent = time.perf_counter(), time.process_time()
        session.run(None, given)
        wall.append(1e3 * (time.perf_counter() - start))
        core.append(1e3 * (time.process_time() - spent))
    return wall, core


def measure(names: list[str], height: int, width: int, rounds: int) -> dict[str, dict]:
    """One row a candidate."""
    rows, times = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        graphs = {}
        for name in tqdm(names, desc="exporting", leave=False):
            torch.manual_seed(0)
            refiner = make_refiner(CANDIDATES[name]).eval()
            given = made_up_rasters(refiner, height, width)
            rows[name] = {
                "parameters": sum(p.numel() for p in refiner.parameters()),
                "mega_macs": multiply_adds(RefinerGraph(refiner), *map(torch.from_numpy, given.values())) / 1e6,
            }
            paths = {kind: Path(folder) / f"{len(graphs)}-{kind}.onnx" for kind in ("fp32", "int8")}
            export_refiner(refiner, paths["fp32"])
            quantize_graph(paths["fp32"], paths["int8"], [given], GraphSettings(depthwise_8_bit=True))
            for kind, path in paths.items():
                rows[name][f"{kind}_megabytes"] = path.stat().st_size / 1e6
            graphs[name] = paths, given
        for _ in tqdm(range(rounds), desc="measuring", leave=False):
            for name, (paths, given) in graphs.items():
                for kind, path in paths.items():
                    for threads in (1, 2):
                        wall, core = runs(open_session(path, threads, height, width), given, 8)
                        kept = core if threads == 1 else wall
                        times.setdefault((name, f"{kind}_{'core' if threads == 1 else 'wall'}_ms"), []).extend(kept)
    for (name, figure), values in times.items():
        rows[name][figure] = float(np.percentile(values, 10))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", default="640x480", help="of the image, multiples of 16")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", default="", help="candidates whose name begins so")
    parser.add_argument("--json", type=Path, help="also write the metrics here")
    options = parser.parse_args()
    width, height = (int(side) for side in options.size.split("x"))
    if width % 16 or height % 16:
        parser.error(f"--size {options.size}: sides must be multiples of 16")
    names = [name for name in CANDIDATES if name.startswith(options.only)]
    rows = measure(names, height, width, options.rounds)
    table = Table(title=f"{width} x {height}, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    figures = ("parameters", "mega_macs", "fp32_wall_ms", "fp32_core_ms", "int8_wall_ms", "int8_core_ms")
    for column in ("refiner", *figures):
        table.add_column(column.replace("_", " "), justify="left" if column == "refiner" else "right")
    for name, row in rows.items():
        cells = (f"{row[f]:.1f}" if f.endswith("ms") else f"{row[f]:,.0f}" for f in figures)
        table.add_row(name, *cells)
    Console().print(table)
    if options.json:
        options.json.write_text(json.dumps({"size": options.size, "load": os.getloadavg()[0], "rows": rows}, indent=1))


if __name__ == "__main__":
    main()
