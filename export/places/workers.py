"""Jobs in processes of their own that are given up when they take too long.

Software renderers now and then never come back from a picture (Mesa's llvmpipe never finishes some views); a place lost
is better than a set that never ends.
"""

from __future__ import annotations

import multiprocessing
import queue
import threading
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection

START_S = 300  # to start a process, imports included, on a busy machine


def _serve(connection: Connection, work: Callable[[tuple], object]) -> None:
    connection.send(None)  # started
    while True:
        try:
            job = connection.recv()
        except EOFError:
            return
        try:
            work(job)
            connection.send(None)
        except Exception as error:  # the waiting thread reports it
            connection.send(error)


class _Worker:
    def __init__(self, work: Callable[[tuple], object]) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, work), daemon=True)
        self._process.start()
        theirs.close()
        self._has_started = False

    def run(self, job: tuple, max_s: float) -> Exception | None:
        """Runs a job; starting the process is not counted in `max_s`."""
        try:
            if not self._has_started:
                if not self._connection.poll(START_S):
                    return TimeoutError(f"its process did not start within {START_S} s")
                self._connection.recv()
                self._has_started = True
            self._connection.send(job)
            if not self._connection.poll(max_s):
                return TimeoutError(f"given up after {max_s:g} s")
            return self._connection.recv()
        except EOFError:
            return RuntimeError(f"its process ended with status {self._process.exitcode}")

    def end(self) -> None:
        self._process.kill()
        self._process.join()
        self._connection.close()


def done(
    work: Callable[[tuple], object], jobs: Sequence[tuple], processes: int, max_s: float
) -> Iterator[tuple[tuple, Exception | None]]:
    """Each job when it is done, and what went wrong with it, if something did. work: a function of a module."""
    waiting: queue.SimpleQueue[tuple] = queue.SimpleQueue()
    for job in jobs:
        waiting.put(job)
    found: queue.SimpleQueue[tuple[tuple, Exception | None]] = queue.SimpleQueue()

    def serve() -> None:
        worker = None
        while True:
            try:
                job = waiting.get_nowait()
            except queue.Empty:
                break
            worker = worker or _Worker(work)
            error = worker.run(job, max_s)
            if error is not None:
                worker.end()
                worker = None
            found.put((job, error))
        if worker:
            worker.end()

    threads = [threading.Thread(target=serve, daemon=True) for _ in range(min(processes, len(jobs)))]
    for thread in threads:
        thread.start()
    for _ in jobs:
        yield found.get()
    for thread in threads:
        thread.join()
