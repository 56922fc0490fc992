"""Bits of frames through the C API are those of torch and of the reference in Python."""

from pathlib import Path

import maquette
import numpy as np
import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")
if not maquette.library_path().exists():
    pytest.skip(f"{maquette.library_path()} is not built: run `make build`", allow_module_level=True)

import torch

from export.bundle import BundleInfo
from export.clips.shapes import shapes_clip
from export.prediction.code_file import read_code_file
from export.prediction.export_onnx import export_bundle
from export.prediction.table import CodeTable, bits_of_stream
from export.prediction.train_autoencoder import load_autoencoder

WEIGHTS = Path("export/weights/prediction-autoencoder.pt")


@pytest.fixture(scope="module")
def clips():
    return [shapes_clip("test", k, large=False).small.rgb for k in range(3)]


def bits_of(novelty: maquette.Novelty, frames: np.ndarray) -> np.ndarray:
    """[T - 1, 16, 16]."""
    novelty.reset()
    return np.stack([novelty.push(np.ascontiguousarray(f), time_s=t / 10).map for t, f in enumerate(frames)])[1:]


def test_cells_of_test_clips_have_the_bits_of_torch(clips, tmp_path):
    net = load_autoencoder(WEIGHTS)
    codes = [net.encode(torch.from_numpy(frames)) for frames in clips]
    table = CodeTable.counted(torch.stack(codes), net.shape.entries)
    export_bundle(net, table, tmp_path, BundleInfo("whole", "fp32"))
    stored = read_code_file(tmp_path / "codes.maqc")
    novelty = maquette.Novelty(bundle_path=tmp_path, threads=1)
    equal, cells = 0, 0
    for frames, of_torch in zip(clips, codes, strict=True):
        expected = bits_of_stream(stored.frequency_bits, stored.after_bits, of_torch.numpy()).mean(1)
        found = bits_of(novelty, frames)
        equal += int((np.abs(found - expected) < 1e-3).sum())
        cells += found.size
    # A cell has four codes in each of two frames, and remembers: one code in a thousand that differs shows in more.
    assert equal >= 0.999 * cells, f"{cells - equal} of {cells} cells differ"


def test_what_was_seen_is_the_image_that_torch_makes_of_the_codes(clips, tmp_path):
    net = load_autoencoder(WEIGHTS)
    codes = net.encode(torch.from_numpy(clips[0]))
    export_bundle(net, CodeTable.counted(codes[None], net.shape.entries), tmp_path, BundleInfo("whole", "fp32"))
    novelty = maquette.Novelty(bundle_path=tmp_path, threads=1)
    psnr_db = []
    for t in (0, 14, 29):
        novelty.push(np.ascontiguousarray(clips[0][t]), time_s=t / 10)
        expected = net.decode(codes[t : t + 1])[0].numpy().clip(0, 255).round()
        squares = np.mean((novelty.reconstruction().pixels().astype(np.float64) - expected) ** 2)
        psnr_db.append(10 * np.log10(255**2 / max(squares, 1e-3)))
    # One code of a thousand may differ by a near tie, which shows in its cell.
    assert np.median(psnr_db) >= 50, psnr_db


def test_the_shipped_bundle_finds_a_cut_between_clips_and_nothing_in_them(clips):
    novelty = maquette.Novelty(threads=1)
    frames = np.concatenate([clips[0][:20], clips[1][:20]])
    scores = [novelty.push(np.ascontiguousarray(frame), time_s=t / 10) for t, frame in enumerate(frames)]
    assert [t for t, score in enumerate(scores) if score.is_cut] == [20]
    assert scores[20].is_event
    assert scores[0].is_stream_start
    assert not any(score.is_stream_start for score in scores[1:])
