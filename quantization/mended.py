"""What the network that mends what is foreseen is given of clips, to calibrate its int8 graph and to measure it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch

from export.densepose.graphs import session
from export.prediction.motion_pictures import HORIZONS
from export.prediction.parallel import times_ahead
from export.prediction.pictures.foreseen import read_foreseen
from export.prediction.pictures.mended_graph import MENDED
from export.prediction.pictures.picture_error import psnr_db
from quantization.samples import Sample


def mended_samples(
    data: Path, sets: Sequence[str], split: str, count: int, before: int
) -> tuple[list[Sample], np.ndarray]:
    """Inputs of the graph, evenly over clips and times ahead, and what came then, uint8 [count, 64, 64, 3]. data: what
    `export.prediction.pictures.foreseen` wrote. Raises SystemExit where there is nothing."""
    known = read_foreseen([data], list(sets), split)
    clips = known.clips
    total = clips.frames.shape[1]
    samples: list[Sample] = []
    truth = []
    for k in range(count):
        clip, h = k * len(clips) // count, k % len(HORIZONS)
        frames, fps = clips.frames[clip], clips.fps[clip]
        now = before - 1 + (7 * k) % (total - before - HORIZONS[h])
        shown = torch.cat([*frames[now + 1 - before : now + 1], known.pictures[clip, now, h]], -1)[None].float()
        samples.append(
            {"pictures": shown.numpy(), "times": times_ahead(fps[None], torch.tensor([HORIZONS[h]])).numpy()}
        )
        truth.append(frames[now + HORIZONS[h]].numpy())
    return samples, np.stack(truth)


def mended_cost(fp32: Path, int8: Path, samples: Sequence[Sample], truth: np.ndarray) -> dict[str, float]:
    """mended_db_fp32, mended_db_int8: PSNR of what it makes."""
    found = {}
    for name, folder in (("fp32", fp32), ("int8", int8)):
        graph = session(folder / f"{MENDED}.onnx")
        made = torch.from_numpy(np.concatenate([graph.run(None, sample)[0] for sample in samples]))
        found[f"mended_db_{name}"] = round(float(psnr_db(made, torch.from_numpy(truth)).mean()), 2)
    return found
