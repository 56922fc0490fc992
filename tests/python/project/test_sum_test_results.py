"""The closing line of `make test` counts the tests that ran, and the script fails when one failed."""

import subprocess
import sys

import pytest

PYTEST = """<testsuites><testsuite>
<testcase name="d"/><testcase name="e"><error/></testcase></testsuite></testsuites>"""
CTEST = """<testsuite><testcase name="a" status="run"/><testcase name="b" status="fail"><failure/></testcase>
<testcase name="c" status="notrun"><skipped/></testcase></testsuite>"""
PASSED = '<testsuite><testcase name="{}" status="run"/></testsuite>'


@pytest.fixture
def reports(tmp_path):
    """Writes the reports given by name, runs the script, and returns exit status, output and errors."""

    def run(**texts):
        for name, text in texts.items():
            path = tmp_path / f"{name.replace('retry_', 'retry/')}.xml"
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
        command = [sys.executable, "scripts/sum_test_results.py", str(tmp_path)]
        done = subprocess.run(command, capture_output=True, text=True)
        return done.returncode, done.stdout.strip(), done.stderr

    return run


def test_counts_of_ctest_and_pytest_are_added(reports):
    assert reports(ctest=CTEST, pytest=PYTEST)[:2] == (1, "2 passed, 2 failed, 1 skipped")


def test_a_native_test_that_was_not_built_is_a_failure(reports):
    absent = '<testcase name="b" status="notrun"><skipped message="Unable to find executable"/></testcase>'
    assert reports(a=f'<testsuite><testcase name="a"/>{absent}</testsuite>')[:2] == (1, "1 passed, 1 failed")


def test_all_passed_is_success(reports):
    assert reports(a=PASSED.format("a"))[:2] == (0, "1 passed, 0 failed")


def test_a_test_that_passes_when_it_is_run_once_more_is_named_as_flaky(reports):
    status, lines, _ = reports(ctest=CTEST, retry_ctest=PASSED.format("b"))
    assert (status, lines.splitlines()[-1]) == (0, "2 passed, 0 failed, 1 skipped")
    assert lines.startswith("flaky: ctest.xml: b failed")


def test_a_test_that_fails_again_stays_a_failure(reports):
    status, lines, _ = reports(ctest=CTEST, retry_ctest=CTEST)
    assert (status, lines) == (1, "1 passed, 1 failed, 1 skipped")


def test_a_broken_report_and_no_test_at_all_are_failures(reports):
    status, line, text = reports(a=PASSED.format("a"), broken="<testsuite")
    assert (status, line) == (1, "1 passed, 1 failed")
    assert "broken.xml" in text


def test_no_test_at_all_is_a_failure(reports):
    assert reports(a="<testsuite/>")[0] == 1
