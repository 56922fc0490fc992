"""Averages of weights before and after a training."""

import pytest
import torch

from export.average import averaged


def weights(value: float, **more) -> dict:
    return {
        "ema": {"conv": torch.full((2, 2), float(value)), "steps": torch.tensor(int(value)), **more},
        "width": int(value),
    }


def test_the_average_lies_between_and_keeps_what_only_the_trained_weights_have():
    found = averaged(weights(1), weights(3, axis=torch.ones(1)), 0.25)
    assert torch.equal(found["ema"]["conv"], torch.full((2, 2), 1.5))
    assert torch.equal(found["ema"]["axis"], torch.ones(1))
    assert found["ema"]["steps"] == 3, "a count is no weight"
    assert found["width"] == 3
    assert torch.equal(averaged(weights(1), weights(3), 1)["ema"]["conv"], torch.full((2, 2), 3.0))


def test_half_precision_is_averaged_in_full_and_stays_half():
    start, trained = ({"ema": {"x": torch.tensor([v], dtype=torch.half)}} for v in (60000.0, 60032.0))
    assert averaged(start, trained, 0.5)["ema"]["x"].dtype == torch.half
    assert torch.isfinite(averaged(start, trained, 0.5)["ema"]["x"]).all()


def test_evidence_of_people_is_left_out_where_the_trained_weights_have_none():
    found = averaged(weights(1, **{"evidence.out.weight": torch.ones(1)}), weights(3), 0.5)
    assert "evidence.out.weight" not in found["ema"]
    assert torch.equal(found["ema"]["conv"], torch.full((2, 2), 2.0))


def test_weights_of_another_network_are_refused():
    with pytest.raises(ValueError, match="other is not in both"):
        averaged(weights(1, other=torch.ones(1)), weights(3), 0.5)


def test_weights_of_scenes_are_averaged_too_and_of_two_kinds_refused():
    start, trained = ({"networks": {"x": torch.tensor([v])}, "config": {}} for v in (1.0, 2.0))
    assert averaged(start, trained, 0.5)["networks"]["x"] == 1.5
    with pytest.raises(ValueError, match="one kind of network"):
        averaged(start, weights(1), 0.5)
