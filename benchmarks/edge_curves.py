"""Curves from the true fields of rendered solids: precision, recall and F-score by length within 2 r, and why what is
missing is missing.

    python -m benchmarks.edge_curves --data .data/solids/val                       # both sizes, with the causes
    python -m benchmarks.edge_curves --data .data/solids/val --noise 0.5 --blur 0.5
    python -m benchmarks.edge_curves --data .data/solids/val --set min_length_px=7

Needs views of `export.solids.dataset --whole` and the program extract_edge_curves
(`cmake --build --preset release --target extract_edge_curves`). Curves whose rounding is neither sharp nor smooth
count neither for nor against.
"""

from __future__ import annotations

import argparse
import json
import struct
import subprocess
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np
from scipy.spatial import cKDTree

from export.edges.curve_metrics import WITHIN_R, places_on
from export.solids.records import BOUNDARY, LIMIT_R, NONE, Record, read_records

PROGRAM = Path("build/release/benchmarks/native/extract_edge_curves")
SIZES = ("320x240", "640x480")
CREASE_KIND, BOUNDARY_KIND = 1, 2  # of the C++ field

# A missing place has the first of these causes that is true of it.
CAUSES = {
    "placed wrong": "a curve that is on no edge in space is there in the picture (within 2 px)",
    "not shown": "no pixel within 1.5 px says that it is on a curve",
    "short": "what is seen of the edge is under 10 px long",
    "in one pixel": "another edge runs beside it, nearer than 1.5 px",
    "side by side": "another edge runs beside it, nearer than 6 px",
    "at a corner": "under 6 px from an end of the edge",
    "grazing": "a pixel along the edge is over 4 r",
    "arc": "of an arc",
    "spline": "of another bent edge",
    "line": "of a line, for none of these causes",
}


@dataclass
class Tally:
    """Sums over places on curves, half a footprint apart. missing: by cause, and by cause and kind of edge."""

    found: int = 0
    right: int = 0
    true: int = 0
    hit: int = 0
    shown: int = 0
    shown_hit: int = 0
    by_length: dict[int, list[int]] = field(default_factory=lambda: defaultdict(lambda: [0, 0]))
    missing: Counter = field(default_factory=Counter)
    missing_kind: Counter = field(default_factory=Counter)
    wrong: Counter = field(default_factory=Counter)
    scores: list[float] = field(default_factory=list)

    @property
    def precision(self) -> float:
        return self.right / max(self.found, 1)

    @property
    def recall(self) -> float:
        return self.hit / max(self.true, 1)

    @property
    def f_score(self) -> float:
        return 2 * self.precision * self.recall / max(self.precision + self.recall, 1e-9)


MIN_LENGTHS_PX = (5, 10, 20, 40)  # recall is also given over edges of which at least so much is seen


@dataclass
class TrueCurve:
    points: np.ndarray  # [n, 3]
    kind: int
    type: str
    sure: bool
    length_px: float


def true_curves(record: Record) -> list[TrueCurve]:
    fx, fy, cx, cy = record.intrinsics
    found = []
    for curve in record.seen_curves()["curves"]:
        points = np.asarray(curve["points"], np.float64)
        if curve["type"] == "arc":
            points = _arc_points(points, np.asarray(curve["centre"]), np.asarray(curve["axis"]))
        pixel = points[:, :2] / points[:, 2:] * [fx, fy] + [cx, cy]
        length = float(np.linalg.norm(np.diff(pixel, axis=0), axis=1).sum())
        found.append(TrueCurve(points, curve["kind"], curve["type"], curve["sure"], length))
    return found


def _arc_points(three: np.ndarray, centre: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Start, middle and end of an arc to a polyline."""
    x = three[0] - centre
    y = np.cross(axis, x)
    angle = [np.arctan2((p - centre) @ y, (p - centre) @ x) % (2 * np.pi) for p in three[1:]]
    sweep = angle[1] if angle[1] > 1e-9 else 2 * np.pi
    if angle[0] > sweep:  # the other way round
        sweep -= 2 * np.pi
    a = np.linspace(0, sweep, max(2, int(np.ceil(abs(sweep) / 0.03)) + 1))[:, None]
    return centre + np.cos(a) * x + np.sin(a) * y


def pack(records: Sequence[Record], path: Path, noise_r: float = 0.0, blur_px: float = 0.0, seed: int = 1) -> None:
    """The views' true fields as extract_edge_curves reads them; blurred within surfaces and with noise if asked."""
    rng = np.random.default_rng(seed)
    with path.open("wb") as file:
        for record in records:
            planes = record.decoded()
            distance = planes["distance"].astype(np.float32)
            if blur_px > 0:
                distance = _blurred(distance, planes["patch"], blur_px)
            if noise_r > 0:
                noisy = distance + noise_r * rng.standard_normal(distance.shape, np.float32)
                distance = np.where(distance < LIMIT_R, np.clip(noisy, 0, LIMIT_R), distance)
            kind = np.where(planes["kind"] == BOUNDARY, BOUNDARY_KIND, CREASE_KIND)
            kind = np.where(planes["kind"] == NONE, 0, kind)
            spread = np.hypot(noise_r, 0.5 * blur_px) * np.sqrt(2 / np.pi)
            pack_field(file, record.intrinsics, distance, planes["depth"], kind, spread)


def pack_field(
    file: BinaryIO,
    intrinsics: Sequence[float],
    distance: np.ndarray,
    depth: np.ndarray,
    kind: np.ndarray,
    spread_r: float = 0.0,
) -> None:
    """Appends a view. intrinsics: fx, fy, cx, cy in pixels. Planes [H, W]: distance in r, depth in metres, kind as in
    the C++ field (0 none, 1 crease, 2 boundary)."""
    height, width = distance.shape
    file.write(struct.pack("<2i6d", width, height, *intrinsics, LIMIT_R, spread_r))
    for plane, to in ((distance, "<f4"), (depth, "<f4"), (kind, "u1")):
        file.write(np.ascontiguousarray(plane, to).tobytes())


def _blurred(distance: np.ndarray, patch: np.ndarray, blur_px: float) -> np.ndarray:
    for axis in (0, 1):
        total, weight = np.zeros(distance.shape), np.zeros(distance.shape)
        for k in range(-3, 4):
            at = np.clip(np.arange(distance.shape[axis]) + k, 0, distance.shape[axis] - 1)
            g = np.exp(-k * k / (2 * blur_px**2)) * (np.take(patch, at, axis) == patch)
            total += g * np.take(distance, at, axis)
            weight += g
        distance = (total / weight).astype(np.float32)
    return distance


def extracted(path: Path, options: Mapping[str, float] | None = None, program: Path = PROGRAM) -> Iterator[dict]:
    """Of each view in turn what the program says."""
    if not program.exists():
        raise SystemExit(f"{program} is missing: cmake --build --preset release --target extract_edge_curves")
    words = [f"{name}={value}" for name, value in (options or {}).items()]
    run = subprocess.run([program, path, *words], stdout=subprocess.PIPE, text=True, check=True)
    return (json.loads(line) for line in run.stdout.splitlines())


def judge(record: Record, found: dict, tally: Tally) -> None:
    """Adds a view to the tally."""
    fx, fy, cx, cy = record.intrinsics
    focal = float(np.sqrt(fx * fy))

    def pixels(points: np.ndarray) -> np.ndarray:
        return points[:, :2] / np.maximum(points[:, 2:], 1e-9) * [fx, fy] + [cx, cy]

    truth = true_curves(record)
    sure, unsure = [c for c in truth if c.sure], [c for c in truth if not c.sure]
    ours = places_on([np.asarray(c["points"]) for c in found["curves"]], focal)
    parts = [places_on([c.points], focal) for c in sure]
    theirs = np.concatenate([np.zeros((0, 3)), *parts])
    owner = np.repeat(np.arange(len(parts)), [len(p) for p in parts])
    doubtful = places_on([c.points for c in unsure], focal)

    def nearest_r(of: np.ndarray, others: np.ndarray) -> np.ndarray:
        if not len(of) or not len(others):
            return np.full(len(of), np.inf)
        return cKDTree(others).query(of)[0] * focal / np.maximum(of[:, 2], 1e-12)

    to_true, to_found = nearest_r(ours, theirs), nearest_r(theirs, ours)
    right = to_true <= WITHIN_R
    counts = right | ~(nearest_r(ours, doubtful) <= WITHIN_R)
    hit = to_found <= WITHIN_R
    tally.found += int(counts.sum())
    tally.right += int(right.sum())
    tally.true += len(theirs)
    tally.hit += int(hit.sum())
    precision, recall = right.sum() / max(counts.sum(), 1), hit.mean() if len(hit) else 1.0
    if len(hit):
        tally.scores.append(2 * precision * recall / max(precision + recall, 1e-9))
    length = np.array([c.length_px for c in sure])[owner] if len(owner) else np.zeros(0)
    for shortest in MIN_LENGTHS_PX:
        tally.by_length[shortest][0] += int((length >= shortest).sum())
        tally.by_length[shortest][1] += int(hit[length >= shortest].sum())
    at, our_pixels = pixels(theirs), pixels(ours)
    if len(ours) and len(theirs):
        false = counts & ~right
        beside = cKDTree(at).query(our_pixels[false])[0] <= WITHIN_R if false.any() else np.zeros(0, bool)
        tally.wrong["placed wrong"] += int(beside.sum())
        tally.wrong["made up"] += int((~beside).sum())
    if not len(theirs):
        return
    shown = _is_shown(record, at)
    tally.shown += int(shown.sum())
    tally.shown_hit += int(hit[shown].sum())
    miss = np.flatnonzero(~hit)
    if not len(miss):
        return
    astray = our_pixels[~right]
    is_placed = cKDTree(astray).query(at[miss])[0] <= WITHIN_R if len(astray) else np.zeros(len(miss), bool)
    beside, corner = _beside(at, owner, miss), _from_end_px(at, owner)[miss] < 6
    step = np.gradient(at, axis=0)
    step_px = np.linalg.norm(step, axis=1)[miss]
    types = np.array([c.type for c in sure])[owner[miss]]
    causes = {
        "placed wrong": is_placed,
        "not shown": ~shown[miss],
        "short": length[miss] < 10,
        "in one pixel": beside < 1.5,
        "side by side": beside < 6,
        "at a corner": corner,
        "grazing": step_px < 0.5 / 4,
        "arc": types == "arc",
        "spline": types == "spline",
        "line": types == "line",
    }
    left = np.ones(len(miss), bool)
    kinds = np.array([c.kind for c in sure])[owner[miss]]
    for name, holds in causes.items():
        own = left & holds
        left &= ~holds
        tally.missing[name] += int(own.sum())
        tally.missing_kind[name, "boundary"] += int((own & (kinds == BOUNDARY)).sum())
        tally.missing_kind[name, "crease"] += int((own & (kinds != BOUNDARY)).sum())


def _is_shown(record: Record, at: np.ndarray) -> np.ndarray:
    """Whether a pixel within 1.5 px of a place is under 2 r from a curve."""
    distance = record.decoded()["distance"]
    y, x = np.nonzero(distance < WITHIN_R)
    if not len(x):
        return np.zeros(len(at), bool)
    return cKDTree(np.stack([x, y], 1)).query(at)[0] <= 1.5


def _beside(at: np.ndarray, owner: np.ndarray, of: np.ndarray) -> np.ndarray:
    """How far across in the picture another edge runs nearly the same way, px; 99 where none does."""
    direction = np.gradient(at, axis=0)
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-12)
    tree = cKDTree(at)
    found = np.full(len(of), 99.0)
    for k, i in enumerate(of):
        near = np.array(tree.query_ball_point(at[i], 6.0))
        near = near[owner[near] != owner[i]]
        if not len(near):
            continue
        offset = at[near] - at[i]
        across = np.abs(offset[:, 0] * direction[i, 1] - offset[:, 1] * direction[i, 0])
        along = np.abs(offset @ direction[i])
        same = np.abs(direction[near] @ direction[i]) > 0.85
        found[k] = across[same & (along < 1)].min(initial=99.0)
    return found


def _from_end_px(at: np.ndarray, owner: np.ndarray) -> np.ndarray:
    """From the nearer end of the own edge, in the picture."""
    found = np.zeros(len(at))
    for k in np.unique(owner):
        own = np.flatnonzero(owner == k)
        ends = at[own[[0, -1]]]
        found[own] = np.linalg.norm(at[own][:, None] - ends[None], axis=2).min(1)
    return found


def views(folder: Path, size: str, most: int | None = None) -> list[Record]:
    """The whole views of one size."""
    found = [record for record in read_records(folder) if record.name.split("/")[3] == size]
    if not found:
        raise SystemExit(f"{folder} has no views of {size}: python -m export.solids.dataset val --whole --out {folder}")
    return found[:most]


def measured(records: Sequence[Record], path: Path, options: Mapping[str, float] | None = None) -> Tally:
    tally = Tally()
    for record, found in zip(records, extracted(path, options), strict=True):
        judge(record, found, tally)
    return tally


def said(size: str, tally: Tally) -> str:
    lines = [
        f"{size}: precision {tally.precision:.4f}, recall {tally.recall:.4f}, F {tally.f_score:.4f}; "
        f"mean F of {len(tally.scores)} views {np.mean(tally.scores):.4f}, median {np.median(tally.scores):.4f}",
        f"  recall of what the frame shows {tally.shown_hit / max(tally.shown, 1):.4f}; of edges of at least "
        + ", ".join(f"{px} px {hit / max(all_, 1):.4f}" for px, (all_, hit) in sorted(tally.by_length.items())),
        "  missing, % of all true length (creases, boundaries):",
    ]
    for name in CAUSES:
        share, crease, boundary = (
            100 * n / max(tally.true, 1)
            for n in (tally.missing[name], tally.missing_kind[name, "crease"], tally.missing_kind[name, "boundary"])
        )
        lines.append(f"    {name:13} {share:6.2f}  ({crease:5.2f}, {boundary:5.2f})")
    wrong = ", ".join(f"{name} {100 * n / max(tally.found, 1):.2f}" for name, n in sorted(tally.wrong.items()))
    return "\n".join([*lines, f"  wrong, % of all found length: {wrong}"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="a folder of whole views")
    parser.add_argument("--sizes", nargs="+", default=SIZES, choices=SIZES)
    parser.add_argument("--views", type=int, help="the first so many of each size (default: all)")
    parser.add_argument("--noise", type=float, default=0.0, help="r, added to the field (default %(default)s)")
    parser.add_argument("--blur", type=float, default=0.0, help="px, of the field (default %(default)s)")
    parser.add_argument("--set", nargs="*", default=[], metavar="OPTION=VALUE", help="members of CurveOptions")
    options = parser.parse_args()
    chosen = {name: float(value) for name, value in (word.split("=") for word in options.set)}
    for size in options.sizes:
        records = views(options.data, size, options.views)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "fields"
            pack(records, path, options.noise, options.blur)
            print(said(size, measured(records, path, chosen)))


if __name__ == "__main__":
    main()
