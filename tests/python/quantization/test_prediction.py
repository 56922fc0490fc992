"""An int8 bundle of prediction has the codes and images of the fp32 one, nearly."""

import json
from pathlib import Path

import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")

import numpy as np
import torch

from export.bundle import BundleInfo
from export.clips.clip import write_clip
from export.clips.shapes import shapes_clip
from export.densepose.graphs import session
from export.prediction.autoencoder import Autoencoder
from export.prediction.bundle import CODES, TRANSFORMER
from export.prediction.codes import CodedClips, write_codes
from export.prediction.config import AutoencoderShape, TransformerShape
from export.prediction.export_onnx import export_bundle
from export.prediction.table import CodeTable
from export.prediction.transformer import LatentTransformer
from quantization import prediction

SMALL = AutoencoderShape(widths=(16, 32), residual=16, blocks=1, slices=2, entries=16)


SHAPE = TransformerShape(
    width=32, layers=2, heads=2, head_width=16, hidden=64, embedding=16, slices=2, entries=16, motion=True
)


@torch.no_grad()
def transformer(table: CodeTable) -> LatentTransformer:
    net = LatentTransformer(SHAPE)
    for parameter in net.parameters():  # heads and biases begin at zero
        parameter.add_(0.1 * torch.randn_like(parameter))
    net.context.rows.weight[-1] = 0
    net.table.copy_(table.stacked())
    return net.eval()


def assert_samples_do_not_depend_on_each_other(int8: Path) -> None:
    rng = np.random.default_rng(1)
    graph = session(int8 / "slices.onnx")
    sizes = {"samples": 3, "rows": 1, "kept": 5, "kept_and_rows": 6}
    given = {i.name: rng.standard_normal([sizes.get(n, n) for n in i.shape]).astype(np.float32)
             for i in graph.get_inputs()}  # fmt: skip
    given["near"][2] *= 10
    alone = {name: array if name.startswith("bias") else array[:1] for name, array in given.items()}
    for one, other in zip(graph.run(None, alone), graph.run(None, given), strict=True):
        np.testing.assert_array_equal(one, other[:1])
    head = session(int8 / "head_1.onnx")
    features, earlier = rng.standard_normal((2, 3, 1, SHAPE.width)).astype(np.float32)
    features[2] *= 10
    one = head.run(None, {"features": features[:1], "earlier": earlier[:1]})[0]
    np.testing.assert_array_equal(one, head.run(None, {"features": features, "earlier": earlier})[0][:1])


def test_int8_keeps_codes_images_and_bits(tmp_path, monkeypatch):
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
    export_bundle(net, table, fp32, BundleInfo("small", "fp32"), transformer(table))
    codes = torch.randint(16, (2, 6, 2, 16, 16), dtype=torch.int16)
    codes[:, 1:] = torch.where(torch.rand(codes[:, 1:].shape) < 0.7, codes[:, :1], codes[:, 1:])
    motion = codes[:, :, None].expand(-1, -1, 5, -1, -1, -1)
    (tmp_path / "codes").mkdir()
    for split in ("train", "val"):
        own = CodedClips(codes, torch.tensor([10.0, 30.0]), ["a", "b"], motion)
        write_codes(own, tmp_path / f"codes/codes-{split}.npz")
    monkeypatch.setattr("sys.argv", [
        "prediction", "--fp32", str(fp32), "--out", str(int8), "--data", str(tmp_path / "clips"), "--sets", "shapes",
        "--codes", str(tmp_path / "codes"),
    ])  # fmt: skip
    prediction.main()
    manifest = json.loads((int8 / "manifest.json").read_text())
    measured = manifest["measured"]["int8_cost"]
    assert measured["equal_codes"] > 0.9
    assert measured["psnr_db_int8"] == pytest.approx(measured["psnr_db_fp32"], abs=0.3)
    assert measured["bits_int8"] == pytest.approx(measured["bits_fp32"], rel=0.02)
    assert_samples_do_not_depend_on_each_other(int8)
    assert manifest["precision"] == "int8"
    assert manifest["transformer"] == {"file": TRANSFORMER, "fps": [10, 30]}
    assert (int8 / CODES).read_bytes() == (fp32 / CODES).read_bytes()
    for name in ("encoder.onnx", TRANSFORMER):  # graphs of such small transformers are hardly weights
        sizes = [(folder / name).stat().st_size for folder in (fp32, int8)]
        assert sizes[1] < 0.8 * sizes[0], name

    # The autoencoder of another bundle of the same codes is taken as it is; of one with other codes it is refused.
    again = tmp_path / "again"
    words = [
        "prediction",
        "--fp32",
        str(fp32),
        "--out",
        str(again),
        "--keep",
        str(int8),
        "--codes",
        str(tmp_path / "codes"),
    ]
    monkeypatch.setattr("sys.argv", words)
    prediction.main()
    for name in ("encoder.onnx", "decoder.onnx", TRANSFORMER):
        assert (again / name).read_bytes() == (int8 / name).read_bytes(), name
    assert json.loads((again / "manifest.json").read_text())["measured"] == manifest["measured"]
    (int8 / CODES).write_bytes(b"others")
    with pytest.raises(SystemExit, match="other codes"):
        prediction.main()
