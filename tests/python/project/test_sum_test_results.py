"""The closing line of `make test` counts what ran, and fails when something did not."""

import subprocess
import sys

import pytest

PYTEST = """<testsuites><testsuite>
<testcase name="d"/><testcase name="e"><error/></testcase></testsuite></testsuites>"""
CTEST = """<testsuite><testcase name="a" status="run"/><testcase name="b" status="fail"><failure/></testcase>
<testcase name="c" status="notrun"><skipped/></testcase></testsuite>"""


def run(*paths):
    command = [sys.executable, "scripts/sum_test_results.py", *map(str, paths)]
    done = subprocess.run(command, capture_output=True, text=True)
    return done.returncode, done.stdout.strip(), done.stderr


@pytest.fixture
def report(tmp_path):
    def write(name, text):
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


def test_counts_of_ctest_and_pytest_are_added(report):
    code, line, _ = run(report("a.xml", CTEST), report("b.xml", PYTEST))
    assert (code, line) == (1, "2 passed, 2 failed, 1 skipped")


def test_a_native_test_that_was_not_built_is_a_failure(report):
    absent = '<testcase name="b" status="notrun"><skipped message="Unable to find executable"/></testcase>'
    code, line, _ = run(report("a.xml", f'<testsuite><testcase name="a"/>{absent}</testsuite>'))
    assert (code, line) == (1, "1 passed, 1 failed")


def test_all_passed_is_success(report):
    assert run(report("a.xml", '<testsuite><testcase name="a" status="run"/></testsuite>'))[:2] == (
        0,
        "1 passed, 0 failed",
    )


def test_a_missing_or_broken_report_and_no_test_at_all_are_failures(report, tmp_path):
    code, line, text = run(report("a.xml", '<testsuite><testcase name="a"/></testsuite>'), tmp_path / "none.xml")
    assert (code, line) == (1, "1 passed, 1 failed")
    assert "none.xml" in text
    assert run(report("c.xml", "<testsuite"))[0] == 1
    assert run(report("d.xml", "<testsuite/>"))[0] == 1
    assert run()[0] == 1
