"""The benchmark of drawn frames: what its figures mean."""

from pathlib import Path

import maquette
import numpy as np
import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")

from benchmarks.drawn import frechet, uncertainty
from benchmarks.drawn.measure import pictures_db
from benchmarks.drawn.times import RECOMPUTING, figures_of

needs_library = pytest.mark.skipif(not maquette.library_path().exists(), reason="the library is not built: make build")


def test_rank_correlation_is_spearmans():
    values = np.array([[3.0, 1, 2, 5], [1, 1, 2, 2], [4, 4, 4, 4]])
    other = np.array([[30.0, 10, 20, 50], [7, 9, 7, 9], [1, 2, 3, 4]])
    np.testing.assert_allclose(uncertainty.rank_correlation(values, other), [1, 0, 0])
    np.testing.assert_allclose(uncertainty.rank_correlation(values, -other), [-1, 0, 0])
    np.testing.assert_allclose(uncertainty.ranks(np.array([5.0, 1, 5, 9])), [1.5, 0, 1.5, 3])
    one, two = np.array([1.0, 2, 3, 4, 5]), np.array([2.0, 1, 4, 3, 5])
    assert uncertainty.rank_correlation(one, two) == pytest.approx(1 - 6 * 4 / (5 * 24))


def test_errors_are_those_of_cells_and_reliability_goes_from_the_surest_on():
    truth = np.zeros((2, 64, 64, 3), np.uint8)
    made = truth.copy()
    made[1, 4:8, 60:64] = 6
    errors = uncertainty.cell_errors(made, truth)
    assert errors.shape == (2, 16, 16)
    assert errors[1, 1, 15] == 6
    assert errors.sum() == 6
    bits = np.arange(10.0)
    assert uncertainty.reliability(bits, bits * 2, bins=2) == [
        (2.0, pytest.approx(np.sqrt(4 * (0 + 1 + 4 + 9 + 16) / 5))),
        (7.0, pytest.approx(np.sqrt(4 * (25 + 36 + 49 + 64 + 81) / 5))),
    ]


def test_frechet_distance_is_that_of_normal_distributions():
    rng = np.random.default_rng(0)
    real = rng.standard_normal((4000, 3)) * [1, 2, 4]
    assert frechet.frechet_distance(real, real) == pytest.approx(0, abs=1e-6)
    # One deviation away along an axis; half as wide along all: (1 - 1 / 2)^2 of each.
    assert frechet.frechet_distance(real, real + [0, 2, 0]) == pytest.approx(1, abs=0.1)
    half = real.mean(0) + (real - real.mean(0)) / 2
    assert frechet.frechet_distance(real, half) == pytest.approx(3 / 4, abs=0.01)


def test_changes_are_those_of_one_clip_and_features_tell_pictures_apart():
    features = np.arange(24.0).reshape(2, 3, 4)
    assert (frechet.changes(features) == 4).all()
    assert frechet.changes(features).shape == (4, 4)
    frames = np.zeros((1, 2, 64, 64, 3), np.uint8)
    frames[0, 1, 8:40, 8:40] = 200
    found = frechet.FrameFeatures().of(frames)
    assert found.shape == (1, 2, 3 * 4 * 64)
    assert np.abs(found[0, 0] - found[0, 1]).max() > 0.1


def test_the_best_of_samples_is_taken_frame_by_frame():
    truth = np.zeros((1, 2, 64, 64, 3), np.uint8)
    right, wrong = truth[0, 0], np.full_like(truth[0, 0], 30)
    samples = np.stack(
        [np.stack([right, wrong]), np.stack([wrong, right]), np.stack([wrong, wrong]), np.stack([wrong, wrong])]
    )
    known = {"auto": truth[:, None], "temperature 0.5": samples[None], "temperature 1": np.repeat(samples, 4, 0)[None]}
    found = pictures_db(known, truth)
    np.testing.assert_allclose(found["temperature 0.5"], [[50, 18.59]], atol=0.01)
    np.testing.assert_allclose(found["temperature 0.5, best of 4"], [[50, 50]])
    np.testing.assert_allclose(found["temperature 0.5, mean of 4"], [[21.09, 21.09]], atol=0.01)


def test_figures_of_times():
    times = {"1 sample": 20.0, "4 passes": 10.0, "1 sample, 11 frames": 200.0, "4 samples, 11 frames": 300.0,
             RECOMPUTING: 900.0}  # fmt: skip
    assert figures_of(times) == {
        "four_samples_times": 1.5, "drawn_frames_a_second": 50.0, "passes_frames_a_second": 100.0,
        "recomputing_times": 45.0,
    }  # fmt: skip


@needs_library
def test_clips_go_on_by_every_method():
    from benchmarks.drawn import continuations

    y, x = np.mgrid[:64, :64]
    frames = [128 + 60 * np.sin((x - 2 * t) / 5) * np.sin(y / 7) for t in range(continuations.GIVEN)]
    shown = np.repeat(np.stack(frames).astype(np.uint8)[..., None], 3, -1)
    last, _ = continuations.foreseen("last")(shown, 0.1)
    assert last.shape == (1, continuations.MADE, 64, 64, 3)
    assert (last == shown[-1]).all()
    from benchmarks.prediction import BUNDLE

    pictures, bits = continuations.drawn(2, BUNDLE, temperature=1, passes=1)(shown, 0.1)
    assert pictures.shape == (2, continuations.MADE, 64, 64, 3)
    assert bits.shape == (2, continuations.MADE, 16, 16)
    assert not (pictures[0] == pictures[1]).all()


def test_the_convolutional_network_makes_every_time_ahead_in_the_size_of_the_frames(tmp_path):
    import torch

    from benchmarks.drawn import continuations
    from export.prediction.pictures.convolutional import ConvolutionalShape
    from export.prediction.pictures.train_convolutional import Training

    training = Training(ConvolutionalShape(widths=(4, 4, 4), blocks=1))
    torch.save(training.weights(), tmp_path / "weights.pt")
    frames = np.full((continuations.GIVEN, 60, 80, 3), 9, np.uint8)
    frames[-1] = 200
    made, bits = continuations.convolutional(tmp_path / "weights.pt")(frames, 0.1)
    assert made.shape == (1, continuations.MADE, 60, 80, 3)
    assert bits is None
    assert np.abs(made.astype(int) - 200).max() <= 1  # a new network repeats the last frame


@needs_library
def test_a_report_has_figures_of_all_gates_and_tables(monkeypatch):
    import torch

    from benchmarks import drawn
    from benchmarks.drawn import continuations, measure
    from benchmarks.drawn.tables import drawn_tables
    from benchmarks.prediction import BUNDLE
    from export.prediction.data import Clips

    rng = np.random.default_rng(0)
    frames = torch.from_numpy(rng.integers(0, 255, (2, 16, 64, 64, 3)).astype(np.uint8))
    known = {name: continuations.foreseen("last") for name in ("last frame", "motion", "auto", "auto, mended")}
    bits = rng.random((continuations.MADE, 16, 16)).astype(np.float32)

    def drawn_by(samples):
        def go_on(shown, step_s):
            noise = rng.integers(-9, 9, (samples, continuations.MADE, 64, 64, 3))
            return (shown[-1] + noise).clip(0, 255).astype(np.uint8), np.stack([bits] * samples)

        return go_on

    known |= {"likeliest": drawn_by(1), "temperature 0.5": drawn_by(4), "temperature 1": drawn_by(16)}
    monkeypatch.setattr(continuations, "methods", lambda bundle, samples, weights: known)
    document, figures = measure.measure_pictures(
        Clips(frames, torch.tensor([10.0, 30]), ["a", "b"]), np.empty(0), BUNDLE
    )
    document["times_ms"] = {"1 sample": 20.0, "4 passes": 10.0, "1 sample, 11 frames": 2.0, "4 samples, 11 frames": 3.0,
                            RECOMPUTING: 900.0}  # fmt: skip
    assert {*figures, *figures_of(document["times_ms"])} == set(drawn.FIGURES)
    assert document["frechet"]["frames"]["last frame"] == 1
    text = "\n".join(part if isinstance(part, str) else str(part) for part in drawn_tables(document))
    assert "of 2 clips" in text
    assert document["gain_db"]["auto, mended"] == 0  # all that draw nothing are the last frame here
    assert "'temperature 1, best of 16'" in text


def test_other_runtimes_have_the_graphs_that_they_can():
    pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")
    from benchmarks.drawn import runtimes
    from benchmarks.prediction import BUNDLE

    weights = (Path(f"export/weights/prediction-{name}.pt") for name in ("autoencoder", "mender"))
    rows = {(row["name"], row["precision"]): row for row in runtimes.measure(BUNDLE, *weights, threads=1, rounds=1)}
    ours = rows["Maquette", "int8"]
    assert set(ours["ms"]) == {*runtimes.PICTURES, *runtimes.CODES}
    assert ours["ours_int8_ratio"] == 1
    in_torch = rows["PyTorch", "fp32"]
    assert not in_torch["missing"], "its pictures are those of our float graphs"
    assert set(in_torch["ms"]) == set(runtimes.PICTURES)
    of_same = sum(ours["ms"][name] for name in in_torch["ms"])
    assert in_torch["ours_int8_ratio"] == pytest.approx(of_same / in_torch["total_ms"], rel=1e-3)
