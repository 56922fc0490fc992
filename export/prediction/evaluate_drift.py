"""Where the transformer ends up when it goes on from its own frames: 160 frames rolled out from the first three of a
validation clip, by a bundle's graphs.

    python -m export.prediction.evaluate_drift                        # sdk/models/prediction-int8, some minutes
    python -m export.prediction.evaluate_drift --frames 40 --temperatures 1

Prints for stretches of frames, beside the clip's own: `bits` a code of what was drawn, by what the network said of it;
`codes`: entropy of the codes of a frame, in bits (8 with all 256 cells different); `contrast`: standard deviation of
the image, as a share of the last true frame's; `motion`: mean difference from the frame before, in grey levels. Each
frame is drawn cell after cell, and its image, made of its codes, is what motion goes by.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from export.densepose.graphs import session
from export.prediction.bundle import CODES, TRANSFORMER
from export.prediction.code_file import prior_of, read_code_file
from export.prediction.config import CODE_SIDE
from export.prediction.data import read_clips
from export.prediction.graphs.graph_runtime import GraphRuntime
from export.prediction.graphs.transformer_file import read_transformer_file
from export.prediction.transformer import UNSEEN

BUNDLE = Path("sdk/models/prediction-int8")
COLUMNS = ("bits", "codes", "contrast", "motion")


class PictureCodes:
    """The autoencoder of a bundle: pictures uint8 [64, 64, 3] as codes int64 [slices, 16, 16], and back."""

    def __init__(self, folder: Path) -> None:
        self.stored = read_code_file(folder / CODES)
        self.encoder, self.decoder = (session(folder / f"{name}.onnx") for name in ("encoder", "decoder"))

    def of(self, picture: np.ndarray) -> np.ndarray:
        entries = self.stored.entries
        features = self.encoder.run(None, {"image": picture[None].astype(np.float32)})[0]
        own = features.reshape(-1, len(entries), entries.shape[2]).transpose(1, 0, 2)
        distance = (entries**2).sum(-1)[:, None] - 2 * own @ entries.transpose(0, 2, 1)
        return distance.argmin(-1).reshape(-1, CODE_SIDE, CODE_SIDE)

    def picture(self, codes: np.ndarray) -> np.ndarray:
        picked = [entries[own] for entries, own in zip(self.stored.entries, codes, strict=True)]
        given = np.concatenate(picked, -1)[None].astype(np.float32)
        return self.decoder.run(None, {"features": given})[0][0].clip(0, 255).round().astype(np.uint8)


class Roll:
    """A stream that goes on from its own frames. seed: of what is drawn; temperature 0: the likeliest."""

    def __init__(self, folder: Path, fps: float, temperature: float, seed: int) -> None:
        import maquette  # its library starts threads: not before it is needed

        self.maquette, self.codes = maquette, PictureCodes(folder)
        self.tables = read_transformer_file(folder / TRANSFORMER)
        self.runtime = GraphRuntime(folder, self.tables, prior_of(self.codes.stored))
        self.predictor = maquette.Predictor(method="motion", threads=1)
        self.fps, self.temperature, self.rng = fps, temperature, np.random.default_rng(seed)
        self.seen: list[np.ndarray] = []  # codes
        self.frames = 0

    def see(self, codes: np.ndarray, picture: np.ndarray) -> None:
        self.seen = [*self.seen, codes][-self.tables.before :]
        at_ns = round(self.frames * 1e9 / self.fps)
        self.predictor.push(self.maquette.Frame(np.ascontiguousarray(picture), timestamp_ns=at_ns))
        self.frames += 1

    def go_on(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Codes and image of the next frame, and its bits a code; it is then seen."""
        before = list(self.seen)
        if self.tables.frames > self.tables.before:
            moved = self.predictor.predict(1 / self.fps).pixels()
            before.append(self.codes.of(moved) if self.frames > 1 else np.full_like(before[-1], UNSEEN))
        self.runtime.begin(np.stack(before), self.fps)
        bits: list[float] = []
        codes = self.runtime.chosen(lambda k, place, logits: self._drawn(logits, bits))
        picture = self.codes.picture(codes)
        self.see(codes, picture)
        return codes, picture, float(np.mean(bits))

    def _drawn(self, logits: np.ndarray, bits: list[float]) -> int:
        likely = logits.astype(np.float64) - logits.max()
        likely -= np.log(np.exp(likely).sum())
        if self.temperature > 0:
            chances = np.exp(likely / self.temperature)
            code = int(self.rng.choice(len(chances), p=chances / chances.sum()))
        else:
            code = int(logits.argmax())
        bits.append(-likely[code] / np.log(2))
        return code


@dataclass(frozen=True)
class State:
    """COLUMNS of a frame; bits of a true frame: nan."""

    bits: float
    codes: float
    contrast: float
    motion: float


def state_of(codes: np.ndarray, picture: np.ndarray, before: np.ndarray, contrast: float, bits: float) -> State:
    """contrast: that is counted as 1."""
    entropy = []
    for own in codes:
        share = np.unique(own, return_counts=True)[1] / own.size
        entropy.append(-(share * np.log2(share)).sum())
    apart = np.abs(picture.astype(float) - before).mean()
    return State(bits, float(np.mean(entropy)), float(picture.std() / contrast), float(apart))


def rolled_out(roll: Roll, frames: np.ndarray, count: int) -> tuple[list[State], list[State]]:
    """The states of a clip's true frames (as their codes show them), and of `count` that are made after its first
    three."""
    shown = [roll.codes.of(frame) for frame in frames]
    pictures = [roll.codes.picture(codes) for codes in shown]
    before = roll.tables.before
    contrast = float(pictures[before - 1].std())
    true = [state_of(shown[t], pictures[t], pictures[t - 1], contrast, np.nan) for t in range(1, len(frames))]
    for codes, frame in zip(shown[:before], frames[:before], strict=True):
        roll.see(codes, frame)
    made, last = [], pictures[before - 1]
    for _ in range(count):
        codes, picture, bits = roll.go_on()
        made.append(state_of(codes, picture, last, contrast, bits))
        last = picture
    return true, made


def stretches(states: list[State], ends: list[int]) -> list[tuple[str, State]]:
    """Means of frames 1 to ends[0], from there to ends[1], ..."""
    rows = []
    for begin, end in zip([0, *ends], ends, strict=False):
        part = states[begin:end]
        if part:
            means = State(*(float(np.mean([getattr(one, name) for one in part])) for name in COLUMNS))
            rows.append((f"{begin + 1} to {begin + len(part)}", means))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bundle", type=Path, default=BUNDLE)
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--sets", nargs="+", default=["pushing"], help="default %(default)s")
    parser.add_argument("--clip", type=int, default=0, help="number among the validation clips (default %(default)s)")
    parser.add_argument("--frames", type=int, default=160, help="to make (default %(default)s)")
    parser.add_argument("--temperatures", type=float, nargs="+", default=[0.0, 1.0], help="default %(default)s")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    clips = read_clips(options.data, options.sets, "val")
    frames, fps = clips.frames[options.clip].numpy(), float(clips.fps[options.clip])
    print(" | ".join(["frames", *COLUMNS]), flush=True)
    for temperature in options.temperatures:
        roll = Roll(options.bundle, fps, temperature, options.seed)
        true, made = rolled_out(roll, frames, options.frames)
        rows = [("the clip's own", stretches(true, [len(true)])[0][1])]
        rows += [
            (f"temperature {temperature:g}, {name}", own) for name, own in stretches(made, [1, 5, 20, 40, 80, 160])
        ]
        for name, own in rows:
            print(" | ".join([name, *(f"{getattr(own, column):.2f}" for column in COLUMNS)]), flush=True)


if __name__ == "__main__":
    main()
