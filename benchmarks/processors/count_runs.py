"""Runs inside an emulator and prints the instructions of each network of a folder, as JSON.

    python count_runs.py FOLDER COUNTER

prints {"xnnpack-int8/trunk.tflite": 123.4, ...}, in millions, of the second run of each.

provider_counts starts it with an interpreter of the emulated processor, so it needs no more than NumPy and the two
runtimes. COUNTER: the file that count_instructions.c writes.
"""

import json
import mmap
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np


def runner_of(path: Path, feed: dict[str, np.ndarray]) -> Callable[[], object]:
    """Runs a network on one thread. feed: the inputs in their order."""
    if path.suffix == ".onnx":
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
        return lambda: session.run(None, feed)
    from ai_edge_litert.interpreter import Interpreter

    interpreter = Interpreter(model_path=str(path), num_threads=1)
    interpreter.allocate_tensors()
    for place, value in zip(interpreter.get_input_details(), feed.values(), strict=True):
        interpreter.set_tensor(place["index"], value)
    return interpreter.invoke


def main() -> None:
    folder = Path(sys.argv[1])
    with open(sys.argv[2], "rb") as file:
        counter = mmap.mmap(file.fileno(), 8, access=mmap.ACCESS_READ)
    counts = {}
    for path in sorted([*folder.rglob("*.onnx"), *folder.rglob("*.tflite")]):
        run = runner_of(path, dict(np.load(path.with_suffix(".npz"))))
        run()
        before = int.from_bytes(counter[:8], sys.byteorder)
        run()
        after = int.from_bytes(counter[:8], sys.byteorder)
        counts[str(path.relative_to(folder))] = (after - before) / 1e6
    print(json.dumps(counts))


if __name__ == "__main__":
    main()
