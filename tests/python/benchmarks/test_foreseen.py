"""SSIM of what is predicted, and errors of the motion behind it."""

import maquette
import numpy as np
import pytest

from benchmarks import prediction
from benchmarks.foreseen import motion_error
from benchmarks.foreseen.structure import structure_of
from benchmarks.prediction import BUNDLE
from export.clips.clip import Clip, Frames, write_clip

needs_library = pytest.mark.skipif(
    not maquette.library_path().exists(), reason=f"{maquette.library_path()} is not built: run `make build`"
)


def moving(step_px: float, frames: int = 4) -> np.ndarray:
    """uint8 [T, 60, 80, 3]: a smooth texture that moves to the right."""
    y, x = np.mgrid[:60, :80]
    made = [128 + 50 * np.sin(0.3 * (x - step_px * i)) + 40 * np.sin(0.25 * y + 0.1 * (x - step_px * i))
            for i in range(frames)]  # fmt: skip
    return np.repeat(np.stack(made)[..., None], 3, axis=-1).clip(0, 255).astype(np.uint8)


def clip_frames(step_px: float) -> Frames:
    """The lower half stands still, as the clip says; nothing of the last ten columns stays visible."""
    motion, visible = np.zeros((3, 60, 80, 2), np.float32), np.ones((3, 60, 80), bool)
    motion[:, :30, :, 0] = step_px
    visible[..., 70:] = False
    return Frames(moving(step_px), motion, visible)


def test_only_what_moves_and_stays_visible_counts():
    frames = clip_frames(2)
    wrong = frames.motion + np.array([3, 4], np.float32)
    wrong[:, 30:] = 100
    wrong[..., 70:, :] = 100
    errors = motion_error.endpoint_errors(wrong, frames)
    assert errors.shape == (3 * 30 * 70,)
    assert np.allclose(errors, 5)
    assert motion_error.endpoint_errors(wrong, clip_frames(0.4)).size == 0


def test_errors_are_means_over_the_clips_with_large_frames(monkeypatch, tmp_path):
    monkeypatch.setattr(motion_error, "found_motion", lambda bgr: np.full((3, 60, 80, 2), (2, 1), np.float32))
    paths = []
    for number, large in enumerate((clip_frames(2), clip_frames(4), clip_frames(0), None)):
        paths.append(tmp_path / f"clip-{number}.npz")
        write_clip(Clip(clip_frames(1), large, {"fps": 10}), paths[-1])
    found = motion_error.measure(paths)
    assert found["clips"] == 2
    assert found["still"] == pytest.approx([3, 3])
    assert found["motion"] == pytest.approx([(1 + 5**0.5) / 2] * 2)
    assert found["dis"][1] < 0.5  # the texture is smooth
    assert motion_error.measure([]) == {"clips": 0}


def test_a_program_that_was_not_built_is_told(monkeypatch, tmp_path):
    monkeypatch.setattr(motion_error, "PROGRAM", tmp_path / "none")
    with pytest.raises(FileNotFoundError, match="--target find_motion"):
        motion_error.found_motion(moving(1))


@needs_library
def test_what_moves_evenly_is_more_alike_by_motion_than_by_the_last_frame():
    found = structure_of(moving(2, frames=16), 30, (1, 3), BUNDLE)
    assert set(found) == {"last", *prediction.METHODS}
    for name in ("motion", "auto", "network", "dis"):
        assert all(own > last + 0.1 for own, last in zip(found[name], found["last"], strict=True)), name
    assert all(own > 0.9 for own in found["motion"])


def test_the_report_has_a_row_a_set_and_the_motion():
    horizons = [
        {f"{method}_{what}": value for method in prediction.METHODS for what, value in (("db", 30.0), ("ssim", 0.9))}
        for _ in prediction.HORIZONS
    ]
    sets = prediction.means_of([{"film": "pushing 1", "horizons": horizons}, {"film": "street", "horizons": horizons}])
    assert sets["real"]["ssim"]["dis"] == pytest.approx([0.9] * 4)
    head, *rows = prediction.ssim_table(sets)
    assert [row[0] for row in rows] == ["mean of 1 (pushing)", "mean of 1 (real)"]
    assert rows[0][1:] == ["0.900"] * (len(head) - 1)
    measured = {
        "sets": sets, "speed": [], "missing": [], "motion_error_px":
            {"clips": 1, "still": [7.0, 6.5], "motion": [1.25, 0.5], "dis": [2, 1]},
        "waits": {"captured": 1, "predicted": 1, "wait_ms": {"median": 1, "p99": 1}},
        "surprise": dict.fromkeys(("frames_a_second", "cpu_ms", "resize_ms", "network_ms", "nearest_ms"), 1.0),
    }  # fmt: skip
    _, parts = prediction.section(measured)
    assert prediction.ssim_table(sets) in parts
    assert any("motion 1.25 and 0.50" in part for part in parts if isinstance(part, str))
