"""Trains the autoencoder of frames (VQ-VAE) on clips and photographs; goes on where it was stopped.

    python -m export.prediction.train_autoencoder --sets pushing shapes --minutes 90

Each frame is varied as by another camera, and its noise is to be left out of the rebuilt one. Writes checkpoint.pt,
weights.pt, log.json, curves.png and sample.png (true frames above, rebuilt below) to --out. Metrics are of held-out
clips: `psnr` of rebuilt frames, dB; `used` fraction of the codebooks' entries.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path

import cv2
import torch
from torch import Tensor

from export.prediction import run
from export.prediction.autoencoder import Autoencoder, scaled
from export.prediction.codebook import used_fraction
from export.prediction.config import AUTOENCODERS, AutoencoderShape
from export.prediction.data import Clips, drawn_frames, read_clips, read_stills, varied
from export.prediction.image_error import psnr_db, rebuilt

_STILLS = 0.25  # of a step's frames are photographs
_CROPS = 40  # of each photograph


class Training(run.Training):
    def __init__(self, shape: AutoencoderShape, bf16: bool = False, device: str = "cpu") -> None:
        net = Autoencoder(shape).train().to(device)
        super().__init__(net, torch.optim.Adam(net.parameters(), betas=(0.9, 0.99)), bf16)

    def advance(self, frames: Tensor, true: Tensor, rate: float) -> dict[str, Tensor]:
        """One step on frames [B, 64, 64, 3], which are to be rebuilt as `true`, at that learning rate."""
        wanted = scaled(true)
        with self.autocast():
            made, _, commitment = self.net(scaled(frames))
        terms = {"picture": (made.float() - wanted).square().mean(), "commitment": commitment}
        self.descend(sum(terms.values()), rate)
        return {name: term.detach() for name, term in terms.items()}


@torch.no_grad()
def figures_of(net: Autoencoder, clips: Clips) -> tuple[dict[str, float], Tensor]:
    """Metrics of every fifth frame of held-out clips, and some true frames above their reconstructions, uint8 [128, W,
    3]."""
    frames = clips.frames[:, ::5].flatten(0, 1)
    made, codes = rebuilt(net, frames)
    chosen = torch.linspace(0, len(frames) - 1, min(12, len(frames))).long().to(frames.device)
    picture = torch.cat([torch.cat(list(p[chosen].float()), 1) for p in (frames, made)])
    figures = {"psnr": float(psnr_db(made, frames).mean()), "used": used_fraction(codes, net.shape.entries)}
    return figures, picture.clamp(0, 255).round().to(torch.uint8)


def load_autoencoder(path: Path) -> Autoencoder:
    """Weights as `train_autoencoder` writes them."""
    stored = torch.load(path, weights_only=True)
    shape = stored["shape"] | {"widths": tuple(stored["shape"]["widths"])}
    net = Autoencoder(AutoencoderShape(**shape))
    net.load_state_dict(stored["net"])
    return net.eval()


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--sets", nargs="+", default=["pushing", "shapes"], help="default %(default)s")
    parser.add_argument("--out", type=Path, default=Path(".data/runs/prediction-autoencoder"))
    parser.add_argument("--size", choices=AUTOENCODERS, default="light")
    parser.add_argument("--slices", type=int, help="codes a cell (default 4)")
    parser.add_argument("--entries", type=int, help="of each codebook (default 512)")
    parser.add_argument("--side", type=int, choices=(8, 16), help="cells of a frame in a row (default 16)")
    parser.add_argument(
        "--stills", type=Path, help="folder of photographs, a quarter of the frames (.data/backgrounds/train)"
    )
    run.add_arguments(parser, minutes=90, batch=32, rate=1e-3)
    return parser.parse_args()


def train(arguments: argparse.Namespace) -> None:
    """Runs or resumes a training."""
    run.begin(arguments)
    clips, held_out = (read_clips(arguments.data, arguments.sets, split) for split in ("train", "val"))
    print(f"{len(clips)} clips to train on, {len(held_out)} held out", flush=True)
    changed = {name: value for name in ("slices", "entries", "side") if (value := getattr(arguments, name))}
    shape = AutoencoderShape(**(asdict(AUTOENCODERS[arguments.size]) | changed))
    training = Training(shape, arguments.bf16, arguments.device)
    clips, held_out = clips.on(training.device), held_out.on(training.device)
    stills = read_stills(arguments.stills, _CROPS).to(training.device) if arguments.stills else None

    def advance(rate: float) -> dict[str, Tensor]:
        photographs = 0 if stills is None else round(_STILLS * arguments.batch)
        frames = drawn_frames(clips, arguments.batch - photographs)
        if photographs:
            chosen = torch.randint(len(stills), (photographs,), device=stills.device)
            frames = torch.cat([frames, stills[chosen]])
        return training.advance(*varied(frames), rate)

    def validate() -> dict[str, float]:
        figures, picture = figures_of(training.net, held_out)
        cv2.imwrite(str(arguments.out / "sample.png"), picture.cpu().numpy()[..., ::-1])
        return figures

    run.run(training, arguments, advance, validate, "held-out frames: dB; used fraction of entries")


def main() -> None:
    train(parsed())


if __name__ == "__main__":
    main()
