"""An int8 bundle of heads: what it is made of, what it says of its losses, and what is refused."""

import contextlib
import io
import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("igl", reason="the extra `heads` is not installed")
import cv2
import torch
from small_prior import small_prior

from export.bundle import BundleInfo, read_manifest
from export.heads.bundle import write_manifest
from export.heads.encoder_data import Crop
from export.heads.export_onnx import export_encoder
from export.heads.head_shards import POINT_SCALE, HeadImages, HeadPoints
from export.heads.prior import PriorError
from export.heads.prior_file import read_prior, write_prior
from export.heads.train_prior import HeadTensors
from quantization import heads
from quantization.analysis.errors import float_nodes_left
from quantization.heads import bases_cost, float_prior, metrics_of, parts_sqnr, spread
from quantization.settings import HEADS, HeadSettings, read_settings

pytestmark = pytest.mark.usefixtures("one_thread", "fixed_seed")
SETTINGS = """
bases = "int8"
crops = 3
held_out_crops = 4
fitted_heads = 2
[encoder]
float_nodes = ["/predict/*", "/points/*", "/first_place/*"]
"""


def ball_images(views: int, seed: int) -> HeadImages:
    """Images of a ball, whose template points are where they are seen."""
    rng = np.random.default_rng(seed)
    y, x = (np.mgrid[:256, :256] - 127.5) / 80
    masks = np.where(x * x + y * y < 1, 255, 0).astype(np.uint8)
    rgb = (np.dstack([x, y, x * y]) * 40 + rng.uniform(60, 190, 3)).clip(0, 255).astype(np.uint8)
    template = (np.dstack([x, 0 * x - 1, -y])[::2, ::2] * POINT_SCALE).clip(-32767, 32767).astype(np.int16)
    normal = np.where(masks[::2, ::2, None] > 0, np.array([0, 0, -127]), 0).astype(np.int8)
    stacked = [np.repeat(one[None], views, 0) for one in (rgb, masks, template, normal)]
    return HeadImages(*stacked, *(np.zeros((views, *size)) for size in ((3, 3), (3,), (3,))))


def ball_points(seed: int) -> HeadPoints:
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=(300, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    near, far = normal * rng.normal(1.2, 0.1, (300, 1)), rng.uniform(-2, 2, (50, 3))
    distances = [np.linalg.norm(points, axis=1) - 1.2 for points in (near, far)]
    floats = [1.2 * normal, normal, 1.2 * normal, near, distances[0], far, distances[1], normal[:20], normal[:20]]
    floats = [array.astype(np.float32) for array in floats]
    return HeadPoints(*floats[:3], np.full((300, 3), 90, np.uint8), *floats[3:])


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """A folder with images and points of two heads a split, and photographs."""
    folder = tmp_path_factory.mktemp("data")
    for k, split in enumerate(("train", "val")):
        for kind, made in (("views", lambda seed: ball_images(6, seed)), ("points", ball_points)):
            (folder / kind / split).mkdir(parents=True)
            for number in range(2):
                stored = vars(made(10 * k + number))
                np.savez(folder / kind / split / f"head-{number:05}.npz", **stored)
        (folder / "photos" / split).mkdir(parents=True)
        noise = np.random.default_rng(k).integers(0, 255, (80, 90, 3)).astype(np.uint8)
        cv2.imwrite(str(folder / "photos" / split / "a.png"), noise)
    (folder / "heads.toml").write_text(SETTINGS)
    return folder


@pytest.fixture(scope="module")
def fp32(lively_encoder, tmp_path_factory):
    folder = tmp_path_factory.mktemp("fp32")
    export_encoder(lively_encoder(0), folder / "encoder.onnx")
    write_prior(small_prior(), folder / "prior.maqp", bases="float32")
    write_manifest(folder, BundleInfo("heads-fp32", "fp32", training_data=({"name": "balls"},)))
    return folder


def command(monkeypatch, fp32: Path, data: Path, out: Path, *more: str) -> None:
    options = ["--fp32", fp32, "--data", data, "--backgrounds", data / "photos", "--settings", data / "heads.toml"]
    monkeypatch.setattr(sys, "argv", ["heads", *map(str, options), "--out", str(out), *more])
    heads.main()


@pytest.fixture(scope="module")
def int8(fp32, data, tmp_path_factory):
    out = tmp_path_factory.mktemp("int8") / "heads-int8"
    with pytest.MonkeyPatch.context() as monkeypatch, contextlib.redirect_stdout(io.StringIO()) as said:
        command(monkeypatch, fp32, data, out)
    assert "bases, 2 heads, head: float16_mm" in said.getvalue()
    return out


def test_the_bundle_says_what_int8_costs(fp32, int8):
    out = int8
    assert sorted(path.name for path in out.iterdir()) == ["encoder.onnx", "manifest.json", "prior.maqp"]
    manifest = read_manifest(out)
    assert (manifest["task"], manifest["precision"], manifest["name"]) == ("heads", "int8", "heads-int8")
    assert manifest["training_data"] == [{"name": "balls"}]
    measured = manifest["measured"]
    assert set(measured["sqnr_db"]["encoder"]) == {"cells", "template_point", "log_sigma", "matte", "normal"}
    assert min(measured["sqnr_db"]["encoder"].values()) > 10
    assert measured["int8_cost"]["crops"] == 4
    costs = [measured["int8_cost"][name] for name in ("fp32", "int8")]
    assert set(costs[0]) == set(costs[1]) == set(heads.FIGURES)
    assert costs[0]["point_mm"] > 0
    assert costs[0] != costs[1]
    assert costs[0]["point_mm"] == pytest.approx(costs[1]["point_mm"], rel=0.2)
    assert measured["bases_cost"]["stored_as"] == "int8"
    assert 0 < measured["bases_cost"]["head"]["difference_mm"] < 20
    assert json.loads((out / "manifest.json").read_text())["prior"] == {"file": "prior.maqp"}
    assert (out / "encoder.onnx").stat().st_size < 0.4 * (fp32 / "encoder.onnx").stat().st_size
    parts = ("/first_place/", "/points/", "/predict/")
    assert {node[: node.rindex("/") + 1] for node in float_nodes_left(out / "encoder.onnx")} <= {
        *parts,
        "/points/linear/",
    }
    assert "/predict/MatMul" in float_nodes_left(out / "encoder.onnx")
    assert (out / "prior.maqp").stat().st_size < (fp32 / "prior.maqp").stat().st_size
    read_prior(out / "prior.maqp")


def test_a_new_encoder_takes_the_prior_of_a_bundle_over(fp32, int8, data, tmp_path, monkeypatch, lively_encoder):
    """Also where the float bundle has the prior in int8, and the old bundle is the one that is written."""
    out, other = shutil.copytree(int8, tmp_path / "heads-int8"), tmp_path / "other"
    before, prior, encoder = read_manifest(out), (out / "prior.maqp").read_bytes(), (out / "encoder.onnx").read_bytes()
    shutil.copytree(fp32, other)
    shutil.copy(out / "prior.maqp", other)
    export_encoder(lively_encoder(1), other / "encoder.onnx")
    write_manifest(other, BundleInfo("heads-fp32", "fp32", training_data=({"name": "cubes"},)))
    for target in (tmp_path / "new", out):
        command(monkeypatch, other, data, target, "--keep", str(out))
        manifest = read_manifest(target)
        assert (target / "prior.maqp").read_bytes() == prior
        assert (target / "encoder.onnx").read_bytes() != encoder
        assert manifest["measured"]["bases_cost"] == before["measured"]["bases_cost"]
        assert manifest["measured"]["int8_cost"] != before["measured"]["int8_cost"]
        assert manifest["training_data"] == [{"name": "cubes"}]


def test_bases_that_are_int8_already_are_refused(fp32, data, tmp_path, monkeypatch):
    write_prior(small_prior(), tmp_path / "prior.maqp")
    with pytest.raises(PriorError, match="int8 already"):
        float_prior(tmp_path / "prior.maqp")
    float_prior(fp32 / "prior.maqp")
    again = shutil.copytree(fp32, tmp_path / "again")
    shutil.copy(tmp_path / "prior.maqp", again)
    with pytest.raises(SystemExit, match=r"^Nothing was made int8: The bases in .* are int8 already"):
        command(monkeypatch, again, data, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_settings_of_bases_that_there_are_not_are_refused(fp32, data, tmp_path, monkeypatch):
    text = SETTINGS.replace('"int8"', '"int4"')
    (tmp_path / "heads.toml").write_text(text)
    with pytest.raises(SystemExit, match="bases 'int4' is not one of float32, float16, int8"):
        command(monkeypatch, fp32, data, tmp_path / "out", "--settings", str(tmp_path / "heads.toml"))


def test_the_settings_that_are_shipped_name_nodes_that_there_are(fp32):
    import onnx

    from quantization.quantize import matching_nodes

    settings = read_settings(HEADS, HeadSettings).graphs["encoder"]
    graph = onnx.load(fp32 / "encoder.onnx").graph
    assert "/predict/MatMul" in matching_nodes(graph, settings.float_nodes)


def test_a_table_shows_what_each_block_gains(fp32, data, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(heads, "blocks", lambda *_: ["/backbone/blocks.3/*"])
    command(monkeypatch, fp32, data, tmp_path / "out", "--blocks")
    assert not (tmp_path / "out").exists()
    lines = [line.split("│") for line in capsys.readouterr().out.splitlines() if "│" in line]
    rows = {line[1].strip(): line[2:-1] for line in lines}
    less = ["- /predict/*", "- /points/*", "- /first_place/*"]
    assert list(rows) == ["everything", "as the settings say", *less, "+ /backbone/blocks.3/*"]
    size, point_db = ({name: float(row[k]) for name, row in rows.items()} for k in (0, 1))
    assert size["everything"] > size["+ /backbone/blocks.3/*"] > size["as the settings say"]
    assert point_db["everything"] > point_db["as the settings say"] > point_db["- /predict/*"]


def test_the_noise_of_template_points_is_told_apart_from_that_of_logits():
    cells = torch.randn(2, 48, 48, 8)
    cells[..., 4] *= 1000
    changed = cells.clone()
    changed[..., :3] += 0.1 * torch.randn(2, 48, 48, 3)
    found = parts_sqnr(cells, changed)
    assert found["template_point"] == pytest.approx(20, abs=0.3)
    assert found["matte"] == found["normal"] == found["log_sigma"] == float("inf")


def test_metrics_are_in_millimetres_and_degrees():
    template = np.random.default_rng(0).normal(size=(48, 48, 3)).astype(np.float32)
    normal = np.broadcast_to(np.float32([0, 0, -1]), (48, 48, 3))
    crop = Crop(np.zeros((192, 192, 3), np.uint8), template, np.ones((48, 48), np.float32), normal)
    cells = torch.zeros(1, 48, 48, 8)
    cells[..., :3] = torch.from_numpy(template) + torch.tensor([0.03, 0.0, 0.04])
    cells[..., 4] = 1.0
    cells[..., 5:] = torch.tensor([0.0, 1.0, -1.0])
    found = metrics_of(cells, [crop])
    assert (found["median_mm"], found["point_mm"], found["matte_iou"]) == (5.0, 5.0, 1.0)
    assert found["normal_deg"] == pytest.approx(45, abs=0.01)


def test_bases_cost_nothing_where_they_are_stored_as_they_are_compared():
    tensors = HeadTensors([ball_points(1), ball_points(2)])
    same = bases_cost(small_prior(), "float16", tensors, steps=20)
    assert same["head"]["difference_mm"] == same["face"]["difference_mm"] == 0
    found = bases_cost(small_prior(), "int8", tensors, steps=20)
    assert found["head"]["difference_mm"] > 0
    assert found["head"]["float16_mm"] == same["head"]["float16_mm"]


def test_crops_are_spread_over_all_of_them():
    assert spread(list(range(10)), 4) == [0, 3, 6, 9]
    assert spread([1, 2], 5) == [1, 2]
