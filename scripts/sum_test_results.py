"""Adds up JUnit reports and prints one line: `N passed, N failed[, N skipped]`.

    python scripts/sum_test_results.py build/test-results/*.xml

Exit status 1 when a test failed, when no test ran, or when a report is missing or unreadable.
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path


def count(report: Path) -> tuple[int, int, int]:
    """(passed, failed, skipped) test cases of one JUnit file, as ctest and pytest write it."""
    passed = failed = skipped = 0
    for case in ElementTree.parse(report).iter("testcase"):
        outcomes = {child.tag: child.get("message") or "" for child in case}
        # ctest says "skipped" of a test whose program was not built, which is no choice of the test's.
        not_built = outcomes.get("skipped", "").startswith("Unable to find executable")
        if outcomes.keys() & {"failure", "error"} or case.get("status") == "fail" or not_built:
            failed += 1
        elif "skipped" in outcomes or case.get("status") in ("notrun", "disabled"):
            skipped += 1
        else:
            passed += 1
    return passed, failed, skipped


def main(paths: list[str]) -> int:
    if not paths:
        print("No test report was given.", file=sys.stderr)
        return 1
    passed = failed = skipped = unreadable = 0
    for path in map(Path, paths):
        try:
            counts = count(path)
        except (OSError, ElementTree.ParseError) as error:
            print(f"{path} cannot be read as a test report: {error}", file=sys.stderr)
            unreadable += 1
            continue
        passed, failed, skipped = passed + counts[0], failed + counts[1], skipped + counts[2]
    print(f"{passed} passed, {failed + unreadable} failed" + (f", {skipped} skipped" if skipped else ""))
    return 1 if failed or unreadable or passed == 0 else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
