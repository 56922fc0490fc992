"""Prediction and concealing through the Python package."""

import gc

import maquette
import numpy as np
import pytest

pytestmark = pytest.mark.skipif(
    not maquette.library_path().exists(), reason=f"{maquette.library_path()} is not built: run `make build`"
)
STEP_PX, PERIOD_S = 4, 0.1


def textured(shift_px: int) -> np.ndarray:
    """uint8 [120, 160, 3]: smooth noise that has moved to the right."""
    y, x = np.mgrid[:120, :160]
    x = x - shift_px
    grey = 128 + 40 * np.sin(x / 7 + y / 11) + 40 * np.sin(x / 5 - y / 9 + 1) + 30 * np.cos(x / 13)
    return np.repeat(grey.clip(0, 255).astype(np.uint8)[..., None], 3, 2)


@pytest.fixture
def moving():
    """A predictor that has seen the noise move by STEP_PX in each PERIOD_S."""
    with maquette.Predictor("motion", threads=1) as predictor:
        for number in range(3):
            predictor.push(textured(STEP_PX * number), time_s=number * PERIOD_S)
        yield predictor


def test_what_moves_moves_on(moving):
    made = moving.predict(2 * PERIOD_S)

    inside = np.s_[20:-20, 40:-40]
    right, still = (np.abs(made.pixels().astype(int) - textured(shift))[inside].mean() for shift in (16, 8))
    assert right < 2 < 10 < still
    assert made.shape == (120, 160)
    assert made.timestamp_ns == round(4 * PERIOD_S * 1e9)
    assert made.origin.horizon_s == pytest.approx(2 * PERIOD_S)
    assert made.origin.age_s >= made.origin.horizon_s
    assert moving.stats["pushed_count"] == 3
    assert moving.stats["predicted_count"] == 1


def test_the_last_frame_is_one_method_and_captured_frames_have_no_origin():
    frame = maquette.Frame(textured(0))
    predictor = maquette.Predictor("last")
    predictor.push(frame)

    assert np.array_equal(predictor.predict(1).pixels(), frame.pixels())
    assert frame.origin is None


def test_samples_depend_on_the_seed_alone_and_have_an_entropy_map():
    with maquette.Predictor("sampled", temperature=1, seed=2, threads=1) as predictor:
        for number in range(4):
            predictor.push(textured(STEP_PX * number), time_s=number * PERIOD_S)
        predictor.sample(3, 2, PERIOD_S)
        frame, bits = predictor.acquire_sample(1, 2), predictor.entropy_map(1, 2)
        stats = predictor.stats
        assert stats["method"] == "sampled"
        assert (stats["sampled_frame_count"], stats["step_count"]) == (6, 2 * 256)
        assert frame.origin.horizon_s == pytest.approx(2 * PERIOD_S)
        assert bits.shape == (16, 16)
        assert bits.dtype == np.float32
        assert 0.3 < bits.mean() < 9
        assert not np.array_equal(frame.pixels(), predictor.acquire_sample(0, 2).pixels())
        predictor.sample(2, 2, PERIOD_S)  # of the shipped networks, in int8
        assert np.array_equal(frame.pixels(), predictor.acquire_sample(1, 2).pixels())
        assert np.array_equal(bits, predictor.entropy_map(1, 2))
        with pytest.raises(maquette.MaquetteError, match="of 2 samples"):
            predictor.acquire_sample(2, 1)
        predictor.cancel()
        with pytest.raises(maquette.MaquetteError, match="MAQ_CANCELLED"):
            predictor.sample(1, 1, PERIOD_S)
        predictor.sample(1, 1, PERIOD_S)


def test_a_predictor_that_has_forgotten_its_frames_asks_for_one(moving):
    moving.reset()

    with pytest.raises(maquette.MaquetteError, match="MAQ_ERROR_INVALID_ARGUMENT"):
        moving.predict(0.1)


def test_arrays_need_their_time_and_frames_have_it(moving):
    with pytest.raises(ValueError, match="time_s"):
        moving.push(textured(0))
    with pytest.raises(ValueError, match="time_s"):
        moving.push(maquette.Frame(textured(0)), time_s=1)


def test_wrong_settings_are_named():
    with pytest.raises(ValueError, match="auto, last, motion"):
        maquette.Predictor("magic")
    with pytest.raises(TypeError, match="frame_pool_size"):
        maquette.Predictor(pool=3)


def test_gaps_are_filled_with_frames_that_are_marked():
    source = maquette.Source("stub:people?count=1&size=160x120&fps=20&drop=0.3&frames=60&live=1", loop=0)
    with maquette.Concealer(source, threads=1) as concealer:
        with pytest.raises(maquette.MaquetteError, match="MAQ_ERROR_BUSY"):
            source.read(0)
        frames = [(frame.timestamp_ns, frame.origin) for frame in concealer]
        stats = concealer.stats

    made_up = [origin for _, origin in frames if origin]
    times = [time_ns for time_ns, _ in frames]
    assert times == sorted(times)
    assert len(made_up) == stats["predicted_count"] > 3
    assert all(0 < origin.horizon_s <= 0.3 for origin in made_up)
    assert len(frames) - len(made_up) == stats["captured_count"] - stats["dropped_count"]


def test_a_source_that_is_forgotten_stays_open_as_long_as_its_concealer():
    concealer = maquette.Concealer(maquette.Source("stub:pattern?size=64x48&fps=100&live=1"), threads=1)
    gc.collect()

    assert all(concealer.read(timeout_s=60) is not None for _ in range(3))


def test_only_live_sources_have_gaps():
    with pytest.raises(maquette.MaquetteError, match="not live"):
        maquette.Concealer(maquette.Source("stub:people?frames=3"))


def test_a_change_is_an_object_in_its_cells():
    health = maquette.CameraHealth()
    assert health.push(textured(0), time_s=0).is_stream_start
    for number in range(1, 12):
        still = health.push(textured(number), time_s=number * PERIOD_S)
    assert (still.event, still.state) == ("ok", "ok")
    assert still.unexplained < 0.02

    # Unlike any part of the texture, whose waves are everywhere.
    blots = np.random.default_rng(0).integers(0, 255, (10, 12, 3), np.uint8).repeat(4, 0).repeat(4, 1)
    found = []
    for number in range(12, 18):
        changed = textured(11)
        changed[0, 0] = number  # frames that are equal would be a freeze
        changed[40:80, 60:108] = blots
        found.append(health.push(changed, time_s=number * PERIOD_S))
    rows, columns = found[0].map.shape
    row, column = np.argwhere(found[0].map > 0.5).mean(0)
    assert 40 < (row + 0.5) * 120 / rows < 80
    assert 60 < (column + 0.5) * 160 / columns < 108
    assert [result.event for result in found if result.event != "ok"] == ["object"]
    event = next(result for result in found if result.event != "ok")
    assert event.began_s == pytest.approx(12 * PERIOD_S)
    assert event.x_px == pytest.approx(84, abs=10)
    assert event.y_px == pytest.approx(60, abs=10)
    assert health.stats["event_count"] == 1
    assert "object" in repr(event)


def test_a_black_camera_has_a_state_until_it_shows_something():
    health = maquette.CameraHealth()
    dark = np.full((120, 160, 3), 5, np.uint8)
    assert health.push(dark, time_s=0).event == "black"
    assert health.push(dark, time_s=PERIOD_S).state == "black"
    assert health.push(textured(0), time_s=2 * PERIOD_S).state == "ok"
    health.reset()
    assert health.push(textured(0), time_s=3 * PERIOD_S).is_stream_start
    with pytest.raises(ValueError, match="time_s"):
        health.push(textured(0))
