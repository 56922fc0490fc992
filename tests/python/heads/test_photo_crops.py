"""Training crops of real faces: labels stay on what they name, and losses count only what is known."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")

from export.heads.encoder import CELL_PX, CELLS, OUTPUTS, at_pixels, photo_figures, photo_losses  # noqa: E402
from export.heads.photos.crops import MixedStream, batched_photos, crop_photo  # noqa: E402
from export.heads.photos.faces import HEAD, NOTHING, UNKNOWN, PhotoFaces  # noqa: E402


class Grey:
    """Backgrounds of one grey."""

    def crop(self, rng, side):
        return np.full((side, side, 3), 100, np.uint8)


def faces() -> PhotoFaces:
    """A black picture with one white dot where its second point is seen; the left half head, a column unknown."""
    rgb = np.zeros((1, 256, 256, 3), np.uint8)
    rgb[0, 97:104, 117:124] = 255
    matte = np.full((1, 256, 256), NOTHING, np.uint8)
    matte[..., :128] = HEAD
    matte[..., 128:140] = UNKNOWN
    pixel = np.array([[[10.0, 10.0], [120.0, 100.0]]], np.float32)
    template = np.array([[0.5, 0, 0], [0.3, -1, 0.2]], np.float32)
    return PhotoFaces(rgb, pixel, template, np.ones((1, 2), np.float32), matte, np.zeros((1, 3), np.float32))


@pytest.mark.parametrize("seed", range(12))
def test_points_stay_on_their_pixels(seed, monkeypatch):
    monkeypatch.setattr("export.heads.photos.crops.as_cameras_see", lambda image, rng: image)
    monkeypatch.setattr("export.heads.photos.crops.occluded", lambda image, *rest: (image, np.zeros(image.shape[:2])))
    crop = crop_photo(faces(), 0, Grey(), np.random.default_rng(seed))
    white = np.where((crop.image > 180).all(-1), 1.0, 0.0)
    white[:, :2] = white[:, -2:] = 0
    y, x = np.nonzero(white * (np.hypot(*(np.indices(white.shape)[::-1] - crop.pixel[1][:, None, None])) < 12))
    assert np.abs(crop.pixel[1] - [x.mean(), y.mean()]).max() < 1
    assert abs(crop.template[1, 0]) == pytest.approx(0.3)


def test_about_half_are_mirrored_and_their_points_with_them():
    rng, mirrored = np.random.default_rng(0), 0
    for _ in range(40):
        crop = crop_photo(faces(), 0, Grey(), rng)
        flipped = crop.pixel[1, 0] < crop.pixel[0, 0]
        assert (crop.template[1, 0] < 0) == flipped
        assert crop.template[1, 1] == -1
        mirrored += flipped
    assert 8 < mirrored < 32


def test_mattes_know_what_is_known():
    crop = crop_photo(faces(), 0, None, np.random.default_rng(0), augment=False)
    assert set(np.unique(crop.matte)) == {-1.0, 0.0, 1.0}
    assert (crop.matte[5:40, 5:20] == 1).all()
    assert (crop.matte[5:40, 30:44] == 0).all()
    assert (crop.matte[10, 24:26] == -1).all()


def test_what_is_covered_or_outside_weighs_nothing(monkeypatch):
    everything = np.ones((192, 192), np.float32)
    monkeypatch.setattr("export.heads.photos.crops.occluded", lambda image, *rest: (image, everything))
    covered = [crop_photo(faces(), 0, Grey(), np.random.default_rng(seed)) for seed in range(20)]
    assert {float(crop.weight[1]) for crop in covered} == {0.0, 1.0}
    for crop in covered:
        inside = ((crop.pixel >= 0) & (crop.pixel <= 191)).all(1)
        assert not crop.weight[~inside].any()


def test_cells_are_read_between_their_middles():
    middle = CELL_PX * torch.arange(CELLS) + (CELL_PX - 1) / 2
    y, x = torch.meshgrid(middle, middle, indexing="ij")
    cells = torch.stack([x, y], -1)[None]
    pixel = torch.tensor([[[1.5, 1.5], [30.0, 77.25], [100.0, 140.0]]])
    assert torch.allclose(at_pixels(cells, pixel), pixel, atol=1e-3)


def right(matte_logit: float = 8.0) -> tuple[torch.Tensor, tuple[torch.Tensor, ...]]:
    """Cells that say what the labels of `faces` say."""
    batch = batched_photos([crop_photo(faces(), 0, None, np.random.default_rng(0), augment=False)])
    cells = torch.zeros(1, CELLS, CELLS, OUTPUTS)
    cells[..., :3] = torch.from_numpy(faces().template[1])
    cells[..., 3] = -4
    cells[..., 4] = matte_logit * (2 * batch[4] - 1)
    batch[3][:, 0] = 0
    return cells, batch[1:]


def test_losses_and_figures_count_known_points_and_cells_alone():
    cells, labels = right()
    terms = photo_losses(cells, *labels)
    assert set(terms) == {"point", "coarse", "matte"}
    assert terms["coarse"] == pytest.approx(0, abs=1e-6)
    assert terms["matte"] < 0.01
    found = photo_figures(cells, *labels)
    assert found["photo_mm"] == pytest.approx(0, abs=1e-4)
    assert found["photo_matte_iou"] == 1
    cells[..., 0] += 0.1
    assert photo_figures(cells, *labels)["photo_mm"] == pytest.approx(10, abs=1e-3)
    assert photo_losses(cells, *labels)["coarse"] == pytest.approx(0.1, abs=1e-5)
    cells[labels[3] < 0] = 1e4  # cells of which nothing is known
    assert photo_losses(cells, *labels)["matte"] < 0.01
    labels[2][:] = 0  # no points at all
    assert torch.isfinite(photo_losses(cells, *labels)["point"])


class Made(MixedStream):
    def __init__(self, share: float) -> None:
        super().__init__([], Grey(), 16, 0, photos=[faces()], share=share)


def test_a_mixed_batch_holds_the_share_in_the_mean_and_both_kinds(monkeypatch):
    from export.heads.encoder_data import CropStream

    monkeypatch.setattr(CropStream, "random_batch", lambda self, rng, count: (torch.zeros(count, 1),))
    stream = iter(Made(0.2))
    sizes = np.array([[len(made[0]), len(real[0])] for made, real in (next(stream) for _ in range(40))])
    assert (sizes.sum(1) == 16).all()
    assert 2.9 < sizes[:, 1].mean() < 3.5
    assert {len(next(iter(Made(0.001)))[1][0])} == {1}
    with pytest.raises(ValueError, match="between 0 and 1"):
        Made(1.0)


def test_the_training_counts_each_crop_of_a_mixed_batch_the_same(monkeypatch):
    from export.heads import train_encoder

    def encoder(image):
        return torch.zeros(len(image), CELLS, CELLS, OUTPUTS)

    monkeypatch.setattr(train_encoder, "losses", lambda cells, *rest: {"coarse": torch.tensor(float(len(cells)))})
    monkeypatch.setattr(train_encoder, "photo_losses", lambda cells, *rest: {"coarse": torch.tensor(1.0)})
    made, real = (torch.zeros(12, 192, 192, 3),), (torch.zeros(4, 192, 192, 3),)
    terms = train_encoder.batch_losses(encoder, (made, real), "float32")
    assert {name: float(value) for name, value in terms.items()} == {"coarse": 9.0, "photo_coarse": 0.25}
    assert set(train_encoder.batch_losses(encoder, made, "float32")) == {"coarse"}


def test_the_training_makes_no_threads_that_its_worker_would_wait_for(tmp_path, monkeypatch):
    """OpenCV's pool of threads, made before the loader's fork, hangs the worker."""
    import cv2

    from export.heads import train_encoder

    monkeypatch.setattr("sys.argv", ["train_encoder", "--data", str(tmp_path), "--out", str(tmp_path / "run")])
    before = cv2.getNumThreads()
    try:
        cv2.setNumThreads(2)
        with pytest.raises(FileNotFoundError):
            train_encoder.main()
        assert cv2.getNumThreads() == 1
    finally:
        cv2.setNumThreads(before)
