"""How right the painted pixels are: parts, masks, U and V, and geodesic point similarity (GPS).

GPS of a person (Guler et al., CVPR 2018): mean over its points of exp(-d^2 / (2 kappa^2)), d the geodesic
distance in metres between the predicted and the true surface point, 0 where the detection has no such pixel;
kappa = 0.255, so 30 cm count one half. Distances are those of our own template body.

GPSm (DensePose task of the COCO 2019 challenge): sqrt(GPS * mask IoU) of the detection and the person. GPS alone does
not mind pixels painted outside the person.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from export.shards import LabelledImage
from export.surface import MIRROR_COARSE, PART_COUNT, PART_TO_COARSE

KAPPA_M = 0.255
POINTS_PER_PERSON = 196


FATES = ("the right part", "front for back", "left for right", "another part", "background")


def _fate_of() -> np.ndarray:
    """Index in FATES of [true part, painted part]. A head's halves are left and right."""
    true, painted = PART_TO_COARSE[:, None].astype(int), PART_TO_COARSE[None].astype(int)
    head = PART_TO_COARSE.max()
    fate = np.full((PART_COUNT + 1, PART_COUNT + 1), 3)
    fate[(true == painted) & (true != head)] = 1
    fate[(painted == MIRROR_COARSE[true]) & ((painted != true) | (true == head))] = 2
    fate[np.diag_indices(PART_COUNT + 1)] = 0
    fate[:, 0] = 4
    return fate


_FATE = _fate_of()


def sample_pixels(image: LabelledImage, number: int, count: int = POINTS_PER_PERSON) -> np.ndarray:
    """Positions (y, x), int64 [K, 2], of up to `count` visible pixels of one person, always the same ones.

    They stand for the about 100 annotated points a person of DensePose-COCO; 196 is the most there are in it.
    """
    pixels = np.argwhere(image.label[..., 3] == number)
    if len(pixels) <= count:
        return pixels
    seed = [*image.name.encode(), number]
    return pixels[np.sort(np.random.default_rng(seed).choice(len(pixels), count, replace=False))]


class SurfaceTable(Protocol):
    """Sample points of the template surface, as `export.people.atlas.load_surface_table` gives them.

    geodesic: float16 [N, N] metres.
    """

    geodesic: np.ndarray

    def nearest_by_point(self, points: np.ndarray) -> np.ndarray: ...

    def nearest_by_iuv(self, part: np.ndarray, uv: np.ndarray) -> np.ndarray: ...


class PixelAccuracy:
    """Sums over images; everybody's visible pixels count, missed people too."""

    def __init__(self) -> None:
        self.confusion = np.zeros((PART_COUNT + 1, PART_COUNT + 1), np.int64)  # [true part, predicted part]
        self.difference = np.zeros((2, 256), np.int64)  # |dU|, |dV| in 1/255 where the part is right

    def add(self, label: np.ndarray, iuv: np.ndarray) -> None:
        """label: uint8 [H, W, 4] (or more channels than 3); iuv: uint8 [H, W, 3]."""
        true, predicted = label[..., 0].astype(np.int64), iuv[..., 0].astype(np.int64)
        size = PART_COUNT + 1
        self.confusion += np.bincount((true * size + predicted).ravel(), minlength=size * size).reshape(size, size)
        right = (true > 0) & (true == predicted)
        for axis in (0, 1):
            gap = np.abs(label[right, 1 + axis].astype(np.int64) - iuv[right, 1 + axis].astype(np.int64))
            self.difference[axis] += np.bincount(gap, minlength=256)

    def merge(self, other: PixelAccuracy) -> None:
        self.confusion += other.confusion
        self.difference += other.difference

    def part_accuracy(self) -> float:
        return fraction(np.trace(self.confusion[1:, 1:]), self.confusion[1:].sum())

    def mask_iou(self) -> float:
        both = self.confusion[1:, 1:].sum()
        return fraction(both, self.confusion.sum() - self.confusion[0, 0])

    def part_recall(self) -> np.ndarray:
        """float64 [25]: fraction of each true part's pixels painted with that part; NaN for unseen parts."""
        return self._diagonal_over(self.confusion.sum(1))

    def part_precision(self) -> np.ndarray:
        """float64 [25]: fraction of the pixels painted with each part that show it; NaN for unpainted parts."""
        return self._diagonal_over(self.confusion.sum(0))

    def fates(self) -> dict[str, float]:
        """Labels of people's pixels: fractions of all, by the names of `FATES`."""
        total = self.confusion[1:].sum()
        return {name: fraction(self.confusion[1:][_FATE[1:] == k].sum(), total) for k, name in enumerate(FATES)}

    def _diagonal_over(self, total: np.ndarray) -> np.ndarray:
        return np.where(total > 0, np.diag(self.confusion) / np.maximum(total, 1), np.nan)

    def median_difference(self) -> tuple[float, float]:
        """Median |dU| and |dV|, 0..1, over pixels whose part is right."""
        medians = []
        for histogram in self.difference:
            total = histogram.sum()
            median = np.searchsorted(np.cumsum(histogram), (total + 1) // 2) / 255 if total else np.nan
            medians.append(float(median))
        return medians[0], medians[1]


class PointAccuracy:
    """Collects sampled points of the people asked for, then compares them on the surface in one go."""

    def __init__(self) -> None:
        self.images: list[tuple[list[slice], int]] = []
        self._point: list[np.ndarray] = []
        self._part: list[np.ndarray] = []
        self._iuv: list[np.ndarray] = []
        self._owner: list[np.ndarray] = []
        self._count = 0

    def add(self, image: LabelledImage, iuv: np.ndarray, inds: np.ndarray, detections: int) -> None:
        """iuv: uint8 [H, W, 3]; inds: uint8 [H, W], k where the k-th of `detections` people is in front."""
        slices = []
        for number in image.instance[~image.ignore]:
            y, x = sample_pixels(image, int(number)).T
            self._point.append(image.point[y, x])
            self._part.append(image.label[y, x, 0])
            self._iuv.append(iuv[y, x])
            self._owner.append(inds[y, x])
            slices.append(slice(self._count, self._count + len(y)))
            self._count += len(y)
        self.images.append((slices, detections))

    def merge(self, other: PointAccuracy) -> None:
        """The other's images follow those that are here."""
        for slices, detections in other.images:
            moved = [slice(points.start + self._count, points.stop + self._count) for points in slices]
            self.images.append((moved, detections))
        for own, more in (
            (self._point, other._point), (self._part, other._part), (self._iuv, other._iuv), (self._owner, other._owner)
        ):  # fmt: skip
            own += more
        self._count += other._count

    def solve(self, table: SurfaceTable) -> SurfacePoints:
        if not self._point:
            nothing = np.zeros(0, np.uint8)
            return SurfacePoints(np.zeros(0, np.float32), nothing, np.zeros(0, bool), nothing, self.images)
        part, owner = np.concatenate(self._part), np.concatenate(self._owner)
        iuv, point = np.concatenate(self._iuv), np.concatenate(self._point)
        painted = (owner > 0) & (iuv[:, 0] > 0)
        distance = np.full(len(part), np.inf, np.float32)
        if painted.any():
            true = table.nearest_by_point(point[painted])
            predicted = table.nearest_by_iuv(iuv[painted, 0], iuv[painted, 1:].astype(np.float32) / 255)
            distance[painted] = table.geodesic[true, predicted]
        return SurfacePoints(distance, part, part == iuv[:, 0], owner, self.images)


class SurfacePoints:
    """distance: float32 [K] m, inf where nothing is painted; part: uint8 [K], the true one; same_part: bool [K];
    owner: detection or 0."""

    def __init__(
        self, distance: np.ndarray, part: np.ndarray, same_part: np.ndarray, owner: np.ndarray, images: list
    ) -> None:
        self.distance, self.part, self.same_part, self.owner, self.images = distance, part, same_part, owner, images

    def similarity(self) -> list[np.ndarray]:
        """For each image GPS of its detections with its people: float64 [D, G]."""
        closeness = np.exp(-(self.distance.astype(np.float64) ** 2) / (2 * KAPPA_M**2))
        matrices = []
        for slices, detections in self.images:
            matrix = np.zeros((detections, len(slices)))
            for column, points in enumerate(slices):
                if points.stop > points.start:
                    sums = np.bincount(self.owner[points], closeness[points], minlength=detections + 1)
                    matrix[:, column] = sums[1 : detections + 1] / (points.stop - points.start)
            matrices.append(matrix)
        return matrices

    def median_error_cm(self, shown: np.ndarray) -> tuple[float, float]:
        """Median distance in cm over painted points with the right part, and over all painted points.

        shown: bool [K], False for points of people below the score threshold.
        """
        painted = np.isfinite(self.distance) & shown
        both = painted & self.same_part
        return tuple(100 * float(np.median(self.distance[m])) if m.any() else np.nan for m in (both, painted))

    def part_error_cm(self, shown: np.ndarray) -> list[float]:
        """[25]: median distance in cm over the painted points of each true part; NaN where there are none."""
        painted = np.isfinite(self.distance) & shown
        chosen = [painted & (self.part == part) for part in range(PART_COUNT + 1)]
        return [100 * float(np.median(self.distance[m])) if m.any() else np.nan for m in chosen]


def mask_overlap(inds: np.ndarray, detections: int, instance: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """IoU of what each detection painted in front with each person's visible pixels: float64 [detections, G].

    inds, instance: uint8 [H, W], detection and person of each pixel, 0 for none. numbers: [G], those of the people.
    """
    shared = np.bincount(inds.astype(np.int64).ravel() * 256 + instance.ravel(), minlength=256 * 256).reshape(256, 256)
    union = shared.sum(1)[:, None] + shared.sum(0)[None] - shared
    return (shared / np.maximum(union, 1))[1 : detections + 1, numbers]


def fraction(part: int, whole: int) -> float:
    """part / whole; NaN of nothing."""
    return float(part / whole) if whole else float("nan")
