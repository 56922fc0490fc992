"""PSNR and SSIM are those that others compute."""

import numpy as np
import pytest

from export.scenes.image_quality import C1, psnr_db, ssim


def pictures() -> tuple[np.ndarray, np.ndarray]:
    y, x = np.mgrid[0:40, 0:56]
    a = np.stack([0.5 + 0.4 * np.sin(x / 5 + k) * np.cos(y / 7) for k in range(3)], 2)
    return a, np.clip(0.9 * a + 0.05 + 0.1 * np.cos(x * y / 11)[..., None], 0, 1)


def test_psnr_follows_from_the_mean_square():
    a = np.full((4, 5, 3), 0.5, np.float32)
    assert psnr_db(a, a + np.float32(0.1)) == pytest.approx(20, abs=1e-5)
    assert psnr_db(a, a) == pytest.approx(100)
    half = a.copy()
    half[:2] += 0.1
    assert psnr_db(half, a) == pytest.approx(20 + 10 * np.log10(2), abs=1e-5)


def test_ssim_is_that_of_scikit_image():
    # structural_similarity(a, b, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1,
    # channel_axis=2) of scikit-image 0.25.2.
    assert ssim(*pictures()) == pytest.approx(0.62405579972681, abs=1e-9)


def test_ssim_of_flat_images_is_that_of_their_brightness():
    a, b = np.full((16, 16, 3), 0.25), np.full((16, 16, 3), 0.75)
    assert ssim(a, b) == pytest.approx((2 * 0.25 * 0.75 + C1) / (0.25**2 + 0.75**2 + C1))


def test_ssim_is_one_for_the_same_and_does_not_care_for_order():
    a, b = pictures()
    assert ssim(a, a) == pytest.approx(1)
    assert ssim(a, b) == pytest.approx(ssim(b, a))
    assert ssim(a, 1 - a) < 0


@pytest.mark.parametrize("shape", [(10, 40, 3), (40, 40), (40, 41, 3)])
def test_what_cannot_be_compared_is_refused(shape):
    with pytest.raises(ValueError, match="SSIM compares"):
        ssim(np.zeros(shape), np.zeros((40, 40, 3)))
