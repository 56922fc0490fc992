"""The script of hostile inputs: its verdicts on made-up outcomes, and a few trials of each kind."""

import os
import signal
import sys
from random import Random

import pytest

from tests.hostile import damage
from tests.hostile.__main__ import left_out, run_all, table
from tests.hostile.kinds import KINDS, trials
from tests.hostile.samples import ROOT, make_images, make_samples
from tests.hostile.trial import MAX_MEMORY_BYTES, REFUSED, WORKS, Outcome, Trial, run
from tests.hostile.verdict import CRASH, FINE, HANG, UNCLEAR, verdict

PROGRAM = ROOT / "build/release/stage/bin/maquette"
REFUSAL = b"maquette: a.jpg is damaged; copy it again.\n"


def trial(**fields) -> Trial:
    return Trial("made up", "made up", (), **fields)


FINE_OUTCOMES = [
    (trial(), Outcome(0, b"1 frame, 0 people.\n")),
    (trial(expects=REFUSED), Outcome(1, b"", REFUSAL)),
    (trial(expects=REFUSED), Outcome(0, b"2 frames\n", b"maquette: Frame 3 is damaged and left out.\n")),
    (trial(expects=REFUSED), Outcome(2, b"", b"--out is required\nRun with --help for more information.\n")),
    (trial(), Outcome(1, b"", b"room: 5 photos, 499 points\n  left out: 1 photo\nmaquette: There is no point.\n")),
    (trial(number=signal.SIGTERM), Outcome(-signal.SIGTERM)),
    (trial(number=signal.SIGINT), Outcome(1)),
    (trial(redirect="2>&-"), Outcome(1)),
    (trial(limits={"as": 1}, must_say="memory"), Outcome(1, b"", b"maquette: There is not enough memory.\n")),
    (trial(limits={"as": 1}), Outcome(127, b"", b"maquette: error while loading shared libraries: libc.so.6\n")),
]
WRONG_OUTCOMES = [
    (CRASH, "signal 11", trial(), Outcome(-signal.SIGSEGV)),
    (CRASH, "signal 6", trial(number=signal.SIGTERM), Outcome(-signal.SIGABRT)),
    (CRASH, "Sanitizer", trial(), Outcome(1, b"", b"==7==ERROR: AddressSanitizer: heap-buffer-overflow\n")),
    (CRASH, "runtime error", trial(), Outcome(0, b"", b"a.cpp:1:2: runtime error: signed integer overflow\n")),
    (CRASH, "terminate", trial(), Outcome(1, b"", b"terminate called after throwing an instance of 'x'\n")),
    (HANG, "goes on", trial(), Outcome(-signal.SIGKILL, seconds=20, timed_out=True)),
    (HANG, "MiB", trial(), Outcome(1, b"", REFUSAL, peak_bytes=MAX_MEMORY_BYTES + 1)),
    (HANG, "more memory", trial(), Outcome(1, b"", b"maquette: There is not enough memory.\n")),
    (UNCLEAR, "without a word", trial(expects=REFUSED), Outcome(0, b"1 frame, 0 people.\n")),
    (UNCLEAR, "without a message", trial(), Outcome(1)),
    (UNCLEAR, "valid", trial(expects=WORKS), Outcome(1, b"", REFUSAL)),
    (UNCLEAR, "exit code 3", trial(), Outcome(3, b"", REFUSAL)),
    (UNCLEAR, "not its own", trial(), Outcome(1, b"", b"libpng error: bad CRC\n" + REFUSAL)),
    (UNCLEAR, "not its own", trial(), Outcome(0, b"", b"Corrupt JPEG data: premature end of data segment\n")),
    (UNCLEAR, "inside", trial(), Outcome(1, b"", b"maquette: basic_string::substr\n")),
    (UNCLEAR, "inside", trial(), Outcome(1, b"", b"maquette: [json.exception.type_error.316] invalid UTF-8\n")),
    (UNCLEAR, "lines", trial(), Outcome(1, b"", REFUSAL * 9)),
    (UNCLEAR, "characters", trial(), Outcome(1, b"", b"maquette: " + b"x" * 5000)),
    (UNCLEAR, "control", trial(), Outcome(1, b"", b"maquette: \x1b[2J.jpg is damaged.\n")),
    (UNCLEAR, "control", trial(), Outcome(0, b"\x1b[2J.jpg: 0 people\n")),
    (UNCLEAR, "UTF-8", trial(), Outcome(1, b"", b"maquette: \xff.jpg is damaged.\n")),
    (UNCLEAR, "left a.mp4.part", trial(number=signal.SIGINT), Outcome(1, left_files=("a.mp4.part",))),
    (UNCLEAR, "left a process", trial(), Outcome(0, left_processes=True)),
    (UNCLEAR, "memory", trial(limits={"as": 1}, must_say="memory"), Outcome(1, b"", REFUSAL)),
]  # fmt: skip


@pytest.mark.parametrize(("given", "outcome"), FINE_OUTCOMES)
def test_outcomes_that_tell_what_was_wrong_are_fine(given, outcome):
    assert verdict(given, outcome).what == FINE, verdict(given, outcome)


@pytest.mark.parametrize(("what", "reason", "given", "outcome"), WRONG_OUTCOMES)
def test_crashes_hangs_and_unclear_errors_are_found(what, reason, given, outcome):
    found = verdict(given, outcome)
    assert found.what == what, found
    assert reason in found.reason


# Behaviour of a program that replaces ours, and the verdict on it.
STAND_INS = [
    (FINE, "import sys; sys.exit('maquette: a is damaged.')"),
    (CRASH, "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"),
    (HANG, "import time; time.sleep(60)"),
    (UNCLEAR, "import sys; sys.exit('maquette: \\x1b[2J')"),
    (UNCLEAR, "open('a.mp4.part', 'w')"),
    (UNCLEAR, "import subprocess; subprocess.Popen(['sleep', '60'])"),
]


@pytest.mark.parametrize(("what", "program"), STAND_INS)
def test_a_run_is_seen_as_it_was(what, program, tmp_path, monkeypatch):
    monkeypatch.setattr("tests.hostile.trial.MAX_SECONDS", 3)
    made = Trial("made up", "made up", ("-c", program))
    outcome = run(sys.executable, made, tmp_path / "trial")
    assert verdict(made, outcome).what == what, outcome
    assert not (tmp_path / "trial").exists()


def test_memory_that_a_run_took_is_seen(tmp_path):
    words = ("-c", f"len(bytearray({MAX_MEMORY_BYTES + (64 << 20)}))")
    made = Trial("made up", "made up", words)
    assert verdict(made, run(sys.executable, made, tmp_path / "trial")).what == HANG


@pytest.mark.parametrize("way", damage.WAYS)
def test_damage_changes_a_file_the_same_way_for_the_same_seed(way):
    data = make_images()["rgb.png"]
    assert way(data, Random(7)) == way(data, Random(7))
    assert any(way(data, Random(seed))[1] != data for seed in range(3))


@pytest.fixture(scope="module")
def samples(tmp_path_factory):
    if not PROGRAM.exists():
        pytest.skip(f"{PROGRAM} is not built")
    return make_samples(PROGRAM, tmp_path_factory.mktemp("samples"))


def test_the_same_seed_gives_the_same_trials_whatever_else_is_asked_for(samples):
    alone = [(kind, made.name, made.words) for kind, made in trials(samples, 3, ["uris"], 5)]
    among_all = [(kind, made.name, made.words) for kind, made in trials(samples, 3, [*KINDS], 5) if kind == "uris"]
    assert alone == among_all
    assert alone != [(kind, made.name, made.words) for kind, made in trials(samples, 4, ["uris"], 5)]


def test_a_few_hostile_inputs_of_each_kind_cause_no_crash_no_hang_and_no_unclear_error(samples):
    chosen = [name for name in KINDS if not left_out(name, has_sanitizers=False)]
    counts, found = run_all(PROGRAM, chosen, count=2, seed=0, jobs=os.cpu_count(), has_sanitizers=False)
    assert not found, "\n".join(f"{entry['verdict']}: {entry['name']}: {entry['reason']}" for entry in found)
    assert f"| all | {sum(sum(row.values()) for row in counts.values())} | 0 | 0 | 0 |" in table(counts)
