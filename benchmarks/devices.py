"""Compares devices: a table from reports of `maquette bench --json` and of the sample app's Benchmark screen.

python -m benchmarks.devices phone.json laptop.json        # Markdown, one line for each device and source
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

SCHEMA = "maquette-bench-3"
HEADER = (
    "| device | system | source | people | frames a second | p50 ms | p99 ms | CPU ms | peak memory | reliable |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)


def read_report(path: Path) -> dict:
    """Reads a report. Raises ValueError with a sentence if the file is not a report."""
    try:
        report = json.loads(path.read_text())
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise ValueError(f"{path} cannot be read as JSON: {error}") from None
    schema = report.get("schema") if isinstance(report, dict) else None
    if schema != SCHEMA:
        raise ValueError(
            f"{path} has the schema {schema!r}; {SCHEMA!r} is expected, as maquette bench --json writes it."
        )
    return report


def cell(text: object) -> str:
    """Escapes a text of a report, so that it cannot end its cell or be markup."""
    return str(text).replace("\\", "").replace("|", "/").replace("<", "(").replace("\n", " ")[:80]


def lines_of(report: dict) -> list[str]:
    """Returns Markdown lines of the report's cases. Raises KeyError or TypeError if it lacks a field."""
    machine = report["machine"]
    memory = f"{float(report['peak_memory_mib']):.0f} MiB"
    return [
        f"| {cell(machine['processor'])}, {int(machine['cores'])} cores | {cell(machine['system'])} "
        f"| `{cell(case['source'])}` | {float(case['people']):.1f} | {float(case['fps']):.0f} "
        f"| {float(case['ms']['frame']['p50']):.1f} | {float(case['ms']['frame']['p99']):.1f} "
        f"| {float(case['cpu_ms']):.1f} | {memory} | {'yes' if report['valid'] and case['valid'] else 'no'} |"
        for case in report["cases"]
    ]


def table(paths: list[Path]) -> str:
    """Returns the table. Raises ValueError for the first file that is not a report."""
    lines = [HEADER]
    for path in paths:
        report = read_report(path)
        try:
            lines += lines_of(report)
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"{path} is not a complete report: {error!r}") from None
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("report", type=Path, nargs="+")
    try:
        print(table(parser.parse_args().report))
    except ValueError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
