"""Jobs in processes of this machine, or of many machines through Dask.

Each process serves one job after another; one that takes too long, or takes its process down with it, is given up and
the others go on. (Mesa's llvmpipe never finishes some images; a place lost is better than a set that never ends.)

Many machines: a scheduler on one, workers on all, each started in a checkout with the same assets; what jobs write must
lie in a folder that all of them share. A job whose machine is lost is done again elsewhere.

    pip install -e '.[train,cluster]'
    dask scheduler                                              # on HOST
    python -m export.jobs tcp://HOST:8786 --processes 8         # on each machine: serves until Ctrl-C
    python -m export.people.dataset --cluster tcp://HOST:8786   # on any of them
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import queue
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

START_S = 300  # to start a process, imports included, on a busy machine
CONNECT_S = 10

Work = Callable[[Any], Any]  # a function of a module; what it takes and returns can be pickled


@dataclass(frozen=True)
class Done:
    """A job that has ended. value: what it returned; error: why it was given up, else None."""

    job: Any
    value: Any
    error: Exception | None


@dataclass(frozen=True)
class Workers:
    """Who does the jobs. processes: of this machine, 0: none but this one; cluster: address of a Dask scheduler,
    instead of these. max_s: seconds after which a job is given up (None: never); not applied with 0 processes."""

    processes: int = 1
    cluster: str | None = None
    max_s: float | None = None

    @staticmethod
    def add_arguments(parser: argparse.ArgumentParser, processes: int | None = None) -> None:
        """--processes (default: `processes`, or one a core) and --cluster."""
        default = os.cpu_count() if processes is None else processes
        parser.add_argument(
            "--processes", type=int, default=default, metavar="N",
            help="on this machine; 0: none beside this one, for debuggers (default %(default)s)",
        )  # fmt: skip
        parser.add_argument(
            "--cluster", metavar="ADDRESS", help="do it on many machines: a Dask scheduler (python -m export.jobs -h)"
        )

    @staticmethod
    def of(options: argparse.Namespace, max_s: float | None = None) -> Workers:
        return Workers(options.processes, options.cluster, max_s)

    def run(self, work: Work, jobs: Sequence[Any]) -> Iterator[Done]:
        """Each job when it has ended, in any order. Raises OSError where the cluster cannot be reached."""
        if self.cluster:
            return _on_cluster(work, jobs, self)
        return _here(work, jobs, self) if self.processes > 0 else (Done(job, work(job), None) for job in jobs)


def results(done: Iterator[Done]) -> Iterator[tuple[Any, Any]]:
    """Jobs and what they returned. Raises the error of the first that was given up."""
    for one in done:
        if one.error is not None:
            raise one.error
        yield one.job, one.value


def _serve(connection: Connection, work: Work) -> None:
    connection.send(None)  # started
    while True:
        try:
            job = connection.recv()
        except EOFError:
            return
        try:
            outcome = (work(job), None)
        except Exception as error:  # the process that waits reports it
            outcome = (None, error)
        try:
            connection.send(outcome)
        except BrokenPipeError:  # nobody waits any longer
            return


_environment = threading.Lock()


@contextmanager
def _one_thread_of_blas() -> Iterator[None]:
    """For processes started meanwhile: sums in several threads round otherwise, and a shard's bytes would depend on how
    many cores a machine has. It is faster, too: there is a process for each core."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    with _environment:
        before = {name: os.environ.get(name) for name in names}
        os.environ.update(dict.fromkeys(names, "1"))
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    del os.environ[name]
                else:
                    os.environ[name] = value


class _Process:
    """One process and the job that it does."""

    def __init__(self, work: Work) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, work), daemon=True)
        with _one_thread_of_blas():
            self._process.start()
        theirs.close()
        self._has_started = False

    def run(self, job: Any, max_s: float | None) -> Done:
        """Starting the process is not counted in `max_s`."""
        try:
            if not self._has_started:
                if not self._connection.poll(START_S):
                    return Done(job, None, TimeoutError(f"its process did not start within {START_S} s"))
                self._connection.recv()
                self._has_started = True
            self._connection.send(job)
            if not self._connection.poll(max_s):
                return Done(job, None, TimeoutError(f"given up after {max_s:g} s"))
            return Done(job, *self._connection.recv())
        except (EOFError, BrokenPipeError, ConnectionResetError):
            self._process.join(START_S)
            return Done(job, None, RuntimeError(f"its process ended with status {self._process.exitcode}"))

    def end(self) -> None:
        self._process.kill()
        self._process.join()
        self._connection.close()


def _here(work: Work, jobs: Sequence[Any], workers: Workers) -> Iterator[Done]:
    waiting: queue.SimpleQueue[Any] = queue.SimpleQueue()
    for job in jobs:
        waiting.put(job)
    found: queue.SimpleQueue[Done] = queue.SimpleQueue()

    def serve() -> None:
        process = None
        while True:
            try:
                job = waiting.get_nowait()
            except queue.Empty:
                break
            process = process or _Process(work)
            done = process.run(job, workers.max_s)
            if done.error is not None:
                process.end()
                process = None
            found.put(done)
        if process:
            process.end()

    threads = [threading.Thread(target=serve, daemon=True) for _ in range(min(workers.processes, len(jobs)))]
    for thread in threads:
        thread.start()
    for _ in jobs:
        yield found.get()
    for thread in threads:
        thread.join()


def _on_cluster(work: Work, jobs: Sequence[Any], workers: Workers) -> Iterator[Done]:
    try:
        from distributed import Client, as_completed
    except ImportError as error:
        raise OSError("--cluster needs Dask: pip install -e '.[train,cluster]'") from error
    try:
        client = Client(workers.cluster, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise OSError(f"No Dask scheduler answers at {workers.cluster}: start one by `dask scheduler`.") from error
    with client:
        # One key a job, so that equal jobs of another run are not taken for these.
        futures = {client.submit(_in_worker, work, job, workers.max_s, pure=False): job for job in jobs}
        for future in as_completed(futures, loop=client.loop):
            error = future.exception()  # of Dask: a job that took too many workers down with it
            yield future.result() if error is None else Done(futures.pop(future), None, error)


_process_of_worker: dict[Work, _Process] = {}


def _in_worker(work: Work, job: Any, max_s: float | None) -> Done:
    """Runs in a Dask worker of one thread, which keeps a process of its own for each kind of job."""
    process = _process_of_worker.pop(work, None) or _Process(work)
    done = process.run(job, max_s)
    if done.error is None:
        _process_of_worker[work] = process
    else:
        process.end()
    return done


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m export.jobs", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scheduler", help="address of the Dask scheduler, tcp://HOST:8786")
    parser.add_argument("--processes", type=int, default=os.cpu_count(), help="of this machine (default %(default)s)")
    options = parser.parse_args()
    # Dask's workers are daemons unless told otherwise, and daemons must not start processes.
    environment = {**os.environ, "DASK_DISTRIBUTED__WORKER__DAEMON": "False"}
    worker = ["-m", "distributed.cli.dask_worker", options.scheduler, "--no-dashboard"]
    worker += ["--nworkers", str(options.processes), "--nthreads", "1"]
    sys.stdout.flush()
    os.execve(sys.executable, [sys.executable, *worker], environment)


if __name__ == "__main__":
    main()
