"""Runs the program on hostile inputs and counts crashes, hangs and unclear errors (tests/hostile/README.md)."""

import argparse
import json
import os
import signal
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from tqdm import tqdm

from tests.hostile.kinds import KINDS, trials
from tests.hostile.samples import ROOT, make_samples
from tests.hostile.trial import Outcome, Trial, run
from tests.hostile.verdict import CRASH, FINE, HANG, UNCLEAR, Verdict, verdict

COLUMNS = ("tried", CRASH, HANG, UNCLEAR)


def run_all(
    program: Path, chosen: list[str], count: int | None, seed: int, jobs: int, has_sanitizers: bool
) -> tuple[dict[str, Counter], list[dict]]:
    """Counts of verdicts by kind, and what was found: all that is not fine."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) == signal.SIG_IGN:  # by nohup, or in the background; the program would inherit it
            signal.signal(number, lambda *_: None)
    counts: dict[str, Counter] = {name: Counter() for name in chosen}
    found = []
    with tempfile.TemporaryDirectory(prefix="hostile-") as name, ThreadPoolExecutor(jobs) as pool:
        folder = Path(name)
        folder.chmod(0o755)  # trials of another user go through it
        made = trials(make_samples(program, folder / "samples"), seed, chosen, count)
        futures = {
            pool.submit(run, program, trial, folder / str(number), has_sanitizers, number): (kind, trial)
            for number, (kind, trial) in enumerate(made)
        }
        try:
            for future in tqdm(as_completed(futures), total=len(futures), unit="trial", leave=False, file=sys.stderr):
                kind, trial = futures[future]
                outcome = future.result()
                what = verdict(trial, outcome, has_sanitizers)
                counts[kind][what.what] += 1
                if what.what != FINE:
                    found.append(described(kind, trial, outcome, what))
        finally:
            pool.shutdown(cancel_futures=True)  # an error of the script, or Ctrl-C, ends it at once
    return counts, sorted(found, key=lambda entry: (entry["kind"], entry["name"]))


def described(kind: str, trial: Trial, outcome: Outcome, what: Verdict) -> dict:
    return {
        "kind": kind, "name": trial.name, "verdict": what.what, "reason": what.reason,
        "words": [os.fsdecode(word)[:200].encode("utf-8", "replace").decode() for word in trial.words],
        "limits": dict(trial.limits), "redirect": trial.redirect, "exit_code": outcome.exit_code,
        "seconds": round(outcome.seconds, 2), "peak_mib": outcome.peak_bytes >> 20,
        "errors": outcome.errors[:2000].decode(errors="replace"),
        "output": outcome.output[:500].decode(errors="replace"),
    }  # fmt: skip


def table(counts: dict[str, Counter]) -> str:
    """Markdown, with a line of sums."""
    rows = [(name, sum(row.values()), *(row[what] for what in COLUMNS[1:])) for name, row in counts.items()]
    rows.append(("all", *(sum(row[k] for row in rows) for k in range(1, 5))))
    lines = ["| kind | tried | crashes | hangs | unclear |", "| --- | --- | --- | --- | --- |"]
    return "\n".join(lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows])


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.hostile", description=__doc__)
    parser.add_argument("--only", nargs="+", metavar="KIND", choices=[*KINDS], default=[*KINDS],
                        help="kinds: " + ", ".join(KINDS))  # fmt: skip
    parser.add_argument("--count", type=int, help="at most so many trials of each kind")
    parser.add_argument("--build", default="release", help="release or asan: the build whose staged program is run")
    parser.add_argument("--seed", type=int, default=0, help="the same seed gives the same inputs")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="trials at a time")
    parser.add_argument("--json", type=Path, help="file for the counts and for all that was found")
    options = parser.parse_args()
    program = ROOT / "build" / options.build / "stage/bin/maquette"
    if not program.exists():
        parser.error(f"{program} does not exist; build it, or choose another --build")
    has_sanitizers = options.build == "asan"
    chosen = [name for name in options.only if not (left_out(name, has_sanitizers))]
    for name in options.only:
        if reason := left_out(name, has_sanitizers):
            print(f"not tried: {name}: {reason}")
    counts, found = run_all(program, chosen, options.count, options.seed, options.jobs, has_sanitizers)
    for entry in found:
        print(f"{entry['verdict']}: {entry['kind']}: {entry['name']}: {entry['reason']}")
        print("".join(f"    {line}\n" for line in entry["errors"].splitlines()[:4]), end="")
    print(table(counts))
    if options.json:
        options.json.write_text(json.dumps({"build": options.build, "seed": options.seed, "found": found,
                                            "counts": counts}, indent=1) + "\n")  # fmt: skip
    return 1 if found else 0


def left_out(name: str, has_sanitizers: bool) -> str:
    needs = KINDS[name].needs
    if "limits" in needs and has_sanitizers:
        return "sanitizers need memory and threads of their own"
    if "user" in needs and os.getuid() != 0:
        return "needs root, to run the program as a user without rights"
    return ""


if __name__ == "__main__":
    sys.exit(main())
