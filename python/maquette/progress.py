"""Progress of long calls, for a person at a terminal or the reader of a log."""

from __future__ import annotations

import shutil
import sys
import time
from typing import TextIO

_REDRAW_S = 0.08


class ProgressLine:
    """Prints the progress of one long call on standard error. On a terminal one line is rewritten; elsewhere each stage
    gets one line.

    head = builder.fit(seconds=3, progress=maquette.ProgressLine())
    """

    def __init__(self, file: TextIO | None = None) -> None:
        self._file = sys.stderr if file is None else file
        self._stage = ""
        self._drawn_s = 0.0
        self._is_ended = False

    def __call__(self, done: float, stage: str = "") -> None:
        if not self._file.isatty():
            if stage != self._stage:
                print(stage, file=self._file, flush=True)
            self._stage = stage
            return
        now_s, was_ended = time.monotonic(), self._is_ended
        self._is_ended = done >= 1
        if self._is_ended and was_ended:  # a call may report its end twice
            return
        if not self._is_ended and now_s - self._drawn_s < _REDRAW_S:
            return
        self._drawn_s = now_s
        text = f"{done:4.0%}  {stage}"[: shutil.get_terminal_size().columns - 1]
        print(f"\r{text}\x1b[K", end="\n" if done >= 1 else "", file=self._file, flush=True)
