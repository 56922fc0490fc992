"""The models of depth cameras of `sensors.py` in torch: batches of frames, each through a sensor of its own.

For a GPU, where one frame after the other would be the slowest part of a training. `sensors.py` is the reference and
says where metrics come from; given the same random numbers both report the same depth. Blurs and changes of size are
products with matrices, so that each frame has its own width of blur; they need float32 as it is: neither autocast
nor TF32, whose 10 bits are a footprint and more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import partial

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from export.solids.sensors import JUMP, Outliers, Phone, Plain, Sensor, Stereo, StructuredLight, TimeOfFlight, clean

__all__ = ["SensorDeck"]

_WIDEST_PX = 9  # window of stereo
_LONGEST_PX = 48  # end of the widest blur of noise on either side


class Draws:
    """Random numbers of torch's own generator of a device: normal and uniform (0..1), float32."""

    def __init__(self, device: torch.device) -> None:
        self.device = device

    def normal(self, *shape: int) -> Tensor:
        return torch.randn(shape, device=self.device)

    def uniform(self, *shape: int) -> Tensor:
        return torch.rand(shape, device=self.device)


def _each(values: Tensor) -> Tensor:
    """One value a frame [N] -> [N, 1, 1]."""
    return values[:, None, None]


def _gaussian_matrix(sigma_px: Tensor, radius_px: Tensor, side: int) -> Tensor:
    """[N, side, side]: row i are the weights of a Gaussian about i, cut off at the radius, with the image mirrored
    about its first and last pixel."""
    at = torch.arange(side, device=sigma_px.device, dtype=torch.float32)
    out, source = at[:, None], at[None, :]

    def weight(distance: Tensor) -> Tensor:
        share = torch.exp(-0.5 * (distance / _each(sigma_px.clamp_min(1e-3))) ** 2)
        return torch.where(distance.abs() <= _each(radius_px), share, 0)

    total = weight(out - source)
    total = total + torch.where(source > 0, weight(out + source), 0)
    total = total + torch.where(source < side - 1, weight(2 * (side - 1) - out - source), 0)
    return total / total.sum(2, keepdim=True)


def _blurred(planes: Tensor, sigma_px: Tensor, radius_px: Tensor) -> Tensor:
    """[N, H, W] through a Gaussian of each frame's own width [N]."""
    height, width = planes.shape[1:]
    down = _gaussian_matrix(sigma_px, radius_px, height)
    across = down if width == height else _gaussian_matrix(sigma_px, radius_px, width)
    return down @ planes @ across.mT


def _cv2_radius(sigma_px: Tensor) -> Tensor:
    """Where cv2.GaussianBlur ends by itself on float images."""
    return (torch.round(8 * sigma_px + 1).int() | 1).sub(1).div(2).float()


def _smooth_noise(draws: Draws, shape: Sequence[int], sigma_px: Tensor) -> Tensor:
    """Normal noise of standard deviation 1, correlated over a Gaussian of sigma_px [N] pixels."""
    noise = draws.normal(*shape)
    radius = torch.ceil(3 * sigma_px).clamp_max(_LONGEST_PX)
    reach = torch.arange(-_LONGEST_PX, _LONGEST_PX + 1, device=noise.device)
    kernel = torch.exp(-0.5 * (reach / sigma_px.clamp_min(1e-3)[:, None]) ** 2) * (reach.abs() <= radius[:, None])
    kernel = kernel / kernel.sum(1, keepdim=True)
    return _blurred(noise, sigma_px, radius) / _each((kernel**2).sum(1))


def _blobs(draws: Draws, shape: Sequence[int], share: Tensor, size_px: Tensor) -> Tensor:
    """Masks that cover about `share` [N] of each image, in blobs of about size_px [N]."""
    field = _smooth_noise(draws, shape, size_px)
    ordered = field.flatten(1).sort(1).values
    at = (1 - share.clamp_max(1)) * (ordered.shape[1] - 1)
    below = at.floor().long()[:, None]
    low, high = ordered.gather(1, below), ordered.gather(1, (below + 1).clamp_max(ordered.shape[1] - 1))
    return field > _each((low + (high - low) * (at[:, None] - below)).squeeze(1))


def lateral_slope(depth: Tensor, focal_px: Tensor) -> Tensor:
    """As `sensors.lateral_slope`: [N, H, W]; focal_px [N]."""
    squares = torch.zeros_like(depth)
    infinite = float("inf")
    for axis in (1, 2):
        step = depth.diff(dim=axis).abs()
        first, last = ((0, 0, 1, 0), (0, 0, 0, 1)) if axis == 1 else ((1, 0), (0, 1))
        least = torch.minimum(F.pad(step, first, value=infinite), F.pad(step, last, value=infinite))
        squares += torch.where(least < infinite, least, 0) ** 2
    known = depth > 0
    return torch.where(known, squares.sqrt() * _each(focal_px) / torch.where(known, depth, 1), 0)


def _hidden(right: Tensor, by_px: float) -> Tensor:
    """Where something farther right in the row lies farther left, by more than by_px, in the other camera."""
    nearest = right.flip(2).cummin(2).values.flip(2)
    return right > nearest + by_px


def plain(depth: Tensor, focal_px: Tensor, sensor: dict[str, Tensor], draws: Draws) -> Tensor:
    noise = draws.normal(*depth.shape)
    return (depth * (1 + _each(sensor["sigma_r"] / focal_px) * noise)).clamp_min(0)


def stereo(depth: Tensor, focal_px: Tensor, sensor: dict[str, Tensor], draws: Draws) -> Tensor:
    window, strength = sensor["window_px"], _each(focal_px * sensor["baseline_m"])
    known = depth > 0
    disparity = torch.where(known, strength / torch.where(known, depth, 1), 0)
    reach = torch.floor(window / 2)
    amount, near = _smooth_noise(draws, depth.shape, window), disparity
    for step in range(1, _WIDEST_PX // 2 + 1):
        wider = F.max_pool2d(near, 3, 1, 1)
        grows = (wider > near * (1 + JUMP) + 1e-6) & (amount > _each(1.2 * (2 * step / (reach + 1) - 1)))
        near = torch.where(grows & _each(reach >= step), wider, near)
    disparity = near
    hidden = _hidden(torch.arange(depth.shape[2], device=depth.device) - disparity, 1)
    noise = _smooth_noise(draws, depth.shape, window / 4)
    steep = 1 + 0.5 * lateral_slope(depth, focal_px).clamp_max(6)
    step_px = _each(sensor["step_px"])
    disparity = torch.round((disparity + _each(sensor["sigma_px"]) * noise * steep) / step_px) * step_px
    blobs = _blobs(draws, depth.shape, sensor["holes"], torch.full_like(window, 3))
    lost = hidden | blobs | (disparity <= 0.5)
    return torch.where(lost, 0, strength / torch.where(lost, 1, disparity))


def time_of_flight(depth: Tensor, focal_px: Tensor, sensor: dict[str, Tensor], draws: Draws) -> Tensor:
    known, slope = depth > 0, lateral_slope(depth, focal_px)
    like = sensor["sigma_m"]
    reflectance = torch.exp(0.35 * _smooth_noise(draws, depth.shape, torch.full_like(like, 12)))
    light = torch.where(known, reflectance / (torch.where(known, depth, 1) ** 2 * torch.sqrt(1 + slope**2)), 0)
    rounding = sensor["rounding_px"]
    weight = _blurred(known.float(), rounding, _cv2_radius(rounding))
    mean = _blurred(depth, rounding, _cv2_radius(rounding)) / weight.clamp_min(1e-6)
    apart = (mean - depth).abs() > JUMP * depth
    concave = known & ~apart & (mean < depth) & (weight > 0.5) & _each(rounding > 0)
    rounded = torch.where(concave, mean, depth)
    mixing = sensor["mixing_px"], _cv2_radius(sensor["mixing_px"])
    mixed_light = _blurred(light, *mixing)
    mixed = _blurred(light * rounded, *mixing) / mixed_light.clamp_min(1e-9)
    sigma = _each(like) * mixed**2 * torch.sqrt(1 + slope.clamp_max(10) ** 2) / reflectance.sqrt()
    out = mixed + sigma * _smooth_noise(draws, depth.shape, torch.full_like(like, 0.4))
    median = torch.where(known, light, float("nan")).flatten(1).nanmedian(1).values
    dim = mixed_light < _each(0.02 * median)
    lost = ~known | dim | (slope > 12) | _blobs(draws, depth.shape, sensor["holes"], torch.full_like(like, 2))
    return torch.where(lost, 0, out.clamp_min(0))


def structured_light(depth: Tensor, focal_px: Tensor, sensor: dict[str, Tensor], draws: Draws) -> Tensor:
    count, height, width = depth.shape
    scale, like = _each(sensor["scale"]), sensor["scale"]
    angle = torch.atan(lateral_slope(depth, focal_px).clamp_max(8))
    lean = angle / (torch.pi / 2 - angle)
    sideways_px = 0.6 * scale * (0.8 + 0.035 * lean)
    x, y = torch.arange(width, device=depth.device), torch.arange(height, device=depth.device)[:, None]
    smooth = torch.full_like(like, 0.7)
    from_x, from_y = (
        torch.round(axis + sideways_px * _smooth_noise(draws, depth.shape, smooth)).long().clamp(0, side - 1)
        for axis, side in ((x, width), (y, height))
    )
    seen = depth.flatten(1).gather(1, (from_y * width + from_x).flatten(1)).view(count, height, width)
    known = seen > 0
    z = torch.where(known, seen, 1)
    sigma = 0.0012 + 0.0019 * (z - 0.4) ** 2 + 0.0001 / z.sqrt() * lean**2
    z = (z + scale * sigma * draws.normal(*depth.shape)).clamp_min(0.01)
    strength = _each(focal_px * sensor["baseline_m"])
    disparity = torch.round(8 * strength / z) / 8
    shadow = _hidden(torch.where(known, x - disparity, float("inf")), 1.5)
    blobs = _blobs(draws, depth.shape, sensor["holes"], torch.full_like(like, 3))
    lost = ~known | shadow | (disparity <= 0) | (angle > 1.4) | blobs
    return torch.where(lost, 0, strength / torch.where(lost, 1, disparity))


def _shrinking(side: int, small: int, device: torch.device) -> Tensor:
    """[small, side]: means over the part of the image that each small pixel covers."""
    rims = torch.arange(small + 1, device=device, dtype=torch.float64) * (side / small)
    at = torch.arange(side, device=device, dtype=torch.float64)
    ends = torch.minimum(rims[1:, None], at + 1) - torch.maximum(rims[:-1, None], at)
    return (ends.clamp_min(0) * (small / side)).float()


def _growing(small: int, side: int, device: torch.device) -> Tensor:
    """[side, small]: linear between the middles of small pixels, constant beyond the outermost."""
    at = ((torch.arange(side, device=device, dtype=torch.float64) + 0.5) * (small / side) - 0.5).clamp(0, small - 1)
    return (1 - (at[:, None] - torch.arange(small, device=device)).abs()).clamp_min(0).float()


def phone(depth: Tensor, focal_px: Tensor, sensor: dict[str, Tensor], draws: Draws, factor: int) -> Tensor:
    sides = [(side, max(1, side // factor)) for side in depth.shape[1:]]
    down, across = (_shrinking(*pair, depth.device) for pair in sides)
    smoothing = sensor["smoothing_px"], _cv2_radius(sensor["smoothing_px"])
    known, small = (_blurred(down @ plane @ across.T, *smoothing) for plane in ((depth > 0).float(), depth))
    noise = _smooth_noise(draws, small.shape, torch.full_like(smoothing[0], 1.5))
    small = small / known.clamp_min(1e-6) * (1 + _each(sensor["sigma"]) * noise)
    up, along = (_growing(less, side, depth.device) for side, less in sides)
    full, sure = (up @ plane @ along.T for plane in (small, known))
    return torch.where((sure > 0.6) & (full > 0), full, 0)


Model = Callable[[Tensor, Tensor, dict[str, Tensor], Draws], Tensor]
MODELS: dict[type, Model] = {
    Plain: plain,
    Stereo: stereo,
    TimeOfFlight: time_of_flight,
    StructuredLight: structured_light,
}


def _model(kind: type | None, factor: int) -> Model | None:
    return partial(phone, factor=factor) if kind is Phone else MODELS[kind] if kind else None


class SensorDeck:
    """Sensors that frames are dealt from: any that `sensors.drawn` makes. Nothing here waits for a GPU."""

    def __init__(self, sensors: Sequence[Sensor], device: torch.device) -> None:
        """Raises ValueError for windows of stereo wider than 9 pixels, KeyError for other sensors than those."""
        inner = [s.of if isinstance(s, Outliers) else s for s in sensors]
        if any(isinstance(s, Stereo) and s.window_px > _WIDEST_PX for s in inner):
            raise ValueError(f"Windows of stereo may be {_WIDEST_PX} pixels wide at most.")
        groups = sorted({self._group(s) for s in inner}, key=str)
        self._models = [_model(*group) for group in groups]
        self._group_of = np.array([groups.index(self._group(s)) for s in inner])
        names = sorted({f.name for kind, _ in groups if kind for f in fields(kind)})
        table = [[float(getattr(s, name, 0)) for name in names] for s in inner]
        wrong = [(s.share, s.size_px) if isinstance(s, Outliers) else (0.0, 0.0) for s in sensors]
        self._wrong = torch.tensor(wrong, dtype=torch.float32, device=device)
        columns = torch.tensor(table, dtype=torch.float32, device=device).reshape(len(table), len(names))
        self._columns = dict(zip(names, columns.T.contiguous(), strict=True))
        self._has_wrong = np.array([isinstance(s, Outliers) for s in sensors])
        self.device = device

    @staticmethod
    def _group(sensor: Sensor) -> tuple[type | None, int]:
        """Properties that must be equal in frames that are computed together."""
        if sensor is clean:
            return None, 0
        return type(sensor), sensor.factor if isinstance(sensor, Phone) else 0

    def _moved(self, numbers: np.ndarray) -> Tensor:
        return torch.from_numpy(numbers).to(self.device, non_blocking=True)

    def __len__(self) -> int:
        return len(self._group_of)

    @torch.no_grad()
    def see(self, chosen: np.ndarray, depth: Tensor, focal_px: Tensor, draws: Draws | None = None) -> Tensor:
        """Depth that the sensors of these numbers report for exact depth [N, H, W], in metres, 0 where nothing is;
        focal_px: [N]."""
        draws = draws or Draws(self.device)
        order = np.argsort(self._group_of[chosen], kind="stable")  # each group one piece
        back = self._moved(np.argsort(order))
        at = self._moved(order)
        numbers = self._moved(chosen[order])
        depth, focal_px, groups = depth[at], focal_px[at], self._group_of[chosen[order]]
        with torch.autocast(depth.device.type, enabled=False):
            parts = []
            for group in np.unique(groups):
                first, last = (int(k) for k in np.searchsorted(groups, [group, group + 1]))
                model, own = self._models[group], depth[first:last]
                if model is not None:
                    sensor = {name: column[numbers[first:last]] for name, column in self._columns.items()}
                    own = model(own, focal_px[first:last], sensor, draws)
                parts.append(own)
            seen = torch.cat(parts)
            wrong = np.flatnonzero(self._has_wrong[chosen[order]])
            if len(wrong):
                rows = self._moved(wrong)
                own, share = seen[rows], self._wrong[numbers[rows]]
                blobs = _blobs(draws, own.shape, share[:, 0], share[:, 1])
                seen[rows] = torch.where(blobs, own * (0.5 + draws.uniform(*own.shape)), own)
        return torch.nan_to_num(seen[back], nan=0, posinf=0, neginf=0)
