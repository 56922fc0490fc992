"""The process of one product. Started by `running.py`, in the product's own environment.

    python -m benchmarks.products.worker '{"adapter": "module:Class", "settings": {}}'

It answers messages on stdin (`protocol.py`) on stdout. All other output, of C++ code too, goes to stderr.
"""

from __future__ import annotations

import importlib
import json
import os
import resource
import socket
import sys
import time
from pathlib import Path
from typing import Any, BinaryIO, Protocol

import numpy as np

from benchmarks.products.protocol import receive, send


class Adapter(Protocol):
    """A product."""

    def start(self) -> None:
        """The next frame is the first one of another stream."""

    def photo(self, image: np.ndarray) -> Any:
        """image: uint8 [H, W, 3] RGB. Returns the product's own result. This is timed."""

    def frame(self, image: np.ndarray, sequence: int, time_ns: int) -> Any:
        """The same for a frame of a stream; sequence: from 0. This is timed."""

    def count(self, result: Any) -> int:
        """Number of people."""

    def found(self, result: Any, shape: tuple[int, int]) -> dict[str, np.ndarray]:
        """Arrays box [n, 4], score [n], inds [H, W], keypoint [n, 33, 3] as of `export.evaluation.backends.Prediction`,
        and id [n]: the person's number from frame to frame."""


class Worker:
    def __init__(self, adapter: Adapter) -> None:
        self._adapter = adapter
        self._kept: dict[str, list[np.ndarray]] = {}

    def answer(self, message: dict, arrays: dict[str, np.ndarray]) -> tuple[dict, dict[str, np.ndarray]]:
        return getattr(self, f"_{message.pop('do')}")(arrays, **message)

    def _start(self, _: dict) -> tuple[dict, dict]:
        self._adapter.start()
        return {}, {}

    def _photo(self, arrays: dict) -> tuple[dict, dict[str, np.ndarray]]:
        image = arrays["image"]
        return {}, self._adapter.found(self._adapter.photo(image), image.shape[:2])

    def _frame(self, arrays: dict, sequence: int, time_ns: int) -> tuple[dict, dict[str, np.ndarray]]:
        image = arrays["image"]
        return {}, self._adapter.found(self._adapter.frame(image, sequence, time_ns), image.shape[:2])

    def _keep(self, arrays: dict, name: str) -> tuple[dict, dict]:
        """Keeps images to be timed."""
        self._kept[name] = [image.copy() for image in arrays.values()]
        return {}, {}

    def _time_photo(self, _: dict, name: str, index: int) -> tuple[dict, dict]:
        return self._timed(lambda: self._adapter.photo(self._kept[name][index])), {}

    def _time_frames(self, _: dict, name: str, warm_up: int, step_ns: int) -> tuple[dict, dict]:
        """Runs the kept images as a stream; those after the first `warm_up` count."""
        self._adapter.start()
        counted = []
        for k, image in enumerate(self._kept[name]):
            timed = self._timed(lambda k=k, image=image: self._adapter.frame(image, k, k * step_ns))
            if k >= warm_up:
                counted.append(timed)
        return {key: [one[key] for one in counted] for key in counted[0]}, {}

    def _timed(self, run: Any) -> dict[str, float]:
        cpu_s, start_s = time.process_time(), time.perf_counter()
        result = run()
        ms, cpu_ms = 1e3 * (time.perf_counter() - start_s), 1e3 * (time.process_time() - cpu_s)
        return {"ms": ms, "cpu_ms": cpu_ms, "people": self._adapter.count(result)}

    def _usage(self, _: dict) -> tuple[dict, dict]:
        """Processor time and memory of the process so far, its threads, and the network interfaces that it sees."""
        used = resource.getrusage(resource.RUSAGE_SELF)
        status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
        return {
            "cpu_s": used.ru_utime + used.ru_stime,
            "rss_mb": int(status["VmRSS"].split()[0]) * 1024 / 1e6,
            "peak_rss_mb": int(status["VmHWM"].split()[0]) * 1024 / 1e6,
            "threads": int(status["Threads"]),
            "interfaces": [name for _, name in socket.if_nameindex()],
        }, {}


def serve(adapter: Adapter, messages: BinaryIO, answers: BinaryIO) -> None:
    """Answers until the messages end. A failure of the product is an answer, too."""
    worker = Worker(adapter)
    send(answers, {"is_ready": True})
    while (given := receive(messages)) is not None:
        try:
            message, arrays = worker.answer(*given)
        except Exception as error:  # any failure of a product is a result, not an error of this program
            message, arrays = {"error": f"{type(error).__name__}: {error}"}, {}
        send(answers, message, **arrays)


def main() -> None:
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    given = json.loads(sys.argv[1])
    module, _, name = given["adapter"].partition(":")
    serve(getattr(importlib.import_module(module), name)(**given["settings"]), sys.stdin.buffer, answers)


if __name__ == "__main__":
    main()
