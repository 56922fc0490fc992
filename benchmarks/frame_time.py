"""Measures frames of dense pose by `maquette bench`: people, pixels and threads; start and memory of a process."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

from tqdm import tqdm

PROGRAM = Path("build/release/stage/bin/maquette")
PEOPLE = (0, 1, 2, 3, 4, 6, 8)
SIZES = ((320, 240), (640, 480), (1280, 720), (1920, 1080))
STARTS = 9
MAX_OTHERS = 0.05  # fraction of all cores; beyond it, times are not reliable


def bench(sources: list[str], *arguments: str) -> dict:
    """Runs `maquette bench` once. Raises FileNotFoundError without the program, CalledProcessError if it fails."""
    if not PROGRAM.exists():
        raise FileNotFoundError(f"{PROGRAM} is not there: make build")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bench.json"
        command = [str(PROGRAM), "bench", *sources, *arguments, "--json", str(path)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        document = json.loads(path.read_text())
    document["bundle"] = Path(document["bundle"]).name  # reports do not name folders of the machine
    return document


def machine() -> dict:
    """Returns this machine, as `maquette bench` describes it."""
    return bench([people(1)], "--runs", "1", "--seconds", "0", "--warm-up", "0")["machine"]


def people(count: int, size: tuple[int, int] = (640, 480)) -> str:
    return f"stub:people?count={count}&size={size[0]}x{size[1]}"


class OthersFraction:
    """Measures the fraction of all cores that other processes use from now on."""

    def __init__(self) -> None:
        self.begin = self.spent_s()

    @staticmethod
    def spent_s() -> tuple[float, float]:
        ticks = [int(x) for x in Path("/proc/stat").read_text().splitlines()[0].split()[1:9]]
        own = os.times()
        all_s = (sum(ticks) - ticks[3] - ticks[4]) / os.sysconf("SC_CLK_TCK")
        return all_s - sum(own[:4]), time.monotonic()

    def now(self) -> float:
        (before_s, begin_s), (after_s, end_s) = self.begin, self.spent_s()
        return max(0.0, after_s - before_s) / ((end_s - begin_s) * (os.cpu_count() or 1))


def measure(folder: Path, threads: int, quick: bool) -> tuple[dict, dict[str, float], dict]:
    """Returns the scaling curves, the metrics with a target, and the machine."""
    runs = ["--runs", "20", "--seconds", "0"] if quick else ["--runs", "150", "--seconds", "3"]
    main = bench([people(k) for k in PEOPLE], *runs, "--threads", str(threads))
    sizes = bench([people(1, size) for size in SIZES], *runs, "--threads", str(threads))
    single = bench([people(k) for k in (0, 1, 4)], *runs, "--threads", "1")
    starts = [
        bench([people(1)], "--runs", "1", "--seconds", "0", "--warm-up", "0", "--threads", str(threads))
        for _ in tqdm(range(3 if quick else STARTS), desc="starts", unit="start", disable=None)
    ]
    fps = {case["source"]: case["fps"] for case in main["cases"]}
    memory = bench([people(1)], *runs, "--threads", str(threads))["peak_memory_mib"] * 1.048576
    metrics = {
        "fps_one_person": fps[people(1)],
        "fps_four_people": fps[people(4)],
        "fps_empty": fps[people(0)],
        "peak_memory_mb": memory,
        "first_result_ms": statistics.median(start["start_to_first_result_ms"] for start in starts),
    }
    metrics = {name: round(value, 2) for name, value in metrics.items()}
    document = {"people": main, "sizes": sizes, "one_thread": single,
                "starts_ms": [start["start_to_first_result_ms"] for start in starts],
                "create_ms": statistics.median(start["create_ms"] for start in starts)}  # fmt: skip
    return document, metrics, main["machine"]
