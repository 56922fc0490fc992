"""Measures `maquette head` as a whole, from a photo to a GLB: its time, peak memory and sizes of files."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import cv2

from benchmarks.heads.photos import Photo

PROGRAM = Path("build/release/stage/bin/maquette")
KIB, MB = 1024, 1e6


# A small process starts the program: the peak of a process includes its size before exec, which is a copy of its
# parent.
_COUNTED = """
import resource, subprocess, sys, time
start = time.perf_counter()
with open(sys.argv[1], "wb") as file:
    code = subprocess.run(sys.argv[2:], stdout=file, stderr=subprocess.STDOUT).returncode
print(code, time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


def run_counted(command: Sequence[str], output: Path) -> tuple[float, float]:
    """Returns wall-clock seconds and peak memory (MB) of a program, whose output goes to a file. Raises OSError if it
    fails."""
    counted = [sys.executable, "-S", "-c", _COUNTED, str(output), *command]
    done = subprocess.run(counted, check=True, capture_output=True, text=True)
    code, seconds, peak_kib = done.stdout.split()
    if code != "0":
        said = output.read_text(errors="replace")[-400:]
        raise OSError(f"{' '.join(command)} ended with {code}: {said}")
    return float(seconds), int(peak_kib) * KIB / MB


def measure_program(bundle: Path, photo: Photo, repeats: int = 3, program: Path = PROGRAM) -> list[dict]:
    """Measures a photo with a known head box: with `--seconds 0` and with the default time. Returns the fastest repeat
    and the largest memory."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        picture, output = Path(folder, "photo.png"), Path(folder, "output.json")
        cv2.imwrite(str(picture), photo.rgb[..., ::-1])
        files = [Path(folder, name) for name in ("head.glb", "head.maqh")]
        command = [
            str(program), "head", str(picture), "--out", str(files[0]), "--save", str(files[1]), "--json",
            "--bundle", str(bundle), "--box", ",".join(f"{side:.1f}" for side in photo.box),
        ]  # fmt: skip
        for what, more in (("first mesh", ["--seconds", "0"]), ("default", [])):
            runs = [run_counted([*command, *more], output) for _ in range(repeats)]
            found = json.loads(output.read_text().splitlines()[-1])
            rows.append(
                {"what": what, "seconds": min(run[0] for run in runs), "peak_mb": max(run[1] for run in runs),
                 "ms": found["ms"], "triangles": found["triangles"], "glb_mb": files[0].stat().st_size / MB,
                 "maqh_kb": files[1].stat().st_size / 1e3}
            )  # fmt: skip
    return rows


def bundle_mb(bundle: Path) -> float:
    return sum(path.stat().st_size for path in bundle.iterdir() if path.is_file()) / MB
