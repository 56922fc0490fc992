"""Times the stages of dense pose through the C API, on photos and clips."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import fields
from pathlib import Path

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table
from tqdm import tqdm

from export.evaluation.machine import describe_machine
from export.evaluation.maquette_api import DensePose, MaquetteError, Stats

SCHEMA = "maquette-stage-times-1"
STAGES = tuple(field.name for field in fields(Stats) if field.name.endswith("_ms"))
PERCENTILES = (50, 90, 99)

EPILOG = """\
examples:
  python -m benchmarks.stage_times
  python -m benchmarks.stage_times --threads 1 --runs 100 my-photo.jpg
  python -m benchmarks.stage_times --bundle .data/bundles/densepose-b-fp32 tests/media/clip.mp4
"""


def frames_of(path: Path) -> list[np.ndarray]:
    """The frames of a photo or clip: uint8 [H, W, 3] RGB each."""
    image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if image is not None:
        return [image[..., ::-1].copy()]
    clip, frames = cv2.VideoCapture(str(path)), []
    while True:
        ok, frame = clip.read()
        if not ok:
            break
        frames.append(frame[..., ::-1].copy())
    if not frames:
        raise ValueError(f"{path} cannot be read as a photo or a clip.")
    return frames


def time_stages(model: DensePose, frames: list[np.ndarray], runs: int, warm_up: int, name: str) -> list[Stats]:
    """One Stats a run, going round the frames; the first warm_up runs are left out."""
    stats = []
    for k in tqdm(range(warm_up + runs), desc=name, unit="run", disable=None):
        result = model.run(frames[k % len(frames)])
        if k >= warm_up:
            stats.append(result.stats)
    return stats


def percentiles(stats: list[Stats]) -> dict[str, dict[str, float]]:
    """Milliseconds at PERCENTILES for each stage."""
    return {
        stage: {f"p{p}": round(float(np.percentile([getattr(s, stage) for s in stats], p)), 3) for p in PERCENTILES}
        for stage in STAGES
    }


def print_table(results: dict[str, dict]) -> None:
    table = Table(title="Milliseconds a frame: p50 / p90", title_justify="left")
    table.add_column("stage")
    for name in results:
        table.add_column(name, justify="right")
    for stage in STAGES:
        times = [result["ms"][stage] for result in results.values()]
        table.add_row(stage.removesuffix("_ms"), *[f"{t['p50']:.1f} / {t['p90']:.1f}" for t in times])
    rates = [1000 / max(result["ms"]["total_ms"]["p50"], 1e-6) for result in results.values()]
    table.add_row("frames a second", *[f"{rate:.1f}" for rate in rates])
    table.add_row("people a frame", *[f"{result['people']:.2f}" for result in results.values()])
    Console().print(table)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.stage_times", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    media = [Path("tests/media/photo.jpg"), Path("tests/media/clip.mp4")]
    parser.add_argument("sources", type=Path, nargs="*", default=media, help="photos and clips")
    parser.add_argument("--bundle", type=Path, default=Path("sdk/models/densepose-b-int8"), metavar="DIR")
    parser.add_argument("--threads", type=int, default=0, help="0: the library chooses (default)")
    parser.add_argument("--runs", type=int, default=60, metavar="N", help="timed runs a source (default 60)")
    parser.add_argument("--warm-up", type=int, default=5, metavar="N", help="runs left out first (default 5)")
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks/stage_times.json"), metavar="JSON")
    arguments = parser.parse_args(argv)
    results = {}
    try:
        with DensePose(arguments.bundle, threads=arguments.threads) as model:
            for source in arguments.sources:
                frames = frames_of(source)
                stats = time_stages(model, frames, arguments.runs, arguments.warm_up, source.name)
                results[source.name] = {
                    "size_px": [frames[0].shape[1], frames[0].shape[0]],
                    "network_px": [stats[0].network_width_px, stats[0].network_height_px],
                    "runs": len(stats),
                    "people": float(np.mean([s.people for s in stats])),
                    "ms": percentiles(stats),
                }
    except (MaquetteError, ValueError) as error:
        print(f"Nothing was timed: {error}", file=sys.stderr)
        return 1
    print_table(results)
    document = {
        "schema": SCHEMA,
        "machine": describe_machine(),
        "bundle": str(arguments.bundle),
        "threads": arguments.threads,
        "warm_up": arguments.warm_up,
        "results": results,
    }
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps(document, indent=1) + "\n")
    print(f"Written: {arguments.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
