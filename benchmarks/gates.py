"""Compares figures with targets.toml."""

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
    """state: "stretch" (better than wished), "met", "missed", or "not measured" with the reason in `why`. tried: what
    was done about a gate that is missed."""

    figure: str
    says: str
    value: float | None
    gate: str
    stretch: str
    state: str
    why: str = ""
    tried: str = ""


def check(
    figures: dict[str, float],
    machine: dict,
    missing: dict[str, str],
    targets: Path = TARGETS,
    only: Collection[str] | None = None,
) -> list[Verdict]:
    """figures: value by name. machine: as `maquette bench` describes it. missing: why a figure was not measured.
    only: the figures that are meant; without it, all.

    Raises ValueError for targets that cannot be read.
    """
    document = tomllib.loads(targets.read_text())
    verdicts = []
    for gate in document["gate"]:
        name = gate["figure"]
        if only is not None and name not in only:
            continue
        if ("min" in gate) == ("max" in gate):
            raise ValueError(f"{targets}: {name} needs either min or max")
        is_min = "min" in gate
        bound, stretch, sign = gate["min" if is_min else "max"], gate["stretch"], "≥" if is_min else "≤"
        state, why, value = "not measured", missing.get(name, ""), figures.get(name)
        wanted = document["machine"][gate["machine"]] if "machine" in gate else None
        if wanted and not same_machine(machine, wanted):
            why = f"the gate is for a {wanted['says']}"
        elif value is not None:
            reached = [value >= limit if is_min else value <= limit for limit in (bound, stretch)]
            state = "stretch" if reached[1] else "met" if reached[0] else "missed"
        elif not why:
            raise ValueError(f"{targets}: no figure is called {name}")
        tried = " ".join(gate.get("tried", "").split()) if state == "missed" else ""
        verdicts.append(Verdict(name, gate["says"], value, f"{sign} {bound}", f"{sign} {stretch}", state, why, tried))
    return verdicts


def same_machine(machine: dict, wanted: dict) -> bool:
    sets = set(machine.get("instruction_sets") or [])
    same = all(machine.get(key) == wanted[key] for key in ("architecture", "cores"))
    return same and set(wanted["instruction_sets"]) <= sets


def print_verdicts(verdicts: list[Verdict]) -> None:
    colours = {"stretch": "bold green", "met": "green", "missed": "bold red", "not measured": "yellow"}
    table = Table(title="Gates", title_justify="left")
    for column in ("what", "figure", "gate", "stretch", "state"):
        table.add_column(column, justify="left" if column in ("what", "state") else "right")
    for v in verdicts:
        value = "" if v.value is None else f"{v.value:.4g}"
        state = f"[{colours[v.state]}]{v.state}[/]" + (f": {v.why}" if v.why else "")
        table.add_row(v.says, value, v.gate, v.stretch, state)
    console = Console()
    console.print(table)
    for v in verdicts:
        if v.tried:
            console.print(f"[bold red]Missed[/]: {v.says}. {v.tried}")
