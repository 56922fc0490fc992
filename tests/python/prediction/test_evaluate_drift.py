"""A stream that goes on from its own frames: what is drawn, what is counted, and over which frames."""

from pathlib import Path

import maquette
import numpy as np
import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")
if not maquette.library_path().exists():
    pytest.skip(f"{maquette.library_path()} is not built: run `make build`", allow_module_level=True)

from export.prediction.evaluate_drift import Roll, State, rolled_out, state_of, stretches

BUNDLE = Path("tests/native/data/tiny_transformer/bundle")


def frames_of(count=5):
    y, x = np.mgrid[:64, :64]
    made = [128 + 60 * np.sin(0.2 * (x - 2 * t) + 0.1 * y) for t in range(count)]
    return np.repeat(np.stack(made)[..., None], 3, -1).astype(np.uint8)


def test_one_colour_has_no_entropy_and_every_code_once_has_eight_bits():
    picture = np.full((64, 64, 3), 9, np.uint8)
    same = state_of(np.zeros((2, 16, 16), int), picture, picture, 10.0, 1.5)
    assert same == State(1.5, 0, 0, 0)
    striped = picture.copy()
    striped[::2] += 20
    other = state_of(np.stack([np.arange(256).reshape(16, 16)] * 2), striped, picture, 10.0, 1.5)
    assert (other.codes, other.contrast, other.motion) == (8, 1, 10)


def test_stretches_are_means_up_to_their_ends_and_end_with_the_frames():
    states = [State(k, 0, 0, 0) for k in range(7)]
    rows = stretches(states, [1, 5, 20, 40])
    assert [(name, own.bits) for name, own in rows] == [("1 to 1", 0), ("2 to 5", 2.5), ("6 to 7", 5.5)]


def test_frames_follow_from_those_that_were_made_and_equal_seeds_make_equal_ones():
    rolls = [Roll(BUNDLE, 15.0, temperature, seed) for temperature, seed in ((0, 1), (0, 2), (1, 1), (1, 1), (1, 2))]
    made = [rolled_out(roll, frames_of(), 2)[1] for roll in rolls]
    seen = [np.stack(roll.seen) for roll in rolls]
    assert made[0] == made[1]
    assert made[2] == made[3] != made[4]
    assert np.array_equal(seen[2], seen[3])
    assert not np.array_equal(seen[2], seen[4])
    assert made[0][0].bits < made[2][0].bits, "the likeliest codes cost least"
    assert rolls[0].frames == 5, "three were seen, two made"
    true, _ = rolled_out(Roll(BUNDLE, 15.0, 0, 0), frames_of(), 0)
    assert len(true) == 4
    assert all(np.isnan(one.bits) and one.motion > 0 for one in true)
