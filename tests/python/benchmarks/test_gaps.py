"""Gaps that are bridged: what is compared with what, over which frames."""

import maquette
import numpy as np
import pytest

from benchmarks import gaps
from benchmarks.prediction import Film
from tests.python.benchmarks.test_prediction import moving

needs_library = pytest.mark.skipif(not maquette.library_path().exists(), reason="the library is not built: make build")


@needs_library
def test_even_motion_is_bridged_far_nearer_than_by_the_frame_repeated():
    film = Film("moving", moving(2, frames=12), 10.0)
    found = gaps.bridged(film)
    assert found.shape == (2, 3, 2), "starts 4 and 7; 12 - 3 frames have all of a gap after them"
    truth = moving(2, frames=12)
    assert found[1, 2, 0] == pytest.approx(gaps.psnr_db(truth[7], truth[10]))
    assert (found[1, :, 1] > found[1, :, 0] + 3).all()
    assert set(gaps.measure([film, Film("short", truth[:5], 10.0)])) == {"moving"}


def test_gaps_are_means_over_their_frames_and_300_ms_long_at_most():
    assert [gaps.longest_gap(fps) for fps in (10, 15, 29.97, 30)] == [3, 5, 9, 9]
    found = np.array([[[20.0, 30], [10, 22]], [[22, 30], [12, 20]]])
    np.testing.assert_allclose(gaps.by_gap(found), [[21, 30], [16, 25.5]])
    films = {"one": gaps.by_gap(found), "worse": np.array([[30.0, 29]])}
    assert gaps.figures_of(films) == {"gap_gain_db": pytest.approx((9.25 - 1) / 2), "gap_worst_db": -1}
    table = gaps.table_of(films)
    assert table[1] == ["one", "21.0 / 30.0", "16.0 / 25.5"]
    assert table[2] == ["worse", "30.0 / 29.0", ""]
