"""Another backbone learns what the neck makes of the first one's maps; the heads stay."""

import json

import pytest
import torch
from rectangle_people import write_shard

from export.densepose import distill_backbone
from export.densepose.config import NetworkConfig
from export.densepose.network import MobileParsingRCNN


@pytest.fixture(autouse=True)
def small(monkeypatch, one_thread, signal_handlers):
    monkeypatch.setattr(distill_backbone, "SIZES", (64,))
    monkeypatch.setattr(distill_backbone, "HELD_OUT_BATCHES", 1)


@pytest.fixture
def folder(tmp_path):
    """Shards, and `old.pt`: weights of a small network."""
    write_shard(tmp_path / "people" / "train", 4)
    write_shard(tmp_path / "people" / "val", 2, seed=1)
    torch.manual_seed(0)
    config = NetworkConfig(width=16, evidence=4)
    kind = {"width": 16, "backbone": config.backbone, "axis": False, "evidence": 4}
    torch.save({"ema": MobileParsingRCNN(config).state_dict(), **kind}, tmp_path / "old.pt")
    return tmp_path


def run(monkeypatch, folder, *options: str) -> dict:
    """The weights after one call of the program."""
    given = ["distill", "--init", str(folder / "old.pt"), "--data", str(folder / "people"), "--batch", "2", "--no-bf16"]
    monkeypatch.setattr("sys.argv", [*given, "--out", str(folder / "run"), *options])
    distill_backbone.main()
    return torch.load(folder / "run" / "weights.pt", weights_only=True)


def test_backbone_and_neck_learn_and_the_heads_stay(monkeypatch, folder):
    saved = run(monkeypatch, folder, "--steps", "2")
    assert saved["backbone"] == "mobilenet_v3_large"
    net = MobileParsingRCNN(NetworkConfig.of(saved))
    net.load_state_dict(saved["ema"])
    old = torch.load(folder / "old.pt", weights_only=True)["ema"]
    for name, value in saved["ema"].items():
        if name.startswith(("rpn.", "box_head.", "dense_head.")):
            torch.testing.assert_close(value, old[name].half() if value.is_floating_point() else old[name])
    assert not torch.allclose(saved["ema"]["neck.conv.o2.1.weight"], old["neck.conv.o2.1.weight"].half(), atol=1e-4)


def test_a_run_goes_on_where_it_stopped_and_logs_what_is_missed(monkeypatch, folder):
    run(monkeypatch, folder, "--steps", "1")
    run(monkeypatch, folder, "--steps", "2")
    last = json.loads((folder / "run" / "log.json").read_text())[-1]
    assert last["step"] == 2
    assert set(distill_backbone.FIGURES) <= set(last)


def test_a_copy_misses_nothing_and_a_constant_all():
    wanted = {"p2": torch.randn(2, 3, 8, 8)}
    constant = {"p2": wanted["p2"].mean((0, 2, 3), keepdim=True).expand(2, 3, 8, 8)}
    assert distill_backbone.missed(wanted, wanted)["p2"] == 0
    assert distill_backbone.missed(constant, wanted)["p2"].item() == pytest.approx(1)


def test_the_start_gives_the_backbone_alone(monkeypatch, folder):
    torch.manual_seed(3)
    config = NetworkConfig(width=16, backbone="mobilenet_v3_large")
    start = MobileParsingRCNN(config).state_dict()
    torch.save({"ema": start, "width": 16, "backbone": config.backbone}, folder / "start.pt")
    saved = run(monkeypatch, folder, "--steps", "1", "--start", str(folder / "start.pt"), "--lr", "0")
    name = "backbone.blocks.3.block.0.0.weight"
    torch.testing.assert_close(saved["ema"][name], start[name].half())
