"""Writes the SDK's predictions of clips by `auto`, as images of 64 x 64: the input of the refiner.

    python -m export.clips.dataset pushing --large --clips 700 --out .data/clips-large
    python -m export.prediction.refiner.auto_predictions --data .data/clips-large --sets pushing collages
    python -m export.prediction.refiner.auto_predictions --sets pushing --split val

Predictions are made from frames of 320 x 240 where a clip has some, else from frames of 64 x 64, whose edges are
rougher, so that motion is less exact. A file a clip, OUT/SET/SPLIT/clip-NUMBER.npz: `frames` uint8 [T, 64, 64, 3], R,
G, B; `predictions` uint8 [T, horizons, 64, 64, 3], made after frame t was seen, as if HORIZONS[h] frames later, 0 where
the clip does not go on for so long and after its first frame; `fps`. Some 2 MB a clip. What is
there already is kept. Needs the SDK's library.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from export.clips.clip import SIDE_PX, SPLITS, clip_paths, read_clip
from export.jobs import Workers, results
from export.prediction.data import Clips
from export.prediction.motion_images import HORIZONS, is_known


@dataclass(frozen=True, eq=False)
class PredictedClips:
    """clips, and the prediction of them: uint8 [N, T, horizons, 64, 64, 3]."""

    clips: Clips
    pictures: Tensor

    def on(self, device: torch.device) -> PredictedClips:
        return PredictedClips(self.clips.on(device), self.pictures.to(device))


def squeezed(picture: np.ndarray) -> np.ndarray:
    """uint8 [H, W, 3] -> uint8 [64, 64, 3]: means of areas, like the SDK."""
    return cv2.resize(picture, (SIDE_PX, SIDE_PX), interpolation=cv2.INTER_AREA)


def predictions_of(frames: np.ndarray, fps: float, threads: int = 1) -> np.ndarray:
    """Predictions of `auto` from frames uint8 [T, H, W, 3] of a clip: uint8 [T, horizons, 64, 64, 3], in the format of
    the files. Raises MaquetteError where the SDK's library is not built."""
    import maquette  # in the process that does it: its library starts threads

    count = len(frames)
    found = np.zeros((count, len(HORIZONS), SIDE_PX, SIDE_PX, 3), np.uint8)
    with maquette.Predictor(method="auto", threads=threads) as predictor:
        for t, frame in enumerate(frames):
            predictor.push(maquette.Frame(np.ascontiguousarray(frame), timestamp_ns=round(t * 1e9 / fps)))
            for h, horizon in enumerate(HORIZONS):
                if is_known(t, horizon, count):
                    found[t, h] = squeezed(predictor.predict(horizon / fps).pixels())
    return found


def write_predictions(job: tuple[Path, Path]) -> None:
    """Writes the predictions of a clip's file atomically."""
    source, path = job
    clip = read_clip(source)
    rgb = (clip.large or clip.small).rgb
    partial = path.with_name(f".{path.name}.partial")
    with partial.open("wb") as file:
        np.savez(
            file,
            frames=np.stack([squeezed(one) for one in rgb]),
            predictions=predictions_of(rgb, clip.fps),
            fps=clip.fps,
        )
    partial.rename(path)


def read_predictions(folders: list[Path], kinds: list[str], split: str) -> PredictedClips:
    """All files of these sets in all these folders. Raises SystemExit where there are none."""
    paths = [(kind, path) for folder in folders for kind in kinds for path in clip_paths(folder, kind, split)]
    if not paths:
        names, places = " ".join(kinds), " or ".join(map(str, folders))
        raise SystemExit(
            f"There are no predictions of {names} in {places} ({split}). Write it: python -m "
            f"export.prediction.refiner.auto_predictions --split {split} --sets {names} --out {folders[0]}"
        )
    frames, pictures, fps = [], [], []
    for _, path in paths:
        with np.load(path) as stored:
            frames.append(torch.from_numpy(stored["frames"]))
            pictures.append(torch.from_numpy(stored["predictions"]))
            fps.append(float(stored["fps"]))
    names = [f"{kind}/{path.stem}" for kind, path in paths]
    return PredictedClips(Clips(torch.stack(frames), torch.tensor(fps), names), torch.stack(pictures))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(".data/clips"), help="clips (default %(default)s)")
    parser.add_argument("--sets", nargs="+", default=["pushing", "collages"], help="default %(default)s")
    parser.add_argument("--split", choices=SPLITS, default="train")
    parser.add_argument("--clips", type=int, help="of each set, at most (default: all)")
    parser.add_argument("--out", type=Path, default=Path(".data/prediction/auto"))
    Workers.add_arguments(parser)
    options = parser.parse_args()
    jobs = []
    for kind in options.sets:
        folder = options.out / kind / options.split
        folder.mkdir(parents=True, exist_ok=True)
        jobs += [(path, folder / path.name) for path in clip_paths(options.data, kind, options.split)[: options.clips]]
    if not jobs:
        raise SystemExit(f"No clips of {', '.join(options.sets)} in {options.data} ({options.split}).")
    missing = [job for job in jobs if not job[1].exists()]
    with tqdm(total=len(jobs), initial=len(jobs) - len(missing), unit="clip") as bar:
        for _ in results(Workers.of(options).run(write_predictions, missing)):
            bar.update()


if __name__ == "__main__":
    main()
