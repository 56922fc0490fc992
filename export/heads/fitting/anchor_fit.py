"""A head's codes and camera from the encoder's template points: the reference of sdk/src/head/fit/anchor_fit.

The point of a head with codes z that a cell shows is x(τ; z) = τ + Σ w_k (a_k(z) - t_k), τ the template point seen
there, a_k the four anchors nearest to it and t_k their own template points. Levenberg-Marquardt over the camera and z,
robust against outliers (Geman-McClure), with N(0, 1) of each code and a log-normal focal length as priors.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import torch
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.spatial import cKDTree
from torch import Tensor

from export.heads.fitting.camera import UNKNOWNS, Camera, ScaledPose, is_small_step, scaled_pose
from export.heads.fitting.photo import HeadPhoto, Look, NoHead, shows_head
from export.heads.prior import Prior

NEIGHBOURS = 4
SOFTENING_DM = 1e-3  # within which of an anchor the others no longer count
MAX_CELLS = 1000
MAX_ANCHOR_DM = 0.5  # cells that see a point farther than this from all anchors are left out
CELL_WEIGHT = 0.15  # of a cell's cost: neighbours say the same
PIXEL_SIGMA = 0.3  # of where in its cell the encoder saw a point, in cells
FACE_BORDER = 1.0  # cells at the border of the look at the face, of which the first look is heard, too
LIMIT = 9.0  # in squared sigmas
INLIER = 13.8  # squared sigmas of two coordinates: 99.9 %
MIN_INLIERS = 0.3  # of the cells
MIN_POINTS = 4
LOG_SIGMA_RANGE = (-4.6, 1.1)  # of template points
# How much of the codes' variance widens the limit, from the mean head to the fitted one, and steps that is worth.
PHASES = ((1.0, 3), (0.2, 3), (0.04, 3), (0.0, 100))
MAX_STEPS = 16


@dataclass(frozen=True, eq=False)
class Observations:
    """Observations in one photo: template points [N, 3] dm, their sigma [N] dm, pixels [N, 2] where they are seen, with
    the first pixel's centre at (0, 0), and the sigma of these [N]. centre: the principal point. log_focal_sigma: 0
    where the focal length is known, else focal_px is the median."""

    template: np.ndarray
    sigma: np.ndarray
    pixels: np.ndarray
    pixel_sigma: np.ndarray
    focal_px: float
    log_focal_sigma: float
    centre: np.ndarray


def observations_of(photo: HeadPhoto) -> Observations:
    """Observations of the cells that show the head: from the face crop, and from the head crop around it."""
    first = shows_head(photo.cells)
    looks: list[tuple[Look, np.ndarray]] = [(photo, first)]
    if photo.face:
        rows, columns = np.nonzero(first)
        at = photo.face.in_cells(*photo.in_photo(columns + 0.5, rows + 0.5).T)
        last = photo.face.cells.shape[0] - FACE_BORDER
        around = first.copy()
        around[rows, columns] = ~((at >= FACE_BORDER) & (at <= last)).all(1)
        looks = [(photo, around), (photo.face, shows_head(photo.face.cells))]
    parts = [_cells_of(look, chosen) for look, chosen in looks]
    template, sigma, pixels, pixel_sigma = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Observations(template, sigma, pixels, pixel_sigma, photo.focal_px, photo.log_focal_sigma, photo.centre)


def _cells_of(look: Look, chosen: np.ndarray) -> tuple[np.ndarray, ...]:
    """Template points, sigmas, pixels and their sigmas of the chosen cells [G, G]."""
    rows, columns = np.nonzero(chosen)
    cells = look.cells[rows, columns].astype(np.float64)
    pixels = look.in_photo(columns + 0.5, rows + 0.5) - 0.5
    sigma = np.exp(np.clip(cells[:, 3], *LOG_SIGMA_RANGE))
    return cells[:, :3], sigma, pixels, np.full(len(rows), max(PIXEL_SIGMA * look.cell_px, 1e-3))


class AnchorPoints:
    """Where template points lie on a head, as linear functions of its codes."""

    def __init__(self, prior: Prior) -> None:
        self.template = prior.template_points.astype(np.float64)
        self.offset = prior.anchor_mean.astype(np.float64) - self.template
        self.linear = prior.anchor_linear.astype(np.float64)
        self.sigma = prior.anchor_sigma.astype(np.float64)
        self._tree = cKDTree(self.template)

    def at(self, template: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Template points [N, 3] -> mean [N, 3], linear [N, 3, K] and sigma [N] of the points of heads there."""
        away, near = self._tree.query(template, NEIGHBOURS)
        w = 1 / (away**2 + SOFTENING_DM**2)
        w /= w.sum(1, keepdims=True)
        mean = template + np.einsum("nk,nkc->nc", w, self.offset[near])
        return mean, np.einsum("nk,nkcd->ncd", w, self.linear[near]), (w * self.sigma[near]).sum(1)

    def distance(self, template: np.ndarray) -> np.ndarray:
        return self._tree.query(template)[0]


class AnchorTerms:
    """Cost of the cells of one photo. Pixels count from the principal point."""

    def __init__(self, seen: Observations, points: AnchorPoints) -> None:
        keep = np.nonzero(points.distance(seen.template) <= MAX_ANCHOR_DM)[0]
        count = min(len(keep), MAX_CELLS)
        keep = keep[np.arange(count) * len(keep) // max(count, 1)]
        mean, linear, sigma = points.at(seen.template[keep])
        pixels = seen.pixels[keep] - seen.centre
        self.pixel_sigma = torch.from_numpy(seen.pixel_sigma[keep])
        self.mean, self.linear, self.pixels = (torch.from_numpy(a) for a in (mean, linear, pixels))
        self.sigma_dm = torch.from_numpy(np.hypot(seen.sigma[keep], sigma))
        self.code_variance = self.linear.square().sum((1, 2)) / 3
        self.inverse_variance = self.limit = torch.ones(count, dtype=torch.float64)

    def __len__(self) -> int:
        return len(self.mean)

    def points(self, z: Tensor) -> Tensor:
        return self.mean + self.linear @ z

    def set_noise(self, pose: ScaledPose, z: Tensor, code_fraction: float) -> None:
        """Takes the noise in pixels as this camera sees it, and holds it until the next call."""
        scale = pose.log_scale.exp() / pose.project(self.points(z))[1].clamp(min=0.1)
        variance = self.pixel_sigma.square() + (scale * self.sigma_dm).square()
        self.inverse_variance = 1 / variance
        self.limit = LIMIT * (1 + code_fraction * scale.square() * self.code_variance / variance)

    def residuals(self, pose: ScaledPose, z: Tensor) -> Tensor:
        """[N, 2], in sigmas; NaN where a cell is not seen."""
        at, ratio = pose.project(self.points(z))
        off = (self.pixels - at) * self.inverse_variance.sqrt()[:, None]
        return torch.where(ratio[:, None] > 1e-3, off, torch.nan)

    def cost(self, pose: ScaledPose, z: Tensor) -> Tensor:
        """Twice a negative log likelihood."""
        error = self.residuals(pose, z).square().sum(1)
        return CELL_WEIGHT * torch.where(error.isnan(), self.limit, error / (1 + error / self.limit)).sum()

    def is_inlier(self, pose: ScaledPose, z: Tensor) -> Tensor:
        return self.residuals(pose, z).square().sum(1) <= INLIER


@dataclass(frozen=True, eq=False)
class AnchorFit:
    """codes [K]; the camera; inliers: how many cells agree, of `cells`; cost: twice the negative log posterior;
    covariance [K, K] of the codes; None where they were not moved."""

    codes: np.ndarray
    pose: ScaledPose
    inliers: int
    cells: int
    cost: float
    covariance: np.ndarray | None = None


class _Equations:
    """Levenberg-Marquardt over the camera and, where they move, the codes."""

    def __init__(self, terms: AnchorTerms, seen: Observations, moves_codes: bool) -> None:
        self.terms, self.moves_codes = terms, moves_codes
        self.log_focal, self.focal_sigma = float(np.log(seen.focal_px)), seen.log_focal_sigma
        self.steps = 0

    def cost(self, pose: ScaledPose, z: np.ndarray) -> float:
        total = float(self.terms.cost(pose, torch.from_numpy(z)))
        if self.moves_codes:
            total += float(z @ z)
        if self.focal_sigma > 0:
            total += ((float(pose.log_focal) - self.log_focal) / self.focal_sigma) ** 2
        return total

    def _set_up(self, pose: ScaledPose, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        count = UNKNOWNS + (len(z) if self.moves_codes else 0)
        at = torch.from_numpy(z)

        def off(step: Tensor) -> Tensor:
            codes = at + step[UNKNOWNS:] if self.moves_codes else at
            return self.terms.residuals(pose.displaced(step[:UNKNOWNS]), codes)

        zero = torch.zeros(count, dtype=torch.float64)
        jacobian, residuals = torch.func.jacfwd(off)(zero), off(zero)
        error = residuals.square().sum(1)
        seen = ~error.isnan()
        root = (1 / (1 + error / self.terms.limit) * CELL_WEIGHT**0.5)[seen, None]
        j = -(jacobian[seen] * root[..., None]).reshape(-1, count).numpy()
        a, b = j.T @ j, j.T @ (residuals[seen] * root).reshape(-1).numpy()
        if self.moves_codes:
            a[UNKNOWNS:, UNKNOWNS:] += np.eye(len(z))
            b[UNKNOWNS:] -= z
        focal = UNKNOWNS - 1
        if self.focal_sigma > 0:
            a[focal, focal] += self.focal_sigma**-2
            b[focal] += (self.log_focal - float(pose.log_focal)) / self.focal_sigma**2
        else:
            a[focal] = a[:, focal] = 0
            a[focal, focal], b[focal] = 1, 0
        return a, b

    def code_covariance(self, pose: ScaledPose, z: np.ndarray) -> np.ndarray:
        """Covariance of the codes, [K, K], at the minimum."""
        return np.linalg.inv(self._set_up(pose, z)[0])[UNKNOWNS:, UNKNOWNS:]

    def minimise(
        self, pose: ScaledPose, z: np.ndarray, max_steps: int, tolerance: float = 1e-4
    ) -> tuple[ScaledPose, np.ndarray]:
        """Ends where a step gains less than this part of the cost."""
        cost, damping, current = self.cost(pose, z), 1e-3, None
        for _ in range(max_steps):
            if damping >= 1e9:
                break
            current = current or self._set_up(pose, z)
            self.steps += 1
            a, b = current
            try:
                change = cho_solve(cho_factor(a + damping * np.diag(np.diag(a)), lower=True), b)
            except LinAlgError:
                change = np.full(len(b), np.nan)
            then = np.inf
            if is_small_step(change[:UNKNOWNS]):
                tried = pose.moved(change[:UNKNOWNS]), z + change[UNKNOWNS:] if self.moves_codes else z
                then = self.cost(*tried)
            if not then < cost:
                damping *= 10
                continue
            is_end = cost - then < tolerance * (1 + then)
            (pose, z), cost, damping, current = tried, then, max(damping * 0.1, 1e-9), None
            if is_end:
                break
        return pose, z


def _start(terms: AnchorTerms, seen: Observations) -> ScaledPose:
    """The camera of the mean head: RANSAC, then least squares over the cells that agree. Raises NoHead."""
    points, pixels = terms.mean.numpy(), terms.pixels.numpy()
    intrinsics = np.diag([seen.focal_px, seen.focal_px, 1.0])
    zero = torch.zeros(terms.linear.shape[2], dtype=torch.float64)
    spread = np.median(np.linalg.norm(points - points.mean(0), axis=1)) * np.sqrt(2 / 3)
    away = np.median(np.linalg.norm(pixels - np.median(pixels, 0), axis=1))
    scale = away / max(spread, 1e-9)  # roughly, pixels a dm
    sigma = np.hypot(
        terms.pixel_sigma.numpy(), scale * np.sqrt(terms.sigma_dm.numpy() ** 2 + terms.code_variance.numpy())
    )
    cv2.setRNGSeed(1)
    found, turn, shift, _ = cv2.solvePnPRansac(
        points, pixels, intrinsics, None, iterationsCount=400, reprojectionError=float(3.7 * np.median(sigma)),
        flags=cv2.SOLVEPNP_EPNP,
    )  # fmt: skip
    if not found or not shift[2, 0] > 0:
        raise NoHead("No camera explains the points that are seen of the head. Use a photo where the face is seen.")
    pose = scaled_pose(Camera(cv2.Rodrigues(turn)[0], shift[:, 0], seen.focal_px))
    # Its noise has the codes', which are 0 here, in it.
    terms.inverse_variance = torch.from_numpy(sigma**-2.0)
    equations = _Equations(terms, seen, moves_codes=False)
    terms.limit = torch.full((len(terms),), LIMIT, dtype=torch.float64)
    pose, _ = equations.minimise(pose, zero.numpy(), 50, 1e-12)
    for _ in range(5):
        inliers = terms.is_inlier(pose, zero)
        # Least squares over the inliers: an infinite limit for them, none of the others' weight.
        terms.inverse_variance = torch.from_numpy(sigma**-2.0) * inliers
        terms.limit = torch.full((len(terms),), torch.inf, dtype=torch.float64)
        pose, _ = equations.minimise(pose, zero.numpy(), 50, 1e-12)
        terms.inverse_variance = torch.from_numpy(sigma**-2.0)
        if torch.equal(terms.is_inlier(pose, zero), inliers):
            break
    # One that sees more of the far side of the head than of the near one is that of a mirrored image, which looks the
    # same without perspective.
    camera, shown = pose.camera(), points[inliers.numpy()]
    eye = -camera.rotation.T @ camera.shift
    if np.sign((shown * (eye - shown)).sum(1)).sum() <= 0:
        raise NoHead("Only a mirrored picture explains the points that are seen of the head. Flip it.")
    return pose


def fit_anchors(prior: Prior, seen: Observations, moves_codes: bool = True) -> AnchorFit:
    """moves_codes: False poses the mean head. Raises NoHead for what no head explains."""
    terms = AnchorTerms(seen, AnchorPoints(prior))
    if len(terms) < MIN_POINTS:
        raise NoHead(f"Only {len(terms)} points of a head are seen. Use a photo where the face is seen, and its box.")
    pose = _start(terms, seen)
    equations, z = _Equations(terms, seen, moves_codes), np.zeros(terms.linear.shape[2])
    for code_fraction, steps in PHASES:
        terms.set_noise(pose, torch.from_numpy(z), code_fraction)
        pose, z = equations.minimise(pose, z, min(steps, MAX_STEPS - equations.steps))
    inliers = int(terms.is_inlier(pose, torch.from_numpy(z)).sum())
    if inliers < MIN_INLIERS * len(terms):
        raise NoHead(
            f"Of {len(terms)} points that are seen of the head, {inliers} agree with one. Use a photo where the face "
            "is seen, 64 pixels or more across, and give its box."
        )
    covariance = equations.code_covariance(pose, z) if moves_codes else None
    return AnchorFit(z, pose, inliers, len(terms), equations.cost(pose, z), covariance)
