"""The network's settings in one place ("Making DensePose Fast and Light", WACV 2021)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class NetworkConfig:
    """Sizes of the network. `width`: channels of neck, RPN, box head and dense head (64 = variant B)."""

    width: int = 64
    tap_channels: tuple[int, ...] = (24, 40, 112, 160)
    tap_strides: tuple[int, ...] = (4, 8, 16, 32)
    rpn_strides: tuple[int, ...] = (4, 8, 16, 32, 64)
    anchor_sizes: tuple[int, ...] = (32, 64, 128, 256, 512)
    aspect_ratios: tuple[float, ...] = (0.5, 1.0, 2.0)
    box_pool: int = 7
    dense_pool: int = 32
    aspp_dilations: tuple[int, ...] = (6, 12, 18)
    coarse_classes: int = 15
    index_classes: int = 25
    canonical_level: int = 4
    canonical_size: int = 224
    delta_weights: tuple[float, ...] = (10.0, 10.0, 5.0, 5.0)


@dataclass(frozen=True)
class DecodeConfig:
    """Thresholds and limits of inference."""

    long_side: int = 256
    pre_nms_top_k: int = 1000
    post_nms_top_k: int = 100
    rpn_nms_iou: float = 0.7
    score_threshold: float = 0.7
    box_nms_iou: float = 0.5
    # Painted where the person is likelier than this. Below a half, since the best mask by IoU is the more generous the
    # less sure a network is (for Dice d, the best threshold is d / 2); this one gave the best IoU on validation.
    mask_threshold: float = 0.42
    max_people: int = 20
