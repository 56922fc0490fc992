"""Training learns, resumes where it stopped, and stops when it is told to."""

import copy
import json
import os
import signal

import cv2
import numpy as np
import pytest
import torch
from rectangle_people import write_shard

from export import training
from export.densepose import data, train
from export.densepose.config import NetworkConfig
from export.densepose.losses import PixelHead, _dense_terms, batch_loss, surface_loss
from export.densepose.network import MobileNetV2, MobileParsingRCNN
from export.shards import load_records


@pytest.fixture(scope="module")
def shards(tmp_path_factory):
    folder = tmp_path_factory.mktemp("people")
    write_shard(folder / "train", 8)
    write_shard(folder / "val", 2, seed=1)
    return folder


@pytest.fixture(autouse=True)
def short_images(monkeypatch, one_thread, signal_handlers):
    monkeypatch.setitem(train.RECIPES, "scratch", (train.Stage(0.0, (96,)),))


def run(monkeypatch, shards, out, *options, stop_after=None) -> list[float]:
    """Losses of the steps of one call of the training's main program."""
    losses = []

    def recorded(*given):
        terms = batch_loss(*given)
        losses.append(sum(terms.values()).item())
        if len(losses) == stop_after:
            os.kill(os.getpid(), signal.SIGTERM)
        return terms

    monkeypatch.setattr(train, "batch_loss", recorded)
    given = ["train", "--data", str(shards), "--out", str(out), "--batch", "2", "--width", "16"]
    monkeypatch.setattr("sys.argv", [*given, "--threads", "1", "--no-bf16", *options])
    train.main()
    return losses


def test_a_resumed_run_goes_on_exactly_as_one_that_never_stopped(monkeypatch, shards, tmp_path):
    straight = run(monkeypatch, shards, tmp_path / "straight", "--steps", "4")
    first = run(monkeypatch, shards, tmp_path / "stopped", "--steps", "4", stop_after=2)
    second = run(monkeypatch, shards, tmp_path / "stopped", "--steps", "4")
    assert len(first) == len(second) == 2
    assert first + second == pytest.approx(straight, rel=1e-5)


def test_a_pretrained_backbone_keeps_its_first_layers_and_its_norms(monkeypatch, shards, tmp_path):
    torch.manual_seed(9)
    pretrained = MobileNetV2().state_dict()
    torch.save(pretrained, tmp_path / "backbone.pt")
    run(monkeypatch, shards, tmp_path / "run", "--steps", "2", "--pretrained", str(tmp_path / "backbone.pt"))
    run(monkeypatch, shards, tmp_path / "run", "--steps", "3")  # goes on as it began
    run(monkeypatch, shards, tmp_path / "next", "--steps", "1", "--init", str(tmp_path / "run" / "weights.pt"))
    for name in ("run", "next"):
        saved = torch.load(tmp_path / name / "weights.pt", weights_only=True)
        found = {key: saved["ema"][f"backbone.{key}"] for key in pretrained}
        assert saved["frozen"]
        for key, value in pretrained.items():
            if key.startswith(("stem.", "blocks.0.", "blocks.1.")) or "running" in key:
                torch.testing.assert_close(found[key].float(), value.float(), rtol=1e-3, atol=1e-5)
        assert not torch.allclose(
            found["blocks.9.expand.conv.weight"].float(), pretrained["blocks.9.expand.conv.weight"]
        )


def test_weights_of_another_backbone_are_left_out_and_freeze_nothing(monkeypatch, shards, tmp_path, capsys):
    torch.save(MobileNetV2().state_dict(), tmp_path / "backbone.pt")
    run(monkeypatch, shards, tmp_path / "v2", "--steps", "1", "--pretrained", str(tmp_path / "backbone.pt"))
    first = str(tmp_path / "v2" / "weights.pt")
    run(monkeypatch, shards, tmp_path / "v3", "--steps", "1", "--init", first, "--backbone", "mobilenet_v3_large")
    assert "untrained: backbone.blocks" in capsys.readouterr().out
    saved = torch.load(tmp_path / "v3" / "weights.pt", weights_only=True)
    assert (saved["backbone"], saved["frozen"]) == ("mobilenet_v3_large", False)


@pytest.mark.curves
def test_a_run_leaves_checkpoint_weights_log_and_curves_and_is_not_trained_on(monkeypatch, shards, tmp_path):
    assert len(run(monkeypatch, shards, tmp_path, "--steps", "1")) == 1
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"checkpoint.pt", "weights.pt", "log.json", "curves.png"}
    last = json.loads((tmp_path / "log.json").read_text())[-1]
    assert {"recall", "precision", "part", "mask_iou"} <= set(last)
    # Weights alone, without code: other programs load them the safe way.
    saved = torch.load(tmp_path / "weights.pt", weights_only=True)
    MobileParsingRCNN(NetworkConfig.of(saved)).load_state_dict(saved["ema"])
    torch.load(tmp_path / "checkpoint.pt", weights_only=True)
    assert cv2.imread(str(tmp_path / "curves.png")).std() > 1
    assert run(monkeypatch, shards, tmp_path, "--steps", "1") == []


def test_a_run_learns_the_surface_first_and_resumes_across_the_stages(monkeypatch, shards, tmp_path):
    stages = (train.Stage(0.0, (64,), data.CLOSE_CROPPING, surface_only=True), train.Stage(0.5, (96,)))
    monkeypatch.setitem(train.RECIPES, "scratch", stages)
    surface = []
    monkeypatch.setattr(train, "surface_loss", lambda *given: surface.append(1) or surface_loss(*given))
    straight = run(monkeypatch, shards, tmp_path / "straight", "--steps", "6")
    assert (len(surface), len(straight)) == (3, 3)
    first = run(monkeypatch, shards, tmp_path / "stopped", "--steps", "6", stop_after=1)
    second = run(monkeypatch, shards, tmp_path / "stopped", "--steps", "6")
    assert (len(surface), len(first)) == (6, 1)
    assert first + second == pytest.approx(straight, rel=1e-5)


def test_the_surface_alone_is_learnt_on_a_few_images(shards):
    torch.manual_seed(0)
    image, truths = data.Batches(load_records(shards / "train"), 4, seed=0).make(0, (96,), data.CLOSE_CROPPING)
    net = MobileParsingRCNN(NetworkConfig(width=16)).train()
    trained = torch.nn.ModuleList([net, PixelHead(net.config)])
    optimiser = torch.optim.AdamW(trained.parameters(), lr=3e-3)
    history = []
    for _ in range(16):
        terms = surface_loss(net, image, truths, torch.autocast("cpu", enabled=False), trained[1])
        optimiser.zero_grad()
        sum(terms.values()).backward()
        optimiser.step()
        history.append({name: value.item() for name, value in terms.items()})
    assert set(history[0]) == {"pixel_index", "pixel_u", "pixel_v"}
    for name in history[0]:
        assert history[-1][name] < 0.8 * history[0][name], name
    # Boxes and RoIs are left for later: their heads get nothing from it.
    learning = {name.split(".")[0] for name, p in net.named_parameters() if p.grad is not None}
    assert learning == {"backbone", "neck"}


def test_close_crops_show_people_larger(shards):
    records = load_records(shards / "train")
    covered = {}
    for cropping in (data.ANY_CROPPING, data.CLOSE_CROPPING):
        rng = np.random.default_rng(0)
        labels = [data.augmented(r, 96, rng, cropping)[1] for r in records for _ in range(8)]
        covered[cropping] = np.mean([(label[..., 0] > 0).mean() for label in labels])
    assert covered[data.CLOSE_CROPPING] > 1.2 * covered[data.ANY_CROPPING]


def test_the_loss_falls_on_a_few_images(shards):
    torch.manual_seed(0)
    batches = data.Batches(load_records(shards / "train"), 4, seed=0)
    fixed = [batches.make(k, (96,)) for k in range(2)]
    net = MobileParsingRCNN(NetworkConfig(width=16)).train()
    optimiser = torch.optim.AdamW(net.parameters(), lr=3e-3)
    autocast = torch.autocast("cpu", enabled=False)
    history = []
    for step in range(24):
        terms = batch_loss(net, *fixed[step % 2], autocast)
        loss = sum(terms.values())
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), 10.0)
        optimiser.step()
        history.append({name: value.item() for name, value in terms.items()})
    first, last = ({n: np.mean([h[n] for h in part]) for n in history[0]} for part in (history[:2], history[-2:]))
    assert sum(last.values()) < 0.6 * sum(first.values())
    for name in ("rpn_class", "box_class", "coarse", "index", "u", "v"):
        assert last[name] < first[name], name


def test_every_weight_gets_a_gradient(shards):
    torch.manual_seed(0)
    net = MobileParsingRCNN(NetworkConfig(width=16)).train()
    image, truths = data.Batches(load_records(shards / "train"), 4, seed=0).make(0, (96,))
    sum(batch_loss(net, image, truths, torch.autocast("cpu", enabled=False)).values()).backward()
    assert [name for name, p in net.named_parameters() if p.grad is None] == []


def test_images_without_people_can_be_learnt_from():
    net = MobileParsingRCNN(NetworkConfig(width=16)).train()
    label = np.zeros((64, 64, 4), np.uint8)
    truths = [data.truth_of(label), data.truth_of(label)]
    terms = batch_loss(net, torch.randn(2, 3, 64, 64), truths, torch.autocast("cpu", enabled=False))
    loss = sum(terms.values())
    assert torch.isfinite(loss)
    loss.backward()


def test_bfloat16_is_taken_where_a_probe_says_so_and_survives(monkeypatch):
    assert training.bf16_pays() in (False, True)
    for probe, pays in (
        ("raise SystemExit(0)", True),
        ("raise SystemExit(1)", False),
        ("import os, signal; os.kill(os.getpid(), signal.SIGILL)", False),
    ):
        monkeypatch.setattr(training, "_BF16_PROBE", probe)
        assert training.bf16_pays() == pays


def test_averaged_weights_follow_slowly():
    net = torch.nn.Linear(2, 2)
    mean = training.Ema(net, decay=0.5)
    before = mean.net.weight.clone()
    with torch.no_grad():
        net.weight += 1
    mean.update(net, step=100)
    assert torch.allclose(mean.net.weight, before + 0.5)


def test_gradients_averaged_over_processes_move_weights_as_alone(tmp_path):
    """Channels-last weights under the fused optimiser, which reads gradients as they lie in memory."""
    torch.manual_seed(0)
    alone = torch.nn.Conv2d(6, 8, 3).to(memory_format=torch.channels_last)
    shared = copy.deepcopy(alone)
    image = torch.randn(4, 6, 9, 9)
    torch.distributed.init_process_group("gloo", init_method=f"file://{tmp_path}/meet", rank=0, world_size=1)
    try:
        for layer in (alone, shared):
            optimiser = torch.optim.AdamW(layer.parameters(), lr=0.01, fused=True)
            for _ in range(3):
                optimiser.zero_grad()
                layer(image)[:, :4].square().sum().backward()
                if layer is shared:
                    assert training.average_gradients(list(layer.parameters()), 2.5, False, 1) == (2.5, False)
                optimiser.step()
    finally:
        torch.distributed.destroy_process_group()
    assert torch.allclose(alone.weight, shared.weight, atol=1e-6)


def test_the_index_is_asked_about_body_pixels_alone():
    torch.manual_seed(0)
    label = torch.zeros(2, 4, 4, 3, dtype=torch.uint8)
    label[:, 1:3, 1:3, 0] = 7
    coarse, index, u, v = (
        torch.randn(2, 15, 4, 4),
        torch.randn(2, 25, 4, 4),
        torch.zeros(2, 25, 4, 4),
        torch.zeros(2, 25, 4, 4),
    )
    index.requires_grad_()
    _dense_terms([coarse, index, u, v], label)["index"].backward()
    assert index.grad[:, 1:, 1:3, 1:3].abs().min() > 0
    assert not index.grad[:, 0].any()
    assert not index.grad[:, :, 0].any()
    assert _dense_terms([coarse, index, u, v], torch.zeros_like(label))["index"] == 0
