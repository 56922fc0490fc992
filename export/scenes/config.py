"""The sizes of the networks of NPBG++ (arXiv 2203.13318) in one place, as published and as the SDK uses them."""

from __future__ import annotations

from dataclasses import dataclass, field

FEATURES = 8  # values of a point's descriptor
COLOURS = 3  # of them that are the photo's red, green, blue
BASIS = 6  # functions of the direction that the descriptor is a combination of
RASTER = FEATURES + 1  # with the occupancy
LEVELS = 5  # rasters at 1, 1/2, 1/4, 1/8, 1/16
MULTIPLE = 2 ** (LEVELS - 1)  # sides of rendered images, pixels
DEPTH_TOLERANCE = 0.1  # a point so much farther than one beside it is occluded (export.scenes.geometry.raster)
ROTATED_MULTIPLE = 64  # sides of those that are rotated afterwards: of every size is a network prepared anew (SDK)
BACKGROUND_PX = 16  # side of blocks of a photo that without a point in them are background
ALPHA = 1.0  # of the ridge regression, as in the paper


@dataclass(frozen=True)
class ExtractorConfig:
    """Channels of the decoder's outputs, from stride 16 to 1.

    The paper's are (256, 128, 64, 32, 16). These have a third of the multiply-adds: at full resolution, where most of
    them are, the width is the paper's.
    """

    widths: tuple[int, ...] = (96, 64, 32, 24, 16)


@dataclass(frozen=True)
class RefinerConfig:
    """widths: channels at 1/2, 1/4, ... of the image; rasters coarser than the last are not read."""

    widths: tuple[int, ...] = (24, 32, 48, 64)

    def __post_init__(self) -> None:
        if not self.widths or min(self.widths) < 1 or self.levels > LEVELS:
            raise ValueError(f"A refiner reads at most {LEVELS} rasters with positive widths, not {self.widths}.")

    @property
    def levels(self) -> int:
        """How many rasters it reads, the finest first."""
        return len(self.widths) + 1


@dataclass(frozen=True)
class SceneConfig:
    """All networks of a system."""

    extractor: ExtractorConfig = field(default_factory=ExtractorConfig)
    refiner: RefinerConfig = field(default_factory=RefinerConfig)


SIZES = {
    "tiny": SceneConfig(ExtractorConfig((32, 24, 16, 16, 16)), RefinerConfig(widths=(16, 16, 24, 24))),
    "small": SceneConfig(),
}
