"""Compares metrics with the thresholds in targets.toml."""

from __future__ import annotations

import tomllib
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

TARGETS = Path(__file__).with_name("targets.toml")


@dataclass(frozen=True)
class Verdict:
    """state: "goal" (the goal is reached too), "met", "missed", or "not measured" with the reason in `why`. tried: the
    attempts at a missed target."""

    metric: str
    description: str
    value: float | None
    threshold: str
    goal: str
    state: str
    why: str = ""
    tried: str = ""


def check(
    metrics: dict[str, float],
    machine: dict,
    missing: dict[str, str],
    targets: Path = TARGETS,
    only: Collection[str] | None = None,
) -> list[Verdict]:
    """metrics: value by name. machine: as `maquette bench` describes it. missing: why a metric was not measured.
    only: names of the metrics to check; None: all.

    Raises ValueError for targets that cannot be read.
    """
    document = tomllib.loads(targets.read_text())
    verdicts = []
    for target in document["target"]:
        name = target["metric"]
        if only is not None and name not in only:
            continue
        if ("min" in target) == ("max" in target):
            raise ValueError(f"{targets}: {name} needs either min or max")
        is_min = "min" in target
        bound, goal, sign = target["min" if is_min else "max"], target["goal"], "≥" if is_min else "≤"
        state, why, value = "not measured", missing.get(name, ""), metrics.get(name)
        wanted = document["machine"][target["machine"]] if "machine" in target else None
        if wanted and not same_machine(machine, wanted):
            why = f"the target is for a {wanted['description']}"
        elif value is not None:
            reached = [value >= limit if is_min else value <= limit for limit in (bound, goal)]
            state = "goal" if reached[1] else "met" if reached[0] else "missed"
        elif not why:
            raise ValueError(f"{targets}: no metric is called {name}")
        tried = " ".join(target.get("tried", "").split()) if state == "missed" else ""
        description = target["description"]
        verdicts.append(Verdict(name, description, value, f"{sign} {bound}", f"{sign} {goal}", state, why, tried))
    return verdicts


def same_machine(machine: dict, wanted: dict) -> bool:
    sets = set(machine.get("instruction_sets") or [])
    same = all(machine.get(key) == wanted[key] for key in ("architecture", "cores"))
    return same and set(wanted["instruction_sets"]) <= sets


def print_verdicts(verdicts: list[Verdict]) -> None:
    colours = {"goal": "bold green", "met": "green", "missed": "bold red", "not measured": "yellow"}
    table = Table(title="Targets", title_justify="left")
    for column in ("metric", "value", "threshold", "goal", "state"):
        table.add_column(column, justify="left" if column in ("metric", "state") else "right")
    for v in verdicts:
        value = "" if v.value is None else f"{v.value:.4g}"
        state = f"[{colours[v.state]}]{v.state}[/]" + (f": {v.why}" if v.why else "")
        table.add_row(v.description, value, v.threshold, v.goal, state)
    console = Console()
    console.print(table)
    for v in verdicts:
        if v.tried:
            console.print(f"[bold red]Missed[/]: {v.description}. {v.tried}")
