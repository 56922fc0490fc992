"""The networks of a bundle of scenes, of any precision, in place of those in torch: for `export.scenes.fitting`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from export.densepose.graphs import session
from export.scenes.bundle import BASIS
from export.scenes.networks.basis import Basis
from export.scenes.networks.light_refiner import depth_to_space, space_to_depth
from quantization.samples import Sample


class _Graph(nn.Module):
    """A graph of a bundle, as a part of `export.scenes.networks.system.Networks`."""

    def __init__(self, path: Path, threads: int) -> None:
        super().__init__()
        self.session = session(path, threads)
        self.seen: list[Sample] | None = None  # a list is filled with what the graph is given

    def run(self, tensors: Sequence[Tensor]) -> Tensor:
        """Channels first at both ends."""
        names = [value.name for value in self.session.get_inputs()]
        given = {n: t.permute(0, 2, 3, 1).contiguous().numpy() for n, t in zip(names, tensors, strict=True)}
        if self.seen is not None:
            self.seen.append(given)
        (found,) = self.session.run(None, given)
        return torch.from_numpy(found).permute(0, 3, 1, 2)


class _Extractor(_Graph):
    def forward(self, image: Tensor) -> Tensor:
        return self.run([image])


class _Refiner(_Graph):
    def forward(self, rasters: list[Tensor]) -> Tensor:
        used = rasters[: len(self.session.get_inputs())]
        return depth_to_space(self.run([space_to_depth(used[0]), *used[1:]]))


class BundleNetworks(nn.Module):
    """The networks of a bundle of any precision. Raises ValueError for a basis of another size."""

    def __init__(self, folder: Path, threads: int = 1) -> None:
        super().__init__()
        self.extractor = _Extractor(folder / "extractor.onnx", threads)
        self.refiner = _Refiner(folder / "refiner.onnx", threads)
        self.basis = Basis()
        values = torch.from_numpy(np.fromfile(folder / BASIS, "<f4"))
        if len(values) != sum(p.numel() for p in self.basis.parameters()):
            raise ValueError(f"{folder / BASIS} has {len(values)} numbers")
        nn.utils.vector_to_parameters(values, self.basis.parameters())
