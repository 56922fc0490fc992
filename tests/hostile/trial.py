"""One hostile run of the program: what it is given, and what came of it."""

import contextlib
import os
import select
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

# Limits of a run without its own limits. Good runs of the same commands stay below a second and 150 MiB.
MAX_SECONDS = 20
MAX_MEMORY_BYTES = 1 << 30
MAX_ADDRESS_SPACE_BYTES = 8 << 30  # of the release build: keeps the machine alive; sanitizers map terabytes
MAX_OUTPUT_BYTES = 1 << 20
FIRST_USER = 61000  # users without rights, a trial each, as limits of threads count per user; they need no account

EITHER, REFUSED, WORKS = "either", "refused", "works"


@dataclass(frozen=True)
class Trial:
    """words: the program's arguments, run in a folder of its own that `prepare` fills.

    expects: REFUSED where the input is certainly damaged: it fails, or says what was wrong with it; WORKS where nothing
    is wrong; EITHER where damage may have left something valid. must_say: a regular expression that the message has if
    the run fails. limits: of prlimit(1), by name. redirect: of the shell, such as `>/dev/full`. as_user: without the
    rights of root. number: a signal that is sent after so many seconds, after which the program has to end.
    """

    kind: str
    name: str
    words: tuple[str | bytes, ...]
    prepare: Callable[[Path], None] = lambda folder: None
    expects: str = EITHER
    must_say: str = ""
    limits: Mapping[str, int] = field(default_factory=dict)
    redirect: str = ""
    as_user: bool = False
    environment: Mapping[str, str | bytes] = field(default_factory=dict)
    number: int = 0
    after_s: float = 0.0


@dataclass(frozen=True)
class Outcome:
    """exit_code: negative is the signal that ended it, as in subprocess. left_files: unfinished ones, by their name.
    left_processes: whether a child lives on."""

    exit_code: int
    output: bytes = b""
    errors: bytes = b""
    seconds: float = 0.0
    peak_bytes: int = 0
    timed_out: bool = False
    left_files: tuple[str, ...] = ()
    left_processes: bool = False


def command_of(program: Path, trial: Trial, has_sanitizers: bool) -> list[str | bytes]:
    limits = dict(trial.limits)
    if not has_sanitizers:
        limits.setdefault("as", MAX_ADDRESS_SPACE_BYTES)
    words = ["prlimit", *(f"--{name}={value}" for name, value in (limits | {"core": 0}).items()), "--", program]
    shell = ["sh", "-c", f'exec "$@" {trial.redirect}', "sh"] if trial.redirect else []
    return [*shell, *words, *trial.words]


def run(program: Path, trial: Trial, folder: Path, has_sanitizers: bool = False, number: int = 0) -> Outcome:
    """folder: is made, and removed at the end. number: differs among those that run at the same time."""
    folder.mkdir(mode=0o777)
    folder.chmod(0o777)
    try:
        trial.prepare(folder)
        limit_s = MAX_SECONDS * (1 + 5 * has_sanitizers)
        return _run(command_of(program, trial, has_sanitizers), trial, folder, limit_s, FIRST_USER + number % 1000)
    finally:
        folder.chmod(0o777)
        shutil.rmtree(folder, ignore_errors=True)


def _run(command: list, trial: Trial, folder: Path, limit_s: float, user_id: int) -> Outcome:
    user = {"user": user_id, "group": user_id, "extra_groups": []} if trial.as_user and os.getuid() == 0 else {}
    begin = time.monotonic()
    process = subprocess.Popen(
        command, cwd=folder, env=os.environ | dict(trial.environment), stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True, **user,
    )  # fmt: skip
    texts: dict[str, bytes] = {}
    readers = [
        threading.Thread(target=_read, args=(texts, name, pipe))
        for name, pipe in (("output", process.stdout), ("errors", process.stderr))
    ]
    for reader in readers:
        reader.start()
    watch = threading.Thread(target=_watch, args=(process.pid, peaks := [0]))
    watch.start()
    if trial.number and not _ends(process.pid, trial.after_s):
        os.kill(process.pid, trial.number)
    timed_out = not _ends(process.pid, limit_s - trial.after_s)
    if timed_out:
        os.kill(process.pid, signal.SIGKILL)
    watch.join()
    process.returncode = os.waitstatus_to_exitcode(os.waitpid(process.pid, 0)[1])
    seconds = time.monotonic() - begin
    left_processes = not timed_out and _group_lives_on(process.pid)
    _kill_group(process.pid)
    for reader in readers:
        reader.join()
    left = tuple(path.name for path in folder.rglob("*.part*"))
    return Outcome(
        process.returncode, texts["output"], texts["errors"], seconds, max(peaks), timed_out, left, left_processes
    )


def _read(texts: dict[str, bytes], name: str, pipe) -> None:
    with pipe:
        texts[name] = pipe.read(MAX_OUTPUT_BYTES)
        while pipe.read(MAX_OUTPUT_BYTES):
            pass


def _watch(process: int, peaks: list[int]) -> None:
    """Notes the memory that a process took, every few milliseconds until its end: wait4() says no less than what the
    process that started it had."""
    while not _ends(process, 0.005):
        with contextlib.suppress(OSError):
            status = Path(f"/proc/{process}/status").read_text()
            peaks += [int(line.split()[1]) * 1024 for line in status.splitlines() if line.startswith("VmHWM:")]


def _ends(process: int, seconds: float) -> bool:
    """Waits for its end, of which it leaves it to others to take note."""
    number = os.pidfd_open(process)
    try:
        ready = select.poll()
        ready.register(number, select.POLLIN)
        return bool(ready.poll(max(seconds, 0) * 1000))
    finally:
        os.close(number)


def _group_lives_on(group: int) -> bool:
    """A second later, that is: a child learns of its parent's end by a signal."""
    for _ in range(20):
        try:
            os.killpg(group, 0)
        except OSError:
            return False
        time.sleep(0.05)
    return True


def _kill_group(group: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(group, signal.SIGKILL)
