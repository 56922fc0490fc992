"""Makes an int8 bundle from a fp32 bundle: static, per output channel, calibrated on rendered people and photographs.

    python -m quantization.quantize --bundle .data/bundles/densepose-b-fp32 --out sdk/models/densepose-b-int8 \\
        --photos .data/photos/shards/train

Activations are unsigned, weights signed 8-bit numbers. What stays float is in `quantization/densepose.toml`.
Prints sizes and each output's signal to noise ratio on images that were not used for calibration.
"""

from __future__ import annotations

import argparse
import fnmatch
import shutil
import tempfile
from pathlib import Path

import numpy as np
import onnx
from onnxruntime.quantization import (
    CalibrationDataReader,
    CalibrationMethod,
    QuantFormat,
    QuantType,
    quantize_static,
)
from onnxruntime.quantization.shape_inference import quant_pre_process

from export.densepose import bundle as bundle_format
from export.densepose import data
from export.densepose.graphs import Bundle, open_bundle
from quantization.errors import float_nodes_left, output_sqnr
from quantization.samples import Sample, collect
from quantization.settings import GraphSettings, Settings, read_settings
from quantization.simplify import simplify

METHODS = {
    "minmax": CalibrationMethod.MinMax,
    "percentile": CalibrationMethod.Percentile,
    "entropy": CalibrationMethod.Entropy,
}


class Samples(CalibrationDataReader):
    """Hands the calibration inputs of one graph to ONNX Runtime, some at a time: it keeps what every layer makes of
    those that it is handed."""

    MOST_AT_ONCE = 8

    def __init__(self, samples: list[Sample]) -> None:
        self._all = samples
        self._left = iter(samples)
        # ONNX Runtime wants equal portions.
        self.portion = max(k for k in range(1, self.MOST_AT_ONCE + 1) if len(samples) % k == 0)

    def __len__(self) -> int:
        return len(self._all)

    def set_range(self, start_index: int, end_index: int) -> None:
        self._left = iter(self._all[start_index:end_index])

    def get_next(self) -> Sample | None:
        return next(self._left, None)


def quantise_graph(source: Path, target: Path, samples: list[Sample], settings: GraphSettings) -> None:
    """Writes the int8 form (QDQ) of one graph. Raises ValueError for a pattern that matches nothing."""
    if not samples:
        raise ValueError(f"nothing to calibrate {source.name} with: the bundle finds nobody in the images")
    if settings.method != "minmax":
        samples = equal_sizes(samples)
    with tempfile.TemporaryDirectory() as folder:
        prepared = Path(folder) / "prepared.onnx"
        quant_pre_process(source, prepared, skip_symbolic_shape=True)
        graph = onnx.load(prepared).graph
        reader = Samples(samples)
        quantize_static(
            prepared,
            target,
            reader,
            quant_format=QuantFormat.QDQ,
            per_channel=True,
            reduce_range=settings.reduce_range,
            activation_type=QuantType.QUInt8,
            weight_type=QuantType.QInt8,
            nodes_to_exclude=matching_nodes(graph, settings.float_nodes),
            calibrate_method=METHODS[settings.method],
            # Not CalibMaxIntermediateOutputs: "minmax" then forgets all samples but those of the last batch.
            extra_options={"CalibPercentile": settings.percentile, "CalibStridedMinMax": reader.portion},
        )
    model = onnx.load(target)
    simplify(model)
    onnx.save(model, target)


def equal_sizes(samples: list[Sample]) -> list[Sample]:
    """Samples of [N, …] arrays as single ones of one size, [1, …], which histograms of activations need.

    Pictures and their features get zeros at the right and bottom, as at run time.
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


def spread(records: list[data.Record], count: int) -> list[data.Record]:
    """At most `count` records, evenly over the shards (a shard holds one orientation)."""
    return records[:: max(1, len(records) // count)][:count]


def quantise_bundle(
    source: Bundle, target: Path, settings: Settings, records: list[data.Record], held_out: list[data.Record]
) -> dict[str, dict[str, float]]:
    """Quantises the graphs of `source` into the folder `target`; chart weights stay float. Returns each output's SQNR
    in dB."""
    target.mkdir(parents=True, exist_ok=True)
    shutil.copy(source.folder / bundle_format.CHARTS, target)
    calibration = collect(source, records, settings.people_per_image)
    test = collect(source, held_out, settings.people_per_image)
    quality = {}
    for name, graph_settings in settings.graphs.items():
        paths = source.folder / f"{name}.onnx", target / f"{name}.onnx"
        quantise_graph(*paths, calibration[name], graph_settings)
        quality[name] = output_sqnr(*paths, test[name])
        sizes = [path.stat().st_size / 1e6 for path in paths]
        print(f"{name}: {sizes[0]:.2f} -> {sizes[1]:.2f} MB, {len(calibration[name])} samples")
        print("  dB: " + ", ".join(f"{output} {value:.1f}" for output, value in quality[name].items()))
        print("  float: " + (", ".join(float_nodes_left(paths[1])) or "nothing"))
    return quality


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bundle", type=Path, default=Path(".data/bundles/densepose-b-fp32"))
    parser.add_argument("--out", type=Path, default=Path("sdk/models/densepose-b-int8"))
    parser.add_argument("--name", help="default: the folder's name")
    parser.add_argument("--data", type=Path, default=Path(".data/people/train"), help="calibration shards")
    parser.add_argument("--photos", type=Path, help="calibrate on these shards too (export.teachers.shards)")
    parser.add_argument("--held-out", type=Path, default=Path(".data/people/val"), help="shards to measure on")
    parser.add_argument("--settings", type=Path, default=Path(__file__).with_name("densepose.toml"))
    options = parser.parse_args()
    settings = read_settings(options.settings)
    source = open_bundle(options.bundle)
    records = spread(data.load_records(options.data), settings.calibration_images)
    if options.photos:
        records += spread(data.load_records(options.photos), settings.calibration_photos)
    held_out = spread(data.load_records(options.held_out), settings.held_out_images)
    quality = quantise_bundle(source, options.out, settings, records, held_out)
    info = bundle_format.BundleInfo(
        name=options.name or options.out.name,
        precision="int8",
        version=source.manifest["version"],
        training_data=tuple(source.manifest["training_data"]),
        measured={
            "sqnr_db": {
                graph: {output: round(value, 1) for output, value in outputs.items()}
                for graph, outputs in quality.items()
            }
        },
    )
    bundle_format.write_manifest(options.out, info, source.network, source.decode)
    sizes = [bundle_format.bytes_of(folder) / 1e6 for folder in (options.bundle, options.out)]
    print(f"{options.out}: {sizes[0]:.2f} -> {sizes[1]:.2f} MB")


if __name__ == "__main__":
    main()
