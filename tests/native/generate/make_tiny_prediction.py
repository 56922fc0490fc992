"""Writes data/tiny_prediction: a bundle for prediction with random weights, and what torch makes of frames.

`bundle`: 16 x 16 places of two codes of 16. `frames.rgb`: uint8 [6][64][64][3], things that move over a texture, the
last one of another scene. `codes.u8`: [6][256][2], codes by torch. `bits.f32`: little-endian [5][256], bits of a code
of each frame but the first, mean of the place, by export/prediction/table.py. `rebuilt.f32`: [64][64][3], the first
frame's codes decoded by torch, 0..255. `large.rgb`: uint8 [120][160][3], and
`large.u8`: what OpenCV's INTER_AREA squeezes it to, [64][64][3].

    python -m tests.native.generate.make_tiny_prediction
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import torch

from export.bundle import BundleInfo
from export.prediction.autoencoder import Autoencoder, scaled
from export.prediction.code_file import read_code_file
from export.prediction.config import AutoencoderShape
from export.prediction.export_onnx import export_bundle
from export.prediction.table import CodeTable, bits_of_stream

FOLDER = Path(__file__).parents[1] / "data" / "tiny_prediction"
SHAPE = AutoencoderShape(widths=(8, 16), residual=8, blocks=1, slices=2, entries=16)


def picture(shift_px: float, width: int, height: int, seed: float = 0.0) -> np.ndarray:
    """uint8 [height, width, 3]."""
    y, x = np.mgrid[:height, :width].astype(np.float64) * (64 / width)
    back = [128 + 60 * np.sin(x / (5 + c) + seed) * np.cos(y / (7 - c) + c) for c in range(3)]
    moving = np.hypot(x - 20 - shift_px, y - 30) < 12
    thing = [128 + 100 * np.cos((x - shift_px) / 3 + c + seed) for c in range(3)]
    return np.rint(np.where(moving[..., None], np.stack(thing, -1), np.stack(back, -1))).clip(0, 255).astype(np.uint8)


def tiny() -> tuple[Autoencoder, np.ndarray, torch.Tensor]:
    """The network, frames uint8 [6, 64, 64, 3], and their codes int64 [6, 2, 16, 16]."""
    torch.manual_seed(5)
    net = Autoencoder(SHAPE).eval()
    for layer in net.encoder:  # weights as they begin make nearly one colour of all
        if isinstance(layer, torch.nn.Conv2d):
            layer.weight.data *= 2.5
    frames = np.stack([*(picture(3 * k, 64, 64) for k in range(5)), picture(40, 64, 64, 2.0)])
    given = torch.from_numpy(frames)
    with torch.no_grad():
        vectors = net.codebook._vectors(net.encoder(scaled(given)))
        for k in range(SHAPE.slices):
            net.codebook.entries[k] = vectors[k, torch.randperm(vectors.shape[1])[: SHAPE.entries]]
    return net, frames, net.encode(given)


def main() -> None:
    net, frames, codes = tiny()
    table = CodeTable.counted(codes[None, :5], SHAPE.entries)
    (FOLDER / "bundle").mkdir(parents=True, exist_ok=True)
    export_bundle(net, table, FOLDER / "bundle", BundleInfo("tiny-prediction", "fp32"))
    stored = read_code_file(FOLDER / "bundle" / "codes.maqc")
    bits = bits_of_stream(stored.frequency_bits, stored.after_bits, codes.numpy())
    net.decode(codes[:1])[0].numpy().astype("<f4").tofile(FOLDER / "rebuilt.f32")
    frames.tofile(FOLDER / "frames.rgb")
    codes.permute(0, 2, 3, 1).numpy().astype(np.uint8).tofile(FOLDER / "codes.u8")
    bits.mean(1).astype("<f4").tofile(FOLDER / "bits.f32")
    large = picture(9, 160, 120)
    large.tofile(FOLDER / "large.rgb")
    cv2.resize(large, (64, 64), interpolation=cv2.INTER_AREA).tofile(FOLDER / "large.u8")
    equal = float((codes[1:5] == codes[:4]).float().mean())
    used = len(torch.unique(codes))
    print(
        f"{FOLDER}: {equal:.0%} of codes equal those before, {used} numbers used, {bits.mean((1, 2, 3)).round(2)} bits"
    )


if __name__ == "__main__":
    main()
