"""Areas under ROC curves are right, and what cannot be overseen is found."""

import pytest

pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")

import numpy as np
import torch

from export.clips.events import KINDS
from export.clips.shapes import shapes_clip
from export.prediction.autoencoder import Autoencoder
from export.prediction.config import AutoencoderShape, TransformerShape
from export.prediction.data import Clips
from export.prediction.evaluate_events import (
    area_under_roc,
    difference,
    flow_residual,
    levels,
    measured,
    table_surprise,
    transformer_surprise,
)
from export.prediction.table import CodeTable
from export.prediction.transformer import LatentTransformer


def test_the_area_is_the_chance_of_a_higher_level():
    assert area_under_roc([0, 1, 2], [3, 4]) == 1
    assert area_under_roc([3, 4], [0, 1]) == 0
    assert area_under_roc([1, 1], [1]) == 0.5
    assert area_under_roc([0, 2], [1]) == 0.5


def test_a_level_is_relative_to_the_frames_before():
    found = levels(np.array([1.0] * 8 + [1.0, 8.0, 0.5]), 0.0)
    assert found == pytest.approx([0, np.log(8), np.log(2)])


@pytest.fixture(scope="module")
def clips():
    frames = np.stack([shapes_clip("val", k, large=False).small.rgb for k in range(4)])
    return Clips(torch.from_numpy(frames), torch.full((4,), 10.0), [f"shapes/{k}" for k in range(4)])


def test_cuts_and_blackouts_are_seen_by_differences(clips):
    found = measured(clips, {"difference": difference, "flow residual": flow_residual}, seed=0)
    for areas in found.values():
        assert set(areas) == set(KINDS)
        assert areas["cut"] > 0.9
        assert areas["blackout"] > 0.9
        assert areas["freeze"] > 0.9, "nothing differs from the frame before any more"


def test_surprise_is_bits_a_code_of_every_frame_but_the_first(clips):
    torch.manual_seed(0)
    net = Autoencoder(AutoencoderShape(widths=(8, 16), residual=8, blocks=1, slices=2, entries=16)).eval()
    codes = torch.stack([net.encode(frames) for frames in clips.frames])
    table = CodeTable.counted(codes, 16)
    shape = TransformerShape(width=32, layers=1, heads=2, head_width=8, hidden=16, embedding=8, slices=2, entries=16)
    transformer = LatentTransformer(shape).eval()
    transformer.table.copy_(table.stacked())
    frames = clips.frames[0].numpy()
    by_table = table_surprise(net, table)(frames, 10.0)
    assert by_table.shape == (29,)
    assert (by_table > 0).all()
    # An untrained transformer adds nothing to the table that it starts from.
    np.testing.assert_allclose(transformer_surprise(net, transformer)(frames, 10.0), by_table, rtol=1e-4, atol=1e-5)
