"""Makes an int8 bundle of the edge network from a fp32 one of export.edges, calibrated on rendered solids.

    python -m quantization.edges --fp32 .data/bundles/edges-fp32 --out sdk/models/edges-int8

What stays float is in `quantization/edges.toml`. Prints sizes, each output's signal to noise ratio, and what int8 costs
on validation frames: RMSE, and pixels on the same side of r.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from export.bundle import read_manifest
from export.densepose.graphs import session
from export.edges.bundle import write_manifest
from export.edges.data import Frame, read_frames
from export.edges.graph_field import field_of_planes, slopes_of
from export.edges.metrics import frame_metrics
from export.edges.validation import frame_through
from export.solids.sensors import LEVELS
from quantization.quantize import int8_info, quantize_graphs
from quantization.samples import Sample
from quantization.settings import EDGES, EdgeSettings, read_settings


def samples(frames: Sequence[Frame]) -> list[Sample]:
    """Inputs of the graph for each frame, through one sensor after the other."""
    levels = list(LEVELS)
    return [
        {"slopes": slopes_of(frame_through(levels[k % len(levels)], frame), frame.focal_px)}
        for k, frame in enumerate(frames)
    ]


def cost(fp32: Path, int8: Path, frames: Sequence[Frame], levels: Sequence[str]) -> dict[str, dict[str, float]]:
    """By level: RMSE of both in r, and the share of pixels that are on the same side of r in both."""
    sessions = {"fp32": session(fp32), "int8": session(int8)}
    out = {}
    for level in tqdm(levels, desc="comparing", unit="level", leave=False):
        rmse, same = {name: [] for name in sessions}, []
        for frame in frames:
            seen = frame_through(level, frame)
            given, fields = {"slopes": slopes_of(seen, frame.focal_px)}, {}
            for name, graph in sessions.items():
                fields[name] = field_of_planes(graph.run(None, given)[0])
                counts = frame.counts & (seen > 0)
                rmse[name].append(frame_metrics(fields[name], frame.distance, counts)["rmse_r"])
            same.append(((fields["fp32"] < 1) == (fields["int8"] < 1))[seen > 0].mean())
        out[level] = {f"rmse_r_{name}": round(float(np.nanmean(values)), 4) for name, values in rmse.items()}
        out[level]["same_side"] = round(float(np.mean(same)), 5)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fp32", type=Path, default=Path(".data/bundles/edges-fp32"))
    parser.add_argument("--out", type=Path, default=Path("sdk/models/edges-int8"))
    parser.add_argument("--name", help="default: the folder's name")
    parser.add_argument("--data", type=Path, default=Path(".data/solids"), help="with the folder val")
    parser.add_argument("--settings", type=Path, default=EDGES)
    options = parser.parse_args()
    settings = read_settings(options.settings, EdgeSettings)
    frames = read_frames(options.data / "val", width_px=320)
    if len(frames) < settings.frames + settings.held_out_frames:
        raise SystemExit(f"{options.data / 'val'} has {len(frames)} frames; calibration and check need more.")
    calibrating, held_out = frames[: settings.frames], frames[settings.frames :][: settings.held_out_frames]
    options.out.mkdir(parents=True, exist_ok=True)
    given = {"field": samples(calibrating)}, {"field": samples(held_out)}
    quality = quantize_graphs(options.fp32, options.out, settings.graphs, *given)
    levels = ("clean", "stereo", "tof")
    measured = cost(options.fp32 / "field.onnx", options.out / "field.onnx", held_out, levels)
    for level, row in measured.items():
        print(f"{level}: " + ", ".join(f"{name} {value}" for name, value in row.items()))
    manifest = read_manifest(options.fp32)
    info = int8_info(options.name or options.out.name, manifest, quality, int8_cost=measured)
    write_manifest(options.out, info, manifest["field"]["multiple_px"])


if __name__ == "__main__":
    main()
