"""A function called in a child process, because OpenCascade may crash, or never end, on some shapes.

The limit is of processor time, so that how busy the machine is does not decide which solids there are.
"""

from __future__ import annotations

import os
import pickle
import resource
import time
from collections.abc import Callable
from typing import TypeVar

Value = TypeVar("Value")


class LostError(RuntimeError):
    """The child crashed, or used up its time."""


def called(function: Callable[..., Value], *arguments, cpu_s: int) -> Value:
    """Returns the function's result or raises its exception; both must be picklable. Raises LostError. Call it from a
    process with one thread."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        _limit(cpu_s)
        try:
            outcome = function(*arguments), None
        except Exception as error:  # the caller raises it
            outcome = None, error
        with os.fdopen(writer, "wb") as stream:
            pickle.dump(outcome, stream)
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as stream:
        data = stream.read()
    _, status = os.waitpid(child, 0)
    if status:
        raise LostError(f"signal {os.WTERMSIG(status)}" if os.WIFSIGNALED(status) else f"status {status}")
    value, error = pickle.loads(data)
    if error is not None:
        raise error
    return value


def _limit(cpu_s: int) -> None:
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    end = int(time.process_time()) + cpu_s + 1
    _, most = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (end if most < 0 else min(end, most), most))
