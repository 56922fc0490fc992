"""How well surprise finds events through the C API, beside a difference of frames and optical flow, and how long a
frame takes.

    python -m benchmarks.surprise                       val clips of pushing, sdk/models/prediction-int8 (some minutes)
    python -m benchmarks.surprise --clips 4             fewer clips, to see that it runs
    python -m benchmarks.surprise --real                parts of real clips at 320 x 240 instead
    python -m benchmarks.surprise --bundle .data/bundles/prediction-fp32

Needs clips of `export.clips` (.data/clips/pushing/val) and the built library (`make build`). Levels, kinds of events
and their places are those of `export.prediction.evaluate_events`; of surprise the scores are `bits` of each frame.
"""

from __future__ import annotations

import argparse
from itertools import zip_longest
from pathlib import Path

import cv2
import maquette
import numpy as np
import torch

from benchmarks.prediction import BUNDLE, SIZE_PX, frames_a_second, read_film
from export.clips.clip import FRAMES
from export.clips.events import KINDS, with_event
from export.prediction.data import Clips, read_clips
from export.prediction.evaluate_events import Score, difference, flow_residual, measured

_MAX_FRAMES = 300  # of a real clip
_MIN_FPS = 8.0  # of parts of real clips


def sdk_surprise(bundle: Path, method: str = "auto") -> Score:
    """Bits of a code of each frame but the first, as maq_surprise_push gives them."""
    stream = maquette.Surprise(bundle_path=bundle, method=method, threads=1)

    def score(frames: np.ndarray, fps: float) -> np.ndarray:
        stream.reset()
        bits = [stream.push(np.ascontiguousarray(frame), time_s=t / fps).bits for t, frame in enumerate(frames)]
        return np.array(bits[1:])

    return score


def real_parts(folder: Path, most: int | None) -> Clips:
    """Parts of FRAMES frames of the real clips, 320 x 240, at their own rate and at a third of it; neighbours are of
    different clips, so that a cut leads elsewhere. Raises SystemExit where there are none."""
    films: list[list[tuple[np.ndarray, float, str]]] = []
    for path in sorted(folder.glob("*.*")):
        own = []
        for step in (3, 1):
            fps = cv2.VideoCapture(str(path)).get(cv2.CAP_PROP_FPS) / step
            frames = read_film(path, step, SIZE_PX, _MAX_FRAMES) if fps >= _MIN_FPS else []
            starts = range(0, len(frames) - FRAMES + 1, FRAMES)
            own += [(np.stack(frames[at : at + FRAMES])[..., ::-1], fps, f"{path.stem} {at}") for at in starts]
        films.append(own)
    rounds = [[part for part in several if part] for several in zip_longest(*films)]
    turns = [part for several in rounds if len(several) > 1 for part in several][:most]
    if not turns:
        raise SystemExit(f"{folder} has no clips: python -m export.photos people")
    rgb, fps, names = zip(*turns, strict=True)
    return Clips(torch.from_numpy(np.ascontiguousarray(np.stack(rgb))), torch.tensor(fps), list(names))


def cuts_found(clips: Clips, bundle: Path, seed: int) -> dict[str, tuple[int, int]]:
    """How many frames say that they are cuts, and of how many: by kind of event the first frame of each, and under ""
    all frames of clips without events."""
    stream = maquette.Surprise(bundle_path=bundle, threads=1)

    def flags(frames: np.ndarray, fps: float) -> list[bool]:
        stream.reset()
        return [stream.push(np.ascontiguousarray(frame), time_s=t / fps).is_cut for t, frame in enumerate(frames)]

    frames, fps = clips.frames.numpy(), clips.fps.numpy()
    without = [flag for own, rate in zip(frames, fps, strict=True) for flag in flags(own, float(rate))]
    found = {"": (sum(without), len(without))}
    for number, kind in enumerate(KINDS):
        at_event = []
        for k, (own, rate) in enumerate(zip(frames, fps, strict=True)):
            rng = np.random.default_rng([seed, number, k])
            event = with_event(kind, own, frames[(k + 1) % len(frames)], float(rate), rng)
            at_event.append(flags(event.rgb, float(rate))[event.at])
        found[kind] = (sum(at_event), len(at_event))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.surprise", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--bundle", type=Path, default=BUNDLE)
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--sets", nargs="+", default=["pushing"], help="default %(default)s")
    parser.add_argument("--split", choices=("val", "test"), default="val")
    parser.add_argument("--real", action="store_true")
    parser.add_argument("--photos", type=Path, default=Path(".data/photos/clip"), help="folder of real clips")
    parser.add_argument("--no-times", action="store_true", help="areas alone, on a busy machine")
    parser.add_argument("--clips", type=int, help="at most so many; default: all")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for threads in () if options.no_times else (1, 2):
        found = frames_a_second(options.bundle, threads)
        parts = ", ".join(f"{name} {value:.2f}" for name, value in found.items() if name != "frames_a_second")
        print(f"640 x 480, {threads} thread(s): {found['frames_a_second']:.0f} frames a second ({parts})", flush=True)
    if options.real:
        clips = real_parts(options.photos, options.clips)
    else:
        clips = read_clips(options.data, options.sets, options.split)
    if options.clips:
        clips = Clips(clips.frames[: options.clips], clips.fps[: options.clips], clips.names[: options.clips])
    cuts = cuts_found(clips, options.bundle, options.seed)
    print("called a cut: " + ", ".join(f"{kind or 'without event'} {n}/{of}" for kind, (n, of) in cuts.items()))
    scores = {"difference": difference, "flow residual": flow_residual}
    scores["surprise"] = sdk_surprise(options.bundle)
    scores["surprise, table"] = sdk_surprise(options.bundle, "table")
    areas = measured(clips, scores, options.seed)
    print(" | ".join(["", *KINDS, "mean"]))
    for name, own in areas.items():
        print(" | ".join([name, *(f"{own[kind]:.2f}" for kind in KINDS), f"{np.mean(list(own.values())):.3f}"]))


if __name__ == "__main__":
    main()
