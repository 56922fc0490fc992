"""The second pass finds the body axis on a surface, and labels of a crop come back to where they belong."""

import cv2
import numpy as np
import pytest
import torch
from rectangle_people import picture

from export.densepose.config import DecodeConfig, NetworkConfig
from export.densepose.crop_pass import CropGraphs, axis_of_surface, crop_maps, crop_of, painted
from export.densepose.network import MobileParsingRCNN
from export.densepose.person_crop import cut_label, rotation


def tilted(label: np.ndarray, degrees: float) -> np.ndarray:
    height, width = label.shape[:2]
    matrix = cv2.getRotationMatrix2D((width / 2 - 0.5, height / 2 - 0.5), -degrees, 1.0)
    return cv2.warpAffine(label, matrix, (width, height), flags=cv2.INTER_NEAREST)


def upright_torso(head: bool = True) -> np.ndarray:
    """Labels [160, 160, 3]: a torso whose U rises downwards, and a head over it."""
    label = np.zeros((160, 160, 3), np.uint8)
    label[60:120, 60:100, 0] = 2
    label[60:120, 60:100, 1] = np.linspace(10, 220, 60)[:, None]
    if head:
        label[40:60, 70:90, 0] = 23
    return label


@pytest.mark.parametrize("head", [True, False])
@pytest.mark.parametrize("degrees", [0, 40, -100, 180])
def test_the_axis_is_read_off_torso_and_head(degrees, head):
    axis = axis_of_surface(tilted(upright_torso(head), degrees))
    assert axis @ (rotation(degrees) @ [0, -1]) > np.cos(np.radians(3))


def test_without_a_torso_there_is_no_axis_and_nothing_is_rotated():
    label = upright_torso()
    label[label[..., 0] == 2] = 0
    assert axis_of_surface(label) is None
    mask = label[..., 0] > 0
    assert np.allclose(crop_of(mask, np.zeros(4), None, 64).into[0, 1], 0)


def test_only_who_leans_is_rotated():
    mask, box = upright_torso()[..., 0] > 0, np.array([60, 40, 100, 120.0])
    for degrees, turned in ((10, False), (-20, True), (170, True)):
        crop = crop_of(mask, box, rotation(degrees) @ [0, -1.0], 64)
        assert (abs(crop.into[0, 1]) > 1e-6) == turned
    empty = crop_of(np.zeros_like(mask), box, None, 64)
    assert np.allclose(empty.back[:, :2] @ empty.box[2:] + empty.back[:, 2], box[2:])


def maps_of(label: np.ndarray, side: int = 64) -> list[torch.Tensor]:
    """Returns the output of a perfect dense head for labels [s, s, 3] at its cells."""
    part = torch.from_numpy(label[..., 0]).long()
    index = 20.0 * torch.nn.functional.one_hot(part, 25).permute(2, 0, 1)
    coarse = torch.zeros(15, side, side)
    coarse[0], coarse[1] = 10.0 * (part == 0), 10.0 * (part > 0)
    u, v = (torch.from_numpy(label[..., k] / np.float32(255)).expand(25, -1, -1).contiguous() for k in (1, 2))
    return [coarse, index, u, v]


@pytest.mark.parametrize("degrees", [0, 35, 120])
def test_a_crops_labels_come_back_to_their_pixels(degrees):
    _, label = picture(np.random.default_rng(1), width=200, height=200, people=1)
    label = tilted(label, degrees)
    mask = label[..., 3] > 0
    crop = crop_of(mask, np.zeros(4), rotation(degrees) @ [0, -1.0], 256)
    seen = cut_label(label, crop)
    # Label cells of the person's box in the crop, as the dense head's grid has them.
    at = [crop.box[k] + (np.arange(64) + 0.5) / 64 * (crop.box[k + 2] - crop.box[k]) for k in (0, 1)]
    cells = seen[np.floor(at[1]).astype(int)[:, None], np.floor(at[0]).astype(int)[None]]
    back = painted(maps_of(cells[..., :3]), crop, mask.shape, DecodeConfig())
    found = back[..., 0] > 0
    assert (found & mask).sum() / (found | mask).sum() > 0.93
    both = found & mask
    assert (back[both, 0] == label[both, 0]).mean() > 0.93
    inner = cv2.erode((label[..., 0] == 2).astype(np.uint8), np.ones((9, 9))) > 0
    assert np.abs(back[inner, 1].astype(int) - label[inner, 1]).mean() < 12


def test_crops_of_an_image_go_through_the_network_together():
    torch.manual_seed(0)
    net = MobileParsingRCNN(NetworkConfig(width=16)).eval()
    image, label = picture(np.random.default_rng(0), people=2)
    crops = [crop_of(label[..., 3] == k, np.zeros(4), None, 64) for k in (1, 2)]
    together = crop_maps(CropGraphs.of_network(net), net.config, image, crops)
    alone = crop_maps(CropGraphs.of_network(net), net.config, image, crops[1:])
    assert [tuple(m.shape) for m in together] == [(2, 15, 64, 64), *[(2, 25, 64, 64)] * 3]
    for a, b in zip(together, alone, strict=True):
        assert torch.allclose(a[1], b[0], atol=1e-4)
