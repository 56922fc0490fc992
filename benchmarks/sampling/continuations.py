"""Continues clips from their first frames by each method."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import maquette
import numpy as np
from tqdm import tqdm

from export.prediction.data import Clips

GIVEN, MADE = 5, 11  # frames of a clip, as in the published system
SAMPLES = 16
TEMPERATURES = (0.25, 0.5, 1.5)  # settings with few samples; temperature 1 has SAMPLES
SEED = 1

# Maps frames of a clip [GIVEN, H, W, 3] and the seconds between them to images [samples, MADE, H, W, 3], and to bits of
# their cells [samples, MADE, 16, 16] or None.
Method = Callable[[np.ndarray, float], tuple[np.ndarray, np.ndarray | None]]


def shown(predictor: maquette.Predictor, frames: np.ndarray, step_s: float) -> None:
    predictor.reset()
    for k, frame in enumerate(frames):
        predictor.push(np.ascontiguousarray(frame), k * step_s)


def predicted(name: str, **settings: object) -> Method:
    """Returns a method that does not sample."""
    predictor = maquette.Predictor(method=name, threads=1, **settings)

    def go_on(frames: np.ndarray, step_s: float) -> tuple[np.ndarray, None]:
        shown(predictor, frames, step_s)
        return np.stack([predictor.predict(k * step_s).pixels() for k in range(1, MADE + 1)])[None], None

    return go_on


def sampled(samples: int, bundle: Path, **settings: float) -> Method:
    """Returns a sampling method. settings: temperature."""
    predictor = maquette.Predictor("sampled", bundle_path=bundle, threads=1, seed=SEED, **settings)

    def go_on(frames: np.ndarray, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        shown(predictor, frames, step_s)
        predictor.sample(samples, MADE, step_s)
        numbers = range(1, MADE + 1)
        # One time after another, so that the work that all samples share is done once.
        images = np.stack([[predictor.acquire_sample(s, k).pixels() for s in range(samples)] for k in numbers], 1)
        return images, np.stack([[predictor.entropy_map(s, k) for k in numbers] for s in range(samples)])

    return go_on


def methods(bundle: Path, samples: int) -> dict[str, Method]:
    return {
        "last frame": predicted("last"),
        "motion": predicted("motion"),
        "auto": predicted("auto"),
        "likeliest": sampled(1, bundle, temperature=0),
        **{f"temperature {value:g}": sampled(4, bundle, temperature=value) for value in TEMPERATURES},
        "temperature 1": sampled(samples, bundle, temperature=1),
    }


def continued(clips: Clips, bundle: Path, samples: int) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Returns by method: images uint8 [clips, samples, MADE, H, W, 3], and bits of cells [clips, samples, MADE, 16, 16]
    if the method has them."""
    images: dict[str, list[np.ndarray]] = {}
    bits: dict[str, list[np.ndarray]] = {}
    known = methods(bundle, samples)
    for frames, fps in tqdm(zip(clips.frames.numpy(), clips.fps.numpy(), strict=True), total=len(clips), disable=None):
        for name, go_on in known.items():
            made, uncertain = go_on(frames[:GIVEN], 1 / float(fps))
            images.setdefault(name, []).append(made)
            if uncertain is not None:
                bits.setdefault(name, []).append(uncertain)
    return {k: np.stack(v) for k, v in images.items()}, {k: np.stack(v) for k, v in bits.items()}
