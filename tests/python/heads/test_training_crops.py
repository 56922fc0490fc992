"""Crops of a whole batch: labels lie where the image shows them, also in mirrored, turned and enlarged ones."""

import numpy as np
import pytest
import torch

from export.heads.encoder import CELL_PX, CELLS, CROP_PX, at_pixels
from export.heads.encoder_training import crops
from export.heads.encoder_training.crops import Backgrounds, Cropper, RealFaces
from export.heads.encoder_training.head_images import Pool, face_boxes
from export.heads.encoder_training.image_corruptions import as_cameras_see, blurred, coarse, compressed
from export.heads.head_shards import POINT_SCALE, SIDE


@pytest.fixture
def plain(monkeypatch):
    """Crops without faults and without anything before the head."""
    monkeypatch.setattr(crops, "as_cameras_see", lambda image, kernels, random: image)
    monkeypatch.setattr(crops, "occluded", lambda image, backgrounds, random: (image, torch.zeros_like(image[:, :1])))


@pytest.fixture
def cropper():
    backgrounds = Backgrounds(torch.full((2, 256, 256, 3), 7, dtype=torch.uint8))
    kernels = torch.zeros(1, 11, 11)
    kernels[0, 5, 5] = 1
    return Cropper(backgrounds, kernels, torch.device("cpu"), 0)


def pool_of_places() -> Pool:
    """One image whose colours say its template points: a disc, red by |x|, green by y, blue by z."""
    at = (torch.arange(SIDE) - (SIDE - 1) / 2) / SIDE
    y, x = torch.meshgrid(at, at, indexing="ij")
    template = torch.stack([2 * x, 0.5 + x * y, -2 * y], -1)
    disc = x**2 + y**2 < 0.3**2
    planes = torch.zeros(SIDE, SIDE, 4)
    planes[..., 0], planes[..., 1:3] = 40 + 200 * template[..., 0].abs(), 100 + 100 * template[..., 1:]
    planes[..., 3] = 255
    planes *= disc[..., None]
    normal = torch.stack([x, y, -torch.sqrt(1 - x**2 - y**2)], -1) * disc[..., None]
    half = slice(None, None, 2)
    face = face_boxes((disc & (x.abs() < 0.15) & (y.abs() < 0.2))[half, half][None])
    return Pool(
        planes.round().to(torch.uint8)[None],
        (template * disc[..., None] * POINT_SCALE).to(torch.int16)[None, half, half],
        (normal * 127).round().to(torch.int8)[None, half, half], face,
    )  # fmt: skip


def correlation(first: torch.Tensor, second: torch.Tensor, on: torch.Tensor) -> torch.Tensor:
    """[B], of cells [B, 48, 48] that are `on`."""
    pairs = zip(first, second, on, strict=True)
    return torch.stack([torch.corrcoef(torch.stack([a[m], b[m]]))[0, 1] for a, b, m in pairs])


def test_labels_lie_where_the_crop_shows_them(plain, cropper):
    pool = pool_of_places()
    assert np.allclose(pool.face[0].numpy(), [179, 153, 332, 358], atol=3)
    image, template, matte, normal = cropper.made(pool, 1, 48)
    assert image.shape == (48, CROP_PX, CROP_PX, 3)
    assert template.shape == normal.shape == (48, CELLS, CELLS, 3)
    on = matte > 0.999
    assert 0.2 < on.float().mean() < 0.8
    shown = (image[:, 1::CELL_PX, 1::CELL_PX] + image[:, 2::CELL_PX, 2::CELL_PX]) / 2
    expected = torch.stack([40 + 200 * template[..., 0].abs(), *(100 + 100 * template[..., 1:]).unbind(-1)], -1)
    off = (shown - expected)[on].abs()
    assert off.mean() < 1.5  # a pixel of the image is 0.8
    assert off.max() < 12  # |x| has an edge
    # Off the disc is background, and no matte.
    assert (image[:, 1::CELL_PX, 1::CELL_PX][matte == 0] - 7).abs().float().median() < 1
    # A mirrored crop shows the mirrored head: x of template points and of normals change their signs together.
    assert (correlation(template[..., 0], normal[..., 0], on) > 0.5).all()
    turned = correlation(-template[..., 0] * template[..., 2], template[..., 1], on)
    assert (turned > 0.9).sum() > 12
    assert (turned < -0.9).sum() > 12


def test_sizes_are_those_of_training(plain, cropper):
    """Half of the crops show the face alone."""
    pool = pool_of_places()
    matte = cropper.made(pool, 1, 60)[2]
    full = matte.mean((1, 2)) > 0.9
    assert 0.1 < full.float().mean() < 0.7


def test_points_of_real_faces_lie_where_the_crop_shows_them(plain, cropper):
    rng = np.random.default_rng(0)
    pixel = rng.uniform(160, 350, (2, 5, 2)).astype(np.float32)
    rgb = np.zeros((2, SIDE, SIDE, 3), np.float32)
    y, x = np.mgrid[:SIDE, :SIDE]
    rgb[..., 0], rgb[..., 1] = x / 2, y / 2  # colours say places
    known = torch.ones(2, SIDE, SIDE, 2, dtype=torch.uint8)
    known[..., 1] = 0
    template = torch.from_numpy(rng.normal(size=(5, 3)).astype(np.float32))
    faces = RealFaces.of(
        torch.from_numpy(rgb.astype(np.uint8)), known, torch.from_numpy(pixel), torch.ones(2, 5), template
    )
    image, at, points, weight, matte = cropper.real(faces, 40)
    whole = torch.nn.functional.interpolate(image.permute(0, 3, 1, 2), scale_factor=CELLS / CROP_PX, mode="area")
    found = at_pixels(whole.permute(0, 2, 3, 1), at)[..., :2]
    # Each of a crop's points is one of its face's: the nearest of both faces by what the crop shows.
    inner = (at > 8).all(-1) & (at < CROP_PX - 9).all(-1) & (weight > 0)
    assert inner.sum() > 60
    expected = torch.from_numpy(pixel) / 2
    off = (found[:, None] - expected[None]).norm(dim=-1)  # [B, face, P]
    off = off.masked_fill(~inner[:, None], 0).amax(-1).amin(1)
    assert off.max() < 2.5
    assert ((points[:, :, 0] / template[:, 0]).round().abs() == 1).all()
    assert {-1.0, 1.0} == set((points[:, 0, 0] / template[0, 0]).round().tolist())
    assert (matte <= 1).all()
    assert (matte == 1).float().mean() > 0.5
    assert ((weight > 0) == (weight == 1)).all()


def test_nothing_before_the_head_is_learnt_from(cropper, monkeypatch):
    """Where something covers the head, the matte is 0."""
    monkeypatch.setattr(crops, "as_cameras_see", lambda image, kernels, random: image)
    pool = pool_of_places()
    covers = []
    real = crops.occluders

    def kept(*arguments):
        covers.append(real(*arguments))
        return covers[-1]

    monkeypatch.setattr(crops, "occluders", kept)
    matte = cropper.made(pool, 1, 64)[2]
    cover = covers[0]
    assert 0.1 < (cover.amax((1, 2, 3)) > 0.9).float().mean() < 0.5
    wholly = torch.nn.functional.avg_pool2d(cover, CELL_PX)[:, 0] > 0.999
    assert wholly.sum() > 100
    assert matte[wholly].max() < 0.01


def test_blurs_keep_the_mean_and_coarse_is_bilinear_between_means():
    random = torch.Generator().manual_seed(0)
    image = 255 * torch.rand(3, 3, 48, 48, generator=random)
    sigma = torch.tensor([0.0, 0.8, 1.5]).view(3, 1, 1, 1)
    soft = blurred(image, sigma, 5)
    assert torch.allclose(soft[0], image[0], atol=1e-2)
    assert soft[2].std() < soft[1].std() < 0.7 * image[1].std()
    assert (soft.mean((1, 2, 3)) - image.mean((1, 2, 3))).abs().max() < 3
    ramp = torch.arange(48.0).expand(2, 3, 48, 48)
    share = torch.tensor([0.25, 1.0]).view(2, 1, 1, 1)
    out = coarse(ramp, share)
    assert torch.equal(out[1], ramp[1])
    assert (out[0] - ramp[0])[:, 12:36, 12:36].abs().max() < 0.2
    again = coarse(image, share.new_full((3, 1, 1, 1), 0.25))
    assert again.std() < 0.5 * image.std()


def test_compression_is_that_of_jpeg():
    import cv2

    rng = np.random.default_rng(0)
    small = rng.uniform(0, 255, (12, 12, 3)).astype(np.float32)
    image = cv2.resize(small, (96, 96), interpolation=cv2.INTER_CUBIC).clip(0, 255).astype(np.uint8)
    tensor = torch.from_numpy(image).permute(2, 0, 1)[None].float()
    errors = {}
    for quality in (25, 80):
        coded = cv2.imencode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
        theirs = cv2.imdecode(coded, 1)[..., ::-1].astype(float) - image
        ours = compressed(tensor, torch.full((1, 1, 1, 1), float(quality)))[0].permute(1, 2, 0).numpy() - image
        errors[quality] = np.sqrt((ours.mean(-1) ** 2).mean()), np.sqrt((theirs.mean(-1) ** 2).mean())
        assert 0.5 < errors[quality][0] / errors[quality][1] < 1.6
    assert errors[25][0] > 1.5 * errors[80][0]


def test_cameras_leave_images_recognizable():
    image = pool_of_places().planes[..., :3].permute(0, 3, 1, 2)[..., ::4, ::4].float().expand(64, -1, -1, -1)
    image = torch.nn.functional.interpolate(image, size=(CROP_PX, CROP_PX))
    kernels = torch.zeros(1, 11, 11)
    kernels[0, 5, 2:9] = 1 / 7
    seen = as_cameras_see(image, kernels, torch.Generator().manual_seed(0))
    assert seen.shape == image.shape
    assert torch.isfinite(seen).all()
    assert seen.min() >= 0
    assert seen.max() <= 255
    alike = torch.stack([torch.corrcoef(torch.stack([a.mean(0).flatten(), b.mean(0).flatten()]))[0, 1]
                         for a, b in zip(image, seen, strict=True)])  # fmt: skip
    assert alike.min() > 0.75
    assert (seen - image).abs().mean((1, 2, 3)).std() > 2
