"""Jobs in processes of this machine, and on a Dask cluster of two workers of which one is lost."""

import argparse
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from export.jobs import Workers, results

ROOT = Path(__file__).parents[3]


def do(what: str) -> str:
    if what == "forever":
        time.sleep(3600)
    if what == "wrong":
        raise ValueError("no such thing")
    if what == "crash":
        os._exit(3)
    return what.upper()


def test_jobs_that_never_end_fail_or_crash_are_given_up_and_others_done():
    jobs = ["a", "forever", "wrong", "crash", "b", "c"]
    found = {done.job: done for done in Workers(2, max_s=3).run(do, jobs)}
    assert [found[name].value for name in "abc"] == ["A", "B", "C"]
    assert all(found[name].error is None for name in "abc")
    assert isinstance(found["forever"].error, TimeoutError)
    assert isinstance(found["wrong"].error, ValueError)
    assert "status 3" in str(found["crash"].error)


def test_results_raise_the_first_error():
    with pytest.raises(ValueError, match="no such thing"):
        list(results(Workers(1).run(do, ["a", "wrong"])))
    assert dict(results(Workers(0).run(do, ["a", "b"]))) == {"a": "A", "b": "B"}
    with pytest.raises(ValueError, match="no such thing"):
        list(results(Workers(0).run(do, ["wrong"])))


def test_options_choose_the_workers():
    parser = argparse.ArgumentParser()
    Workers.add_arguments(parser)
    assert Workers.of(parser.parse_args([])) == Workers(os.cpu_count())
    options = parser.parse_args(["--processes", "3", "--cluster", "tcp://host:1"])
    assert Workers.of(options, 9) == Workers(3, "tcp://host:1", 9)


def test_a_cluster_that_is_not_there_is_said(monkeypatch):
    pytest.importorskip("distributed", reason="Dask is not installed: scripts/make-venv.sh train,dev,cluster")
    monkeypatch.setattr("export.jobs.CONNECT_S", 1)
    with pytest.raises(OSError, match=r"No Dask scheduler answers at tcp://127\.0\.0\.1:9"):
        list(Workers(cluster="tcp://127.0.0.1:9").run(do, ["a"]))


def started(*command: str) -> subprocess.Popen:
    """A program in a process group of its own, which finds the tests' modules."""
    paths = [ROOT, ROOT / "tests" / "python" / "support", Path(__file__).parent]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, paths))}
    return subprocess.Popen(
        [sys.executable, *command], cwd=ROOT, env=environment, start_new_session=True, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip


def line_with(process: subprocess.Popen, pattern: str) -> str:
    """Returns the match of the pattern's group in the program's output."""
    for line in process.stdout:
        if found := re.search(pattern, line):
            return found[1]
    raise AssertionError(f"{process.args} ended with {process.wait()} before it wrote {pattern}")


@pytest.fixture(scope="module")
def cluster():
    """The address of a scheduler, and its two workers."""
    pytest.importorskip("distributed", reason="Dask is not installed: scripts/make-venv.sh train,dev,cluster")
    scheduler = started("-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
    processes = [scheduler]
    try:
        address = line_with(scheduler, r"Scheduler at:\s+(tcp://\S+)")
        processes += [started("-m", "export.jobs", address, "--processes", "1") for _ in range(2)]
        for worker in processes[1:]:
            line_with(worker, r"(Registered to):")
        yield address, processes[1:]
    finally:
        for process in processes:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            process.stdout.close()


def test_a_job_that_is_given_up_on_a_cluster_costs_no_other(cluster):
    jobs = ["a", "forever", "wrong", "crash", "b"]
    found = {done.job: done for done in Workers(cluster=cluster[0], max_s=3).run(do, jobs)}
    assert [found[name].value for name in "ab"] == ["A", "B"]
    assert isinstance(found["forever"].error, TimeoutError)
    assert isinstance(found["wrong"].error, ValueError)
    assert "status 3" in str(found["crash"].error)


def write(job: tuple[int, Path]) -> int:
    number, path = job
    time.sleep(0.5)
    path.write_text(str(number))
    return number


def test_a_cluster_that_loses_a_worker_does_all_jobs(cluster, tmp_path):
    """The last test of the cluster, which has one worker afterwards."""
    address, workers = cluster
    done = results(Workers(cluster=address).run(write, [(number, tmp_path / str(number)) for number in range(8)]))
    numbers = [next(done)[1]]
    os.killpg(workers[0].pid, signal.SIGKILL)  # in the middle of a job, with all that it started
    numbers += [number for _, number in done]
    assert sorted(numbers) == list(range(8))
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {str(k): str(k) for k in range(8)}
