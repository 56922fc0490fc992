"""The verdict on an outcome: fine, a crash, a hang, or unclear to the person who meets it."""

import re
from dataclasses import dataclass

from tests.hostile.trial import MAX_MEMORY_BYTES, REFUSED, WORKS, Outcome, Trial

FINE, CRASH, HANG, UNCLEAR = "fine", "crash", "hang", "unclear"
MAX_LINES = 8
MAX_LINE_CHARACTERS = 4000  # paths may have so many

CRASHED = re.compile(
    rb"(Address|Leak|Thread|UndefinedBehavior)Sanitizer|runtime error:|terminate called|Assertion .* failed|"
    rb"stack smashing|double free|free\(\): |malloc\(\): |corrupted|buffer overflow detected"
)
# Texts that only a programmer understands.
INTERNAL = re.compile(
    r"std::|basic_string|bad_alloc|what\(\)|json\.exception|nlohmann|cv::|OpenCV\(|\b[Ee]xception\b|stoi|stod|"
    r"filesystem error|defect of|_M_|vector::|0x[0-9a-f]{8}|\.cpp\b"
)
MEMORY = re.compile(r"not enough memory|out of memory", re.IGNORECASE)
# Lines that the program writes to standard error: each names it, but for the state of a build and CLI11's usage errors.
OWN_LINE = re.compile(r"maquette(-bench)?: |[^:]*: \d+ photos, \d+ points$|  left out: ")
# Where commands tell of it on standard output: damaged frames are counted, `info` lists what is missing.
TOLD = re.compile(rb"[1-9]\d* dropped| missing: ")
# The system's loader, before the program begins; what it prints is its own.
LOADER = re.compile(r"error while loading shared libraries|^prlimit: ")
# Tabs are in no text of the program; names have their control characters escaped.
CONTROL = re.compile(rb"[\x00-\x09\x0b-\x1f\x7f]")


@dataclass(frozen=True)
class Verdict:
    what: str  # FINE, CRASH, HANG or UNCLEAR
    reason: str = ""


def verdict(trial: Trial, outcome: Outcome, has_sanitizers: bool = False) -> Verdict:
    """The worst that can be said of it."""
    if reason := _crash(trial, outcome):
        return Verdict(CRASH, reason)
    if reason := _hang(trial, outcome, has_sanitizers):
        return Verdict(HANG, reason)
    if reason := _unclear(trial, outcome):
        return Verdict(UNCLEAR, reason)
    return Verdict(FINE)


def _crash(trial: Trial, outcome: Outcome) -> str:
    if found := CRASHED.search(outcome.errors + outcome.output):
        return f'printed "{found[0].decode(errors="replace")}"'
    if outcome.exit_code < 0 and not outcome.timed_out and -outcome.exit_code != trial.number:
        return f"ended by signal {-outcome.exit_code}"
    return ""


def _hang(trial: Trial, outcome: Outcome, has_sanitizers: bool) -> str:
    if outcome.timed_out:
        return f"goes on after {outcome.seconds:.0f} s"
    if outcome.peak_bytes > MAX_MEMORY_BYTES * (1 + 3 * has_sanitizers):
        return f"took {outcome.peak_bytes >> 20} MiB of memory"
    if outcome.exit_code > 0 and not trial.limits and MEMORY.search(outcome.errors.decode(errors="replace")):
        return "asked for more memory than its limit for a small input"
    return ""


def _unclear(trial: Trial, outcome: Outcome) -> str:
    if outcome.exit_code < 0:
        return ""  # by the signal that it was sent
    if outcome.exit_code in (126, 127) and trial.limits and LOADER.search(outcome.errors.decode(errors="replace")):
        return ""
    for name, text in (("standard error", outcome.errors), ("standard output", outcome.output)):
        if found := CONTROL.search(text):
            return f"{name} has the control character {found[0]!r}"
        try:
            text.decode()
        except UnicodeDecodeError:
            return f"{name} is not UTF-8"
    if outcome.left_files:
        return f"left {', '.join(outcome.left_files)}"
    if outcome.left_processes:
        return "left a process"
    message = outcome.errors.decode().strip("\n")
    if outcome.exit_code not in (0, 1, 2, 128 + trial.number if trial.number else 1):
        return f"exit code {outcome.exit_code}"
    if "2>" in trial.redirect or (trial.number and not message):
        return ""  # there is no one to tell, or nothing: it ends as it was told to
    is_told = bool(message) or TOLD.search(outcome.output)
    if outcome.exit_code != 0 and not is_told:
        return "failed without a message"
    if outcome.exit_code != 0 and trial.expects == WORKS:
        return "refused what is valid"
    if outcome.exit_code == 0 and trial.expects == REFUSED and not is_told:
        return "took damaged input without a word"
    return _unclear_message(trial, outcome, message)


def _unclear_message(trial: Trial, outcome: Outcome, message: str) -> str:
    lines = message.splitlines()
    is_usage = outcome.exit_code == 2 and message.endswith("Run with --help for more information.")
    foreign = [line for line in lines if not OWN_LINE.match(line)]
    if foreign and not is_usage:
        return f'a line that is not its own: "{foreign[0][:100]}"'
    if len(lines) > MAX_LINES:
        return f"{len(lines)} lines of errors"
    if long := [line for line in lines if len(line) > MAX_LINE_CHARACTERS]:
        return f"a line of {len(long[0])} characters"
    if found := INTERNAL.search(message):
        return f'the text of a program\'s inside: "{found[0]}"'
    if outcome.exit_code != 0 and trial.must_say and not re.search(trial.must_say, message + outcome.output.decode()):
        return f'does not say "{trial.must_say}"'
    return ""
