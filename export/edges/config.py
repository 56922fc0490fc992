"""The sizes of the edge network, and what its planes mean.

Lengths are in footprints: r = depth / focal length in pixels, metres between neighbouring pixels of a surface seen
head-on at that depth. A network that reads slopes and answers in r knows no scale.
"""

from __future__ import annotations

from dataclasses import dataclass

EPS_R = 16.0  # distances are cut off there (the paper's 50 r are on 64 x 64 px crops of one resolution)
SHARP_R = (1.0, 4.0)  # a pixel nearer than that to a sharp curve is a sharp one: the paper's two thresholds
INPUT_PLANES = 3  # slope in x, slope in y, known
FOLD = 2  # 2 x 2 pixels become channels, on the way in and on the way out
KINDS = 2  # crease, boundary: logits


@dataclass(frozen=True)
class NetworkConfig:
    """widths: channels at 1/2, 1/4, 1/8, ... of the frame. bins: 0 for one distance and its spread per pixel, else a
    histogram of so many bins over 0..EPS_R (the paper's loss). blocks: residual blocks at 1/4, 1/8, ..., or none."""

    widths: tuple[int, ...] = (24, 32, 48, 64)
    bins: int = 0
    blocks: tuple[int, ...] = ()

    @property
    def multiple(self) -> int:
        """Sides of a frame are multiples of it, pixels."""
        return FOLD * 2 ** (len(self.widths) - 1)

    @property
    def planes(self) -> int:
        """Values of a pixel in the output."""
        return (self.bins or 2) + KINDS


SIZES = {
    "xs": NetworkConfig((16, 24, 32, 48)),
    "s": NetworkConfig((24, 32, 48, 64)),
    "m": NetworkConfig((32, 48, 64, 96)),
    "l": NetworkConfig((48, 64, 96, 128)),
    "xl": NetworkConfig((48, 64, 96, 128), blocks=(1, 1, 1)),
}
