"""Training of the scenes' networks learns, resumes where it stopped, and leaves what other programs need."""

import json
import os
import signal
from dataclasses import replace

import cv2
import numpy as np
import pytest
import torch
from box_scene import write_capture

from export.densepose.network import MobileNetV2
from export.scenes import samples, train
from export.scenes.bundle import with_earlier
from export.scenes.captures import read_captures
from export.scenes.config import SIZES
from export.scenes.losses import LossWeights, image_terms, own_rasters
from export.scenes.networks.system import Networks, load_networks
from export.scenes.perceptual import Perceptual
from export.scenes.samples import Sampling, draw_sample

pytestmark = pytest.mark.usefixtures("one_thread", "fixed_seed", "signal_handlers")

SAMPLING = Sampling(crop_px=64, sources=(2, 2), margin_px=32, long_side_px=96)


@pytest.fixture(scope="module")
def places(tmp_path_factory):
    folder = tmp_path_factory.mktemp("places")
    for split, seed in (("train", 0), ("val", 1)):
        write_capture(folder / split / "room", seed, views=5, width=96, height=64)
    return folder


def run(monkeypatch, places, out, *options, stop_after=None) -> list[float]:
    """Losses of the steps of one call of the training's main program."""
    losses, terms_of = [], train.batch_terms

    def recorded(*given):
        terms = terms_of(*given)
        losses.append(sum(terms.values()).item())
        if len(losses) == stop_after:
            os.kill(os.getpid(), signal.SIGTERM)
        return terms

    with monkeypatch.context() as patch:
        patch.setattr(train, "batch_terms", recorded)
        given = ["train", "--data", str(places), "--out", str(out), "--size", "tiny", "--batch", "1", "--threads", "1"]
        patch.setattr("sys.argv", [*given, "--crop", "64", "--sources", "2", "2", "--margin", "32", *options])
        train.main()
    return losses


def test_a_resumed_run_goes_on_exactly_as_one_that_never_stopped(monkeypatch, places, tmp_path):
    straight = run(monkeypatch, places, tmp_path / "straight", "--steps", "4")
    first = run(monkeypatch, places, tmp_path / "stopped", "--steps", "4", stop_after=2)
    second = run(monkeypatch, places, tmp_path / "stopped", "--steps", "4")
    assert len(first) == len(second) == 2
    assert first + second == pytest.approx(straight, rel=1e-5)
    assert run(monkeypatch, places, tmp_path / "stopped", "--steps", "4") == []


def test_a_run_leaves_checkpoint_weights_log_curves_and_sample(monkeypatch, places, tmp_path):
    torch.save(MobileNetV2().state_dict(), tmp_path / "trunk.pt")
    run(monkeypatch, places, tmp_path / "run", "--steps", "1", "--pretrained", str(tmp_path / "trunk.pt"))
    names = {path.name for path in (tmp_path / "run").iterdir()}
    assert names == {"checkpoint.pt", "weights.pt", "log.json", "curves.png", "sample.png"}
    log = json.loads((tmp_path / "run" / "log.json").read_text())
    assert {"quarter", "full", "perceptual"} == set(log[0]["terms"])
    assert {"psnr_db", "plain_psnr_db"} <= set(log[-1])
    assert cv2.imread(str(tmp_path / "run" / "sample.png")).shape == (64, 3 * 96, 3)
    assert load_networks(tmp_path / "run" / "weights.pt").config == SIZES["tiny"]


def test_another_size_does_not_go_on_with_a_run(monkeypatch, places, tmp_path):
    run(monkeypatch, places, tmp_path, "--steps", "1")
    with pytest.raises(SystemExit, match="--size tiny, not small"):
        run(monkeypatch, places, tmp_path, "--steps", "2", "--size", "small")


def test_a_run_begins_with_the_weights_of_another(monkeypatch, places, tmp_path):
    run(monkeypatch, places, tmp_path / "a", "--steps", "1")
    run(monkeypatch, places, tmp_path / "b", "--steps", "1", "--lr", "0", "--start", str(tmp_path / "a/weights.pt"))
    first, second = (load_networks(tmp_path / name / "weights.pt") for name in "ab")
    for (name, before), after in zip(first.named_parameters(), second.parameters(), strict=True):
        assert torch.equal(before, after), name


def test_targets_are_mostly_photos_that_the_cloud_was_not_made_of(places, monkeypatch):
    (capture,) = read_captures(places / "train")
    capture = replace(capture, held_out=frozenset({1}))
    drawn = []
    monkeypatch.setattr(samples, "drawn", lambda target, *_: drawn.append(target) or [0, 2])
    for seed in range(40):
        draw_sample([capture], SAMPLING, np.random.default_rng(seed))
    assert 25 <= drawn.count(1) < 40


def test_a_manifest_names_the_data_that_the_weights_before_learnt_from(tmp_path):
    of_both, of_one = ({"name": name, "licence": "CC0-1.0", "used_for": "training"} for name in ("a", "b"))
    (tmp_path / "manifest.json").write_text(json.dumps({"training_data": [of_both, of_one]}))
    assert with_earlier([of_both], tmp_path) == [of_both, of_one]


def test_a_few_steps_lower_the_loss_on_the_made_up_room(places):
    captures = read_captures(places / "train")
    rng = np.random.default_rng(0)
    samples = [draw_sample(captures, SAMPLING, rng) for _ in range(2)]
    networks = Networks(SIZES["tiny"]).train()
    optimiser = torch.optim.Adam(networks.parameters(), lr=2e-3)
    history = []
    for _ in range(70):
        torch.manual_seed(0)
        terms = train.batch_terms(networks, samples, LossWeights(), None)
        optimiser.zero_grad()
        sum(terms.values()).backward()
        optimiser.step()
        history.append({name: value.item() for name, value in terms.items()})
    for name in ("quarter", "full"):
        assert history[-1][name] < 0.93 * history[0][name], (name, history[0], history[-1])


def test_samples_depend_on_their_generator_alone_and_show_the_photo(places):
    captures = read_captures(places / "train")
    first, again = (draw_sample(captures, SAMPLING, np.random.default_rng(3)) for _ in range(2))
    assert torch.equal(first.target, again.target)
    assert first.target.shape == (3, 64, 64)
    assert len(first.sources.images) == 2
    assert 0.5 < first.mask.mean() <= 1
    other = draw_sample(captures, SAMPLING, np.random.default_rng(4))
    assert not torch.equal(first.target, other.target)


def test_colours_change_alike_in_target_and_sources(places):
    captures = read_captures(places / "train")
    plain = [
        draw_sample(captures, Sampling(64, (2, 2), 32, 96, jitter=0.0), np.random.default_rng(s)) for s in range(4)
    ]
    assert all(sample.target.min() >= 0 and sample.target.max() <= 1 for sample in plain)
    changed = draw_sample(captures, Sampling(64, (2, 2), 32, 96, jitter=1.0), np.random.default_rng(0))
    hue = [np.sort(image.numpy().reshape(3, -1).mean(1)) for image in changed.sources.images]
    np.testing.assert_allclose(hue[0], hue[1], atol=0.15)


def test_pixels_outside_of_the_photo_do_not_count():
    target, picture = torch.rand(1, 3, 32, 32), torch.rand(1, 3, 32, 32)
    mask = torch.ones(1, 1, 32, 32)
    mask[..., 16:] = 0
    picture[..., :16] = target[..., :16]
    perceptual = Perceptual(MobileNetV2())
    terms = image_terms(picture, target, mask, LossWeights(), perceptual)
    assert all(value == 0 for value in terms.values())
    assert all(value > 0 for value in image_terms(picture, target, mask.flip(3), LossWeights(), perceptual).values())


def test_the_perceptual_distance_has_a_gradient_for_the_image_alone():
    perceptual = Perceptual(MobileNetV2()).train()
    picture = torch.rand(1, 3, 64, 64, requires_grad=True)
    perceptual(picture, torch.rand(1, 3, 64, 64), torch.ones(1, 1, 64, 64)).backward()
    assert picture.grad.abs().max() > 0
    assert all(p.grad is None for p in perceptual.parameters())
    assert not perceptual.trunk.training


def test_an_images_own_rasters_lose_most_where_they_are_finest():
    rasters = own_rasters(torch.ones(1, 8, 512, 512))
    shares = [float(raster[:, 8].mean()) for raster in rasters]
    assert shares == pytest.approx([0.5, 0.75, 0.875, 0.9375, 0.96875], abs=0.02)
    for raster in rasters:
        assert torch.equal(raster[:, 3], raster[:, 8])
