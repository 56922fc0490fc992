"""Compares the time of the same graphs in several runtimes, measured alternately.

    python -m benchmarks.runtimes            writes build/benchmarks/runtimes.json

Each graph gets what it sees on a photograph of one person (640 x 480, the bundle's input size). All use the same
number of threads and fixed sizes, and are measured alternately, round by round; a figure is the median over rounds.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
import onnxruntime
from rich.console import Console
from rich.table import Table
from tqdm import tqdm

from benchmarks import roofline
from benchmarks.graphs import Feed, feeds_of, four_by_three, work_of
from export.densepose.bundle import GRAPHS
from export.densepose.graphs import open_bundle


@dataclass(frozen=True)
class Runner:
    """run: runs one graph on fixed inputs, which is timed. read: returns the outputs of the last run."""

    run: Callable[[], object]
    read: Callable[[], list[np.ndarray]]


TOLERANCE = 0.02  # largest accepted difference from our results, relative to the largest value


@dataclass
class Runtime:
    """A runtime with a precision. ms: median milliseconds of each graph. missing: why it was not measured."""

    name: str
    version: str
    precision: str
    ms: dict[str, float] = field(default_factory=dict)
    missing: str = ""
    runs: dict[str, Runner] = field(default_factory=dict, repr=False)

    @property
    def total_ms(self) -> float:
        return sum(self.ms.values())


def maquette_runs(folder: Path, feeds: dict[str, Feed], threads: int) -> tuple[str, dict[str, Runner]]:
    """Returns ONNX Runtime with the settings of sdk/src/nn/session.cpp."""
    runs = {}
    for name, feed in feeds.items():
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        options.add_session_config_entry("session.force_spinning_stop", "1")
        options.log_severity_level = 3
        session = onnxruntime.InferenceSession(folder / f"{name}.onnx", options, providers=["CPUExecutionProvider"])
        binding = session.io_binding()
        for x, value in feed.items():
            binding.bind_cpu_input(x, value)
        outputs = session.run(None, feed)
        for output, value in zip(session.get_outputs(), outputs, strict=True):
            binding.bind_output(output.name, "cpu", 0, np.float32, value.shape, value.ctypes.data)

        run = partial(session.run_with_iobinding, binding)
        runs[name] = Runner(run, lambda outputs=outputs: outputs)
    return onnxruntime.__version__, runs


def openvino_runs(folder: Path, feeds: dict[str, Feed], threads: int) -> tuple[str, dict[str, Runner]]:
    """Returns OpenVINO with the latency hint, in float32 if the graph is float."""
    import openvino

    core, runs = openvino.Core(), {}
    settings = {"PERFORMANCE_HINT": "LATENCY", "INFERENCE_NUM_THREADS": threads, "INFERENCE_PRECISION_HINT": "f32"}
    for name, feed in feeds.items():
        model = core.read_model(folder / f"{name}.onnx")
        model.reshape({x: list(value.shape) for x, value in feed.items()})
        request = core.compile_model(model, "CPU", settings).create_infer_request()
        for x, value in feed.items():
            request.set_tensor(x, openvino.Tensor(value, shared_memory=True))

        def read(request: object = request, count: int = len(model.outputs)) -> list[np.ndarray]:
            return [request.get_output_tensor(k).data for k in range(count)]

        runs[name] = Runner(request.infer, read)
    return openvino.__version__.split("-")[0], runs


def torch_runs(checkpoint: Path, feeds: dict[str, Feed], threads: int) -> tuple[str, dict[str, Runner]]:
    """Returns the trained network in PyTorch: eager, channels last, batch normalisation folded as in the exported
    graphs."""
    import torch

    torch.set_num_threads(threads)
    runs = {}
    for name, (module, inputs) in torch_modules(checkpoint, feeds).items():
        module = module.to(memory_format=torch.channels_last)
        inputs = [x.contiguous(memory_format=torch.channels_last) for x in inputs]

        found: list = []

        def run(module: torch.nn.Module = module, inputs: list = inputs, found: list = found) -> None:
            with torch.inference_mode():
                found[:] = [module(*inputs)]

        def read(found: list = found) -> list[np.ndarray]:
            return [x.numpy() for x in (found[0] if isinstance(found[0], tuple | list) else found)]

        runs[name] = Runner(run, read)
    return torch.__version__.split("+")[0], runs


def torch_modules(checkpoint: Path, feeds: dict[str, Feed]) -> dict[str, tuple]:
    """Returns the module of each graph in evaluation mode, and its inputs."""
    import torch

    from export.densepose.config import NetworkConfig
    from export.densepose.export_onnx import graph_modules
    from export.densepose.network import MobileParsingRCNN
    from export.densepose.simplified import simplified

    saved = torch.load(checkpoint, map_location="cpu", weights_only=True)
    net = MobileParsingRCNN(NetworkConfig.of(saved))
    net.load_state_dict(saved["ema"])
    modules = graph_modules(simplified(net))
    return {name: (modules[name].eval(), [torch.from_numpy(x) for x in feed.values()]) for name, feed in feeds.items()}


def ncnn_runs(checkpoint: Path, feeds: dict[str, Feed], threads: int) -> tuple[str, dict[str, Runner]]:
    """Returns ncnn, whose graphs pnnx converts from PyTorch. It takes one image or RoI at a time, because ncnn has no
    batches."""
    import ncnn
    import pnnx

    runs = {}
    for name, (module, inputs) in torch_modules(checkpoint, feeds).items():
        count = len(inputs[0])
        single = [x[:1].contiguous() for x in inputs]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"{name}.pt"
            _silently(lambda module=module, path=path, single=single: pnnx.export(module, str(path), tuple(single)))
            net = ncnn.Net()
            net.opt.num_threads = threads
            if net.load_param(str(path.with_suffix(".ncnn.param"))) or net.load_model(
                str(path.with_suffix(".ncnn.bin"))
            ):
                raise RuntimeError(f"ncnn cannot load {name}")
        arrays = [x.numpy() for x in inputs]
        outputs = sorted(net.output_names(), key=lambda x: int(x.removeprefix("out")))

        found = []

        def run(
            net: object = net, arrays: list = arrays, outputs: list = outputs, count: int = count, found: list = found
        ) -> None:
            found.clear()
            for k in range(count):
                extractor = net.create_extractor()
                for i, array in enumerate(arrays):
                    extractor.input(f"in{i}", ncnn.Mat(array[k]))
                found.append([extractor.extract(x)[1] for x in outputs])

        def read(found: list = found) -> list[np.ndarray]:
            return [np.stack([np.array(x) for x in values]) for values in zip(*found, strict=True)]

        runs[name] = Runner(run, read)
    return ncnn.__version__, runs


def _silently(work: Callable[[], object]) -> None:
    """Runs `work` without its output, including output of C++ code."""
    sys.stdout.flush()
    kept = os.dup(1), os.dup(2)
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1), os.dup2(nowhere.fileno(), 2)
        try:
            work()
        finally:
            for target, descriptor in zip((1, 2), kept, strict=True):
                os.dup2(descriptor, target)
                os.close(descriptor)


def prepare(int8: Path, float32: Path, checkpoint: Path, feeds: dict[str, Feed], threads: int) -> list[Runtime]:
    """Loads the graphs in all runtimes; a runtime that cannot load them records why."""
    makers = {
        ("Maquette", "int8"): lambda: maquette_runs(int8, feeds, threads),
        ("Maquette", "fp32"): lambda: maquette_runs(float32, feeds, threads),
        ("OpenVINO", "int8"): lambda: openvino_runs(int8, feeds, threads),
        ("OpenVINO", "fp32"): lambda: openvino_runs(float32, feeds, threads),
        ("PyTorch", "fp32"): lambda: torch_runs(checkpoint, feeds, threads),
        ("ncnn", "fp32"): lambda: ncnn_runs(checkpoint, feeds, threads),
    }
    runtimes = []
    for (name, precision), make in makers.items():
        runtime = Runtime(name, "", precision)
        try:
            runtime.version, runtime.runs = make()
        except ImportError as error:
            runtime.missing = f"not installed ({error.name}); scripts/make-venv.sh train,bench installs it"
        except Exception as error:  # any failure of another runtime is a result, not an error of this program
            runtime.missing = " ".join(str(error).split())[:200] or type(error).__name__
        runtimes.append(runtime)
    return runtimes


def compare_outputs(runtimes: list[Runtime]) -> None:
    """Removes runtimes with other results than ours, because they compute something else."""

    def results(runner: Runner) -> list[np.ndarray]:
        runner.run()
        return [x.reshape(-1) for x in runner.read()]

    ours = {
        runtime.precision: {name: results(runner) for name, runner in runtime.runs.items()} for runtime in runtimes[:2]
    }
    for runtime in runtimes[2:]:
        # int8 sums are exact, but each runtime rounds scales and fuses layers in its own way.
        limit = TOLERANCE if runtime.precision == "fp32" else 10 * TOLERANCE
        for name, runner in runtime.runs.items():
            for expected, actual in zip(ours[runtime.precision][name], results(runner), strict=True):
                same_size = expected.size == actual.size
                error = np.abs(expected - actual).max() / max(np.abs(expected).max(), 1e-6) if same_size else np.inf
                if error > limit:
                    runtime.missing = f"{name} differs from ours by {error:.2f} of its largest value"
        if runtime.missing:
            runtime.runs = {}


def time_alternately(runtimes: list[Runtime], rounds: int, block: int) -> None:
    """Fills `ms`. In each round every runtime runs each graph once to warm up, then `block` times; the median of the
    block counts."""
    times: dict[tuple[int, str], list[float]] = {}
    for _ in tqdm(range(rounds), desc="runtimes", unit="round", disable=None):
        for name in runtimes[0].runs:
            for k, runtime in enumerate(runtimes):
                if name not in runtime.runs:
                    continue
                runtime.runs[name].run()
                values = []
                for _ in range(block):
                    start = time.perf_counter()
                    runtime.runs[name].run()
                    values.append(1e3 * (time.perf_counter() - start))
                times.setdefault((k, name), []).append(statistics.median(values))
                time.sleep(0.002)  # threads of some runtimes stay awake for a moment
    for (k, name), values in times.items():
        runtimes[k].ms[name] = round(statistics.median(values), 4)


def rows_of(runtimes: list[Runtime]) -> list[dict]:
    """Returns the rows of a document. The first is ours in int8; its time for the same graphs is divided by that of
    each other runtime."""
    rows = []
    for runtime in runtimes:
        row = {key: getattr(runtime, key) for key in ("name", "version", "precision", "ms", "missing")}
        row["total_ms"] = round(runtime.total_ms, 4) if runtime.ms else None
        of_same = sum(runtimes[0].ms[name] for name in runtime.ms)
        row["ours_int8_ratio"] = round(of_same / runtime.total_ms, 4) if runtime.ms else None
        rows.append(row)
    return rows


def measure(
    int8: Path, float32: Path, checkpoint: Path, threads: int = 2, rounds: int = 15, block: int = 7
) -> dict[str, object]:
    """Returns the document: the runtimes and, for each, the ratio of our time to its time."""
    feeds = feeds_of(open_bundle(int8), four_by_three())
    runtimes = prepare(int8, float32, checkpoint, feeds, threads)
    compare_outputs(runtimes)
    time_alternately(runtimes, rounds, block)
    rows = rows_of(runtimes)
    work = {name: work_of(int8 / f"{name}.onnx", feed) for name, feed in feeds.items()}
    sizes = {name: [list(x.shape) for x in feed.values()] for name, feed in feeds.items()}
    return {"threads": threads, "rounds": rounds, "inputs": sizes, "runtimes": rows,
            "roofline": roofline.measure(work, runtimes[0].ms, threads)}  # fmt: skip


def print_table(document: dict, graphs: Sequence[str] = GRAPHS) -> None:
    table = Table(title="Milliseconds per graph: same inputs, runtimes measured alternately", title_justify="left")
    for column in ("runtime", *graphs, "all", "int8 Maquette by it"):
        table.add_column(column, justify="left" if column == "runtime" else "right")
    for row in document["runtimes"]:
        name = f"{row['name']} {row['version']} {row['precision']}"
        if row["total_ms"] is None:
            table.add_row(name, row["missing"])
            continue
        times = [f"{row['ms'][graph]:.2f}" if graph in row["ms"] else "" for graph in graphs]
        table.add_row(name, *times, f"{row['total_ms']:.2f}", f"{row['ours_int8_ratio']:.2f}")
    Console().print(table)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--int8", type=Path, default=Path("sdk/models/densepose-b-int8"), metavar="DIR")
    parser.add_argument("--fp32", type=Path, default=Path("build/benchmarks/densepose-b-fp32"), metavar="DIR")
    parser.add_argument("--checkpoint", type=Path, default=Path("export/weights/densepose-b.pt"), metavar="FILE")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks/runtimes.json"), metavar="JSON")
    options = parser.parse_args(argv)
    document = measure(options.int8, options.fp32, options.checkpoint, options.threads, options.rounds)
    print_table(document)
    line = document["roofline"]
    peaks = [line[name] / 1e9 for name in ("float32_macs_s", "int8_macs_s", "bytes_s")]
    print("Peak {:.0f} (float32), {:.0f} (int8) billion multiply-adds a second, {:.0f} GB/s".format(*peaks))
    print(f"Fraction of that roofline: {line['fraction']:.0%}")
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(json.dumps(document, indent=1) + "\n")
    print(f"Written: {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
