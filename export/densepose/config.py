"""The network's settings in one place ("Making DensePose Fast and Light", WACV 2021)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar


@dataclass(frozen=True)
class NetworkConfig:
    """Sizes of the network. `width`: channels of neck, RPN, box head and dense head (64 = variant B); `axis`: whether
    the box head also tells the direction of the body axis; `evidence`: channels of `PersonEvidence`, `keypoints`: how
    many of them the dense head tells; both 0 without."""

    BACKBONES: ClassVar[dict[str, tuple[int, ...]]] = {  # and their channels at strides 4, 8, 16, 32
        "mobilenet_v2": (24, 32, 96, 160),
        "mobilenet_v3_large": (24, 40, 112, 160),
    }

    width: int = 64
    backbone: str = "mobilenet_v2"
    axis: bool = False
    evidence: int = 0
    keypoints: int = 0
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

    @property
    def tap_channels(self) -> tuple[int, ...]:
        return self.BACKBONES[self.backbone]

    @staticmethod
    def of(saved: dict[str, Any]) -> NetworkConfig:
        """The network that a checkpoint or weights file of `export.densepose.train` holds."""
        return NetworkConfig(
            width=saved["width"],
            backbone=saved.get("backbone", "mobilenet_v3_large"),
            axis=saved.get("axis", False),
            evidence=saved.get("evidence", 0),
            keypoints=saved.get("keypoints", 0),
        )


@dataclass(frozen=True)
class DecodeConfig:
    """Thresholds and limits of inference."""

    long_side: int = 288
    pre_nms_top_k: int = 1000
    post_nms_top_k: int = 50  # half of the paper's 100: the same AP and a millisecond less
    rpn_nms_iou: float = 0.7
    score_threshold: float = 0.6
    box_nms_iou: float = 0.5
    # Boxes with more than this score go through the box head again, from where its first pass put them (None: one
    # pass). The second pass depends less on which proposals there were: recall .72 -> .74 at the same precision, box
    # AP + .6 on 300 images. A third pass gained nothing.
    second_pass_threshold: float | None = 0.3
    # Painted where the person is likelier than this. Below a half, since the best mask by IoU is the more generous the
    # less sure a network is (for Dice d, the best threshold is d / 2); this one gave the best IoU on validation.
    mask_threshold: float = 0.42
    # A person of whose pixels a smaller fraction is visible past better scored people is a second box on one of them.
    min_visible_fraction: float = 0.3
    max_people: int = 20
