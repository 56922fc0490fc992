"""The graphs of a bundle in ONNX Runtime, put together to what `export.densepose.decode` works with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import onnxruntime
import torch
from torch import Tensor
from torch.nn import functional as F

from export.bundle import read_manifest
from export.densepose.bundle import KEYPOINTS, decode_config
from export.densepose.config import DecodeConfig, NetworkConfig
from export.densepose.crop_pass import CropGraphs
from export.densepose.decode import DenseHead, Graphs


def session(path: Path, threads: int = 1) -> onnxruntime.InferenceSession:
    """A CPU session of one graph."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.log_severity_level = 3  # else every constant that quantization left behind is worth a warning
    return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])


@dataclass(frozen=True)
class Bundle:
    """A bundle's graphs as callables, and the settings that its manifest names.

    crop_graphs: of the crop pass; None where those of the whole image do that, too. surface: RoIs of the dense head ->
    its features of the surface [P, h, w, C], which the keypoints are made of.
    """

    folder: Path
    manifest: dict
    network: NetworkConfig
    decode: DecodeConfig
    graphs: Graphs
    crop_graphs: CropGraphs | None
    surface: Callable[[Tensor], Tensor]


def open_bundle(folder: Path, threads: int = 1) -> Bundle:
    """Raises what `export.bundle.read_manifest` raises."""
    manifest = read_manifest(folder)
    rpn, head, dense = manifest["rpn"], manifest["box_head"], manifest["dense_head"]
    network = NetworkConfig(
        width=manifest["graphs"]["box_head"]["inputs"][0]["shape"][3],
        evidence=int("evidence_stride" in head),  # how many channels it has within the graph, no manifest says
        keypoints=manifest[KEYPOINTS]["count"] if KEYPOINTS in manifest else 0,
        anchor_sizes=tuple(rpn["anchor_sizes_px"]),
        aspect_ratios=tuple(rpn["aspect_ratios"]),
        rpn_strides=tuple(rpn["strides"]),
        delta_weights=tuple(head["delta_weights"]),
    )
    sessions = {name: session(folder / entry["file"], threads) for name, entry in manifest["graphs"].items()}

    def run(name: str, *given: Tensor) -> list[Tensor]:
        entry = manifest["graphs"][name]
        feed = {x["name"]: np.ascontiguousarray(t.numpy()) for x, t in zip(entry["inputs"], given, strict=True)}
        return [torch.from_numpy(x) for x in sessions[name].run([x["name"] for x in entry["outputs"]], feed)]

    def detector(image: Tensor) -> tuple[list[Tensor], list[Tensor], list[Tensor], Tensor | None]:
        outputs = run("trunk", image)
        features = outputs[: len(network.rpn_strides)]
        evidence = outputs[len(features)].permute(0, 3, 1, 2) if "evidence_stride" in head else None
        found = [x.permute(0, 3, 1, 2) for x in run("rpn_fine", features[0]) + run("rpn_coarse", *features[1:])]
        anchors = len(network.aspect_ratios)
        maps = [x.permute(0, 3, 1, 2).contiguous() for x in features]
        return maps, [x[:, :anchors] for x in found], [x[:, anchors:] for x in found], evidence

    def box_head(rois: Tensor) -> tuple[Tensor, Tensor]:
        (found,) = run("box_head", rois.permute(0, 2, 3, 1))
        return found[:, :2], found[:, 2:]

    def dense_head_of(graph: str, charts_file: str) -> DenseHead:
        charts = read_charts(folder / charts_file, dense["index_classes"] - 1)

        def dense_head(rois: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
            labels, surface = run(graph, rois.permute(0, 2, 3, 1))
            both = interleaved(labels)
            coarse, index = both[:, : dense["coarse_classes"]], both[:, dense["coarse_classes"] :]
            return coarse, index, *chart_maps(surface, *charts)

        return dense_head

    def finest(crops: Tensor) -> Tensor:
        # Exported for one image, as the trunk is.
        return torch.cat([run("crop_trunk", crop[None])[0].permute(0, 3, 1, 2) for crop in crops])

    def surface(rois: Tensor) -> Tensor:
        return run("dense_head", rois.permute(0, 2, 3, 1))[1]

    def keypoints(rois: Tensor) -> Tensor:
        return interleaved(run(KEYPOINTS, surface(rois))[0])

    graphs = Graphs(
        detector, box_head, dense_head_of("dense_head", manifest["charts"]["file"]),
        keypoints if KEYPOINTS in sessions else None,
    )  # fmt: skip
    crop_graphs = None
    if "crop_charts" in manifest:
        crop_graphs = CropGraphs(finest, dense_head_of("crop_dense_head", manifest["crop_charts"]["file"]))
    return Bundle(folder, manifest, network, decode_config(manifest), graphs, crop_graphs, surface)


def read_charts(path: Path, parts: int) -> tuple[Tensor, Tensor]:
    """The transposed convolution of U and V: weight [2, parts, 4, 4, C], bias [2, parts]; docs/reference/formats.md."""
    values = torch.from_numpy(np.fromfile(path, "<f4"))
    biases = 2 * parts
    return values[:-biases].reshape(2, parts, 4, 4, -1), values[-biases:].reshape(2, parts)


def interleaved(labels: Tensor) -> Tensor:
    """Four phases [P, h, w, 4 C] of the dense head's labels, or of keypoints, as maps [P, C, 2h, 2w]."""
    phases = labels.unflatten(3, (2, 2, -1))  # row and column of the phase
    return phases.permute(0, 5, 1, 3, 2, 4).flatten(4, 5).flatten(2, 3)


def chart_maps(surface: Tensor, weight: Tensor, bias: Tensor) -> tuple[Tensor, Tensor]:
    """U and V [P, 1 + parts, 2h, 2w] of every part; zero for the background, which has none. surface: [P, h, w, C]."""
    kernel = weight.permute(4, 0, 1, 2, 3).flatten(1, 2)
    maps = F.conv_transpose2d(surface.permute(0, 3, 1, 2), kernel, bias.flatten(), stride=2, padding=1)
    maps = F.pad(maps.unflatten(1, (2, -1)), (0, 0, 0, 0, 1, 0))
    return maps[:, 0], maps[:, 1]
