"""Training of the edge network learns, resumes where it stopped, and its metrics tell good fields from bad ones."""

import json
import os
import signal

import numpy as np
import pytest
import torch
from box_crops import write_crops

from export.edges import train
from export.edges.data import Batches, RecordError, read_frames
from export.edges.device_batches import DeviceBatches
from export.edges.metrics import cuts, frame_metrics, summary
from export.edges.validation import metrics_of
from export.edges.weights import load_network
from export.solids.compact import write_compact
from export.solids.records import read_records
from export.solids.sensors import clean

pytestmark = pytest.mark.usefixtures("one_thread", "fixed_seed", "signal_handlers")


@pytest.fixture(scope="module")
def crops(tmp_path_factory):
    folder = tmp_path_factory.mktemp("solids")
    write_crops(folder / "train", 0, 12)
    write_crops(folder / "val", 1, 3)
    return folder


def run(monkeypatch, crops, out, *options, stop_after=None) -> list[float]:
    """Losses of the steps of one call of the training's main program."""
    losses, terms_of = [], train.field_terms

    def recorded(*given):
        terms = terms_of(*given)
        losses.append(sum(terms.values()).item())
        if len(losses) == stop_after:
            os.kill(os.getpid(), signal.SIGTERM)
        return terms

    with monkeypatch.context() as patch:
        patch.setattr(train, "field_terms", recorded)
        given = ["train", "--data", str(crops), "--out", str(out), "--size", "xs", "--batch", "4", "--crop", "48"]
        patch.setattr("sys.argv", [*given, "--threads", "1", *options])
        train.main()
    return losses


def test_a_resumed_run_goes_on_exactly_as_one_that_never_stopped(monkeypatch, crops, tmp_path):
    straight = run(monkeypatch, crops, tmp_path / "straight", "--steps", "4")
    first = run(monkeypatch, crops, tmp_path / "stopped", "--steps", "4", stop_after=2)
    second = run(monkeypatch, crops, tmp_path / "stopped", "--steps", "4")
    assert len(first) == len(second) == 2
    assert first + second == pytest.approx(straight, rel=1e-5)
    assert run(monkeypatch, crops, tmp_path / "stopped", "--steps", "4") == []


def test_it_learns_and_leaves_weights_curves_and_a_sample(monkeypatch, crops, tmp_path):
    losses = run(monkeypatch, crops, tmp_path, "--steps", "120")
    assert np.mean(losses[-5:]) < 0.7 * np.mean(losses[:5])
    network, config = load_network(tmp_path / "weights.pt")
    assert not network.training
    assert config.bins == 0
    assert {"log.json", "curves.png", "sample.png", "checkpoint.pt"} <= {path.name for path in tmp_path.iterdir()}
    assert json.loads((tmp_path / "log.json").read_text())[-1]["rmse_r/clean"] > 0


def test_a_run_with_sensors_in_batches_learns_from_a_pack_and_resumes_exactly(monkeypatch, crops, tmp_path):
    write_compact(tmp_path / "crops.xz", list(read_records(crops / "train")))
    options = ("--pack", str(tmp_path / "crops.xz"), "--batched-sensors", "--validate-minutes", "0")
    straight = run(monkeypatch, crops / "none", tmp_path / "straight", "--steps", "60", *options)
    assert np.mean(straight[-5:]) < 0.9 * np.mean(straight[:5])
    run(monkeypatch, crops / "none", tmp_path / "stopped", "--steps", "60", *options, stop_after=2)
    rest = run(monkeypatch, crops / "none", tmp_path / "stopped", "--steps", "60", *options)
    assert rest[:2] == pytest.approx(straight[2:4], rel=1e-5)
    load_network(tmp_path / "straight" / "weights.pt")


def test_batches_of_a_device_are_crops_mirrored_and_scaled_with_their_labels(monkeypatch, crops):
    monkeypatch.setattr("export.edges.device_batches.drawn", lambda rng: clean)
    batches = DeviceBatches(crops / "train", 64, 12, seed=1).moved(torch.device("cpu"))
    planes = [record.decoded() for record in read_records(crops / "train")]
    turns = [(k, turned) for k in range(4) for turned in (np.asarray, np.transpose)]
    found = []
    for step in range(2):
        depth, focal_px, target = batches.draw(step, torch.device("cpu"))
        assert (focal_px == 150).all()
        assert target.counts.all()
        for k, own in enumerate(depth.numpy()):
            scale = own.max() / 1.4
            assert 0.5 <= scale <= 2
            alike = [
                (number, turn, turned.__name__)
                for number, of in enumerate(planes)
                for turn, turned in turns
                if np.allclose(turned(np.rot90(of["depth"], turn)) * scale, own, rtol=1e-5)
                and np.array_equal(turned(np.rot90(of["distance"], turn)), target.distance[k].numpy())
                and np.array_equal(turned(np.rot90(of["kind"] > 0, turn)) * 2, target.kind[k].numpy())
            ]
            assert len(alike) >= 1
            found += alike[:1]
    assert sorted(number for number, *_ in found) == sorted([*range(12)] * 2)  # each crop once a pass
    assert len({(turn, name) for _, turn, name in found}) >= 6


def test_a_share_of_a_batch_is_of_scenes_made_meanwhile(monkeypatch, crops, tmp_path):
    for name, value in (("MADE_AT_ONCE", 2), ("FIRST_S", 0), ("MADE_CROPS", 8), ("drawn", lambda rng: clean)):
        monkeypatch.setattr(f"export.edges.device_batches.{name}", value)
    cpu = torch.device("cpu")
    batches = DeviceBatches(crops / "train", 32, 4, seed=1).moved(cpu, 0.5)
    assert batches.made_crops == 2
    depth, focal_px, target = batches.draw(0, cpu)
    assert focal_px[:2, 0].tolist() == [150, 150]
    assert (focal_px[2:, 0] >= 180).all()
    assert depth.shape == target.distance.shape == (4, 32, 32)
    assert not (target.counts & (depth == 0)).any()
    batches._next = 0
    batches.draw(1, cpu)
    assert batches.made_crops == 4
    options = ("--batched-sensors", "--made-fraction", "0.5", "--steps", "2", "--validate-minutes", "0")
    assert np.isfinite(run(monkeypatch, crops, tmp_path, *options)).all()


def test_a_run_of_another_size_is_not_overwritten(monkeypatch, crops, tmp_path):
    run(monkeypatch, crops, tmp_path, "--steps", "1")
    with pytest.raises(SystemExit, match="another --out"):
        run(monkeypatch, crops, tmp_path, "--steps", "2", "--loss", "histogram")


def test_a_batch_depends_on_the_seed_and_its_number_alone(crops):
    first, second = (Batches(crops / "train", 48, 4, seed=3) for _ in range(2))
    first.draw(0, "cpu")
    depth, focal_px, target = first.draw(5, "cpu")
    again = second.draw(5, "cpu")
    assert depth.equal(again[0])
    assert focal_px.equal(again[1])
    assert target.distance.equal(again[2].distance)
    assert not depth.equal(first.draw(6, "cpu")[0])


@pytest.mark.parametrize(("crop", "batch", "wanted"), [(48, 40, "fewer than a batch"), (50, 4, "multiples of 16")])
def test_crops_that_do_not_fit_are_refused(crops, crop, batch, wanted):
    with pytest.raises(RecordError, match=wanted):
        Batches(crops / "train", crop, batch, seed=0)


def test_the_true_field_is_perfect_and_none_finds_nothing(crops):
    frames = read_frames(crops / "val")
    true = iter(frames)
    perfect = metrics_of(lambda depth, focal_px: next(true).distance, frames, "clean")
    metrics = summary(perfect, cuts(perfect))
    assert metrics["rmse_r"] == metrics["q95_r"] == 0
    assert metrics["recall_1r"] == metrics["recall_4r"] == 1
    nothing = metrics_of(lambda depth, focal_px: np.full(depth.shape, 16.0), frames, "clean")
    assert summary(nothing, cuts(nothing))["recall_4r"] == 0


def test_metrics_count_only_pixels_with_a_label():
    true = np.array([[0.5, 3.0], [16.0, 16.0]])
    found = np.array([[0.5, 5.0], [16.0, 1.0]])
    counts = np.array([[True, True], [True, False]])
    metrics = frame_metrics(found, true, counts)
    assert metrics["rmse_r"] == pytest.approx(np.sqrt(4 / 3))
    assert metrics["found_4r"][64] == pytest.approx(0.5)  # cut at 4 r: of two sharp pixels one
    assert metrics["false_4r"][64] == 0
