"""Runs tests/soak/soak.cpp for a long time and draws what it used: python -m tests.soak [--seconds 600].

Fails when the process grows: the last third of the run has more open files or threads than the second, or over 2 % and
1 MiB more memory (medians). Writes build/soak/soak.svg and soak.json.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt

ROOT = Path(__file__).parents[2]
OUT = ROOT / "build/soak"
DRAWN = ("dense pose", "edges", "prediction", "camera health")  # the tasks of each round


def run(program: Path, seconds: float) -> list[dict]:
    lines = []
    with (
        tempfile.TemporaryDirectory() as folder,
        subprocess.Popen([program, str(seconds), folder], stdout=subprocess.PIPE, text=True) as process,
    ):
        for line in process.stdout:
            lines.append(json.loads(line))
            now = lines[-1]
            print(f"{now['seconds']:8.0f} s  {now['resident_mib']:7.1f} MiB  {now['files']} files  "
                  f"{now['threads']} threads", flush=True)  # fmt: skip
    if process.returncode != 0:
        sys.exit(f"The program ended with {process.returncode}.")
    return lines


def growth(lines: list[dict]) -> list[str]:
    """Returns what is larger in the last third than in the second."""
    third = len(lines) // 3
    found = []
    for what, fraction, slack in (("resident_mib", 0.02, 1), ("files", 0, 0), ("threads", 0, 0)):
        before, after = (median(line[what] for line in part) for part in (lines[third : 2 * third], lines[2 * third :]))
        if after > before + max(fraction * before, slack):
            found.append(f"{what}: {before:.1f} in the second third, {after:.1f} in the last")
    return found


def draw(lines: list[dict], path: Path) -> None:
    minutes = [line["seconds"] / 60 for line in lines]
    figure, (memory, counts, times) = plt.subplots(3, sharex=True, figsize=(8, 8), layout="constrained")
    memory.plot(minutes, [line["resident_mib"] for line in lines])
    memory.set(ylabel="resident memory, MiB", ylim=(0, None))
    for what in ("files", "threads"):
        counts.plot(minutes, [line[what] for line in lines], label=f"open {what}" if what == "files" else what)
    counts.set(ylabel="number", ylim=(0, None))
    counts.legend()
    for i, task in enumerate(DRAWN):
        for which, style in ((1, "-"), (2, ":")):
            times.plot(minutes, [line["tasks"][task][which] for line in lines], style, color=f"C{i}",
                       label=f"{task}, {'p50' if which == 1 else 'p99'}")  # fmt: skip
    times.set(ylabel="ms", yscale="log", xlabel="minutes")
    times.legend(ncols=2, fontsize="small")
    figure.savefig(path)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.soak", description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--program", type=Path, default=ROOT / "build/release/tests/native/soak")
    options = parser.parse_args()
    lines = run(options.program, options.seconds)
    OUT.mkdir(parents=True, exist_ok=True)
    (OUT / "soak.json").write_text(json.dumps(lines))
    draw(lines, OUT / "soak.svg")
    found = growth(lines)
    print(f"{OUT / 'soak.svg'}: " + ("; ".join(found) or "memory, open files and threads stay the same"))
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
