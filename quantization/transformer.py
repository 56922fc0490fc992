"""The transformer of prediction in int8: products with weights take bytes, whose scales are found for each input as it
comes, so that nothing is calibrated; weights have 7 bits, which no processor's sums of products overflow. Rows that
codes stand for become bytes; attention, softmax and norms stay float."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import torch
from onnxruntime.quantization import QuantType, quantize_dynamic
from tqdm import tqdm

from export.checked_file import write_whole
from export.prediction.bundle import CODES, TRANSFORMER, transformer_graphs
from export.prediction.code_file import prior_of, read_code_file
from export.prediction.codes import CodedClips
from export.prediction.config import TransformerShape
from export.prediction.graphs.expected_graph import EXPECTED
from export.prediction.graphs.graph_runtime import GraphRuntime
from export.prediction.graphs.transformer_file import read_transformer_file, transformer_bytes
from export.prediction.train_transformer import examples, held_out_frames
from quantization.graphs.stored_bytes import store_as_bytes


def quantize_transformer(source: Path, target: Path) -> None:
    """Writes the transformer of a fp32 bundle into the folder of an int8 one, and prints sizes."""
    tables = read_transformer_file(source / TRANSFORMER)
    for name in transformer_graphs(len(tables.earlier)):
        paths = source / f"{name}.onnx", target / f"{name}.onnx"
        quantize_dynamic(*paths, per_channel=True, reduce_range=True, weight_type=QuantType.QInt8)
        print(f"{name}: {paths[0].stat().st_size / 1e6:.2f} -> {paths[1].stat().st_size / 1e6:.2f} MB")
    write_whole(transformer_bytes(tables, row_bytes=1), target / TRANSFORMER)


def quantize_expected(source: Path, target: Path) -> None:
    """The same of the graph of the expected frame. Probabilities times rows stay float products: in bytes, all but the
    largest of 512 would vanish."""
    name = f"{EXPECTED}.onnx"
    graph = onnx.load(source / name).graph
    constants = {tensor.name: list(tensor.dims) for tensor in graph.initializer}
    chances = {node.output[0] for node in graph.node if node.op_type == "Softmax"}
    by_chance = [n for n in graph.node if n.op_type == "MatMul" and n.input[0] in chances and n.input[1] in constants]
    rows = [n.input[0] for n in graph.node if n.op_type == "Gather" and len(constants.get(n.input[0], [])) == 2]
    quantize_dynamic(
        source / name, target / name, per_channel=True, reduce_range=True, weight_type=QuantType.QInt8,
        op_types_to_quantize=["MatMul"], nodes_to_exclude=[node.name for node in by_chance],
    )  # fmt: skip
    model = onnx.load(target / name)
    axes = {node.input[1]: len(constants[node.input[1]]) - 1 for node in by_chance}
    store_as_bytes(model, [*axes.items(), *((row, 0) for row in dict.fromkeys(rows))])
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, target / name)
    print(f"{EXPECTED}: {(source / name).stat().st_size / 1e6:.2f} -> {(target / name).stat().st_size / 1e6:.2f} MB")


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
