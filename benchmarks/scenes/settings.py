"""Lists the measured settings: networks, options of `scene build`, options of `scene render`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

SHIPPED, FLOAT = "shipped", "float"
POINTS = 500_000  # as shipped
CONSTANT = "1e9"  # min. variation that no descriptor reaches, so that all keep their mean
TUNED = {"10s": "10 s", "60s": "1 min", "600s": "10 min"}


@dataclass(frozen=True)
class Setting:
    """axis: the varied option. networks: SHIPPED, FLOAT, or the name of another bundle. build, render: options of the
    commands. shrink: divisor of the photos' sides. tuned: a fine-tuned scene file, which is not built here."""

    name: str
    axis: str
    networks: str = SHIPPED
    build: tuple[str, ...] = ("--points", str(POINTS))
    render: tuple[str, ...] = ()
    shrink: int = 1
    tuned: str = ""


@dataclass(frozen=True)
class Sources:
    """places: folders of rendered captures, real: folders of real captures (docs/reference/formats.md). bundles: by
    SHIPPED, FLOAT (the same networks in fp32) and names of others. tuned: folder of fine-tuned scenes, PLACE/10s.maqs
    and so on, with PLACE/10s-networks beside them if the networks were tuned too."""

    places: list[Path]
    real: list[Path]
    bundles: dict[str, Path]
    tuned: Path | None = None


def sources(
    places: Path, real: Sequence[Path], shipped: Path, fp32: Path, others: Sequence[Path], tuned: Path | None
) -> Sources:
    """Returns the existing sources: captures in the folder `places`, by name. Raises ValueError if two bundles have one
    name."""
    names = [bundle_name(path) for path in others]
    if len({SHIPPED, FLOAT, *names}) < len(names) + 2:
        raise ValueError(f"bundles of networks need different names to be told apart; these are {', '.join(names)}")
    found = sorted(path.parent for path in places.glob("*/transforms.json"))
    return Sources(found, list(real), {SHIPPED: shipped, FLOAT: fp32, **dict(zip(names, others, strict=True))}, tuned)


def bundle_name(folder: Path) -> str:
    """Returns the name in the manifest, or the folder's name."""
    try:
        return str(json.loads((folder / "manifest.json").read_text())["name"])
    except (OSError, ValueError, KeyError, TypeError):
        return folder.name


def settings(bundles: Sequence[str]) -> list[Setting]:
    """Returns the settings, the shipped one first. bundles: names besides SHIPPED and FLOAT."""
    all_points = ("--points", str(POINTS))
    made = [Setting("as shipped", "shipped")]
    made += [Setting(f"{n:,} points", "points", build=("--points", str(n))) for n in (50_000, 200_000)]
    made += [Setting("half the size", "size", shrink=2)]
    made += [Setting("half the size, 200,000 points", "size", build=("--points", "200000"), shrink=2)]
    made += [Setting(name, "networks", name) for name in bundles if name not in (SHIPPED, FLOAT)]
    made.append(Setting("fp32 networks", "precision", FLOAT))
    everything = (*all_points, "--coefficients", "32", "--min-variation", "0")
    made.append(Setting("fp32 networks and descriptors, all varying", "precision", FLOAT, everything))
    for bits in (8, 16, 32):
        made.append(Setting(f"coefficients of {bits} bits", "coefficients", build=(*all_points, "--coefficients",
                                                                                   str(bits))))  # fmt: skip
    made.append(Setting("means alone", "view dependence", build=(*all_points, "--min-variation", CONSTANT)))
    made.append(Setting("every descriptor varies", "view dependence", build=(*all_points, "--min-variation", "0")))
    made += [Setting(f"fine-tuned {said}", "fine-tuned", tuned=name) for name, said in TUNED.items()]
    return made
