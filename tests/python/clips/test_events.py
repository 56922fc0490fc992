"""Each event happens at the frame and place that it says, and nowhere else."""

import numpy as np
import pytest

from export.clips.events import BLACKOUT_FRAMES, KINDS, with_event

FPS = 10.0


def moving(seed: int, frames: int = 30) -> np.ndarray:
    """Noise that moves one pixel a frame: no frame equals another."""
    noise = np.random.default_rng(seed).integers(0, 256, (32, 96, 3), dtype=np.uint8)
    return np.stack([noise[:, t : t + 48] for t in range(frames)])


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", KINDS)
def test_before_its_frame_and_outside_its_region_nothing_happens(kind, seed):
    rgb, other = moving(1), moving(2)
    event = with_event(kind, rgb, other, FPS, np.random.default_rng(seed))
    assert event.rgb.shape[1:] == rgb.shape[1:]
    assert 10 <= event.at <= len(event.rgb) - 4
    outside = ~event.region
    if kind in ("appears", "vanishes", "jump"):
        assert 0 < event.region.mean() < 0.3
        assert (event.rgb[:, outside] == rgb[:, outside]).all()
    else:
        assert event.region.all()
        assert (event.rgb[: event.at] == rgb[: event.at]).all()
    assert (event.rgb[event.at] != rgb[event.at])[event.region].mean() > 0.3 or kind == "vanishes"


def test_what_each_event_shows():
    rgb, other = moving(1), moving(2)
    made = {kind: with_event(kind, rgb, other, FPS, np.random.default_rng(3)) for kind in KINDS}
    at = made["freeze"].at
    assert (made["freeze"].rgb[at:] == rgb[at - 1]).all()
    assert (made["cut"].rgb[made["cut"].at :] == other[made["cut"].at :]).all()
    drop = made["drop"]
    assert len(drop.rgb) == 27
    assert (drop.rgb[drop.at] == rgb[drop.at + 3]).all()
    back = made["reversal"]
    assert (back.rgb[back.at] == rgb[back.at - 2]).all()
    assert (back.rgb[back.at + 1] == rgb[back.at - 3]).all()
    black = made["blackout"]
    assert [bool(frame.any()) for frame in black.rgb[black.at - 1 : black.at + BLACKOUT_FRAMES + 1]] == [
        True, *[False] * BLACKOUT_FRAMES, True,
    ]  # fmt: skip
    there = made["vanishes"]
    changed = (there.rgb != rgb).any((1, 2, 3))
    assert changed[: there.at].all()
    assert not changed[there.at :].any()


def test_short_clips_and_other_kinds_are_refused():
    with pytest.raises(ValueError, match="needs 14 frames"):
        with_event("cut", moving(1, 11), moving(2), FPS, np.random.default_rng(0))
    with pytest.raises(ValueError, match="no event"):
        with_event("fire", moving(1), moving(2), FPS, np.random.default_rng(0))
