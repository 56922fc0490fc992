"""Camera figures come from what `maquette play` and the virtual machine said, or are missing with a reason."""

import json
import subprocess

import pytest

from benchmarks import camera_section, cameras, gates, report

MACHINE = {"architecture": "x86_64", "cores": 2, "instruction_sets": ["avx2"], "processor": "P", "memory_mib": 2048,
           "system": "S"}  # fmt: skip


def played(frames=100, dropped_frames=0, cpu=0.01, wall_s=4.0, events=()):
    return {
        "schema": "maquette-play-2",
        "width_px": 640,
        "height_px": 360,
        "frames": frames,
        "fps": 29.97,
        "dropped_frames": dropped_frames,
        "interval_ms": {"median": 33.3, "p99": 34.0},
        "age_ms": {"median": 0.1, "p99": 0.4},
        "wall_seconds": wall_s,
        "cpu_utilization": cpu,
        "start_monotonic_s": 50.0,
        "events": list(events),
    }


def event(state, at_s, before_next_frame_s=None):
    found = {"state": state, "reason": "", "at_s": at_s}
    return found if before_next_frame_s is None else found | {"before_next_frame_s": before_next_frame_s}


# Unplugged at 52 and 56 on the monotonic clock.
TWICE = [event("started", 0.01, 0.03),
         event("lost", 2.02, 1.9), event("reconnecting", 2.02, 1.9), event("reconnected", 3.9, 0.02),
         event("lost", 6.04, 2.0), event("reconnecting", 6.04, 2.0), event("reconnected", 8.0, 0.04)]  # fmt: skip
CYCLES = [{"unplugged_s": 52.0, "plugged_in_s": 53.4, "appeared_s": 53.8},
          {"unplugged_s": 56.0, "plugged_in_s": 57.5, "appeared_s": 57.9}]  # fmt: skip


def guest_output(**changes):
    said = {"vivid": played(), "vivid_few": played(10, wall_s=1.0, cpu=0.02), "uvc": played(dropped_frames=2),
            "vivid_allocations": {"frames": 80, "allocations": 0}, "uvc_allocations": {"frames": 80, "allocations": 4},
            "plug": {"cycles": CYCLES, "play": played(events=TWICE)}} | changes  # fmt: skip
    figures = [f"figure {name} {json.dumps(value)}" for name, value in said.items() if value is not None]
    return "\n".join(["== figures", "ok vivid loads", "#   figure no {", *figures, "# the guest is done", "3 passed"])


def test_each_outage_is_timed_from_its_own_unplugging():
    first, second = cameras.outages(played(events=TWICE), CYCLES)
    assert (first.noticed_ms, first.replug_ms, first.reopen_ms) == pytest.approx((20, 520, 120))
    assert (second.noticed_ms, second.replug_ms, second.reopen_ms) == pytest.approx((40, 540, 140))


@pytest.mark.parametrize(
    "events",
    [TWICE[:4], TWICE[:-1], [*TWICE[:-1], event("reconnected", 8.0)]],
    ids=["once", "not reconnected", "reconnected without frame"],
)
def test_an_outage_that_was_not_seen_is_no_figure(events):
    with pytest.raises(ValueError, match="of 2 times"):
        cameras.outages(played(events=events), CYCLES)
    plug = {"cycles": CYCLES, "play": played(events=events)}
    said, why = cameras.read_guest(guest_output(plug=plug), 0)
    figures, missing = cameras.guest_figures(said, 100, why)
    assert "camera_noticed_ms" not in figures
    assert "of 2 times" in missing["camera_replug_ms"]
    assert figures["camera_vivid_dropped_frames"] == 0


def test_processor_time_of_starting_is_taken_off():
    longer, shorter = played(cpu=0.03, wall_s=10.0), played(cpu=0.12, wall_s=2.0)
    assert cameras.cpu_utilization(longer, shorter) == pytest.approx((0.3 - 0.24) / 8)


def test_the_guests_figures_are_read_from_its_lines():
    said, why = cameras.read_guest(guest_output(), 0)
    figures, missing = cameras.guest_figures(said, 100, why)
    assert not why
    assert not missing
    assert set(figures) == set(cameras.GUEST_FIGURES)
    assert (figures["camera_vivid_dropped_frames"], figures["camera_uvc_dropped_frames"]) == (0, 2)
    assert figures["camera_vivid_fps"] == 29.97
    assert figures["camera_v4l2_allocations"] == 0.05
    assert figures["camera_noticed_ms"] == pytest.approx(30)


def test_a_guest_that_cannot_run_leaves_its_figures_out_and_says_why():
    said, why = cameras.read_guest("fetching\nnot run: qemu-system-x86_64 is missing\n", 77)
    figures, missing = cameras.guest_figures(said, 1000, why)
    assert not figures
    assert missing == dict.fromkeys(cameras.GUEST_FIGURES, "not run: qemu-system-x86_64 is missing")
    verdicts = gates.check(cameras.host_figures(host()), MACHINE, missing, only=cameras.FIGURES)
    states = {v.figure: v.state for v in verdicts}
    assert set(states) == set(cameras.FIGURES)
    assert all((state == "not measured") == (name in missing) for name, state in states.items())


def test_figures_of_fewer_frames_than_asked_for_do_not_count():
    said, why = cameras.read_guest(guest_output(vivid=played(frames=60)) + "\nnot ok vivid: stopped: it hung", 1)
    figures, missing = cameras.guest_figures(said, 100, why)
    assert "camera_vivid_dropped_frames" not in figures
    assert missing["camera_vivid_fps"] == "vivid: stopped: it hung"
    assert figures["camera_uvc_dropped_frames"] == 2


def test_a_guest_that_ends_early_without_saying_so_is_noticed():
    said, why = cameras.read_guest(guest_output(uvc=None), 124)
    _, missing = cameras.guest_figures(said, 100, why)
    assert set(missing) == {"camera_uvc_dropped_frames", "camera_uvc_fps"}
    assert "status 124" in missing["camera_uvc_dropped_frames"]


def host(**changes):
    def run(age, cpu):
        return {"age_ms": {"median": age, "p99": 4 * age}, "dropped_frames": 0, "cpu_utilization": cpu}

    away = [{"noticed_ms": x, "replug_ms": 10 * x, "reopen_ms": 10 * x} for x in (2.0, 9.0, 4.0)]
    return {"stub": [run(0.1, 0.02), run(0.9, 0.02), run(0.15, 0.02)],
            "recording": [run(0.1, 0.004), run(0.1, 0.02), run(0.1, 0.005)], "closing": [40.0, 80.0, 41.0],
            "outages": away, "allocations": {"frames": 1000, "allocations": 0},
            "others_fraction": 0.0} | changes  # fmt: skip


def test_figures_of_the_host_are_medians_of_its_runs():
    assert cameras.host_figures(host()) == pytest.approx({
        "camera_age_ms": 0.15, "camera_processor_percent": 0.5, "camera_close_ms": 41.0, "camera_fault_noticed_ms": 4.0,
        "camera_fault_replug_ms": 40.0, "camera_allocations": 0.0})  # fmt: skip


def test_gates_of_cameras_tell_good_from_bad():
    said, why = cameras.read_guest(guest_output(), 0)
    good = cameras.host_figures(host()) | cameras.guest_figures(said, 100, why)[0]
    bad = cameras.host_figures(host(closing=[51.0], allocations={"frames": 1000, "allocations": 1},
                                    stub=[{"age_ms": {"median": 0.21}}])) | {"camera_noticed_ms": 101}  # fmt: skip
    missed = [
        {v.figure for v in gates.check(good | other, MACHINE, {}, only=cameras.FIGURES) if v.state == "missed"}
        for other in ({}, bad)
    ]
    assert missed[0] == {"camera_uvc_dropped_frames", "camera_v4l2_allocations"}
    assert missed[1] - missed[0] == {"camera_close_ms", "camera_allocations", "camera_age_ms", "camera_noticed_ms"}


def test_the_section_shows_what_was_lost_and_the_pages_are_written(tmp_path):
    said, why = cameras.read_guest(guest_output(), 0)
    measured = {"host": host(), "guest": said, "guest_missing": why, "frames": 100, "warnings": ["others were busy"]}
    title, parts = camera_section.section(measured)
    assert title == "Cameras"
    vivid, usb = parts[1][1:]
    assert vivid[1:] == ["640 x 360", "100", "29.97", "0", "33.3, 34.0", "0.67% of the core", "0"]
    assert (usb[4], usb[7]) == ("2", "0.05")
    verdicts = gates.check(cameras.host_figures(host()), MACHINE, {}, only=cameras.HOST_FIGURES)
    document = {"machine": MACHINE, "quick": True, "cameras": measured, "gates": [vars(v) for v in verdicts]}
    report.write(document, tmp_path)
    text = (tmp_path / "report.md").read_text()
    for shown in ("others were busy", "quick run",
                  "| from unplugging to the app's notification | stub | 4 ms | 9 ms | 3 |"):  # fmt: skip
        assert shown in text
    assert "others were busy" in (tmp_path / "index.html").read_text()


PROGRAM = """
#include <maquette/source.h>
#include <stdlib.h>
maq_status maq_source_acquire_frame(maq_source* source, int64_t timeout_ns, maq_frame** frame);
void run_network(void);
int main(void) {
  for (int i = 1; i <= 40; ++i) {
    if (i == 25) run_network();
    void* volatile taken = i % 5 == 0 ? malloc(100) : NULL; /* before frames 5, 10, 15 ... */
    void* volatile aligned = i == 22 ? aligned_alloc(64, 128) : NULL;
    maq_frame* frame = NULL;
    while (maq_source_acquire_frame(NULL, 0, &frame) != MAQ_OK) continue;
    taken = i == 23 ? realloc(taken, 200) : taken;
    free(taken);
    free(aligned);
  }
  return 0;
}
"""
# Every second call times out: only frames count.
LIBRARY = """
#include <maquette/source.h>
maq_status maq_source_acquire_frame(maq_source* source, int64_t timeout_ns, maq_frame** frame) {
  static int calls;
  (void)source, (void)timeout_ns, (void)frame;
  return ++calls % 2 ? MAQ_TIMEOUT : MAQ_OK;
}
"""


RUNTIME = """
#include <stdlib.h>
void run_network(void) {
  void* volatile taken = malloc(10);
  free(taken);
  taken = calloc(2, 5);
  free(taken);
}
"""


def test_allocations_between_two_frames_are_counted(tmp_path):
    def compiled(name, *arguments):
        command = ["cc", "-std=c11", "-O1", "-fno-builtin", "-Isdk/include", "-o", str(tmp_path / name), *arguments]
        subprocess.run([str(x) for x in command], check=True)
        return str(tmp_path / name)

    (tmp_path / "p.c").write_text(PROGRAM)
    (tmp_path / "l.c").write_text(LIBRARY)
    library = compiled("libsource.so", "-shared", "-fPIC", tmp_path / "l.c")
    (tmp_path / "r.c").write_text(RUNTIME)
    runtime = compiled("libonnxruntime.so", "-shared", "-fPIC", tmp_path / "r.c")
    program = compiled("program", tmp_path / "p.c", library, runtime, f"-Wl,-rpath,{tmp_path}")
    counter = compiled("count.so", "-shared", "-fPIC", cameras.COUNTER)
    count = tmp_path / "count.json"
    environment = {"LD_PRELOAD": counter, "COUNT_FROM": "10", "COUNT_TO": "30", "COUNT_FILE": str(count)}
    run = subprocess.run([program], check=True, capture_output=True, text=True, env=environment)
    # Before frames 15, 20, 25 and 30, the aligned one, and the one that grows.
    assert json.loads(count.read_text()) == {"frames": 20, "allocations": 8, "of_onnxruntime": 2}
    assert run.stderr.count("allocation in steady state") == 5
    subprocess.run([program], check=True, capture_output=True, env=environment | {"COUNT_TO": "24"})
    assert json.loads(count.read_text()) == {"frames": 14, "allocations": 4, "of_onnxruntime": 0}
    own = subprocess.run(
        [program], check=True, capture_output=True, text=True,
        env=environment | {"COUNT_FROM": "24", "COUNT_OWN": "1"},
    )  # fmt: skip
    assert json.loads(count.read_text()) == {"frames": 6, "allocations": 4, "of_onnxruntime": 2}
    assert own.stderr.count("allocation in steady state") == 2
