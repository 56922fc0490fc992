"""The transformer of prediction in int8: products with weights take bytes, whose scales are found for each input as it
comes, so that nothing is calibrated; weights have 7 bits, which no processor's sums of products overflow. Rows that
codes stand for become bytes; attention, softmax and norms stay float."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from onnxruntime.quantization import QuantType, quantize_dynamic
from tqdm import tqdm

from export.checked_file import write_whole
from export.prediction.bundle import CODES, TRANSFORMER, transformer_graphs
from export.prediction.code_file import prior_of, read_code_file
from export.prediction.codes import CodedClips
from export.prediction.config import TransformerShape
from export.prediction.graph_runtime import GraphRuntime
from export.prediction.train_transformer import examples, held_out_frames
from export.prediction.transformer_file import read_transformer_file, transformer_bytes


def quantize_transformer(source: Path, target: Path) -> None:
    """Writes the transformer of a fp32 bundle into the folder of an int8 one, and prints sizes."""
    tables = read_transformer_file(source / TRANSFORMER)
    for name in transformer_graphs(len(tables.earlier)):
        paths = source / f"{name}.onnx", target / f"{name}.onnx"
        quantize_dynamic(*paths, per_channel=True, reduce_range=True, weight_type=QuantType.QInt8)
        print(f"{name}: {paths[0].stat().st_size / 1e6:.2f} -> {paths[1].stat().st_size / 1e6:.2f} MB")
    write_whole(transformer_bytes(tables, row_bytes=1), target / TRANSFORMER)


def bits_of_frames(folder: Path, clips: CodedClips, count: int) -> np.ndarray:
    """Bits a code of `count` held-out frames by the transformer of a bundle: [frames]."""
    tables = read_transformer_file(folder / TRANSFORMER)
    runtime = GraphRuntime(folder, tables, prior_of(read_code_file(folder / CODES)))
    shape = TransformerShape(frames=tables.before, slices=len(tables.earlier), motion=tables.frames > tables.before)
    one = examples(clips, *held_out_frames(clips, count), shape)
    found = []
    for before, codes, fps in tqdm(zip(one.before, one.codes, one.fps, strict=True), desc=folder.name, leave=False):
        runtime.begin(before.numpy(), float(fps))
        likely = torch.from_numpy(runtime.logits(codes.numpy())).log_softmax(-1)
        found.append(-float(likely.gather(-1, codes.flatten(1)[..., None]).mean()) / np.log(2))
    return np.array(found)


def transformer_cost(fp32: Path, int8: Path, clips: CodedClips, count: int) -> dict[str, float]:
    """bits_fp32, bits_int8: a code, of held-out frames."""
    folders = {"fp32": fp32, "int8": int8}
    return {f"bits_{k}": round(float(bits_of_frames(v, clips, count).mean()), 4) for k, v in folders.items()}
