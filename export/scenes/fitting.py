"""From photos and a cloud to descriptors, and from descriptors to an image: all of NPBG++ (arXiv 2203.13318) in torch.

The reference for the SDK and what training differentiates through. Points are float64 [P, 3], photos RGB in 0..1
[H, W, 3] (numpy float32), features and rasters float32.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from export.camera import Camera
from export.scenes.config import ALPHA, BACKGROUND_PX, DEPTH_TOLERANCE, LEVELS, MULTIPLE, RASTER, ROTATED_MULTIPLE
from export.scenes.descriptors import FittedDescriptors, Moments
from export.scenes.geometry.cameras import moves, upright, warped
from export.scenes.geometry.raster import filled, projected, pyramid, visible, without_occluded
from export.scenes.networks.basis import directions
from export.scenes.networks.extractor import STRIDE
from export.scenes.networks.system import Networks

_CONFIDENCE = (1.0, 1.0, 1.0, 0.5, 0.25)  # that a pixel is covered by points, by the scale that has one there


@dataclass(frozen=True, eq=False)
class View:
    """A photo and its camera. image: RGB float32 [H, W, 3] in 0..1."""

    image: np.ndarray
    camera: Camera


@dataclass(frozen=True)
class Options:
    """up: of the world. visibility_scale: of the photos' sides, for finding which points are visible (1/2 in the paper
    where points are sparse, against bleed-through). depth_tolerance: how much farther than the nearest point of its
    block of pixels a point may be, as a fraction of that depth (see `without_occluded`; infinite in the paper). near:
    depth of the nearest visible point, in the scene's units. alpha: of the ridge regression. precision: of the
    moments."""

    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    visibility_scale: float = 1.0
    depth_tolerance: float = DEPTH_TOLERANCE
    near: float = 0.0
    alpha: float = ALPHA
    precision: torch.dtype = torch.float32


def sampled(features: Tensor, columns: Tensor, rows: Tensor) -> Tensor:
    """Bilinear [P, C] of a map [C, H, W] at pixels [P], the border repeated outside."""
    height, width = features.shape[1:]
    grid = torch.stack([(2 * columns + 1) / width - 1, (2 * rows + 1) / height - 1], -1)
    found = F.grid_sample(features[None], grid[None, None], mode="bilinear", padding_mode="border", align_corners=False)
    return found[0, :, 0].T


def shown_in(points: Tensor, camera: Camera, options: Options) -> Tensor:
    """Keys, int64 [H, W], of the points [P, 3] that a camera sees."""
    return without_occluded(visible(points, camera, options.near), options.depth_tolerance)


def visibility_camera(camera: Camera, options: Options) -> Camera:
    """The camera in whose image visibility is decided."""
    scale = options.visibility_scale
    return camera.resized(max(1, round(camera.width_px * scale)), max(1, round(camera.height_px * scale)))


def seen_in(points: Tensor, camera: Camera, options: Options) -> Tensor:
    """Which points are visible in the photo, bool [P]. Asked of the camera as it is: its pixels are the photo's."""
    keys = shown_in(points, visibility_camera(camera, options), options)
    seen = torch.zeros(len(points), dtype=torch.bool, device=points.device)
    seen[pyramid(keys, 1).points] = True
    return seen


@dataclass(frozen=True)
class FittedPoints:
    """The points of a cloud that some photo sees, float64 [P, 3], their descriptors, and the colour of what has no
    points, [3] in 0..1."""

    positions: Tensor
    fit: FittedDescriptors
    background: Tensor

    def descriptors_from(self, chosen: Tensor, centre: np.ndarray, networks: Networks) -> Tensor:
        """Descriptors of the points with indices `chosen` [V] as seen from a camera's centre [3]: float32 [V, 8].

        As in the paper the target's basis values have no gradient; the basis learns from the sources'.
        """
        positions, fit = self.positions[chosen], self.fit
        with torch.no_grad():
            basis = networks.basis(directions(positions, torch.from_numpy(centre).to(positions)).float())
        mean, slope = fit.mean[chosen], fit.slope[chosen]
        return FittedDescriptors(mean, slope, fit.views[chosen], fit.singular[chosen]).seen_from(basis.to(mean)).float()

    def rasters(self, camera: Camera, networks: Networks, options: Options) -> list[Tensor]:
        """[9, H/2^k, W/2^k] for k = 0..4 of what a camera sees, whose sides are multiples of 16; `filled`."""
        shown = pyramid(shown_in(self.positions, camera, options), LEVELS)
        return filled(shown.rasters(self.descriptors_from(shown.points, camera.centre, networks)), self.background)


@dataclass(frozen=True, eq=False)
class Sources:
    """Visibility of a cloud in some photos, before any network. positions: float64 [P, 3], points that at least one
    photo shows. images: RGB float32 [3, h, w] of each photo, rotated upright. columns, rows: pixels of the points in
    it, [P]. seen: bool [P]. centres: of the cameras, [3]. background: colour of areas without points, [3]."""

    positions: Tensor
    images: list[Tensor]
    columns: list[Tensor]
    rows: list[Tensor]
    seen: list[Tensor]
    centres: list[np.ndarray]
    background: Tensor


def background_of(points: Tensor, seen: Sequence[Tensor], views: Sequence[View], options: Options) -> Tensor:
    """Background colour of photos: the mean colour [3] of the blocks of BACKGROUND_PX x BACKGROUND_PX
    pixels, counted from the first one, without a seen point; of all pixels where every block has one."""
    sums, counts = torch.zeros(2, 3, dtype=torch.float64), torch.zeros(2)
    for sees, view in zip(seen, views, strict=True):
        small = visibility_camera(view.camera, options)
        columns, rows, _ = projected(points[sees], small)
        cells = torch.ones(-(-small.height_px // BACKGROUND_PX), -(-small.width_px // BACKGROUND_PX))
        at = [((x + 0.5).long().clamp(0, side - 1) // BACKGROUND_PX).cpu()
              for x, side in ((rows, small.height_px), (columns, small.width_px))]  # fmt: skip
        cells[at[0], at[1]] = 0
        height, width = view.image.shape[:2]
        lines = torch.arange(height) * small.height_px // height // BACKGROUND_PX
        across = torch.arange(width) * small.width_px // width // BACKGROUND_PX
        empty = cells[lines][:, across]
        image = torch.from_numpy(view.image)
        for k, weight in enumerate((empty, torch.ones_like(empty))):
            sums[k] += (image * weight[..., None]).sum((0, 1), dtype=torch.float64)
            counts[k] += weight.sum()
    return (sums[0] / counts[0] if counts[0] > 0 else sums[1] / counts[1].clamp_min(1)).float()


def gathered(
    points: Tensor,
    views: Sequence[View],
    options: Options,
    target: Camera | None = None,
    window_px: int | None = None,
    seen: Sequence[Tensor] | None = None,
) -> Sources:
    """The cloud [P, 3] after all views; with a `target`, only what is visible to that camera: enough to render it.

    A photo is rotated by bilinear interpolation before the extractor sees it, in the smallest frame that holds it, or,
    with `window_px`, in a square of that side about the points; what is outside of it is then not seen. seen: of all
    points, if it is known (`seen_in`). Raises ValueError without views.
    """
    if not views:
        raise ValueError("a model needs at least one view, and none is given")
    found = torch.stack(list(seen) if seen else [seen_in(points, view.camera, options) for view in views])
    background = background_of(points, found, views, options)
    (chosen,) = torch.where(found.any(0))
    if target is not None:
        chosen = chosen[pyramid(shown_in(points[chosen], target, options), 1).points]
    positions, found = points[chosen], found[:, chosen]
    sources = Sources(positions, [], [], [], [], [view.camera.centre for view in views], background)
    for view, sees in zip(views, found, strict=True):
        camera = upright(view.camera, np.asarray(options.up), STRIDE)
        columns, rows, _ = projected(positions, camera)
        if window_px is not None:
            middle = [float(at[sees].median()) if sees.any() else 0.0 for at in (columns, rows)]
            left, top = (round(at - window_px / 2) for at in middle)
            camera = camera.reframed(left, top, window_px, window_px)
            columns, rows = columns - left, rows - top
            for at in (columns, rows):
                sees = sees & (at >= 0) & (at <= window_px - 1)
        image = warped(view.image, view.camera, camera)
        sources.images.append(torch.from_numpy(image).permute(2, 0, 1))
        # An unseen point may have no pixel at all; its value has no effect, but must be a number.
        sources.columns.append(torch.where(sees, columns, 0))
        sources.rows.append(torch.where(sees, rows, 0))
        sources.seen.append(sees)
    return sources


def fitted_to_features(
    sources: Sources, features: Iterable[Tensor], networks: Networks, options: Options
) -> FittedPoints:
    """The points with their descriptors, from the features [8, h, w] of each photo's image."""
    positions = sources.positions
    moments = Moments.zeros(len(positions), torch.zeros((), dtype=options.precision, device=positions.device))
    each = zip(features, sources.columns, sources.rows, sources.seen, sources.centres, strict=True)
    for maps, columns, rows, sees, centre in each:
        basis = networks.basis(directions(positions, torch.from_numpy(centre).to(positions)).float())
        moments = moments.with_view(sampled(maps, columns, rows), basis, sees)
    return FittedPoints(positions, moments.solved(options.alpha), sources.background.to(positions.device))


def fitted_to_views(
    points: Tensor, views: Sequence[View], networks: Networks, options: Options, target: Camera | None = None
) -> FittedPoints:
    """The cloud after all views (see `gathered`)."""
    sources = gathered(points, views, options, target)
    return fitted_to_features(
        sources, (networks.extractor(x[None].to(points.device))[0] for x in sources.images), networks, options
    )


def coverage(rasters: list[Tensor]) -> Tensor:
    """How much of an image is the refiner's, the rest is background: [1, H, W], 1 where there is a point in the 16 x
    16 pixels that a pixel is in, fading to 0 beyond (Coverage and kOwnBackgroundGain in the SDK)."""
    found = rasters[-1][None, RASTER - 1 :] * _CONFIDENCE[-1]
    for raster, confidence in zip(reversed(rasters[:-1]), reversed(_CONFIDENCE[:-1]), strict=True):
        wider = F.interpolate(found, scale_factor=2, mode="bilinear", align_corners=False)
        found = torch.maximum(wider, raster[None, RASTER - 1 :] * confidence)
    return (found[0] / _CONFIDENCE[-1]).clamp_max(1)


@torch.no_grad()
def render(model: FittedPoints, camera: Camera, networks: Networks, options: Options) -> np.ndarray:
    """The image of a camera of any size and roll: RGB float32 [H, W, 3] in 0..1.

    Rendered upright in the smallest frame that holds it, rotated back, cropped. Frames that are rotated have sides of a
    few sizes, so that those of a hand-held camera are mostly the same.
    """
    rotated = upright(camera, np.asarray(options.up), MULTIPLE)
    if moves(camera, rotated):
        rotated = upright(camera, np.asarray(options.up), ROTATED_MULTIPLE)
    rasters = model.rasters(rotated, networks, options)
    picture = networks.refiner([raster[None] for raster in rasters])[0].clamp(0, 1)
    background = model.background[:, None, None].to(picture)
    picture = background + coverage(rasters) * (picture - background)
    picture = np.ascontiguousarray(picture.clamp(0, 1).permute(1, 2, 0).cpu().numpy())
    return warped(picture, rotated, camera)


def painted(points: Tensor, colours: Tensor, camera: Camera, near: float = 0.0) -> np.ndarray:
    """The cloud with its own colours [P, 3] in 0..1, nothing between the points: RGB float32 [H, W, 3]; what every
    method is compared with."""
    shown = pyramid(visible(points, camera, near), 1)
    return shown.rasters(colours[shown.points])[0][:3].permute(1, 2, 0).cpu().numpy()
