"""The benchmark of prediction: its baseline, its means, what is said of clips that are not there."""

import numpy as np
import pytest

from benchmarks import prediction


def moving(step_px: int, frames: int = 16) -> np.ndarray:
    """uint8 [T, 60, 80, 3]: a smooth texture that moves to the right."""
    y, x = np.mgrid[:60, :80]
    made = [128 + 50 * np.sin(0.3 * (x - step_px * i)) + 40 * np.sin(0.25 * y + 0.1 * (x - step_px * i))
            for i in range(frames)]  # fmt: skip
    return np.repeat(np.stack(made)[..., None], 3, axis=-1).clip(0, 255).astype(np.uint8)


def test_dis_follows_what_moves_evenly():
    errors, ms = prediction.dis_errors(moving(2))
    last = prediction.psnr_db(moving(2)[4], moving(2)[5])
    assert errors[1] > last + 6
    assert set(errors) == set(prediction.HORIZONS)
    assert ms > 0


def test_psnr_is_that_of_one_grey_level():
    black = np.zeros((4, 4, 3), np.uint8)
    assert prediction.psnr_db(black, black + 1) == pytest.approx(48.13, abs=0.01)
    assert prediction.psnr_db(black, black) == pytest.approx(68.13, abs=0.01)


def test_means_are_over_the_clips_of_a_set():
    def row(name, db):
        return {"film": name, "horizons": [{f"{method}_db": db for method in prediction.METHODS} | {"frames": n}
                                           for n in prediction.HORIZONS]}  # fmt: skip

    means = prediction.means_of([row("pushing 1", 20.0), row("pushing 2", 30.0), row("street, 10 fps", 40.0)])
    assert means["pushing"]["clips"] == 2
    assert means["pushing"]["motion"] == [25.0] * 4
    assert means["real"]["last"] == [40.0] * 4
    assert "pushing" not in prediction.means_of([row("street", 1.0)])


def test_folders_without_clips_give_none(tmp_path):
    assert prediction.real_films(tmp_path, prediction.SIZE_PX, quick=True) == []
    assert prediction.clip_films(tmp_path / "none", 3) == []


def test_a_program_that_was_not_built_is_told(monkeypatch, tmp_path):
    monkeypatch.setattr(prediction, "PROGRAM", tmp_path / "none")
    with pytest.raises(FileNotFoundError, match="--target measure_prediction"):
        prediction.measure()
