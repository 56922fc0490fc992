"""The bundle of a tuned refiner has the precision of the one that it was tuned from."""

import hashlib
import json
import sys

import numpy as np
import pytest

from export.bundle import BundleInfo
from export.scenes.bundle import write_manifest
from export.scenes.config import SIZES
from export.scenes.export_onnx import export
from export.scenes.networks.system import Networks
from quantization import tuned_bundle
from quantization.analysis.errors import float_nodes_left
from quantization.compare_refiners import made_up_rasters

pytestmark = pytest.mark.usefixtures("one_thread", "fixed_seed")


@pytest.mark.parametrize("precision", ["fp32", "int8"])
def test_only_an_int8_refiner_is_calibrated(tmp_path, monkeypatch, precision):
    networks = Networks(SIZES["small"]).eval()
    shipped, out, samples = (tmp_path / name for name in ("shipped", "out", "samples"))
    export(networks, shipped)
    write_manifest(shipped, BundleInfo("made", precision))
    samples.mkdir()
    np.savez(samples / "0.npz", **made_up_rasters(networks.refiner, 48, 64))
    command = ["tuned_bundle", "--refiner", shipped / "refiner.onnx", "--samples", samples]
    monkeypatch.setattr(sys, "argv", [*map(str, command), "--shipped", str(shipped), "--out", str(out)])
    tuned_bundle.main()
    manifest = json.loads((out / "manifest.json").read_text())
    assert (manifest["name"], manifest["precision"]) == ("made-tuned", precision)
    for name, entry in manifest["files"].items():
        assert hashlib.sha256((out / name).read_bytes()).hexdigest() == entry["sha256"]
    heavy, left = float_nodes_left(shipped / "refiner.onnx"), float_nodes_left(out / "refiner.onnx")
    assert left == (heavy if precision == "fp32" else [])
