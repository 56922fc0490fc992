"""Runs the commands that README.md and the guides show, in a shell of a newcomer's; run.sh makes the root around it.

    python tests/newcomer/walk.py FOLDER REPORT [docs]

FOLDER has clone/ and home/; what the commands say goes to FOLDER/log. REPORT: JUnit, one test case for each command.
"""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

README = ["README.md"]
GUIDES = [
    "sdk/README.md",
    "docs/scenes.md",
    "docs/cameras.md",
    "docs/cameras/v4l2.md",
    "docs/cameras/libcamera.md",
    "docs/cameras/depthai.md",
    "docs/cameras/simulated.md",
    "docs/desktop-demo.md",
]

# Commands that are not run, and why.
LEFT_OUT = {
    r"^make test$": "it runs this walk",
    r"^(scripts/make-venv\.sh|python -m|\.venv/bin/python) ": "needs packages and data from a network, and hours",
    r"^sudo |^echo .* sudo ": "changes the system",
    r"depthai-core|maquette_depthai": "needs depthai-core, which no package has",
    r"\b(PLACE|CAPTURE|BUNDLE)\b": "has words to be filled in",
    r"--target measure_": "measures",
    r"^scripts/|^cmake --preset (asan|tsan)": "a developer's",
}
# Commands that somebody ends: by Ctrl-C once they show something, or with their window.
ENDLESS = r"^maquette (play|record|densepose) stub:|/maquette play stub:"
WINDOW = r"^make desktop-demo|^maquette-demo"
# A camera that is not there, with its options.
CAMERA = r"'?(v4l2|libcamera|depthai):[^\s']*'?"
PROGRAM = re.compile(
    r"    (make|cmake|cc|sudo|echo|python|export|maquette[a-z-]*|measure_\w+|xvfb-run|[\w./]*/[\w.-]+) "
)
END = r"(?m)^= (\d+)$"
LIMIT_S = 1800  # for the build, on a slow machine


@dataclass
class Command:
    page: str
    text: str


def commands(page: str) -> Iterator[Command]:
    """Lines of a page's indented blocks, in the README all of them; after a backslash a command goes on in the next."""
    text = re.sub(r"```.*?```", "", Path(page).read_text(), flags=re.DOTALL).replace("\\\n", "\n+")
    lines = re.sub(r"\n\+\s*", " ", text).splitlines()
    for line in lines:
        if PROGRAM.match(line + " ") or (page in README and line.startswith("    ")):
            yield Command(page, line.strip())


class Shell:
    """A newcomer's shell in the clone, whose settings hold from one command to the next."""

    def __init__(self, folder: Path, display: str):
        said = (folder / "log").open("ab")
        self._said = (folder / "log").open("rb")
        self._start = 0  # of the running command's output
        environment = {
            "HOME": str(folder / "home"),
            "PATH": "/usr/local/bin:/usr/bin:/bin",
            "TERM": "xterm",
            "DISPLAY": display,
            "REAL": "no",  # the README's own switch for machines without a network
        }
        if "CCACHE_DIR" in os.environ:  # the same objects in less time
            environment |= {name: value for name, value in os.environ.items() if name.startswith("CCACHE_")}
            environment["CCACHE_BASEDIR"] = str(folder.parent.parent)
        self._bash = subprocess.Popen(
            ["bash"], cwd=folder / "clone", env=environment, text=True, stdin=subprocess.PIPE, stdout=said, stderr=said
        )

    def run(self, command: str, end: Callable[[Shell], None] | None = None) -> tuple[int, str]:
        """Exit status and output of a command; `end` waits for what it shows and ends it."""
        self._start = os.fstat(self._said.fileno()).st_size
        script = f"echo {shlex.quote('$ ' + command)}\n{{ {command}\n}} </dev/null\nprintf '\\n= %s\\n' $?"
        print(script, file=self._bash.stdin, flush=True)
        if end is not None:
            end(self)
        self.wait(END, "the command's end")
        return int(re.search(END, self.output())[1]), self.output()

    def output(self) -> str:
        """What the running command has said, after a line that is the command."""
        return os.pread(self._said.fileno(), 1 << 26, self._start).decode(errors="replace")

    def wait(self, pattern: str, what: str) -> None:
        end_s = time.monotonic() + LIMIT_S
        while not re.search(pattern, self.output()):
            if time.monotonic() > end_s or self._bash.poll() is not None:
                raise AssertionError(f"{what} did not come:\n{self.output()[-2000:]}")
            time.sleep(0.2)

    def interrupt(self) -> None:
        """As Ctrl-C does: all that runs in the shell, but the shell."""
        children = subprocess.run(["ps", "-eo", "pid=,ppid="], capture_output=True, text=True, check=True).stdout
        parents = dict(map(int, line.split()) for line in children.splitlines())
        for process in parents:
            ancestor = process
            while ancestor in parents and (ancestor := parents[ancestor]) != self._bash.pid:
                pass
            if ancestor == self._bash.pid:
                os.kill(process, signal.SIGINT)


def interrupt_once_it_shows(shell: Shell) -> None:
    shell.wait(r"\n(?s:.*)\S{3}", "any output")
    shell.interrupt()


def close_window(shell: Shell) -> None:
    """By Ctrl+Q, once it is on the screen; a window takes keys a moment later."""
    from Xlib import XK, X
    from Xlib.display import Display
    from Xlib.ext import xtest

    display = Display()
    end_s = time.monotonic() + LIMIT_S
    while time.monotonic() < end_s and not re.search(END, shell.output()):
        time.sleep(0.5)
        for window in display.screen().root.query_tree().children:
            if window.get_wm_name() == "Maquette" and window.get_attributes().map_state == X.IsViewable:
                window.set_input_focus(X.RevertToParent, X.CurrentTime)
                keys = [display.keysym_to_keycode(XK.string_to_keysym(name)) for name in ("Control_L", "q")]
                for kind, order in ((X.KeyPress, keys), (X.KeyRelease, keys[::-1])):
                    for key in order:
                        xtest.fake_input(display, kind, key)
                    display.sync()
                    time.sleep(0.2)
    display.close()


def try_out(shell: Shell, command: Command) -> tuple[str, str] | None:
    """Runs a command in its way; gives what happened when it is not what a newcomer hopes for: failure or skipped."""
    text = re.sub(CAMERA, "stub:people", re.sub(r"\s+# .*", "", command.text))
    for pattern, why in LEFT_OUT.items():
        if re.search(pattern, text):
            return "skipped", why
    if re.search(WINDOW, text):
        status, output = shell.run(text, close_window)
        allowed = (0,)
    elif re.search(ENDLESS, text.replace("'", "")) and "--seconds" not in text and "--max-frames" not in text:
        status, output = shell.run(text, interrupt_once_it_shows)
        allowed = (0, 130)
    else:
        status, output = shell.run(text)
        allowed = (0,)
    if status not in allowed:
        return "failure", f"exit status {status}\n{output[-4000:]}"
    return None


def start_display() -> str:
    read, write = os.pipe()
    subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1600x1200x24", "-nolisten", "tcp", "-noreset"],
        pass_fds=[write], stderr=subprocess.DEVNULL,
    )  # fmt: skip
    return ":" + os.read(read, 16).decode().strip()


def main(folder: Path, report: Path, pages: list[str]) -> int:
    os.chdir(folder / "clone")
    os.environ["DISPLAY"] = start_display()
    shell = Shell(folder, os.environ["DISPLAY"])
    suite = ElementTree.Element("testsuite", name="newcomer")
    counts = {"passed": 0, "failure": 0, "skipped": 0}
    for page in pages:
        if page == GUIDES[0]:  # the guides' programs are those that the README installs
            shell.run("export PATH=~/maquette/bin:$PATH")
        for command in commands(page):
            start_s = time.monotonic()
            outcome = try_out(shell, command)
            took_s = time.monotonic() - start_s
            case = ElementTree.SubElement(suite, "testcase", classname=page, name=command.text, time=f"{took_s:.1f}")
            if outcome:
                ElementTree.SubElement(case, outcome[0], message=outcome[1].encode("ascii", "replace").decode())
            counts[outcome[0] if outcome else "passed"] += 1
            print(f"{page}: {command.text}:", ": ".join(outcome) if outcome else f"{took_s:.0f} s", flush=True)
    ElementTree.ElementTree(suite).write(report, encoding="unicode")
    print(f"{counts['passed']} passed, {counts['failure']} failed, {counts['skipped']} left out")
    return 1 if counts["failure"] or not counts["passed"] else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2]), README + (GUIDES if "docs" in sys.argv[3:] else [])))
