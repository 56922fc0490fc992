"""Samples of the transformer through the C API are those of the reference, with the image that motion predicts."""

import math
from pathlib import Path

import maquette
import numpy as np
import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")
if not maquette.library_path().exists():
    pytest.skip(f"{maquette.library_path()} is not built: run `make build`", allow_module_level=True)

import torch
from code_sampler import drawn_code

from export.bundle import BundleInfo
from export.clips.shapes import shapes_clip
from export.prediction.bundle import TRANSFORMER
from export.prediction.code_file import prior_of, read_code_file
from export.prediction.config import TransformerShape
from export.prediction.export_onnx import export_bundle
from export.prediction.graphs.graph_runtime import GraphRuntime
from export.prediction.graphs.transformer_file import read_transformer_file
from export.prediction.table import CodeTable
from export.prediction.train_autoencoder import load_autoencoder
from export.prediction.transformer import LatentTransformer

WEIGHTS = Path("export/weights/prediction-autoencoder.pt")
FPS = 15.0
SHAPE = TransformerShape(
    width=32, layers=2, heads=2, head_width=8, hidden=16, embedding=16, motion=True, slice_layers=1
)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Bundle with a transformer of random weights, the networks, and frames of a clip with their codes."""
    frames = shapes_clip("test", 0, large=False).small.rgb
    autoencoder = load_autoencoder(WEIGHTS)
    codes = autoencoder.encode(torch.from_numpy(frames))
    table = CodeTable.counted(codes[None], autoencoder.shape.entries)
    torch.manual_seed(2)
    net = LatentTransformer(SHAPE).eval()
    with torch.no_grad():
        for parameter in net.parameters():  # heads and biases begin at zero
            parameter.add_(0.1 * torch.randn_like(parameter))
        net.context.rows.weight[-1] = 0
        net.context.rows.weight[SHAPE.frames * SHAPE.slices * SHAPE.entries : -1] *= 6  # motion counts
        net.table.copy_(table.stacked())
    folder = tmp_path_factory.mktemp("bundle")
    export_bundle(autoencoder, table, folder, BundleInfo("whole", "fp32"), net)
    stored = read_code_file(folder / "codes.maqc")
    net.table.copy_(torch.from_numpy(prior_of(stored)))  # as a runtime has it
    return folder, autoencoder, net, stored, frames, codes


def test_samples_of_a_seed_are_those_of_the_reference(made):
    folder, autoencoder, _, stored, frames, codes = made
    seen, made_frames, seed = 5, 2, 11
    predictor = maquette.Predictor(
        "sampled", bundle_path=folder, temperature=1, seed=seed, threads=1
    )  # fmt: skip
    base = maquette.Predictor("motion", threads=1)
    for t in range(seen):
        predictor.push(np.ascontiguousarray(frames[t]), time_s=t / FPS)
        base.push(np.ascontiguousarray(frames[t]), time_s=t / FPS)
    predictor.sample(2, made_frames, 1 / FPS)
    tables = read_transformer_file(folder / TRANSFORMER)
    runtime = GraphRuntime(folder, tables, prior_of(stored))
    for sample in range(2):
        before = list(codes[seen - 3 : seen].numpy())
        for number in range(1, made_frames + 1):
            moved = autoencoder.encode(torch.from_numpy(base.predict(number / FPS).pixels()[None]))[0].numpy()
            runtime.begin(np.stack([*before, moved]), FPS)
            entropy = np.zeros((SHAPE.slices, 256))

            def chosen(k, place, logits, number=number, sample=sample, entropy=entropy):
                likely = logits.astype(np.float64) - np.logaddexp.reduce(logits.astype(np.float64))
                entropy[k, place] = -(np.exp(likely) * likely).sum() / math.log(2)
                return drawn_code(logits.astype(np.float32), 1, seed, seen, number, sample, place, k)

            before = [*before[1:], runtime.chosen(chosen)]
            found = predictor.entropy_map(sample, number)
            # A place depends on all codes before it: one that differed would change most of those after it.
            assert np.mean(np.abs(found - entropy.mean(0).reshape(16, 16)) < 2e-3) >= 0.99, (sample, number)
