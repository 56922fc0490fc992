"""Measures false positives of the shipped bundle on scans of round toys, away from their borders: there is no edge."""

from __future__ import annotations

from pathlib import Path

from benchmarks.edges.edges_api import Edges, Pinhole
from export.depth_frames.sheet import false_positives
from export.edges.data import frame_of
from export.solids.records import RecordError, read_records

METRIC = "edges_curved_false_percent"
SCANS = Path(".data/solids/real")
NAMES = ("real/rs1_normals", "real/rs22_proc2")  # names in export.depth_frames.originals
FETCH = f"python -m export.depth_frames fetch --out {SCANS}"


def measure(folder: Path, bundle: Path, threads: int) -> dict:
    """Returns export.depth_frames.sheet.false_positives over both scans, and for each by its name. Raises
    FileNotFoundError without the scans."""
    try:
        frames = {r.name: frame_of(r) for r in read_records(folder) if r.name in NAMES}
    except RecordError as error:
        raise FileNotFoundError(f"{folder} has no scans: {FETCH}") from error
    if len(frames) < len(NAMES):
        raise FileNotFoundError(f"{folder} has {len(frames)} of {len(NAMES)} scans: {FETCH}")
    with Edges(bundle, threads) as edges:

        def field(depth, focal_px):
            return edges.run(depth, Pinhole.centred(depth.shape, focal_px)).distance

        scans = [{"name": name, **false_positives(field, [frame])} for name, frame in frames.items()]
        return false_positives(field, list(frames.values())) | {"scans": scans}


def found_in(bundle: Path, threads: int) -> tuple[dict | None, str]:
    """Returns the result of `measure` for SCANS, or None and why it cannot be measured."""
    try:
        return measure(SCANS, bundle, threads), ""
    except FileNotFoundError as error:
        return None, str(error)


def metrics_from(found: dict | None) -> dict[str, float]:
    return {} if found is None else {METRIC: 100 * found["under_1r"]}
