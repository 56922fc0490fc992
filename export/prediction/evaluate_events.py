"""How well surprise tells frames with events from frames without: the area under the ROC curve by kind of event, beside
the difference between frames and what is left of it after motion.

    python -m export.prediction.evaluate_events --sets pushing --split val
    python -m export.prediction.evaluate_events --transformer .data/runs/prediction-transformer/weights.pt

A frame's level is how many times its score is above or below the median of the 8 before it: one threshold serves quiet
and busy streams, and an image that stands still all at once stands out, too.
With an event: its first frame, and the following two of a freeze. Without: all frames of the same clips as they were.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
import torch
from scipy.stats import rankdata
from torch.nn import functional as F
from tqdm import tqdm

from export.clips.events import KINDS, with_event
from export.prediction.autoencoder import Autoencoder
from export.prediction.codes import read_codes
from export.prediction.data import Clips, read_clips
from export.prediction.table import CodeTable, bits_by_table, bits_of_stream
from export.prediction.train_autoencoder import load_autoencoder
from export.prediction.train_transformer import load_transformer
from export.prediction.transformer import UNSEEN, LatentTransformer

BEFORE = 8  # frames whose median a level is relative to; fewer than come before any event
_FREEZE_FRAMES = 3
_FLOOR = 0.02  # of a score's mean over all frames: what a still stream's noise counts as

# Frames uint8 [T, H, W, 3] and frames a second -> a score of each frame but the first, [T - 1].
Score = Callable[[np.ndarray, float], np.ndarray]


def difference(frames: np.ndarray, fps: float) -> np.ndarray:
    """Mean absolute difference from the frame before."""
    del fps
    return np.abs(np.diff(frames.astype(np.float32), axis=0)).mean((1, 2, 3))


def flow_residual(frames: np.ndarray, fps: float) -> np.ndarray:
    """The same after the frame before was moved along OpenCV's dense flow (DIS)."""
    del fps
    flow = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    grey = [cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY) for frame in frames]
    rows, columns = np.indices(grey[0].shape, np.float32)
    left = []
    for t in range(1, len(frames)):
        motion = flow.calc(grey[t], grey[t - 1], None)
        moved = cv2.remap(
            frames[t - 1], columns + motion[..., 0], rows + motion[..., 1], cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )  # fmt: skip
        left.append(np.abs(moved.astype(np.float32) - frames[t]).mean())
    return np.array(left)


def table_surprise(net: Autoencoder, table: CodeTable) -> Score:
    """Bits a code by the table of what follows which code."""

    def score(frames: np.ndarray, fps: float) -> np.ndarray:
        del fps
        return bits_by_table(table, net.encode(torch.from_numpy(frames))[None])[0].numpy()

    return score


def stream_surprise(net: Autoencoder, table: CodeTable) -> Score:
    """The SDK's bits a code, by the table and by the codes that stay in this stream."""
    frequency_bits, after_bits = (-logs.numpy() / math.log(2) for logs in (table.frequency, table.after))

    def score(frames: np.ndarray, fps: float) -> np.ndarray:
        del fps
        codes = net.encode(torch.from_numpy(frames)).numpy()
        return bits_of_stream(frequency_bits, after_bits, codes).mean((1, 2, 3))

    return score


def transformer_surprise(net: Autoencoder, transformer: LatentTransformer) -> Score:
    """Bits a code by the transformer, which sees the frames before."""

    @torch.no_grad()
    def score(frames: np.ndarray, fps: float) -> np.ndarray:
        codes = net.encode(torch.from_numpy(frames))
        count, seen = len(codes), transformer.shape.frames
        padded = torch.cat([torch.full_like(codes[:1], UNSEEN).expand(seen, -1, -1, -1), codes])
        bits = []
        for t in range(1, count):
            logits = transformer(padded[None, t : t + seen], codes[None, t], torch.tensor([fps]))
            bits.append(F.cross_entropy(logits[0].flatten(0, 1), codes[t].flatten()) / math.log(2))
        return torch.stack(bits).numpy()

    return score


def levels(scores: np.ndarray, floor: float) -> np.ndarray:
    """|log(score / median of the scores before)| of scores [n], from the BEFORE-th on."""
    medians = np.array([np.median(scores[k - BEFORE : k]) for k in range(BEFORE, len(scores))])
    return np.abs(np.log((scores[BEFORE:] + floor) / (medians + floor)))


def area_under_roc(without: Sequence[float], with_event: Sequence[float]) -> float:
    """The chance that a frame with an event has the higher level; ties count half."""
    ranks = rankdata(np.concatenate([without, with_event]))
    own = len(with_event)
    return float((ranks[len(without) :].sum() - own * (own + 1) / 2) / (own * len(without)))


def measured(clips: Clips, scores: dict[str, Score], seed: int) -> dict[str, dict[str, float]]:
    """Area under the ROC curve by score and kind of event."""
    frames, fps = clips.frames.numpy(), clips.fps.numpy()
    plain = {name: [score(f, r) for f, r in zip(frames, fps, strict=True)] for name, score in scores.items()}
    floors = {name: _FLOOR * float(np.concatenate(own).mean()) for name, own in plain.items()}
    without = {name: np.concatenate([levels(s, floors[name]) for s in own]) for name, own in plain.items()}
    found: dict[str, dict[str, float]] = {name: {} for name in scores}
    for kind in tqdm(KINDS, unit="kind", leave=False):
        seen: dict[str, list[float]] = {name: [] for name in scores}
        for k in range(len(frames)):
            rng = np.random.default_rng([seed, KINDS.index(kind), k])
            event = with_event(kind, frames[k], frames[(k + 1) % len(frames)], float(fps[k]), rng)
            shown = _FREEZE_FRAMES if kind == "freeze" else 1
            for name, score in scores.items():
                own = levels(score(event.rgb, float(fps[k])), floors[name])
                first = event.at - 1 - BEFORE  # scores begin at frame 1, levels BEFORE later
                seen[name] += [float(level) for level in own[first : first + shown]]
        for name in scores:
            found[name][kind] = area_under_roc(without[name], seen[name])
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--sets", nargs="+", default=["pushing"], help="default %(default)s")
    parser.add_argument("--split", choices=("val", "test"), default="val")
    parser.add_argument("--autoencoder", type=Path, default=Path(".data/runs/prediction-autoencoder/weights.pt"))
    parser.add_argument("--codes", type=Path, default=Path(".data/prediction"), help="of export.prediction.codes")
    parser.add_argument("--transformer", type=Path, help="weights.pt of export.prediction.train_transformer")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    net = load_autoencoder(options.autoencoder)
    table = CodeTable.counted(read_codes(options.codes, "train").codes, net.shape.entries)
    scores: dict[str, Score] = {
        "difference": difference, "flow residual": flow_residual, "surprise, table": table_surprise(net, table),
        "surprise, table and what stays": stream_surprise(net, table),
    }  # fmt: skip
    if options.transformer:
        scores["surprise, transformer"] = transformer_surprise(net, load_transformer(options.transformer))
    found = measured(read_clips(options.data, options.sets, options.split), scores, options.seed)
    print(" | ".join(["", *KINDS, "mean"]))
    for name, areas in found.items():
        print(" | ".join([name, *(f"{areas[kind]:.2f}" for kind in KINDS), f"{np.mean(list(areas.values())):.2f}"]))


if __name__ == "__main__":
    main()
