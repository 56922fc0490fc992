"""Records the commit and date of each measured section, and refuses to publish sections of different commits."""

from __future__ import annotations

import subprocess
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime

CHANGED = ", with uncommitted changes"


def stamp() -> dict[str, str]:
    """Returns {"commit": …, "date": …} of the working tree. The commit ends with CHANGED if tracked files outside
    docs/benchmarks differ from it; it is "unknown" outside of a git checkout."""
    date = datetime.now(UTC).strftime("%Y-%m-%d")
    try:
        commit = _git("rev-parse", "--short=12", "HEAD")
        changed = _git("status", "--porcelain", "--untracked-files=no", "--", ".", ":(exclude)docs/benchmarks")
    except (OSError, subprocess.CalledProcessError):
        return {"commit": "unknown", "date": date}
    return {"commit": commit + (CHANGED if changed else ""), "date": date}


def stamp_of_code() -> dict[str, str]:
    """As `stamp`, of the last commit that changed anything outside docs, so that a page may be committed between two
    measurements."""
    found = stamp()
    try:
        found["commit"] = _git("log", "-1", "--abbrev=12", "--format=%h", "--", ".", ":(exclude)docs")
        if _git("status", "--porcelain", "--untracked-files=no", "--", ".", ":(exclude)docs"):
            found["commit"] += CHANGED
    except (OSError, subprocess.CalledProcessError):
        pass  # `stamp` has said "unknown"
    return found


def library_refusal(commit: str) -> str:
    """Returns one sentence that says why a library of this commit is not the one of this tree, or "" if its sources are
    the same. The commit of a library with changed files ends with "+"."""
    again = "Build it again: make build"
    if commit.endswith("+"):
        return f"The library was built from commit {commit[:-1]} with uncommitted changes. {again}"
    try:
        differs = _git("diff", "--name-only", commit, "HEAD", "--", "sdk", "cmake", "CMakeLists.txt")
    except (OSError, subprocess.CalledProcessError):
        return f"The library is of commit {commit}, which this checkout does not have. {again}"
    return (
        f"The library is of commit {commit}, whose sources differ from those of this checkout. {again}"
        if differs
        else ""
    )


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], check=True, capture_output=True, text=True).stdout.strip()


def refusal(stamps: Mapping[str, Mapping[str, str]], sections: Iterable[str], command: str) -> str:
    """Returns one sentence that says why the sections cannot be published together, or "" if they can: all have a stamp
    of the same commit, without uncommitted changes. command: measures the sections whose names are appended."""
    commits = {name: stamps.get(name, {}).get("commit", "unknown") for name in sections}
    newest = _newest(stamps, commits)
    again = [name for name, commit in commits.items() if commit != newest]
    if not again and newest and "unknown" not in newest and CHANGED not in newest:
        return ""
    said = "; ".join(f"{name} is of commit {commit}" for name, commit in commits.items())
    if not again:
        return (
            f"The report is not published, because its commit is not known exactly: {said}. Commit all changes, then "
            "run: python -m benchmarks --publish"
        )
    return (
        f"The report is not published, because its sections are of different commits: {said}. Check out one commit, "
        f"then run there: {command} {' '.join(dict.fromkeys(name.split('.')[0] for name in again))}"
    )


def _newest(stamps: Mapping[str, Mapping[str, str]], commits: Mapping[str, str]) -> str:
    """Returns the commit that most sections of the latest date have."""
    dates = {name: stamps.get(name, {}).get("date", "") for name in commits}
    latest = [commit for name, commit in commits.items() if dates[name] == max(dates.values())]
    return max(latest, key=latest.count, default="")


def sentence(stamps: Mapping[str, Mapping[str, str]]) -> str:
    """Returns the line of the report that names commits and dates; one commit is named once."""
    distinct = list(dict.fromkeys((one["commit"], one["date"]) for one in stamps.values()))
    if not distinct:
        return "The commit of the measured code was not recorded."
    if len({commit for commit, _ in distinct}) == 1:
        dates = sorted({date for _, date in distinct})
        return f"Measured at commit {distinct[0][0]}, {' to '.join(dict.fromkeys((dates[0], dates[-1])))}."
    said = "; ".join(f"{name}: {one['commit']}, {one['date']}" for name, one in stamps.items())
    return f"Sections of different commits, not for publication: {said}."
