"""Models of depth cameras in batches, against those of one frame, with the same random numbers."""

import numpy as np
import pytest
import torch

from export.solids.batched_sensors import Draws, SensorDeck
from export.solids.sensors import LEVELS, Outliers, Phone, Plain, Stereo, StructuredLight, TimeOfFlight, clean, drawn

CPU = torch.device("cpu")
FOCAL_PX = 280.0
SENSORS = {
    name: LEVELS[name]
    for name in ("clean", "plain-1/2", "stereo", "stereo-coarse", "tof", "tof-dim", "structured-light", "phone")
} | {
    "phone, a third": Phone(3, 0.002, 1.2),
    "stereo, small window": Stereo(sigma_px=0.1, window_px=3, baseline_m=0.1, step_px=1 / 16),
    "time of flight, hardly rounded": TimeOfFlight(mixing_px=0.3, rounding_px=0.4),
    "structured light, little noise": StructuredLight(scale=0.4),
    "outliers": Outliers(0.02, 0.5),
    "single outliers": Outliers(0.05, 0, Plain(0.2)),
}


class Same(Draws):
    """The numbers that `sensors.py` would get, for a batch of one frame."""

    def __init__(self, seed: int) -> None:
        super().__init__(CPU)
        self.rng = np.random.default_rng(seed)

    def normal(self, *shape: int) -> torch.Tensor:
        return torch.from_numpy(self.rng.standard_normal(shape[1:], np.float32))[None]

    def uniform(self, *shape: int) -> torch.Tensor:
        return torch.from_numpy(self.rng.uniform(0, 1, shape[1:]).astype(np.float32))[None]


def scene(height: int = 80, width: int = 112) -> np.ndarray:
    """A leaning wall, a box before it, and nothing in a corner."""
    y, x = np.mgrid[:height, :width].astype(np.float32)
    depth = (1.5 + 0.004 * x - 0.002 * y).astype(np.float32)
    depth[20:50, 30:70] = 1.1 + 0.006 * (x - 30)[20:50, 30:70]
    depth[:12, 90:] = 0
    return depth


@pytest.mark.parametrize("name", SENSORS)
def test_a_batch_sees_what_a_frame_alone_would(name):
    sensor, depth = SENSORS[name], scene()
    expected = np.nan_to_num(sensor(depth, FOCAL_PX, np.random.default_rng(5)))
    deck = SensorDeck([sensor], CPU)
    found = deck.see(np.array([0]), torch.from_numpy(depth)[None], torch.tensor([FOCAL_PX]), Same(5))[0].numpy()
    # A rounding to the other side of a threshold or of a step moves single pixels.
    assert ((found > 0) == (expected > 0)).mean() > 0.999
    both = (found > 0) & (expected > 0)
    error = np.abs(found - expected)[both] / expected[both]
    assert (error > 1e-5).mean() < 0.002
    if name not in ("clean", "outliers", "single outliers"):
        assert (np.abs(expected - depth)[both] / expected[both] > 1e-5).mean() > 0.1  # the model does something


def test_each_frame_of_a_batch_has_the_sensor_and_focal_length_of_its_own():
    names = ("clean", "plain-1/2", "tof", "clean", "stereo", "phone", "single outliers", "tof-dim")
    deck = SensorDeck([SENSORS[name] for name in names], CPU)
    chosen = np.array([4, 0, 7, 3, 5, 2, 6, 1, 0])
    depth = torch.from_numpy(scene())[None] * torch.linspace(1, 1.8, len(chosen))[:, None, None]
    torch.manual_seed(1)
    seen = deck.see(chosen, depth, torch.full((len(chosen),), FOCAL_PX))
    off = torch.where(seen > 0, seen - depth, 0).abs() / depth.clamp_min(1e-6)
    exact = [k for k, number in enumerate(chosen) if names[number] == "clean"]
    assert all((off[k] == 0).all() for k in exact)
    assert all(off[k].max() > 1e-4 for k in range(len(chosen)) if k not in exact)
    wrong = list(chosen).index(6)
    assert 0.03 < (off[wrong] > 0.02).float().mean() < 0.07  # of this frame alone
    assert ((seen > 0) <= (depth > 0)).float().mean() > 0.99  # little grows beyond what is there


def test_a_deck_takes_whatever_is_drawn_to_train_on_and_reports_finite_depth():
    rng = np.random.default_rng(3)
    deck = SensorDeck([drawn(rng) for _ in range(200)] + [clean], CPU)
    depth = torch.from_numpy(scene(112, 112)).expand(len(deck), -1, -1)
    seen = deck.see(np.arange(len(deck)), depth, torch.full((len(deck),), FOCAL_PX))
    assert seen.shape == depth.shape
    assert torch.isfinite(seen).all()
    assert (seen >= 0).all()
    assert (seen > 0).float().mean() > 0.8
    nothing = deck.see(np.arange(len(deck)), torch.zeros_like(depth), torch.full((len(deck),), FOCAL_PX))
    assert (nothing > 0).float().mean() < 1e-4  # coarse stereo invents a disparity now and then, as in sensors.py
