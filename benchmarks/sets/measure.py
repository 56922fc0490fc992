"""Of a set of clips: rebuilt frames, bits a code, pictures by time ahead."""

from __future__ import annotations

from pathlib import Path

import maquette
import numpy as np
import torch
from tqdm import tqdm

from benchmarks.prediction import clip_films, measure_film
from export.prediction.bundle import CODES
from export.prediction.code_file import read_code_file
from export.prediction.codes import CodedClips
from export.prediction.data import Clips, read_clips
from export.prediction.evaluate_drift import PictureCodes
from export.prediction.pictures.picture_error import psnr_db
from export.prediction.table import bits_of_stream
from export.prediction.train_transformer import held_out_frames
from export.prediction.transformer import UNSEEN
from quantization.transformer import bits_of_frames

JUDGED = ("auto", "network")  # the latter: auto, mended
GATE_DB = -0.1  # of these over the better of the last frame and motion


def coded(clips: Clips, codes: PictureCodes) -> CodedClips:
    """Codes by the bundle's encoder, also of what motion foresees one frame ahead."""
    found, foreseen = [], []
    for frames, fps in tqdm(zip(clips.frames.numpy(), clips.fps.tolist(), strict=True), total=len(clips), leave=False):
        own = np.stack([codes.of(frame) for frame in frames])
        moved = np.full_like(own, UNSEEN)
        with maquette.Predictor(method="motion", threads=1) as predictor:
            for t, frame in enumerate(frames):
                predictor.push(maquette.Frame(frame, timestamp_ns=round(t * 1e9 / fps)))
                if t > 0:
                    moved[t] = codes.of(predictor.predict(1 / fps).pixels())
        found.append(own.astype(np.int16))
        foreseen.append(moved[:, None].astype(np.int16))
    return CodedClips(
        torch.from_numpy(np.stack(found)), clips.fps, clips.names, torch.from_numpy(np.stack(foreseen))
    )  # fmt: skip


def bits_of(clips: CodedClips, bundle: Path, count: int) -> dict[str, float]:
    """A code, mean of the same `count` frames."""
    stored = read_code_file(bundle / CODES)
    codes = clips.codes.numpy().astype(np.int64)
    slices = np.arange(codes.shape[2])[:, None, None]
    clip, t = (own.numpy() for own in held_out_frames(clips, count))
    streams = {
        k: bits_of_stream(stored.frequency_bits, stored.after_bits, codes[k]).mean((1, 2, 3)) for k in np.unique(clip)
    }
    now, before = codes[clip, t], codes[clip, t - 1]
    return {
        "frequency": float(stored.frequency_bits[slices, now].mean()),
        "table": float(stored.after_bits[slices, before, now].mean()),
        "stream's table": float(np.mean([streams[k][at - 1] for k, at in zip(clip, t, strict=True)])),
        "transformer": float(bits_of_frames(bundle, clips, count).mean()),
    }


def rebuilt_db(clips: Clips, codes: PictureCodes) -> float:
    """PSNR of every fifth frame, made codes and a frame again."""
    frames = clips.frames[:, ::5].flatten(0, 1)
    made = np.stack([codes.picture(codes.of(frame)) for frame in frames.numpy()])
    return float(psnr_db(torch.from_numpy(made), frames).mean())


def networks_on(data: Path, kind: str, bundle: Path, frames: int) -> dict[str, float]:
    """Of a set's validation clips: "rebuilt" in dB, the clips' own step as "still" (codes that stay as they are), and
    bits a code. Raises SystemExit where there are none."""
    clips, codes = read_clips(data, [kind], "val"), PictureCodes(bundle)
    known = coded(clips, codes)
    still = float((known.codes[:, 1:] == known.codes[:, :-1]).float().mean())
    return {"rebuilt": rebuilt_db(clips, codes), "still": still, **bits_of(known, bundle, frames)}


def pictures_on(data: Path, kind: str, most: int, threads: int = 1) -> dict[str, np.ndarray]:
    """PSNR in dB at 320 x 240 by method, [clips, times ahead of benchmarks.prediction], of at most so many validation
    clips. Raises SystemExit where there are none."""
    films = clip_films(data / kind / "val", most)
    if not films:
        raise SystemExit(f"No clips with frames of 320 x 240 in {data / kind / 'val'}: python -m export.clips.dataset")
    rows = [measure_film(film, threads)["horizons"] for film in tqdm(films, desc=kind, leave=False)]
    return {m: np.array([[row[f"{m}_db"] for row in own] for own in rows]) for m in ("last", "motion", *JUDGED)}


def gate_of(found: dict[str, np.ndarray], method: str) -> tuple[np.ndarray, int, float]:
    """What a method gains over the better of the last frame and motion: of the set's means by time ahead; how many
    clips and times ahead lose more than the gate, and the largest loss."""
    means = {name: own.mean(0) for name, own in found.items()}
    gained = found[method] - np.maximum(found["last"], found["motion"])
    of_means = means[method] - np.maximum(means["last"], means["motion"])
    return of_means, int((gained < GATE_DB).sum()), float(gained.min())
