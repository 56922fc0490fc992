"""An int8 bundle of prediction has the codes and pictures of the fp32 one, nearly."""

import json

import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")

import torch

from export.bundle import BundleInfo
from export.clips.clip import write_clip
from export.clips.shapes import shapes_clip
from export.prediction.autoencoder import Autoencoder
from export.prediction.bundle import CODES
from export.prediction.config import AutoencoderShape
from export.prediction.export_onnx import export_bundle
from export.prediction.table import CodeTable
from quantization import prediction

SMALL = AutoencoderShape(widths=(16, 32), residual=16, blocks=1, slices=2, entries=16)


def test_int8_keeps_codes_and_pictures(tmp_path, monkeypatch):
    for split in ("train", "val"):
        folder = tmp_path / "clips/shapes" / split
        folder.mkdir(parents=True)
        write_clip(shapes_clip(split, 0, large=False), folder / "clip-00000.npz")
    torch.manual_seed(0)
    net = Autoencoder(SMALL)
    frames = torch.from_numpy(shapes_clip("train", 0, large=False).small.rgb)
    net.train()(frames.permute(0, 3, 1, 2) / 127.5 - 1)  # entries lie where features are
    net.eval()
    table = CodeTable.counted(torch.randint(16, (3, 5, 2, 16, 16)), 16)
    fp32, int8 = tmp_path / "fp32", tmp_path / "int8"
    export_bundle(net, table, fp32, BundleInfo("small", "fp32"))
    monkeypatch.setattr("sys.argv", [
        "prediction", "--fp32", str(fp32), "--out", str(int8), "--data", str(tmp_path / "clips"), "--sets", "shapes",
    ])  # fmt: skip
    prediction.main()
    manifest = json.loads((int8 / "manifest.json").read_text())
    measured = manifest["measured"]["int8_cost"]
    assert measured["equal_codes"] > 0.9
    assert measured["psnr_db_int8"] == pytest.approx(measured["psnr_db_fp32"], abs=0.3)
    assert manifest["precision"] == "int8"
    assert (int8 / CODES).read_bytes() == (fp32 / CODES).read_bytes()
    sizes = [(folder / "encoder.onnx").stat().st_size for folder in (fp32, int8)]
    assert sizes[1] < sizes[0]
