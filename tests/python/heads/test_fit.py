"""Stage 0 of the fit in Python: the crop of a photo, its head, codes and camera."""

from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")

from export.heads.fitting.anchor_fit import fit_anchors, observations_of  # noqa: E402
from export.heads.fitting.photo import Encoder, NoHead, crop, look_at, square  # noqa: E402
from export.heads.head_shards import is_face  # noqa: E402
from export.heads.prior_file import read_prior  # noqa: E402

ROUND = Path("tests/native/data/round_heads/bundle")  # by tests/native/generate/make_round_heads.py
CODES = np.array([1.5, 0.5, -1.5])  # of the head that the encoder of ROUND sees
GREY = np.full((200, 200, 3), 120, np.uint8)

pytestmark = pytest.mark.usefixtures("one_thread")


@pytest.fixture(scope="module")
def encoder():
    return Encoder(ROUND)


def test_the_codes_that_the_cells_show_are_found(encoder):
    prior = read_prior(ROUND / "prior.maqp")
    photo = look_at(encoder, GREY, (40, 30, 160, 170), focal_px=900.0)
    fit = fit_anchors(prior, observations_of(photo))
    assert fit.inliers > 0.9 * fit.cells
    # Size and distance look alike: what is compared is the shape.
    ratio = (1 + 0.07 * fit.codes) / (1 + 0.07 * CODES)
    assert np.ptp(ratio[[0, 2]]) < 0.01
    turn = fit.pose.camera().rotation @ np.array([0, -1, 0])
    assert np.degrees(np.arctan2(turn[0], -turn[2])) == pytest.approx(np.degrees(0.25), abs=2)


def test_a_head_is_found_without_a_box(encoder):
    photo = look_at(encoder, GREY)
    left, top, right, bottom = photo.box_px
    # The encoder of ROUND sees a head of 1 / 1.6 of any crop in its middle.
    assert [left + right, top + bottom] == pytest.approx([200, 200], abs=10)
    assert 40 < left < 80


def test_photos_that_show_no_head_are_refused(encoder):
    with pytest.raises(NoHead, match="--box"):
        look_at(encoder, np.zeros_like(GREY))
    with pytest.raises(NoHead, match=r"in the box \(40, 30, 160, 170\)"):
        look_at(encoder, np.zeros_like(GREY), (40, 30, 160, 170))
    mirrored = np.zeros_like(GREY)
    mirrored[..., 0] = 250  # the encoder of ROUND sees a head there that no camera explains
    with pytest.raises(NoHead, match="mirrored"):
        fit_anchors(read_prior(ROUND / "prior.maqp"), observations_of(look_at(encoder, mirrored, (40, 30, 160, 170))))


def test_crops_are_bilinear_and_grey_beyond_the_photo():
    y, x = np.mgrid[:100, :100]
    bgr = np.dstack([x, y, x + y]).astype(np.uint8)  # planes, which any resampling keeps
    to_photo = square((30, 40, 70, 80), 0.3, 1.0, 64)
    made = crop(bgr, to_photo, 64)
    at = to_photo[:, :2] @ (20.5, 40.5) + to_photo[:, 2] - 0.5
    np.testing.assert_allclose(made[40, 20], [at.sum(), at[1], at[0]], atol=1e-3)
    assert (crop(bgr, square((-200, -200, -150, -150), 0, 1.0, 64), 64) == 127).all()


def test_faces_are_told_by_template_points():
    assert is_face(np.array([[0.0, -1.24, -0.35], [0, 1, 0]])).tolist() == [True, False]
