"""Graphs of the autoencoder agree with torch, and files of codes keep what they are given or say what is wrong."""

import json

import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")

import numpy as np
import torch

from export.bundle import BundleInfo
from export.densepose.graphs import session
from export.prediction.autoencoder import Autoencoder
from export.prediction.bundle import CODES, write_manifest
from export.prediction.code_file import HEAD, STEPS_OF_BIT, CodeFileError, code_bytes, read_code_file
from export.prediction.config import AutoencoderShape
from export.prediction.export_onnx import export_bundle
from export.prediction.table import CodeTable

SMALL = AutoencoderShape(widths=(8, 16), residual=8, blocks=1, slices=2, entries=16)


@pytest.fixture
def bundle(tmp_path):
    torch.manual_seed(0)
    net = Autoencoder(SMALL).eval()
    table = CodeTable.counted(torch.randint(16, (3, 5, 2, 16, 16)), 16)
    differences = export_bundle(net, table, tmp_path, BundleInfo("small", "fp32"))
    return tmp_path, net, table, differences


def test_graphs_give_the_codes_and_images_of_torch(bundle):
    folder, net, _, differences = bundle
    assert max(differences.values()) < 1e-4
    frames = torch.randint(0, 256, (4, 64, 64, 3), dtype=torch.uint8)
    expected = net.encode(frames)
    encoder, decoder = session(folder / "encoder.onnx"), session(folder / "decoder.onnx")
    entries = read_code_file(folder / CODES).entries
    for frame, codes in zip(frames, expected, strict=True):
        (features,) = encoder.run(None, {"image": frame[None].numpy().astype(np.float32)})
        slices = features.reshape(16, 16, 2, 8)
        distance = ((slices[:, :, :, None] - entries) ** 2).sum(-1)
        assert (distance.argmin(-1) == codes.permute(1, 2, 0).numpy()).mean() > 0.998, "equal but for near ties"
        picked = np.stack([entries[k][codes[k].numpy()] for k in range(2)], 2).reshape(1, 16, 16, 16)
        (image,) = decoder.run(None, {"features": picked})
        assert np.abs(image - net.decode(codes[None]).numpy()).max() < 0.05


def test_the_file_keeps_entries_and_bits(bundle):
    folder, net, table, _ = bundle
    codes = read_code_file(folder / CODES)
    assert (codes.entries == net.codebook.entries.numpy()).all()
    assert codes.side == 16
    for bits, logs in ((codes.frequency_bits, table.frequency), (codes.after_bits, table.after)):
        expected = np.minimum(-logs.numpy() / np.log(2), 255 / STEPS_OF_BIT)
        assert np.abs(bits - expected).max() <= 0.5 / STEPS_OF_BIT + 1e-5
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["task"] == "prediction"
    assert manifest["frame_px"] == 64
    assert set(manifest["files"]) == {"encoder.onnx", "decoder.onnx", CODES}


def test_a_damaged_file_is_refused(bundle, tmp_path):
    data = (bundle[0] / CODES).read_bytes()
    path = tmp_path / "damaged.maqc"
    places = [0, 7, 8, 12, 16, 24, HEAD.itemsize - 1, HEAD.itemsize, len(data) // 2, len(data) - 1]
    for at in places:
        path.write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
        with pytest.raises(CodeFileError):
            read_code_file(path)
    for length in (0, 7, HEAD.itemsize, len(data) - 1):
        path.write_bytes(data[:length])
        with pytest.raises(CodeFileError):
            read_code_file(path)


def test_what_cannot_be_a_file_is_refused():
    entries, frequency, after = np.zeros((2, 4, 3)), np.full((2, 4), -1.0), np.full((2, 4, 4), -1.0)
    code_bytes(entries, frequency, after, 16)
    for wrong in (
        (np.full((2, 4, 3), np.nan), frequency, after, 16),
        (entries, np.full((2, 4), 0.5), after, 16),
        (entries, frequency, np.full((2, 4, 4), np.nan), 16),
        (entries, frequency[:1], after, 16),
        (entries, frequency, after, 0),
        (np.zeros((17, 4, 3)), np.zeros((17, 4)), np.zeros((17, 4, 4)), 16),
    ):
        with pytest.raises(CodeFileError):
            code_bytes(*wrong)


def test_codes_of_another_network_are_refused(bundle):
    folder = bundle[0]
    (folder / CODES).write_bytes(code_bytes(np.zeros((2, 4, 3)), np.zeros((2, 4)), np.zeros((2, 4, 4)), 16))
    with pytest.raises(ValueError, match="2 x 3 numbers"):
        write_manifest(folder, BundleInfo("small", "fp32"))
