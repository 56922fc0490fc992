"""Measures waits of a user of an app with a window: until a live source or a scene is shown, and in the window's
thread.

    python -m benchmarks --only ui_latency about a minute; `make bench` builds what is needed

Small programs of the app library measure live sources and scenes (benchmarks/native/measure_live_*.cpp). The desktop
demo on a display in memory measures the window, if both are installed.
"""

from __future__ import annotations

import json
import os
import shutil
import statistics
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tqdm import tqdm

from benchmarks.frame_time import MAX_OTHERS, OthersFraction
from benchmarks.scenes import command as scene_command

METRICS = ("live_first_result_ms", "live_next_result_ms", "live_lost_ms", "live_back_ms", "live_scene_ms",
           "demo_longest_ms")  # fmt: skip
PROGRAMS = Path("build/release/benchmarks/native")
DEMO = Path("build/release/stage/bin/maquette-demo")
DENSE_POSE, SCENES, ROOM = Path("sdk/models/densepose-b-int8"), Path("sdk/models/scenes-int8"), Path("tests/media/room")
UNPLUG_AT_MS, ABSENCE_MS, PLAY_S = 1000, 300, 2.5
SOURCE = f"stub:people?count=1&size=640x480&fps=30&live=1&unplug={ABSENCE_MS}ms@{UNPLUG_AT_MS}ms"
DEMO_RUNS = {
    "people": ("stub:people?count=2", "--view", "try-on", "--frames", "300"),
    "scene": (str(ROOM), "--frames", "60"),
}
DEMO_LIMIT_S = 300


def run(program: str, *arguments: str) -> dict | list:
    """Runs a program of benchmarks/native and returns its JSON. Raises FileNotFoundError, CalledProcessError."""
    path = PROGRAMS / program
    if not path.exists():
        raise FileNotFoundError(f"{path} is not there: make bench builds it")
    return json.loads(subprocess.run([str(path), *arguments], check=True, stdout=subprocess.PIPE, text=True).stdout)


def source_times(opened: dict) -> dict[str, float]:
    """Returns times of one call of open(): until the app is notified of opening and of running, until the first result;
    from unplugging to the notification (`lost_ms`), from plugging in to the next result (`back_ms`); the longest call.

    The source's time starts when it is open, a little after the app is notified that it is being opened: `lost_ms` and
    `back_ms` are too long by that. Raises ValueError when the source was not lost or did not come back.
    """
    times_ms: dict[str, list[float]] = {}
    for event in opened["events"]:
        if event["name"] == "opening" or times_ms:  # earlier events belong to the source that played before
            times_ms.setdefault(event["name"], []).append(event["ms"])
    if not times_ms.keys() >= {"opening", "running", "result", "reconnecting"}:
        raise ValueError(f"a live source was not told of as lost, or gave no result: {opened['events']}")
    unplugged_ms = times_ms["opening"][0] + UNPLUG_AT_MS
    plugged_in_ms = unplugged_ms + ABSENCE_MS
    back_ms = [ms for ms in times_ms["result"] if ms >= plugged_in_ms]
    if not back_ms:
        raise ValueError(f"a live source gave no result after it was plugged in again: {opened['events']}")
    return {"opening_ms": times_ms["opening"][0], "running_ms": times_ms["running"][0],
            "result_ms": times_ms["result"][0], "lost_ms": times_ms["reconnecting"][0] - unplugged_ms,
            "back_ms": back_ms[0] - plugged_in_ms, "longest_call_ms": opened["longest_call_ms"]}  # fmt: skip


@contextmanager
def display() -> Iterator[str]:
    """Starts a display in memory and returns its name. Raises FileNotFoundError if Xvfb does not start."""
    command = ["Xvfb", "-displayfd", "1", "-screen", "0", "1600x1200x24", "-nolisten", "tcp", "-noreset"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as server:
        try:
            number = server.stdout.readline().strip()
            if not number:
                raise FileNotFoundError("Xvfb does not start")
            yield f":{number}"
        finally:
            server.terminate()


def demo_missing() -> str:
    """Returns why the demo cannot be measured, "" if it can."""
    if not DEMO.exists():
        return "maquette-demo is not built (scripts/install-packages.sh desktop, make build)"
    return "" if shutil.which("Xvfb") else "there is no Xvfb (scripts/install-packages.sh test)"


def demo_times(name: str, screen: str) -> dict:
    """Returns `longest_ms`, `p99_ms`, `frames`, `start_ms` of the window's thread in one run of the demo."""
    command = [str(DEMO), *DEMO_RUNS[name], "--headless"]
    ran = subprocess.run(command, env=os.environ | {"DISPLAY": screen}, check=True, stdout=subprocess.PIPE, text=True,
                         timeout=DEMO_LIMIT_S)  # fmt: skip
    return json.loads(ran.stdout)["ui"]


def measure(quick: bool) -> tuple[dict, dict[str, float], dict[str, str]]:
    """Returns the document, the metrics with a target, and why others are missing."""
    rounds = 1 if quick else 3
    measured: dict = {"first": [], "next": [], "scene": [], "capture": [], "demo": {}, "demo_missing": demo_missing()}
    others = OthersFraction()
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "room.maqs"
        scene_command.build(ROOM, scene, SCENES)
        for _ in tqdm(range(rounds), desc="live", unit="round", disable=None):
            opened = run("measure_live_source", str(DENSE_POSE), SOURCE, str(PLAY_S))
            for kind, times in zip(("first", "next"), opened, strict=True):
                measured[kind].append(source_times(times))
            for kind, path in (("scene", scene), ("capture", ROOM)):
                measured[kind].append(run("measure_live_scene", str(SCENES), str(path)))
    if not measured["demo_missing"]:
        with display() as screen:
            for _ in tqdm(range(rounds), desc="demo", unit="round", disable=None):
                for name in DEMO_RUNS:
                    measured["demo"].setdefault(name, []).append(demo_times(name, screen))
    busy = others.now()
    measured["warnings"] = [f"other processes used {busy:.0%} of the CPU (window)"] if busy > MAX_OTHERS else []
    missing = {"demo_longest_ms": measured["demo_missing"]} if measured["demo_missing"] else {}
    return measured, metrics_of(measured), missing


def metrics_of(measured: dict) -> dict[str, float]:
    metrics = {
        "live_first_result_ms": median(measured["first"], "result_ms"),
        "live_next_result_ms": median(measured["next"], "result_ms"),
        "live_lost_ms": median(measured["next"], "lost_ms"),
        "live_back_ms": median(measured["next"], "back_ms"),
        "live_scene_ms": median(measured["scene"], "first_view_ms"),
    }
    if measured["demo"]:
        metrics["demo_longest_ms"] = max(median(runs, "longest_ms") for runs in measured["demo"].values())
    return {name: round(value, 2) for name, value in metrics.items()}


def median(runs: list[dict], key: str) -> float:
    return statistics.median(run[key] for run in runs)


def section(measured: dict) -> tuple[str, list]:
    """Returns the title and the parts of the section, from a document of `measure`."""
    waits = [["from", "to", "median, ms", "worst", "runs"]]

    def add(begin: str, end: str, kind: str, key: str) -> None:
        runs = measured[kind]
        waits.append([begin, end, f"{median(runs, key):.1f}", f"{max(run[key] for run in runs):.1f}", str(len(runs))])

    for kind, begin in (("first", "open a live source"), ("next", "open it again, the model is loaded")):
        add(begin, "the app is notified that it is being opened", kind, "opening_ms")
        add(begin, "the app is notified that it runs", kind, "running_ms")
        add(begin, "the first result", kind, "result_ms")
    add("the source is unplugged", "the app is notified", "next", "lost_ms")
    add("the source is plugged in again", "the next result", "next", "back_ms")
    for kind, begin in (("scene", "open a scene file"), ("capture", "open a capture, which is built")):
        add(begin, "the app is notified that it is ready", kind, "open_ms")
        add(begin, "the first view, 640 x 480", kind, "first_view_ms")
    kinds = ("first", "next", "scene", "capture")
    longest_ms = max(run["longest_call_ms"] for kind in kinds for run in measured[kind])
    parts: list = [
        waits,
        "Measured with the library of apps with a window (sdk/app). The live source is a stub of one person, 640 x 480 "
        f"at 30 frames a second, unplugged for {ABSENCE_MS / 1000:g} s as its URI asks; the scene is the room of "
        "tests/media. The longest call of the window's thread took "
        f"{longest_ms:.2f} ms.",
    ]
    if measured["demo_missing"]:
        return "Waits of an app with a window", [
            *parts, f"The demo's window was not measured: {measured['demo_missing']}."]  # fmt: skip
    window = [["maquette-demo with", "longest frame, ms (median)", "worst run", "p99", "frames of a run", "runs"]]
    for name, runs in measured["demo"].items():
        longest = [run["longest_ms"] for run in runs]
        window.append([DEMO_RUNS[name][0], f"{statistics.median(longest):.1f}", f"{max(longest):.1f}",
                       f"{median(runs, 'p99_ms'):.1f}", f"{median(runs, 'frames'):.0f}", str(len(runs))])  # fmt: skip
    return "Waits of an app with a window", [
        *parts,
        window,
        "Frames of the window's thread, from reading the input to showing the image, while the networks run at "
        "full speed on other threads. The display is in memory (Xvfb) and rendered by the processor.",
    ]
