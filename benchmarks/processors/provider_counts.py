"""Compares ONNX Runtime's own kernels with XNNPACK's, in instructions on emulated processors.

    python -m benchmarks.processors.provider_counts      graphs of the shipped bundle and of its fp32 twin, on a photo

No build of ONNX Runtime for Linux has the XNNPACK provider. LiteRT runs the same graphs (benchmarks/tflite.py) with
XNNPACK's kernels, on one thread. "Signed": the int8 graphs with signed activations, the only ones that the provider
takes, in ONNX Runtime's own kernels. Needs scripts/aarch64-sysroot.sh, which brings Python for aarch64; the runtimes
for it are fetched once. Times on this processor: python -m benchmarks.runtimes.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np
import onnx
from onnx import numpy_helper
from tqdm import tqdm

from benchmarks.graphs import Feed, feeds_of, four_by_three
from benchmarks.processors.emulated import OTHERS, ROOT, SYSROOT, Processor, check_features
from benchmarks.processors.instruction_counts import emulated, prepare
from export.densepose.graphs import open_bundle

WHEELS = ROOT / ".deps/aarch64-wheels"
PACKAGES = ("numpy", "onnxruntime", "ai-edge-litert")
NEEDED = ("backports.strenum", "flatbuffers", "ml_dtypes", "protobuf", "tqdm", "typing-extensions")  # kernels in LiteRT
RUNTIMES = {
    "int8": "ONNX Runtime, int8",
    "signed": "ONNX Runtime, int8 signed",
    "xnnpack-int8": "XNNPACK, int8",
    "fp32": "ONNX Runtime, fp32",
    "xnnpack-fp32": "XNNPACK, fp32",
}


def signed(path: Path) -> onnx.ModelProto:
    """Returns an int8 graph with signed activations: zero points decrease by 128. The results stay."""
    model = onnx.load(path)
    for value in model.graph.initializer:
        if value.data_type == onnx.TensorProto.UINT8:
            less = numpy_helper.to_array(value).astype(np.int16) - 128
            value.CopyFrom(numpy_helper.from_array(less.astype(np.int8), value.name))
    return model


def write_networks(folder: Path, int8: Path, fp32: Path, feeds: dict[str, Feed]) -> None:
    """Writes each graph for each of RUNTIMES, with its inputs beside it."""
    from benchmarks import tflite

    for name, feed in feeds.items():
        for runtime in RUNTIMES:
            source = (fp32 if "fp32" in runtime else int8) / f"{name}.onnx"
            path = folder / runtime / f"{name}{'.tflite' if 'xnnpack' in runtime else '.onnx'}"
            path.parent.mkdir(parents=True, exist_ok=True)
            if runtime == "signed":
                onnx.save(signed(source), path)
            elif "xnnpack" in runtime:
                path.write_bytes(tflite.from_onnx(source, feed))
            else:
                path.write_bytes(source.read_bytes())
            inputs = tflite.channels_last(feed) if "xnnpack" in runtime else feed.values()
            np.savez(path.with_suffix(".npz"), **dict(zip(feed, inputs, strict=True)))


def fetch_wheels() -> None:
    """Fetches the runtimes for aarch64 in the versions installed here. Raises CalledProcessError."""
    pinned = [f"{package}=={version(package)}" for package in PACKAGES]
    stamp = WHEELS / ".made-of"
    if stamp.exists() and stamp.read_text() == " ".join(pinned):
        return
    platforms = [f"--platform=manylinux_2_{k}_aarch64" for k in (17, 27, 28)] + ["--platform=manylinux2014_aarch64"]
    subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps",
                    "--upgrade", "--only-binary=:all:", "--python-version=3.11", *platforms, f"--target={WHEELS}",
                    *pinned, *NEEDED], check=True)  # fmt: skip
    stamp.write_text(" ".join(pinned))


def counted(processor: Processor, networks: Path) -> dict[str, float]:
    """Returns millions of instructions of each network. Raises ValueError with the failure."""
    if processor.build == "aarch64":
        python = ["-E", f"PYTHONPATH={WHEELS}", str(SYSROOT / "usr/bin/python3.11")]
    else:
        python = [sys.executable]
    with tempfile.TemporaryDirectory() as folder:
        counter = Path(folder) / "counter"
        command = [
            *emulated(processor, counter),
            *python,
            str(ROOT / "benchmarks/processors/count_runs.py"),
            str(networks),
            str(counter),
        ]
        done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise ValueError(f"{processor.title}: count_runs failed ({done.returncode}).\n{done.stderr.strip()[-2000:]}")
    return json.loads(done.stdout)


def lines_of(counts: dict[str, float], names: Sequence[str]) -> list[str]:
    """Returns a table in Markdown: a line for each runtime, a column for each graph, the sum, and its ratio to the
    shipped one."""
    lines = ["| | " + " | ".join(names) + " | all | by the shipped |", "| --- |" + " --- |" * (len(names) + 2)]
    rows = {runtime: [] for runtime in RUNTIMES}
    for path, value in counts.items():
        rows[path.split("/")[0]].append((Path(path).stem, value))
    sums = {runtime: sum(value for _, value in row) for runtime, row in rows.items()}
    for runtime, title in RUNTIMES.items():
        row = dict(rows[runtime])
        values = [f"{row[name]:.1f}" for name in names]
        lines.append(
            f"| {title} | " + " | ".join(values) + f" | {sums[runtime]:.1f} | {sums[runtime] / sums['int8']:.2f} |"
        )
    return lines


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.processors.provider_counts",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--int8", type=Path, default=ROOT / "sdk/models/densepose-b-int8", metavar="DIR")
    parser.add_argument("--fp32", type=Path, default=ROOT / "build/benchmarks/densepose-b-fp32", metavar="DIR")
    parser.add_argument("--only", action="append", choices=[processor.name for processor in OTHERS])
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processors at a time (default: the cores)")
    options = parser.parse_args(argv)
    processors = [processor for processor in OTHERS if not options.only or processor.name in options.only]
    try:
        feeds = feeds_of(open_bundle(options.int8), four_by_three())
        prepare(processors)
        for processor in processors:
            check_features(processor)
        if any(processor.build == "aarch64" for processor in processors):
            fetch_wheels()
        with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            write_networks(Path(folder), options.int8, options.fp32, feeds)
            measured = pool.map(lambda processor: counted(processor, Path(folder)), processors)
            found = list(tqdm(measured, total=len(processors), desc="counting", unit="processor", disable=None))
        for processor, counts in zip(processors, found, strict=True):
            print(f"\n{processor.title}, millions of instructions:\n")
            print("\n".join(lines_of(counts, list(feeds))))
    except (ValueError, OSError, subprocess.CalledProcessError) as error:
        print(f"provider_counts: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
