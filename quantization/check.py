"""Checks every quantization scale of the shipped bundle, in under a minute and without data outside this repository.

The command exports fp32 graphs from `export/weights`, runs them on the images in `tests/media`, and compares every
integer tensor with its float original. It names each tensor whose signal-to-noise ratio differs from
`docs/research/quantization.json` (written by `python -m quantization.report`): a scale that is too large rounds
coarsely, a scale that is too small clips.
"""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np
import onnx

from export.bundle import BundleInfo, read_manifest
from export.densepose import bundle as bundle_format
from export.densepose.config import DecodeConfig
from export.densepose.graphs import Bundle, open_bundle
from export.evaluation.sheet import clip_frames
from export.shards import Record
from quantization.analysis.comparison import TensorError, pair_errors, weight_errors
from quantization.graphs.prepare import prepare
from quantization.samples import Sample, collect

MEDIA = Path("tests/media")
CLIP_FRAMES = 3
TOLERANCE_DB = 1.0  # float sums differ by far less from machine to machine; a scale off by a quarter, by more
WEIGHTS = Path("export/weights/densepose-b.pt")


def media_records() -> list[Record]:
    """The photo and some frames of the clip of this repository, without labels."""
    photo = cv2.imread(str(MEDIA / "photo.jpg"), cv2.IMREAD_COLOR)
    images = [photo, *(image[..., ::-1] for _, image in clip_frames(MEDIA / "clip.mp4", CLIP_FRAMES))]
    return [Record(_png(image), _png(np.zeros((*image.shape[:2], 4), np.uint8))) for image in images]


def _png(image: np.ndarray) -> bytes:
    return cv2.imencode(".png", np.ascontiguousarray(image))[1].tobytes()


def fp32_bundle(weights: Path, folder: Path) -> Bundle:
    """The fp32 bundle of trained weights, as `export.densepose.export_onnx` makes it. Needs torch."""
    from export.densepose.export_onnx import export_graphs, load_network

    net = load_network(weights)
    export_graphs(net, folder)
    bundle_format.write_manifest(folder, BundleInfo(folder.name, "fp32"), net.config, DecodeConfig())
    return open_bundle(folder)


def prepared_graphs(source: Path, folder: Path) -> dict[str, onnx.ModelProto]:
    """The prepared float graphs of a bundle by name. folder: where they are written."""
    folder.mkdir(parents=True, exist_ok=True)
    return {name: prepare(source / f"{name}.onnx", folder / f"{name}.onnx") for name in read_manifest(source)["graphs"]}


def media_samples(bundle: Bundle) -> dict[str, list[Sample]]:
    """Inputs of each graph of a fp32 bundle for the images of this repository."""
    return collect(bundle, media_records(), people=2)


def own_errors(
    reference: dict[str, onnx.ModelProto], quantized: Path, samples: dict[str, list[Sample]]
) -> list[TensorError]:
    """Each integer tensor's own error: weights, biases and activations of all graphs of an int8 bundle."""
    found = []
    for name, model in reference.items():
        graph = onnx.load(quantized / f"{name}.onnx")
        found += weight_errors(name, model, graph) + pair_errors(name, model, graph, samples[name])
    return found


def metrics_of(errors: list[TensorError]) -> dict[str, list[float | None]]:
    """`here` and `worst_channel` in dB by "graph: tensor", for a JSON file."""
    return {f"{e.graph}: {e.name}": [_finite(e.here), _finite(e.worst_channel)] for e in errors}


def _finite(value: float | None) -> float | None:
    """JSON has no infinity: a tensor without error, or silent on these images, has no figure."""
    return None if value is None or not math.isfinite(value) else round(value, 2)


def complaints(expected: dict[str, list[float | None]], errors: list[TensorError]) -> list[str]:
    """One sentence for every tensor that is not as expected; worst first, empty if all is well."""
    actual = metrics_of(errors)
    found = [(math.inf, f"{name} is no longer quantized, or is gone") for name in expected.keys() - actual.keys()]
    found += [(math.inf, f"{name} is quantized, but unknown") for name in actual.keys() - expected.keys()]
    for name in expected.keys() & actual.keys():
        gaps = []
        for label, before, after in zip(("", " in its worst channel"), expected[name], actual[name], strict=True):
            gap = 0.0 if before == after else math.inf if None in (before, after) else abs(before - after)
            shown = ["no noise" if value is None else f"{value:.1f} dB" for value in (after, before)]
            gaps.append((gap, f"{name} has {shown[0]}{label} instead of {shown[1]}: is its scale right?"))
        worst = max(gaps)
        if worst[0] > TOLERANCE_DB:
            found.append(worst)
    return [text for _, text in sorted(found, key=lambda item: (-item[0], item[1]))]
