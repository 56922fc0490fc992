"""Writes the section "Cameras" of the report."""

from __future__ import annotations

import statistics

from benchmarks import cameras

USB = "USB camera, virtual (uvcvideo)"
NAMES = {"vivid": "vivid, the kernel's test camera", "vivid_640x480": "vivid", "uvc": USB}


def section(measured: dict) -> tuple[str, list]:
    """Returns the title and the parts of the section, from a document of cameras.measure."""
    parts: list = [
        "Frames on their way from a camera to an app that discards them. The cameras of the first table are in a "
        "virtual machine with Debian's kernel, its V4L2 drivers and its USB. Its processor is emulated: one core that "
        "takes a nanosecond for each instruction and has no caches, with a clock of its own. These metrics do not "
        "depend on the load of this machine; they show the work of the kernel and the SDK, not processor speed."
    ]
    delivered = delivery_rows(measured["guest"])
    if len(delivered) > 1:
        parts += [
            delivered,
            "All cameras run at 30 frames a second; vivid cannot at 640 x 480, so it has another size. Processor: time "
            "of the capture without its start, in the program and in the kernel. Allocations: by all threads, after a "
            "fifth of the frames.",
        ]
    if measured["guest_missing"]:
        parts.append(f"Not measured in the virtual machine: {measured['guest_missing']}.")
    parts += [
        time_rows(measured),
        "On this machine a stub or a recording acts as a camera. A frame's age is the time from its due time until the "
        "app receives it, through the source's thread. The processor time of the recording is an upper bound for a "
        "camera: its frames (BGR, 0.9 MB) are read from a file and checked, while camera frames are in driver memory; "
        "the stub draws its frames. A fault in the URI unplugs the stub. In the virtual machine the virtual USB camera "
        "ends, at a time known to 10 ms; plugging in begins with the start of its program, and includes the kernel's "
        "detection of the device.",
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
        fraction = f"{cameras.cpu_utilization(played, few):.2%} of the core" if few else ""
        allocated = f"{counted['allocations'] / counted['frames']:g}" if counted else ""
        size = f"{played['width_px']} x {played['height_px']}"
        intervals = f"{between['median']:.1f}, {between['p99']:.1f}"
        delivered = [str(played["frames"]), f"{played['fps']:.2f}", str(played["dropped_frames"]), intervals]
        rows.append([name, size, *delivered, fraction, allocated])
    return rows


def time_rows(measured: dict) -> list[list[str]]:
    host, said = measured["host"], measured["guest"]
    rows = [["time", "source", "median", "worst", "runs"]]

    def add(what: str, where: str, values: list[float], unit: str, worst: list[float] | None = None) -> None:
        shown = [f"{statistics.median(values):.3g} {unit}", f"{max(worst or values):.3g} {unit}", str(len(values))]
        rows.append([what, where, *shown])

    for kind, name in (("stub", "stub"), ("recording", "recording")):
        ages = [run["age_ms"] for run in host[kind]]
        add("age of a frame when the app receives it (worst: p99)", f"{name}, 640 x 480 at 30",
            [a["median"] for a in ages], "ms", [a["p99"] for a in ages])  # fmt: skip
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
