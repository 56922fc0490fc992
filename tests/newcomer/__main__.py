"""Follows README.md as a newcomer does, in a bare Debian (tests/newcomer/README.md)."""

import argparse
import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from tests.newcomer.bare_system import BareSystem
from tests.newcomer.readme import PRINTS, READERS_FILES, Block, readme_blocks

ROOT = Path(__file__).resolve().parents[2]
CLONE = "maquette"
SYSTEM = ROOT / "build/newcomer/system"  # of no one's choice: it is deleted as a whole
LIMIT_S = 1800  # of a block that ends by itself
TEST_LIMIT_S = 5400  # of a block that builds the tests, too
BUILD_LIMIT_S = 900  # until a block that runs until Ctrl-C has begun: the demo is built first
END_LIMIT_S = 20  # from Ctrl-C to the end
SCREEN = (1280, 1024)
# A window that shows people has thousands of colours; one that shows nothing, a handful.
MIN_COLOURS = 500


@contextlib.contextmanager
def screen(folder: Path) -> Iterator[str]:
    """The name of a display without a monitor; `folder` gets its pixels, as Xvfb_screen0 (X Window Dump)."""
    read, write = os.pipe()
    size = f"{SCREEN[0]}x{SCREEN[1]}x24"
    words = ["Xvfb", "-displayfd", str(write), "-screen", "0", size, "-fbdir", str(folder), "-nolisten", "tcp"]
    server = subprocess.Popen(words, pass_fds=(write,), stderr=subprocess.DEVNULL)
    os.close(write)
    try:
        with os.fdopen(read) as name:
            number = name.readline().strip()
        if not number:
            raise RuntimeError("Xvfb did not start. Install Debian's package xvfb.")
        yield f":{number}"
    finally:
        server.terminate()
        server.wait()


def colours(dump: Path) -> int:
    """How many colours an X Window Dump of 32 bits a pixel has."""
    return len(set(memoryview(dump.read_bytes()[-4 * SCREEN[0] * SCREEN[1] :]).cast("I")))


def missing(block: Block, clone: Path, printed: str) -> list[str]:
    """The promises of `block` that were not kept."""
    lost = []
    for promise in block.promises:
        if promise.startswith(PRINTS):
            if not re.search(pattern := promise.removeprefix(PRINTS), printed):
                lost.append(f"its output has nothing like {pattern}")
        elif not any(file.stat().st_size > 0 for file in clone.glob(promise)):
            lost.append(f"{promise} was not written")
    return lost


def look_and_interrupt(process: subprocess.Popen, block: Block, window: Path, shown: Path) -> list[str]:
    """Waits until `block` shows something, looks at it, and presses Ctrl-C; what went wrong."""
    is_windowed = "desktop-demo" in block.script
    end = time.monotonic() + BUILD_LIMIT_S
    while is_windowed and colours(window) < MIN_COLOURS:
        if process.poll() is not None:
            return [f"ended with exit code {process.returncode} before it showed anything"]
        if time.monotonic() > end:
            return [f"showed no window within {BUILD_LIMIT_S} s"]
        time.sleep(1)
    time.sleep(block.seconds_until_interrupted or 0)
    if is_windowed:
        shutil.copyfile(window, shown)
    if process.poll() is not None:
        return [f"ended by itself, with exit code {process.returncode}"]
    os.killpg(process.pid, signal.SIGINT)
    try:
        process.wait(END_LIMIT_S)
    except subprocess.TimeoutExpired:
        return [f"still ran {END_LIMIT_S} s after Ctrl-C"]
    return []


def wait_for_words(process: subprocess.Popen, pattern: str, output: Path) -> list[str]:
    """Waits until `output` has a match of `pattern`, and ends the process; returns what went wrong."""
    end = time.monotonic() + TEST_LIMIT_S
    while not re.search(pattern, output.read_text(errors="replace")):
        if process.poll() is not None:
            return [f"ended with exit code {process.returncode} before it printed anything like {pattern}"]
        if time.monotonic() > end:
            return [f"printed nothing like {pattern} within {TEST_LIMIT_S} s"]
        time.sleep(1)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    return []


def run_block(system: BareSystem, block: Block, output: Path, display: str, window: Path) -> list[str]:
    """Returns the fault of `block`; nothing if it does what the README says."""
    with system.running(block.script, CLONE, output, display) as process:
        if block.seconds_until_interrupted is not None:
            problems = look_and_interrupt(process, block, window, output.with_name("screen.xwd"))
        elif block.last_words is not None:
            problems = wait_for_words(process, block.last_words, output)
        else:
            try:
                code = process.wait(LIMIT_S)
                problems = [f"exit code {code}"] if code else []
            except subprocess.TimeoutExpired:
                problems = [f"still ran after {LIMIT_S} s"]
    printed = output.read_text(errors="replace")
    return problems + missing(block, system.home / CLONE, printed)


def follow(system: BareSystem, out: Path) -> int:
    """Runs all blocks of the README; the number of those that failed."""
    subprocess.run(["git", "clone", "--quiet", "--no-hardlinks", ROOT, system.home / CLONE], check=True)
    for name, file in READERS_FILES.items():
        shutil.copyfile(ROOT / file, system.home / CLONE / name)
    system.give_to_user()
    ran = failed = 0
    with screen(out) as display:
        for number, block in enumerate(readme_blocks(system.home / CLONE), 1):
            output = out / f"{number:02}.txt"
            begin = time.monotonic()
            problems = run_block(system, block, output, display, out / "Xvfb_screen0")
            what = "; ".join(line.split("  #")[0].strip() for line in block.lines)
            print(f"{'not ok' if problems else 'ok':7}{time.monotonic() - begin:4.0f} s {what[:110]}", flush=True)
            if problems:
                last = output.read_text(errors="replace").splitlines()[-15:]
                print(
                    "\n".join(
                        [f"    {', '.join(problems)}; all of its output: {output}", *(f"    > {s}" for s in last)]
                    )
                )
            ran += 1
            failed += bool(problems)
    print(f"{ran - failed} passed, {failed} failed")
    return failed


def main() -> int:
    parser = argparse.ArgumentParser(prog="python3 -m tests.newcomer", description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "build/newcomer", help="output of each block (%(default)s)")
    parser.add_argument("--keep", action="store_true", help=f"keep the bare system; enter it by: sudo chroot {SYSTEM}")
    arguments = parser.parse_args()
    if os.geteuid() != 0:
        parser.error("a bare system is made and entered by root: run it by sudo")
    for command in ("debootstrap", "Xvfb", "unshare", "setpriv"):
        if shutil.which(command) is None:
            parser.error(f"{command} is missing: run `make test-newcomer`, which installs it")
    system = BareSystem(SYSTEM)
    system.remove()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print(f"making a bare Debian in {system.root}", flush=True)
    begin = time.monotonic()
    try:
        system.make()
        print(f"ok     {time.monotonic() - begin:4.0f} s debootstrap, and a clone of HEAD", flush=True)
        return 1 if follow(system, arguments.out.resolve()) else 0
    finally:
        if not arguments.keep:
            system.remove()


if __name__ == "__main__":
    sys.exit(main())
