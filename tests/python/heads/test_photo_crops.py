"""Training crops of real faces: labels stay on what they name, and losses count only what is known."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")

from export.heads.encoder import CELL_PX, CELLS, OUTPUTS, at_pixels, photo_losses, photo_metrics  # noqa: E402
from export.heads.photos.faces import HEAD, NOTHING, UNKNOWN, PhotoFaces  # noqa: E402
from export.heads.photos.judge import batched_photos, crop_photo  # noqa: E402


def faces() -> PhotoFaces:
    """A black image with one white dot where its second point is seen; the left half head, a column unknown."""
    rgb = np.zeros((1, 256, 256, 3), np.uint8)
    rgb[0, 97:104, 117:124] = 255
    matte = np.full((1, 256, 256), NOTHING, np.uint8)
    matte[..., :128] = HEAD
    matte[..., 128:140] = UNKNOWN
    pixel = np.array([[[10.0, 10.0], [120.0, 100.0]]], np.float32)
    template = np.array([[0.5, 0, 0], [0.3, -1, 0.2]], np.float32)
    return PhotoFaces(rgb, pixel, template, np.ones((1, 2), np.float32), matte, np.zeros((1, 3), np.float32))


def test_points_stay_on_their_pixels():
    crop = crop_photo(faces(), 0)
    y, x = np.nonzero((crop.image > 180).all(-1))
    assert np.abs(crop.pixel[1] - [x.mean(), y.mean()]).max() < 1
    assert not crop.weight[0]  # outside the crop
    assert crop.weight[1]


def test_mattes_know_what_is_known():
    crop = crop_photo(faces(), 0)
    assert set(np.unique(crop.matte)) == {-1.0, 0.0, 1.0}
    assert (crop.matte[5:40, 5:20] == 1).all()
    assert (crop.matte[5:40, 30:44] == 0).all()
    assert (crop.matte[10, 24:26] == -1).all()


def test_cells_are_read_between_their_middles():
    middle = CELL_PX * torch.arange(CELLS) + (CELL_PX - 1) / 2
    y, x = torch.meshgrid(middle, middle, indexing="ij")
    cells = torch.stack([x, y], -1)[None]
    pixel = torch.tensor([[[1.5, 1.5], [30.0, 77.25], [100.0, 140.0]]])
    assert torch.allclose(at_pixels(cells, pixel), pixel, atol=1e-3)


def right(matte_logit: float = 8.0) -> tuple[torch.Tensor, tuple[torch.Tensor, ...]]:
    """Cells that say what the labels of `faces` say."""
    batch = batched_photos([crop_photo(faces(), 0)])
    cells = torch.zeros(1, CELLS, CELLS, OUTPUTS)
    cells[..., :3] = torch.from_numpy(faces().template[1])
    cells[..., 3] = -4
    cells[..., 4] = matte_logit * (2 * batch[4] - 1)
    batch[3][:, 0] = 0
    return cells, batch[1:]


def test_losses_and_metrics_count_known_points_and_cells_alone():
    cells, labels = right()
    terms = photo_losses(cells, *labels)
    assert set(terms) == {"point", "coarse", "matte"}
    assert terms["coarse"] == pytest.approx(0, abs=1e-6)
    assert terms["matte"] < 0.01
    found = photo_metrics(cells, *labels)
    assert found["photo_mm"] == pytest.approx(0, abs=1e-4)
    assert found["photo_matte_iou"] == 1
    cells[..., 0] += 0.1
    assert photo_metrics(cells, *labels)["photo_mm"] == pytest.approx(10, abs=1e-3)
    assert photo_losses(cells, *labels)["coarse"] == pytest.approx(0.1, abs=1e-5)
    cells[labels[3] < 0] = 1e4  # cells of which nothing is known
    assert photo_losses(cells, *labels)["matte"] < 0.01
    labels[2][:] = 0  # no points at all
    assert torch.isfinite(photo_losses(cells, *labels)["point"])
