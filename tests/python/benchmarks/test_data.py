"""The data of the benchmark: each command names a module that exists, and runs until it succeeded once."""

import importlib.util

from benchmarks import data


def test_each_command_is_a_module_of_this_project():
    for one in data.SETS:
        for command in one.commands:
            assert importlib.util.find_spec(command.split()[0]) is not None, command


def test_a_command_that_succeeded_does_not_run_again_and_one_that_failed_does(tmp_path, monkeypatch):
    ran, fail = [], {"two"}

    class Ended:
        def __init__(self, words):
            ran.append(words[-1])
            self.returncode = int(words[-1] in fail)

    monkeypatch.setattr(data.subprocess, "run", Ended)
    assert not data.make(("one", "two", "three"), tmp_path)
    assert ran == ["one", "two"]
    fail.clear()
    assert data.make(("one", "two", "three"), tmp_path)
    assert ran == ["one", "two", "two", "three"]
