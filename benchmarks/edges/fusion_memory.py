"""Measures the memory that fusion adds to a process, in a process of its own, for benchmarks/edges/fused.py:

    python -m benchmarks.edges.fusion_memory VIEWS.npz BUNDLE THREADS CELL_M

prints {"points": 1000000, "cell_m": 0.002, "memory_mb": 110.0}: the peak above the peak after the network ran once.
Copies of the points are not included. VIEWS.npz: depth [V, H, W] in metres, intrinsics [V, 4] (fx, fy, cx, cy in
pixels), rotation [V, 3, 3] and centre [V, 3] of its cameras. CELL_M: 0 is the library's choice.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.edges.edges_api import Edges, Pinhole
from benchmarks.edges.fusion_api import Fusion
from export.camera import Camera


def in_child(
    depths: Sequence[np.ndarray],
    cameras: Sequence[Camera],
    bundle: Path,
    threads: int,
    folder: Path,
    cell_m: float = 0,
) -> dict:
    """Runs the program on these views, which it reads from a file in `folder`; returns its JSON. Raises
    CalledProcessError."""
    file = folder / "edges-fusion-views.npz"
    intrinsics = [(c.fx_px, c.fy_px, c.cx_px, c.cy_px) for c in cameras]
    np.savez(file, depth=np.stack(depths), intrinsics=intrinsics, rotation=[c.rotation for c in cameras],
             centre=[c.centre for c in cameras])  # fmt: skip
    command = [sys.executable, "-m", "benchmarks.edges.fusion_memory", str(file), str(bundle), str(threads),
               repr(float(cell_m))]  # fmt: skip
    try:
        return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    finally:
        file.unlink()


def measured(file: Path, bundle: Path, threads: int, cell_m: float) -> dict:
    with np.load(file) as views:
        depths = views["depth"].astype(np.float32)
        height, width = depths.shape[1:]
        poses = zip(views["intrinsics"].tolist(), views["rotation"], views["centre"], strict=True)
        cameras = [Camera(width, height, *lens, rotation, centre) for lens, rotation, centre in poses]
    with Edges(bundle, threads) as edges:
        first = cameras[0]
        edges.run(depths[0], Pinhole(first.fx_px, first.cx_px, first.cy_px))
        before = _status_mb("VmRSS")
        with Fusion(edges, threads=max(threads, 0), cell_m=cell_m) as fusion:
            for depth, camera in zip(depths, cameras, strict=True):
                fusion.add_view(depth, camera)
            fusion.finish()
            added = _status_mb("VmHWM") - before
            return {"points": fusion.info.point_count, "cell_m": fusion.info.cell_m, "memory_mb": round(added, 3)}


def _status_mb(name: str) -> float:
    """Returns the peak of this process alone; getrusage() begins with the peak of the parent process."""
    text = Path("/proc/self/status").read_text()
    return next(float(line.split()[1]) for line in text.splitlines() if line.startswith(f"{name}:")) * 1024e-6


if __name__ == "__main__":
    print(json.dumps(measured(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4]))))
