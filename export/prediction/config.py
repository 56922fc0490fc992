"""Shapes of the networks: those of the paper (Latent Video Transformer, arXiv 2006.10704, BAIR) and light ones."""

from __future__ import annotations

from dataclasses import dataclass

CODE_SIDE = 16  # codes a side of a frame of 64 x 64


@dataclass(frozen=True)
class AutoencoderShape:
    """widths: channels at 32 x 32 and at 16 x 16; residual: channels within a residual block; slices: codes a cell,
    each from a codebook of `entries`; depth_to_space: convolution and rearrangement for transposed convolutions; side:
    cells of a frame in a row, 16 or 8 (everything behind the autoencoder takes 16)."""

    widths: tuple[int, int] = (64, 128)
    residual: int = 64
    blocks: int = 2
    slices: int = 4
    entries: int = 512
    depth_to_space: bool = True
    side: int = CODE_SIDE


@dataclass(frozen=True)
class TransformerShape:
    """layers: of the context network; slice_layers: of the slice network, where they are not as many; embedding:
    channels of embedded codes; frames: how many before the predicted one are seen; motion: whether the codes of the
    image that motion alone predicts are seen as well; slices, entries: of the autoencoder."""

    width: int = 192
    layers: int = 6
    heads: int = 6
    head_width: int = 32
    hidden: int = 384
    embedding: int = 64
    frames: int = 3
    slices: int = 4
    entries: int = 512
    motion: bool = False
    slice_layers: int | None = None

    @property
    def layers_of_slices(self) -> int:
        return self.layers if self.slice_layers is None else self.slice_layers

    @property
    def seen(self) -> int:
        """Frames of codes that the context network is given: those before, oldest first, and last the one by motion."""
        return self.frames + self.motion


AUTOENCODERS = {
    "light": AutoencoderShape(),
    "paper": AutoencoderShape(widths=(128, 256), residual=128, depth_to_space=False),
}
TRANSFORMERS = {
    "light": TransformerShape(motion=True),
    "paper": TransformerShape(width=512, layers=8, heads=8, head_width=128, hidden=512, embedding=128),
}
