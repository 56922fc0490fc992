"""Measures how frames get from a camera to the app: lost frames, unplugging, age, processor time, heap allocations.

    python -m benchmarks --only cameras              about 3 minutes; `make build` first
    python -m benchmarks --only cameras --no-guest   without the virtual machine

`maquette play` runs on two machines. The guest is a real kernel with its drivers in a virtual machine
(tests/camera_vm, guest "metrics"), with the kernel's test camera and a virtual USB camera; its clock counts
instructions, so that its times come out alike however busy this machine is. The host is this machine, with a stub and a
recording replayed as cameras.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from benchmarks import frame_time
from benchmarks.frame_time import MAX_OTHERS, OthersFraction

HOST_FIGURES = ("camera_age_ms", "camera_processor_percent", "camera_close_ms", "camera_fault_noticed_ms",
                "camera_fault_replug_ms", "camera_allocations")  # fmt: skip
GUEST_METRICS = ("camera_vivid_dropped_frames", "camera_vivid_fps", "camera_uvc_dropped_frames", "camera_uvc_fps",
                 "camera_v4l2_allocations", "camera_noticed_ms", "camera_replug_ms", "camera_reopen_ms")  # fmt: skip
METRICS = HOST_FIGURES + GUEST_METRICS
COUNTER = Path("benchmarks/count_allocations.c")
STUB = "stub:pattern?live=1&size=640x480&fps=30"
COUNTED = "stub:pattern?live=1&size=320x240&fps=400"
COUNT_FROM, COUNT_TO = 200, 1200
UNPLUG_AT_S = 2.0
ABSENCES_S = (1.0, 1.03, 1.06)  # two checks of the source are 100 ms apart, so the times vary
UNUSABLE = 77  # exit status of run.sh if no virtual machine can run


@dataclass(frozen=True)
class Outage:
    """Times in milliseconds: from unplugging to the app's notification, from plugging in to the first frame, and from
    the return of the device to the first frame."""

    noticed_ms: float
    replug_ms: float
    reopen_ms: float


def play(uri: str, *arguments: str, **environment: str) -> dict:
    """Returns the metrics of one run of `maquette play`. Raises FileNotFoundError, CalledProcessError."""
    if not frame_time.PROGRAM.exists():
        raise FileNotFoundError(f"{frame_time.PROGRAM} is not there: make build")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "play.json"
        command = [str(frame_time.PROGRAM), "play", uri, *arguments, "--no-image", "--json", str(path)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=os.environ | environment)
        return json.loads(path.read_text())


def cpu_utilization(longer: dict, shorter: dict) -> float:
    """Returns the used fraction of a core without start and end, from two runs that differ in length alone."""
    spent_s = [run["cpu_utilization"] * run["wall_seconds"] for run in (longer, shorter)]
    return (spent_s[0] - spent_s[1]) / (longer["wall_seconds"] - shorter["wall_seconds"])


def outages(played: dict, cycles: list[dict]) -> list[Outage]:
    """Returns the times of each outage. cycles: times of unplugging and return, on the monotonic clock.

    Raises ValueError when the source did not notice, or did not come back, as often.
    """
    events = [(event["state"], played["start_monotonic_s"] + event["at_s"], event) for event in played["events"]]
    lost = [at_s for state, at_s, _ in events if state == "lost"]
    first = [at_s + event["before_next_frame_s"] for state, at_s, event in events
             if state == "reconnected" and "before_next_frame_s" in event]  # fmt: skip
    if not len(lost) == len(first) == len(cycles):
        raise ValueError(
            f"of {len(cycles)} times that the camera was unplugged {len(lost)} were noticed, and after {len(first)} it "
            "gave frames again"
        )
    found = []
    for lost_s, first_s, cycle in zip(lost, first, cycles, strict=True):
        seconds = (lost_s - cycle["unplugged_s"], first_s - cycle["plugged_in_s"], first_s - cycle["appeared_s"])
        found.append(Outage(*(1000 * x for x in seconds)))
    return found


def fault_outage(absence_s: float) -> Outage:
    """Returns the outages of a stub that is away for a given time. The stub's clock starts when the source opens, a
    little after that of the metrics: two of the times are too long by that difference."""
    uri = f"{STUB}&unplug={absence_s:g}s@{UNPLUG_AT_S:g}s"
    played = play(uri, "--seconds", str(UNPLUG_AT_S + absence_s + 1))
    begin_s = played["start_monotonic_s"]
    unplugged_s, back_s = begin_s + UNPLUG_AT_S, begin_s + UNPLUG_AT_S + absence_s
    return outages(played, [{"unplugged_s": unplugged_s, "plugged_in_s": back_s, "appeared_s": back_s}])[0]


def count_allocations(folder: Path) -> dict:
    """Returns frames and allocations of a live source in steady state. Raises CalledProcessError without a C
    compiler."""
    library, count = folder / "count_allocations.so", folder / "count.json"
    subprocess.run(["cc", "-std=c11", "-O2", "-shared", "-fPIC", "-Isdk/include", "-o", str(library), str(COUNTER)],
                   check=True)  # fmt: skip
    play(COUNTED, "--frames", str(COUNT_TO), LD_PRELOAD=str(library), COUNT_FILE=str(count),
         COUNT_FROM=str(COUNT_FROM), COUNT_TO=str(COUNT_TO))  # fmt: skip
    return json.loads(count.read_text())


def measure_host(quick: bool) -> dict:
    """Runs each kind alternately; returns a list of results for each kind."""
    rounds = 1 if quick else 3
    few, many = ("15", "60") if quick else ("30", "270")
    measured: dict[str, list] = {"stub": [], "recording": [], "closing": [], "outages": []}
    others = OthersFraction()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        recording = folder / "pattern.maqrec"
        command = [str(frame_time.PROGRAM), "record", "stub:pattern?size=640x480", str(recording), "--frames", "30"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        for k in tqdm(range(rounds), desc="cameras", unit="round", disable=None):
            for kind, uri in (("stub", STUB), ("recording", f"rec:{recording}?live=1&loop=1")):
                shorter, longer = play(uri, "--frames", few), play(uri, "--frames", many)
                measured[kind].append({"age_ms": longer["age_ms"], "dropped_frames": longer["dropped_frames"],
                                       "cpu_utilization": cpu_utilization(longer, shorter)})  # fmt: skip
            measured["closing"].append(play(f"{STUB}&hang=5s@1s", "--seconds", "2")["close_ms"])
            measured["outages"].append(vars(fault_outage(ABSENCES_S[k])))
        measured["allocations"] = count_allocations(folder)
    measured["others_fraction"] = others.now()
    return measured


def host_metrics(measured: dict) -> dict[str, float]:
    counted = measured["allocations"]
    return {
        "camera_age_ms": statistics.median(run["age_ms"]["median"] for run in measured["stub"]),
        "camera_processor_percent": 100 * statistics.median(run["cpu_utilization"] for run in measured["recording"]),
        "camera_close_ms": statistics.median(measured["closing"]),
        "camera_fault_noticed_ms": statistics.median(outage["noticed_ms"] for outage in measured["outages"]),
        "camera_fault_replug_ms": statistics.median(outage["replug_ms"] for outage in measured["outages"]),
        "camera_allocations": counted["allocations"] / counted["frames"],
    }


def measure_guest(frames: int) -> tuple[dict, str]:
    """Returns the metrics of the guest by name, and why some are missing ("" if none are)."""
    print("Cameras in a virtual machine: about a minute")
    run = subprocess.run(["tests/camera_vm/run.sh", "metrics"], env=os.environ | {"FRAMES": str(frames)},
                         stdout=subprocess.PIPE, text=True, check=False)  # fmt: skip
    return read_guest(run.stdout, run.returncode)


def read_guest(output: str, status: int) -> tuple[dict, str]:
    """Parses the lines `metric NAME JSON` of run.sh, with `outages` computed from `plug`. Also returns why some are
    missing.

    Raises ValueError for broken JSON.
    """
    lines = output.splitlines()
    metrics = {}
    for line in lines:
        if line.startswith("metric "):
            _, name, text = line.split(" ", 2)
            metrics[name] = json.loads(text)
    failed = [line.removeprefix("not ok ") for line in lines if line.startswith("not ok ")]
    if status == UNUSABLE:
        return metrics, next((line for line in reversed(lines) if line.strip()), "there is no virtual machine")
    if status != 0 and not failed:
        failed.append(f"tests/camera_vm/run.sh ended with status {status}")
    if "plug" in metrics:
        try:
            found = outages(metrics["plug"]["play"], metrics["plug"]["cycles"])
            metrics["outages"] = [vars(outage) for outage in found]
        except ValueError as error:
            failed.append(str(error))
    return metrics, "; ".join(failed)


def guest_metrics(said: dict, frames: int, why: str) -> tuple[dict[str, float], dict[str, str]]:
    """Returns the metrics, and why others are missing."""
    metrics = {}
    for camera in ("vivid", "uvc"):
        played = said.get(camera)
        if played is not None and played["frames"] == frames:
            metrics[f"camera_{camera}_dropped_frames"] = played["dropped_frames"]
            metrics[f"camera_{camera}_fps"] = played["fps"]
    counts = [said[name] for name in ("vivid_allocations", "uvc_allocations") if name in said]
    if len(counts) == 2:
        metrics["camera_v4l2_allocations"] = max(count["allocations"] / count["frames"] for count in counts)
    if "outages" in said:
        for name in ("noticed_ms", "replug_ms", "reopen_ms"):
            metrics[f"camera_{name}"] = statistics.median(outage[name] for outage in said["outages"])
    return metrics, {name: why or "the guest did not say" for name in GUEST_METRICS if name not in metrics}


def measure(quick: bool, with_guest: bool = True) -> tuple[dict, dict[str, float], dict[str, str]]:
    """Returns the document, the metrics with a target, and why others are missing."""
    frames = 100 if quick else 1000
    host = measure_host(quick)
    said, why = measure_guest(frames) if with_guest else ({}, "left out by --no-guest")
    found, missing = guest_metrics(said, frames, why)
    metrics = {name: round(value, 4) for name, value in (host_metrics(host) | found).items()}
    others = host["others_fraction"]
    warnings = [f"other processes used {others:.0%} of the CPU (cameras)"] if others > MAX_OTHERS else []
    return {"host": host, "guest": said, "guest_missing": why, "frames": frames, "warnings": warnings}, metrics, missing
