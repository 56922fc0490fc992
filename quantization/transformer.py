"""The transformer of prediction in int8: products with weights take bytes; weights have 7 bits, which no processor's
sums of products overflow. The context network finds scales for each input as it comes; those of slices and heads are
fixed by training frames, so that a sample that is drawn depends on no other, and a cell is the same alone and beside
all others. Rows that codes stand for become bytes; attention, softmax and norms stay float."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import torch
from onnxruntime.quantization import QuantType, quantize_dynamic
from tqdm import tqdm

from export.checked_file import write_whole
from export.prediction.bundle import CODES, TRANSFORMER, transformer_graphs
from export.prediction.code_file import prior_of, read_code_file
from export.prediction.codes import CodedClips
from export.prediction.config import TransformerShape
from export.prediction.graphs.graph_runtime import GraphRuntime
from export.prediction.graphs.transformer_file import read_transformer_file, transformer_bytes
from export.prediction.graphs.transformer_graphs import SLICES, head_name
from export.prediction.train_transformer import examples, held_out_frames
from quantization.graphs.fixed_scales import Ranges, fix_scales, scaled_inputs, show


def quantize_transformer(source: Path, target: Path, clips: CodedClips, count: int) -> None:
    """Writes the transformer of a fp32 bundle into the folder of an int8 one, which has the codes, and prints sizes.
    `count` frames of `clips` set the ranges."""
    tables = read_transformer_file(source / TRANSFORMER)
    write_whole(transformer_bytes(tables, row_bytes=1), target / TRANSFORMER)
    names = transformer_graphs(len(tables.earlier))
    for name in names:
        quantize_dynamic(
            source / f"{name}.onnx", target / f"{name}.onnx", per_channel=True, reduce_range=True,
            weight_type=QuantType.QInt8,
        )  # fmt: skip
    fix_sample_scales(target, clips, count)
    for name in names:
        sizes = [(folder / f"{name}.onnx").stat().st_size / 1e6 for folder in (source, target)]
        print(f"{name}: {sizes[0]:.2f} -> {sizes[1]:.2f} MB")


class ShownSession:
    """A graph whose last outputs are noted by their range and not given. ranges: is added to."""

    def __init__(self, path: Path, shown: Sequence[str], ranges: Ranges) -> None:
        model = onnx.load(path)
        self.own = len(model.graph.output)
        show(model, shown)
        self.session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
        self.shown, self.ranges = shown, ranges

    def get_inputs(self) -> list[onnxruntime.NodeArg]:
        return self.session.get_inputs()

    def run(self, _: None, given: dict[str, np.ndarray]) -> list[np.ndarray]:
        found = self.session.run(None, given)
        names = (output.name for output in self.session.get_outputs())
        values = given | dict(zip(names, found, strict=True))
        for name in self.shown:
            low, high = self.ranges.get(name, (0.0, 0.0))
            self.ranges[name] = min(low, float(values[name].min())), max(high, float(values[name].max()))
        return found[: self.own]


def fix_sample_scales(folder: Path, clips: CodedClips, count: int) -> None:
    """Fixes the scales of slices and heads of an int8 bundle, in place, by `count` frames of `clips`."""
    runtime, shape = runtime_of(folder)
    names = [SLICES, *(head_name(k) for k in range(runtime.slice_count))]
    ranges: dict[str, Ranges] = {name: {} for name in names}
    watched = []
    for name in names:
        path = folder / f"{name}.onnx"
        watched.append(ShownSession(path, scaled_inputs(onnx.load(path)), ranges[name]))
    runtime.slice_graph, *runtime.head_graphs = watched
    one = examples(clips, *held_out_frames(clips, count), shape)
    for before, codes, fps in tqdm(zip(one.before, one.codes, one.fps, strict=True), desc="ranges", leave=False):
        runtime.begin(before.numpy(), float(fps))
        runtime.logits(codes.numpy())
    for name in names:
        model = onnx.load(folder / f"{name}.onnx")
        fix_scales(model, ranges[name])
        onnx.save(model, folder / f"{name}.onnx")


def runtime_of(folder: Path) -> tuple[GraphRuntime, TransformerShape]:
    """The runtime and the shape of a bundle's transformer."""
    tables = read_transformer_file(folder / TRANSFORMER)
    shape = TransformerShape(frames=tables.before, slices=len(tables.earlier), motion=tables.frames > tables.before)
    return GraphRuntime(folder, tables, prior_of(read_code_file(folder / CODES))), shape


def bits_of_frames(folder: Path, clips: CodedClips, count: int) -> np.ndarray:
    """Bits a code of `count` held-out frames by the transformer of a bundle: [frames]."""
    runtime, shape = runtime_of(folder)
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
