"""The field network of heads in torch; the C++ engine (sdk/src/head/field) computes the same formulas.

encoding  e = [x, y, z, then for l = 0 .. octaves - 1: sin(2^l x, y, z), cos(2^l x, y, z)]
geometry  h = a(G0 e + g0), ..., o = G h + g: o[0] the signed distance (dm), the rest the feature
surface   c = a(C0 [o, x, y, z] + c0), ..., s = C c + c: logits of red, green and blue, then the template point (dm)
a(v) = (v + sqrt(v v + smoothing)) / 2. The first layers of both are W0 + sum of codes times bases.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor, nn

from export.heads.prior import FieldShape, Layer, Prior

Weights = Sequence[Tensor]  # of each layer, [..., outputs, inputs + 1]: the last column is the bias


def encode(points: Tensor, octaves: int) -> Tensor:
    """[..., 3] -> [..., 3 + 6 octaves]"""
    parts = [points]
    for octave in range(octaves):
        scaled = points * 2.0**octave
        parts += [torch.sin(scaled), torch.cos(scaled)]
    return torch.cat(parts, -1)


def _activation(v: Tensor, smoothing: float) -> Tensor:
    return (v + torch.sqrt(v * v + smoothing)) / 2


def _linear(x: Tensor, weights: Tensor) -> Tensor:
    """x [..., N, inputs]; weights [outputs, inputs + 1], or [H, outputs, inputs + 1] with x [H, N, inputs]."""
    if weights.dim() == 2:
        return nn.functional.linear(x, weights[:, :-1], weights[:, -1])
    return torch.baddbmm(weights[:, None, :, -1], x, weights[..., :-1].transpose(1, 2))


def geometry(shape: FieldShape, weights: Weights, points: Tensor) -> Tensor:
    """Points [(H,) N, 3], dm -> [(H,) N, 1 + feature]: signed distance (dm), then the feature."""
    h = encode(points, shape.octaves)
    for layer in range(shape.geometry_layers):
        h = _activation(_linear(h, weights[layer]), shape.smoothing)
    return _linear(h, weights[shape.geometry_layers])


def surface(shape: FieldShape, weights: Weights, points: Tensor, out: Tensor) -> tuple[Tensor, Tensor]:
    """Features of `geometry` at points -> logits of RGB and template points (dm), [(H,) N, 3] each."""
    h = torch.cat([out, points], -1)
    for layer in range(shape.first_surface_layer, len(weights) - 1):
        h = _activation(_linear(h, weights[layer]), shape.smoothing)
    h = _linear(h, weights[-1])
    return h[..., :3], h[..., 3:]


class FieldBases(nn.Module):
    """W0 of all layers, and bases of the personal ones."""

    def __init__(self, shape: FieldShape, shape_codes: int = 64, colour_codes: int = 32) -> None:
        super().__init__()
        self.shape, self.shape_codes, self.colour_codes = shape, shape_codes, colour_codes
        self.constant, self.bases = nn.ParameterList(), nn.ParameterDict()
        personal = [*shape.personal[0], *shape.personal[1]]
        for layer in range(shape.layers):
            inputs, outputs = shape.inputs(layer), shape.outputs(layer)
            weights = torch.randn(outputs, inputs + 1) * math.sqrt(2 / inputs)
            weights[:, -1] = 0
            if layer == 0:  # low frequencies first: a head is smooth at the start
                for octave in range(shape.octaves):
                    weights[:, 3 + 6 * octave : 9 + 6 * octave] *= 0.5**octave
            if layer in (shape.geometry_layers, shape.layers - 1):
                weights *= 0.3
            self.constant.append(nn.Parameter(weights))
            if layer in personal:
                count = self.codes_of(layer)
                scale = 0.15 * weights.std() / math.sqrt(count)
                self.bases[str(layer)] = nn.Parameter(torch.randn(count, outputs, inputs + 1) * scale)

    def codes_of(self, layer: int) -> int:
        return self.shape_codes if layer < self.shape.first_surface_layer else self.colour_codes

    def combine(self, shape_code: Tensor, colour_code: Tensor) -> list[Tensor]:
        """Codes [K] or [H, K] -> the weights of one head, or of H."""
        out = []
        for layer, constant in enumerate(self.constant):
            if str(layer) not in self.bases:
                out.append(constant)
                continue
            code = shape_code if layer < self.shape.first_surface_layer else colour_code
            out.append(constant + torch.tensordot(code, self.bases[str(layer)], 1))
        return out

    @torch.no_grad()
    def whiten(self, mean: Tensor, root: Tensor, first: int, last: int) -> None:
        """Folds codes = mean + root z into W0 and the bases of layers first..last: from then on z is the code."""
        for layer in range(first, last):
            if str(layer) in self.bases:
                bases = self.bases[str(layer)]
                self.constant[layer] += torch.tensordot(mean, bases, 1)
                self.bases[str(layer)] = nn.Parameter(torch.tensordot(root.T, bases, 1))


def bases_of(prior: Prior) -> FieldBases:
    """The field of a prior; without gradients."""

    def weights_of(layer: Layer) -> Tensor:
        return torch.from_numpy(np.concatenate([layer.weights, layer.bias[..., None]], -1).astype(np.float32))

    bases = FieldBases(prior.shape, prior.shape_codes, prior.colour_codes).requires_grad_(False)
    for stored, layer in zip(bases.constant, prior.constant, strict=True):
        stored.data = weights_of(layer)
    shape_layers, colour_layers = prior.shape.personal
    for index, layer in zip(shape_layers + colour_layers, prior.shape_bases + prior.colour_bases, strict=True):
        bases.bases[str(index)].data = weights_of(layer)
    return bases
