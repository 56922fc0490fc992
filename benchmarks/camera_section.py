"""Writes the section "Cameras" of the report."""

from __future__ import annotations

import statistics

from benchmarks import cameras

USB = "USB camera, virtual (uvcvideo)"
NAMES = {"vivid": "vivid, the kernel's test camera", "vivid_640x480": "vivid", "uvc": USB}


def section(measured: dict) -> tuple[str, list]:
    """Returns the title and the parts of the section, from a document of cameras.measure."""
    parts: list = [
        "How frames get from a camera to the app, which does nothing with them. The cameras of the first table are "
        "in a virtual machine with Debian's kernel, its V4L2 drivers and its USB. Its processor is emulated: one "
        "core that takes a nanosecond for each instruction and knows no caches, on a clock of its own. So these "
        "metrics come out alike however busy this machine is, and tell what the kernel and the SDK do, not how fast "
        "a processor is."
    ]
    delivered = delivery_rows(measured["guest"])
    if len(delivered) > 1:
        parts += [
            delivered,
            "All were asked for 30 frames a second; vivid has no rate as high at 640 x 480, hence its other size. "
            "Processor: what capturing takes, starting left out, for the program and for the kernel on its behalf. "
            "Allocations: of all threads, after a fifth of the frames.",
        ]
    if measured["guest_missing"]:
        parts.append(f"Not measured in the virtual machine: {measured['guest_missing']}.")
    parts += [
        time_rows(measured),
        "On this machine a stub or a recording is replayed as a camera. A frame's age counts from the moment it was "
        "due to the app's having it, through the source's own thread. The recording's processor time is an upper "
        "bound of a camera's: its frames (BGR, 0.9 MB) are read from a file and checked, where a camera's lie in "
        "its driver's memory; the stub draws its own. Unplugging there is a fault that the URI asks for. In the "
        "virtual machine it is the end of the virtual USB camera, at a time known to 10 ms; plugged in counts from "
        "the start of its program, and has the kernel's time to find the device in it.",
    ]
    return "Cameras", parts


def delivery_rows(said: dict) -> list[list[str]]:
    rows = [["camera", "size", "frames", "frames a second", "dropped", "between two, ms (p50, p99)", "processor",
             "allocations a frame"]]  # fmt: skip
    for camera, name in NAMES.items():
        if camera not in said:
            continue
        played, few, counted = said[camera], said.get(f"{camera}_few"), said.get(f"{camera}_allocations")
        between = played["interval_ms"]
        share = f"{cameras.cpu_utilization(played, few):.2%} of the core" if few else ""
        allocated = f"{counted['allocations'] / counted['frames']:g}" if counted else ""
        size = f"{played['width_px']} x {played['height_px']}"
        intervals = f"{between['median']:.1f}, {between['p99']:.1f}"
        delivered = [str(played["frames"]), f"{played['fps']:.2f}", str(played["dropped_frames"]), intervals]
        rows.append([name, size, *delivered, share, allocated])
    return rows


def time_rows(measured: dict) -> list[list[str]]:
    host, said = measured["host"], measured["guest"]
    rows = [["what", "where", "median", "worst", "runs"]]

    def add(what: str, where: str, values: list[float], unit: str, worst: list[float] | None = None) -> None:
        shown = [f"{statistics.median(values):.3g} {unit}", f"{max(worst or values):.3g} {unit}", str(len(values))]
        rows.append([what, where, *shown])

    for kind, name in (("stub", "stub"), ("recording", "recording")):
        ages = [run["age_ms"] for run in host[kind]]
        add("age of a frame when the app has it (worst: p99)", f"{name}, 640 x 480 at 30", [a["median"] for a in ages],
            "ms", [a["p99"] for a in ages])  # fmt: skip
    for kind, name in (("recording", "recording"), ("stub", "stub, which draws")):
        add("processor time of capture, of a core", f"{name}, 640 x 480 at 30",
            [100 * run["cpu_utilization"] for run in host[kind]], "%")  # fmt: skip
    add("closing a source whose device hangs", "stub", host["closing"], "ms")
    for place, found in (("stub", host["outages"]), (USB, said.get("outages", []))):
        if not found:
            continue
        add("from unplugging to the app's notification", place, [x["noticed_ms"] for x in found], "ms")
        if place != "stub":
            add("from plugging in to the first frame", place, [x["replug_ms"] for x in found], "ms")
        add("from the device's return to the first frame", place, [x["reopen_ms"] for x in found], "ms")
    counted = host["allocations"]
    each = counted["allocations"] / counted["frames"]
    rows.append(["allocations a frame", "stub", f"{each:g}", "", f"{counted['frames']} frames"])
    return rows
