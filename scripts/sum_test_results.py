"""Adds up the JUnit reports of a folder and prints one line: `N passed, N failed[, N skipped]`.

    python scripts/sum_test_results.py build/test-results

Reports in the subfolder `retry` are of tests that failed and were run once more. A test that passed then counts
as passed and is named in a line of its own, "flaky: ...".

Exit status 1 when a test failed, when no test ran, or when a report is missing or unreadable.
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

Outcomes = dict[tuple[str, str, str], str]  # (report, class, test) -> passed, failed or skipped


def outcomes(report: Path) -> Outcomes:
    """Returns the outcome of each test case of one JUnit file, as ctest and pytest write it."""
    found: Outcomes = {}
    for case in ElementTree.parse(report).iter("testcase"):
        children = {child.tag: child.get("message") or "" for child in case}
        # ctest reports a test whose program was not built as skipped.
        not_built = children.get("skipped", "").startswith("Unable to find executable")
        if children.keys() & {"failure", "error"} or case.get("status") == "fail" or not_built:
            outcome = "failed"
        elif "skipped" in children or case.get("status") in ("notrun", "disabled"):
            outcome = "skipped"
        else:
            outcome = "passed"
        key = (report.name, case.get("classname") or "", case.get("name") or "")
        # pytest writes a second case for an error of a fixture's end.
        found[key] = "failed" if "failed" in (outcome, found.get(key)) else outcome
    return found


def read_folder(folder: Path) -> tuple[Outcomes, int]:
    """Returns the outcomes of all reports of a folder, and the number of reports that cannot be read."""
    found: Outcomes = {}
    unreadable = 0
    for path in sorted(folder.glob("*.xml")):
        try:
            found |= outcomes(path)
        except (OSError, ElementTree.ParseError) as error:
            print(f"{path} cannot be read as a test report: {error}", file=sys.stderr)
            unreadable += 1
    return found, unreadable


def main(arguments: list[str]) -> int:
    if len(arguments) != 1 or not (folder := Path(arguments[0])).is_dir():
        print(__doc__, file=sys.stderr)
        return 1
    first, unreadable = read_folder(folder)
    second, _ = read_folder(folder / "retry")
    flaky = [key for key, outcome in first.items() if outcome == "failed" and second.get(key) == "passed"]
    for key in flaky:
        first[key] = "passed"
        print(f"flaky: {key[0]}: {'::'.join(filter(None, key[1:]))} failed, and passed when it was run once more")
    counts = [sum(outcome == kind for outcome in first.values()) for kind in ("passed", "failed", "skipped")]
    passed, failed, skipped = counts[0], counts[1] + unreadable, counts[2]
    print(f"{passed} passed, {failed} failed" + (f", {skipped} skipped" if skipped else ""))
    return 1 if failed or passed == 0 else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
