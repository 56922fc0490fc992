"""Writes data/tiny_transformer: the bundle of data/tiny_prediction with transformers of random weights, and what torch
says of codes.

`bundle`, and `rows_in_bytes.maqr`: its rows as bytes. `foreseen.f32`: little-endian [5][256][2], bits of each code of
frames 1 to 5 of data/tiny_prediction given those before them, at 10 frames a second. `stream.f32`: [5][256], bits of a
code of a stream, mean of the cell. `likeliest.u8`: [256][2], codes after frames 0 to 2, each the
likeliest given those before it.

    python -m tests.native.generate.make_tiny_transformer
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import torch

from export.bundle import BundleInfo
from export.checked_file import write_whole
from export.prediction.code_file import prior_of, read_code_file
from export.prediction.config import TransformerShape
from export.prediction.export_onnx import export_bundle
from export.prediction.graphs.graph_runtime import GraphRuntime
from export.prediction.graphs.transformer_file import TransformerTables, transformer_bytes
from export.prediction.table import CodeTable, bits_of_stream
from export.prediction.transformer import UNSEEN, LatentTransformer
from tests.native.generate.make_tiny_prediction import tiny

FOLDER = Path(__file__).parents[1] / "data" / "tiny_transformer"
SHAPE = TransformerShape(width=32, layers=2, heads=2, head_width=8, hidden=16, embedding=8, slices=2, entries=16)
FPS = 10.0


def frames_before(codes: np.ndarray, t: int) -> np.ndarray:
    """[frames, slices, 16, 16]; UNSEEN before the first."""
    padded = np.concatenate([np.full((SHAPE.frames, *codes.shape[1:]), UNSEEN), codes])
    return padded[t : t + SHAPE.frames]


def main() -> None:
    autoencoder, _, codes = tiny()
    table = CodeTable.counted(codes[None, :5], SHAPE.entries)
    torch.manual_seed(7)
    net = LatentTransformer(SHAPE).eval()
    with torch.no_grad():
        for parameter in net.parameters():  # heads and biases begin at zero
            parameter.add_(0.15 * torch.randn_like(parameter))
        net.context.rows.weight[-1] = 0
        net.table.copy_(table.stacked())
    bundle = FOLDER / "bundle"
    export_bundle(autoencoder, table, bundle, BundleInfo("tiny-transformer", "fp32"), net)
    tables = TransformerTables.of(net)
    write_whole(transformer_bytes(tables, row_bytes=1), FOLDER / "rows_in_bytes.maqr")
    stored = read_code_file(bundle / "codes.maqc")
    runtime = GraphRuntime(bundle, tables, prior_of(stored))
    net.table.copy_(torch.from_numpy(prior_of(stored)))  # as a runtime has it
    foreseen = []
    for t in range(1, len(codes)):
        before = frames_before(codes.numpy(), t)
        with torch.no_grad():
            logits = net(torch.from_numpy(before)[None], codes[t : t + 1], torch.tensor([FPS]))[0]
        likely = logits.double().log_softmax(-1).gather(-1, codes[t].flatten(1)[..., None])[..., 0]
        foreseen.append(-likely.numpy().reshape(codes.shape[1:]) / math.log(2))
    foreseen = np.stack(foreseen)
    foreseen.reshape(len(foreseen), SHAPE.slices, -1).transpose(0, 2, 1).astype("<f4").tofile(FOLDER / "foreseen.f32")
    stream = bits_of_stream(stored.frequency_bits, stored.after_bits, codes.numpy(), foreseen)
    stream.mean(1).astype("<f4").tofile(FOLDER / "stream.f32")
    runtime.begin(frames_before(codes.numpy(), 3), FPS)
    likeliest = runtime.chosen(lambda _k, _place, logits: int(logits.argmax()))
    likeliest.transpose(1, 2, 0).astype(np.uint8).tofile(FOLDER / "likeliest.u8")
    print(f"{FOLDER}: bits {foreseen.mean((1, 2, 3)).round(2)}, of the stream {stream.mean((1, 2, 3)).round(2)}")


if __name__ == "__main__":
    main()
