"""Compares the edges found on a real box, in the fused depth of 42 photos, with corners marked by hand.

    python -m benchmarks.edges.carton            needs `make build` and, once: python -m export.captures fetch box

The box is that of export/captures. Its depth comes from photos alone (a plane sweep). The corners were marked in three
photos, to a pixel or two, at the intersection of straight edges: the cardboard is rounded and bulges. The corners in
space are the least-squares intersections of their rays; the two corners that no photo shows complete the box.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.spatial import cKDTree

from export.camera import Camera
from export.edges.curve_metrics import curves_of
from export.scenes.captures import read_capture

CAPTURE = Path(".data/places/real/box")
PROGRAM = Path("build/release/stage/bin/maquette")
FETCH = "python -m export.captures fetch box"

# Pixels (x, y). Front corners: A, B at the top, C, D at the bottom, clockwise from the left. E, F are behind A, B.
MARKS = {
    "002.jpg": {"A": (302, 98), "B": (563, 172), "C": (538, 236), "D": (303, 162), "E": (373, 12), "F": (593, 67)},
    "014.jpg": {"A": (130, 107), "B": (383, 206), "C": (375, 302), "D": (138, 189), "E": (281, 52), "F": (503, 117)},
    "026.jpg": {"A": (203, 199), "B": (474, 281), "C": (457, 347), "D": (208, 264), "E": (297, 113), "F": (514, 168)},
}
EDGES = ("AB", "BC", "CD", "DA", "AE", "BF", "EF", "FG", "CG", "DH", "EH", "GH")  # behind C, D
METRICS = ("edges_carton_edges", "edges_carton_px", "edges_carton_angle_deg")
FOUND_PX = 3.0  # an edge is found if half of it has a curve within this distance
STEPS = 200  # samples along an edge
SAME_DEG = 20.0  # largest angle between a line and the edge it belongs to


def corners_of(cameras: Mapping[str, Camera], marks: Mapping[str, Mapping[str, tuple[float, float]]]) -> dict:
    """Returns the corners A to H, float64 [3], in the world of the cameras, which are given by the names of `marks`."""
    normal = {name: np.zeros((3, 3)) for corners in marks.values() for name in corners}
    right = {name: np.zeros(3) for name in normal}
    for photo, corners in marks.items():
        camera = cameras[photo]
        for name, (x, y) in corners.items():
            ray = np.array([(x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px, 1]) @ camera.rotation
            ray /= np.linalg.norm(ray)
            across = np.eye(3) - np.outer(ray, ray)
            normal[name] += across
            right[name] += across @ camera.centre
    found = {name: np.linalg.solve(normal[name], right[name]) for name in normal}
    back = found["E"] - found["A"], found["F"] - found["B"]
    return found | {"G": found["C"] + back[1], "H": found["D"] + back[0]}


def compared(
    curves: Sequence[np.ndarray], lines: Sequence[np.ndarray], corners: Mapping[str, np.ndarray], camera: Camera
) -> dict:
    """Compares curves (polylines [n, 3]) and lines (two ends each) with the edges. For each edge: the fraction with a
    curve within FOUND_PX and the median distance of that fraction, pixels of `camera`. Over all edges: the number
    found, their median distance, and the deviation from 90 degrees of the angles between found lines at a corner
    (largest and median; None without any)."""
    places = cKDTree(np.concatenate([_along(curve) for curve in curves] or [np.zeros((0, 3))]))
    rows, ways = [], {}
    for name in EDGES:
        a, b = (corners[end] for end in name)
        on = a + (b - a) * ((np.arange(STEPS) + 0.5) / STEPS)[:, None]
        depth = (on - camera.centre) @ camera.rotation[2]
        off_px = places.query(on)[0] * camera.fx_px / depth
        near = off_px <= FOUND_PX
        rows.append({"edge": name, "part": float(near.mean()),
                     "median_px": float(np.median(off_px[near])) if near.any() else None})  # fmt: skip
        if near.mean() >= 0.5:
            ways[name] = _line_along(lines, a, b)
    angles = []
    for one, other in combinations([name for name, way in ways.items() if way is not None], 2):
        if set(one) & set(other):
            cosine = abs(ways[one] @ ways[other])
            angles.append(float(90 - np.degrees(np.arccos(min(cosine, 1.0)))))
    medians = [row["median_px"] for row in rows if row["edge"] in ways]
    return {
        "edges": rows, "found": len(ways), "median_px": float(np.median(medians)) if medians else None,
        "angles": len(angles), "angle_deg": max(angles, default=None),
        "median_angle_deg": float(np.median(angles)) if angles else None,
    }  # fmt: skip


def _along(curve: np.ndarray) -> np.ndarray:
    """Returns points on a polyline, dense enough that the nearest one gives the distance: [m, 3]."""
    t = (np.arange(STEPS) / (STEPS - 1))[:, None]
    return np.concatenate([a + (b - a) * t for a, b in pairwise(curve)])


def _line_along(lines: Sequence[np.ndarray], a: np.ndarray, b: np.ndarray) -> np.ndarray | None:
    """Returns the direction of the longest line along the edge from a to b; its middle is within a tenth of its length
    of the edge."""
    edge, length = (b - a) / np.linalg.norm(b - a), np.linalg.norm(b - a)
    best, size = None, 0.0
    for line in lines:
        way, middle = line[-1] - line[0], (line[0] + line[-1]) / 2 - a
        long = float(np.linalg.norm(way))
        t = np.clip(middle @ edge, 0, length)
        beside = np.linalg.norm(middle - t * edge) < 0.1 * length
        if long > size and beside and abs(way @ edge) > np.cos(np.radians(SAME_DEG)) * long:
            best, size = way / long, long
    return best


def measure(capture: Path = CAPTURE, bundle: Path | None = None) -> dict:
    """Returns `compared` of the fused curves. Raises FileNotFoundError without the capture or its depth,
    CalledProcessError if the program fails."""
    if not (capture / "depth").is_dir():
        raise FileNotFoundError(f"{capture} has no depth: {FETCH}")
    place = read_capture(capture)
    cameras = {Path(name).name: camera for name, camera in zip(place.names, place.cameras, strict=True)}
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "curves.json"
        settings = ["--bundle", str(bundle)] if bundle else []
        subprocess.run([str(PROGRAM), "edges", "build", str(capture), "--out", str(out), *settings], check=True,
                       capture_output=True, text=True)  # fmt: skip
        document = json.loads(out.read_text())
    curves = curves_of(document)
    lines = [points for points, curve in zip(curves, document["curves"], strict=True) if curve["type"] == "line"]
    found = compared(curves, lines, corners_of(cameras, MARKS), cameras[next(iter(MARKS))])
    return found | {"curves": len(curves)}


def found_in(bundle: Path) -> tuple[dict | None, str]:
    """Returns the result of `measure` for CAPTURE, or None and why it cannot be measured."""
    try:
        return measure(CAPTURE, bundle), ""
    except FileNotFoundError as error:
        return None, str(error)
    except subprocess.CalledProcessError as error:
        return None, error.stderr.strip()


def metrics_from(found: dict | None) -> dict[str, float]:
    """Returns the known metrics of METRICS."""
    if found is None:
        return {}
    values = dict(zip(METRICS, (found["found"], found["median_px"], found["angle_deg"]), strict=True))
    return {name: float(value) for name, value in values.items() if value is not None}


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.edges.carton", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--capture", type=Path, default=CAPTURE, help="default: %(default)s")
    parser.add_argument("--bundle", type=Path, help="default: the shipped bundle")
    options = parser.parse_args(argv)
    try:
        found = measure(options.capture, options.bundle)
    except FileNotFoundError as error:
        print(error, file=sys.stderr)
        return 1
    except subprocess.CalledProcessError as error:
        print(error.stderr.strip(), file=sys.stderr)
        return 1
    table = Table("edge", "found of it, %", "off, px (median)")
    for row in found["edges"]:
        off = "" if row["median_px"] is None else f"{row['median_px']:.1f}"
        table.add_row(row["edge"], f"{100 * row['part']:.0f}", off)
    Console().print(table)
    print(f"{found['found']} of {len(EDGES)} edges, {found['curves']} curves; median distance {found['median_px']} px")
    print(
        f"{found['angles']} angles, off 90 degrees by {found['median_angle_deg']} (median), {found['angle_deg']} (max)"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
