"""Makes an int8 bundle from a fp32 bundle: static, per output channel, calibrated on rendered people and photographs.

    python -m quantization.quantize --bundle .data/bundles/densepose-b-fp32 --out sdk/models/densepose-b-int8 \\
        --photos .data/photos/shards/train

With networks for person crops (`export.densepose.export_onnx --crops`), the others taken over as they are shipped:

    python -m quantization.quantize --bundle .data/bundles/densepose-full-fp32 --keep sdk/models/densepose-b-int8 \\
        --out .data/bundles/densepose-full-int8 --data .data/people-wide/train --held-out .data/people-wide/val

Activations are unsigned, weights signed 8-bit numbers. What stays float is in `quantization/densepose.toml`.
Prints sizes and each output's signal to noise ratio on images that were not used for calibration.
"""

from __future__ import annotations

import argparse
import fnmatch
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from onnxruntime.quantization import CalibrationDataReader, CalibrationMethod, QuantType
from onnxruntime.quantization.calibrate import TensorsData, create_calibrator
from onnxruntime.quantization.qdq_quantizer import QDQQuantizer
from onnxruntime.quantization.registry import QDQRegistry, QLinearOpsRegistry

from export.bundle import BundleInfo, bytes_of, read_manifest
from export.data_sources import CREDITS
from export.densepose import bundle as bundle_format
from export.densepose.graphs import open_bundle
from export.shards import load_records
from quantization.analysis.errors import float_nodes_left, output_sqnr
from quantization.graphs.bias_correction import correct_biases
from quantization.graphs.prepare import prepare
from quantization.graphs.rounding import round_together
from quantization.graphs.simplify import simplify
from quantization.samples import Sample, calibration_records, collect, options_of_calibration, spread
from quantization.settings import DensePoseSettings, GraphSettings, read_settings

METHODS = {
    "minmax": CalibrationMethod.MinMax,
    "percentile": CalibrationMethod.Percentile,
    "entropy": CalibrationMethod.Entropy,
}
# The largest integer of a weight, as onnxruntime.quantization has it.
SEVEN_BITS, EIGHT_BITS = 64, 127
OPERATORS = sorted({*QLinearOpsRegistry, *QDQRegistry})


class Samples(CalibrationDataReader):
    """Hands the calibration inputs of one graph to ONNX Runtime, one by one."""

    def __init__(self, samples: list[Sample]) -> None:
        self._left = iter(samples)

    def get_next(self) -> Sample | None:
        return next(self._left, None)


def quantize_graph(source: Path, target: Path, samples: list[Sample], settings: GraphSettings) -> None:
    """Writes the int8 form (QDQ) of one graph. Raises ValueError for a pattern that matches nothing."""
    if not samples:
        raise ValueError(f"nothing to calibrate {source.name} with: the bundle finds no person in the images")
    with tempfile.TemporaryDirectory() as folder:
        prepared = Path(folder) / "prepared.onnx"
        prepare(source, prepared)
        quantize_prepared(prepared, target, calibrate(prepared, samples, settings), settings)
        correct(prepared, target, samples, settings)


def correct(prepared: Path, target: Path, samples: list[Sample], settings: GraphSettings) -> None:
    """Refinements of a quantized graph's integers once scales are fixed."""
    if settings.round_together:
        round_together(prepared, target, samples, SEVEN_BITS if settings.reduce_range else EIGHT_BITS)
    if settings.bias_correction:
        correct_biases(prepared, target, samples)


def calibrate(prepared: Path, samples: list[Sample], settings: GraphSettings) -> TensorsData:
    """Ranges of all activations of a prepared graph. They do not depend on what stays float."""
    if settings.method != "minmax":
        samples = equal_sizes(samples)
    with tempfile.TemporaryDirectory() as folder:
        calibrator = create_calibrator(
            prepared,
            OPERATORS,
            augmented_model_path=str(Path(folder) / "augmented.onnx"),
            calibrate_method=METHODS[settings.method],
            # Not max_intermediate_outputs: "minmax" then forgets all samples but those of the last batch.
            extra_options={"percentile": settings.percentile} if settings.method == "percentile" else {},
        )
        # Few at a time: it keeps what every layer made of them.
        for start in range(0, len(samples), 8):
            calibrator.collect_data(Samples(samples[start : start + 8]))
        return calibrator.compute_data()


def quantize_prepared(prepared: Path, target: Path, ranges: TensorsData, settings: GraphSettings) -> None:
    """Writes the int8 form of a prepared graph with known ranges: `quantize_static` without its calibration, so that
    many choices of what stays float can be tried at the cost of one calibration."""
    model = onnx.load(prepared)
    quantizer = QDQQuantizer(
        model,
        per_channel=True,
        reduce_range=settings.reduce_range,
        weight_qType=QuantType.QInt8,
        activation_qType=QuantType.QUInt8,
        tensors_range=ranges,
        nodes_to_quantize=[],
        nodes_to_exclude=matching_nodes(model.graph, settings.float_nodes),
        op_types_to_quantize=OPERATORS,
        extra_options={"TensorQuantOverrides": eight_bit_weights(model.graph) if settings.depthwise_8_bit else {}},
    )
    quantizer.quantize_model()
    simplify(quantizer.model.model)
    quantizer.model.save_model_to_file(str(target))


def eight_bit_weights(graph: onnx.GraphProto) -> dict[str, list[dict[str, object]]]:
    """Asks ONNX Runtime for all 8 bits in depthwise convolutions: their kernel adds in 32 bits on every processor
    (quantization.analysis.saturation), so that they have nothing to fear from 16-bit sums."""
    shapes = {value.name: list(value.dims) for value in graph.initializer}
    found = {}
    for node in graph.node:
        group = next((a.i for a in node.attribute if a.name == "group"), 1)
        if node.op_type == "Conv" and group > 1 and shapes[node.input[1]][:2] == [group, 1]:
            found[node.input[1]] = [
                {"quant_type": QuantType.QInt8, "symmetric": True, "reduce_range": False, "axis": 0}
            ]
    return found


def equal_sizes(samples: list[Sample]) -> list[Sample]:
    """Samples of [N, …] arrays as single ones of one size, [1, …], which histograms of activations need.

    Images and their features get zeros at the right and bottom, as at run time.
    """
    shape = {name: np.max([s[name].shape[1:] for s in samples], axis=0) for name in samples[0]}
    singles = [
        {name: array[k : k + 1] for name, array in sample.items()}
        for sample in samples
        for k in range(len(next(iter(sample.values()))))
    ]
    return [{name: _padded(array, shape[name]) for name, array in single.items()} for single in singles]


def _padded(array: np.ndarray, shape: np.ndarray) -> np.ndarray:
    return np.pad(array, [(0, 0), *((0, size - given) for size, given in zip(shape, array.shape[1:], strict=True))])


def matching_nodes(graph: onnx.GraphProto, patterns: tuple[str, ...]) -> list[str]:
    """Names of the nodes that match any of the patterns; every pattern must match some node."""
    names = [node.name for node in graph.node]
    for pattern in patterns:
        if not fnmatch.filter(names, pattern):
            raise ValueError(f"no node of {graph.name} is called {pattern}; names are like {', '.join(names[:4])}")
    return [name for name in names if any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)]


def quantize_graphs(
    source: Path,
    target: Path,
    settings: dict[str, GraphSettings],
    calibration: dict[str, list[Sample]],
    held_out: dict[str, list[Sample]],
) -> dict[str, dict[str, float]]:
    """Quantizes graphs, by name, from one folder into another and prints what became of each. calibration, held_out:
    inputs of each graph. Returns each output's SQNR in dB on `held_out`."""
    quality = {}
    for name, graph_settings in settings.items():
        paths = source / f"{name}.onnx", target / f"{name}.onnx"
        quantize_graph(*paths, calibration[name], graph_settings)
        quality[name] = output_sqnr(*paths, held_out[name])
        sizes = [path.stat().st_size / 1e6 for path in paths]
        print(f"{name}: {sizes[0]:.2f} -> {sizes[1]:.2f} MB, {len(calibration[name])} samples")
        print("  dB: " + ", ".join(f"{output} {value:.1f}" for output, value in quality[name].items()))
        print("  float: " + (", ".join(float_nodes_left(paths[1])) or "nothing"))
    return quality


def as_measured(quality: dict[str, dict[str, float]]) -> dict[str, dict[str, float]]:
    """The result of `quantize_graphs` in the form of the manifest."""
    return {graph: {name: round(value, 1) for name, value in outputs.items()} for graph, outputs in quality.items()}


def int8_info(
    name: str, source: Mapping[str, Any], quality: dict[str, dict[str, float]], **measured: object
) -> BundleInfo:
    """Metadata of the int8 bundle of a fp32 bundle. source: manifest of the fp32 bundle; quality: result of
    `quantize_graphs`; measured: further metrics."""
    return BundleInfo(
        name=name,
        precision="int8",
        version=source["version"],
        training_data=tuple(source["training_data"]),
        measured={"sqnr_db": as_measured(quality), **measured},
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, parents=[options_of_calibration()]
    )
    parser.add_argument("--out", type=Path, default=Path("sdk/models/densepose-b-int8"))
    parser.add_argument("--keep", type=Path, metavar="DIR", help="int8 bundle whose graphs are taken over as they are")
    parser.add_argument("--name", help="default: the folder's name")
    options = parser.parse_args()
    settings = read_settings(options.settings, DensePoseSettings)
    source = open_bundle(options.bundle)
    kept = read_manifest(options.keep) if options.keep else {"graphs": {}, "measured": {}}
    calibration = calibration_records(settings, options.data, options.photos)
    held_out = spread(load_records(options.held_out), settings.held_out_images)
    options.out.mkdir(parents=True, exist_ok=True)
    crops = source.crop_graphs is not None
    # Chart weights stay float. Those of the graphs that are kept belong to them.
    shutil.copy((options.keep or source.folder) / bundle_format.CHARTS, options.out)
    if crops:
        shutil.copy(source.folder / bundle_format.CROP_CHARTS, options.out)
    if (source.folder / CREDITS).exists():
        shutil.copy(source.folder / CREDITS, options.out)
    for name in kept["graphs"]:
        shutil.copy(options.keep / f"{name}.onnx", options.out)
    wanted = {name: settings.graphs[name] for name in source.manifest["graphs"] if name not in kept["graphs"]}
    samples = [collect(source, records, settings.people_per_image) for records in (calibration, held_out)]
    quality = quantize_graphs(source.folder, options.out, wanted, *samples)
    quality = kept["measured"].get("sqnr_db", {}) | quality
    info = int8_info(options.name or options.out.name, source.manifest, quality)
    bundle_format.write_manifest(options.out, info, source.network, source.decode, crops=crops)
    sizes = [bytes_of(folder) / 1e6 for folder in (options.bundle, options.out)]
    print(f"{options.out}: {sizes[0]:.2f} -> {sizes[1]:.2f} MB")


if __name__ == "__main__":
    main()
