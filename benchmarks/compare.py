"""Two benchmark runs of one build beside each other: do they agree within 5 % in every ratio that is a gate?

python -m benchmarks.compare first/benchmark.json second/benchmark.json
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

MAX_DIFFERENCE = 0.05
RATIOS = ("time_by_openvino_int8", "time_by_pytorch_fp32", "roofline_fraction")


def differences(first: dict[str, float], second: dict[str, float]) -> dict[str, float]:
    """Relative difference of each figure that both have."""
    return {name: abs(second[name] / first[name] - 1) for name in first if name in second and first[name]}


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("first", type=Path)
    parser.add_argument("second", type=Path)
    options = parser.parse_args(argv)
    first, second = (json.loads(path.read_text())["figures"] for path in (options.first, options.second))
    table = Table(title="Two runs", title_justify="left")
    for column in ("figure", "first", "second", "difference"):
        table.add_column(column, justify="left" if column == "figure" else "right")
    found = differences(first, second)
    for name, difference in found.items():
        mark = " (gate)" if name in RATIOS else ""
        table.add_row(name + mark, f"{first[name]:.4g}", f"{second[name]:.4g}", f"{difference:.1%}")
    Console().print(table)
    far = [name for name in RATIOS if found.get(name, float("inf")) > MAX_DIFFERENCE]
    apart = f"Further apart than {MAX_DIFFERENCE:.0%}: {', '.join(far)}"
    print(apart if far else f"All ratios within {MAX_DIFFERENCE:.0%}")
    return 1 if far else 0


if __name__ == "__main__":
    sys.exit(main())
