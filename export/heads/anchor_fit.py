"""A head's codes and camera from template points seen at pixels: the reference of sdk/src/head/fit/anchor_fit.

The point of a head with codes z that a pixel shows is x(τ; z) = τ + Σ w_k (a_k(z) - t_k), τ the template point seen
there, a_k the four anchors nearest to it and t_k their own template points. Levenberg-Marquardt over rotation,
translation, log focal length and z, with a prior on z (what the encoder says of codes) and on the focal
length (log-normal), robust against outliers (Geman-McClure).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from export.heads.prior import Prior

NEIGHBOURS = 4


@dataclass(frozen=True)
class Observations:
    """Of one photo: template points [N, 3] dm, their sigma [N] dm, pixels [N, 2] of the photo; shape codes [K, 2]: what
    the encoder says of them, means and log sigmas."""

    template: np.ndarray
    sigma: np.ndarray
    pixels: np.ndarray
    codes: np.ndarray


@dataclass(frozen=True)
class AnchorFitOptions:
    focal_px: float  # the prior's median
    log_focal_sigma: float = 0.35
    centre_px: tuple[float, float] = (0.0, 0.0)
    pixel_sigma: float = 1.0
    weight: float = 0.1  # of each observation: neighbours err alike
    outlier_sigmas: float = 4.0
    steps: int = 15


@dataclass(frozen=True)
class AnchorFit:
    """codes [K]; head to camera: rotation [3, 3], shift [3] dm; focal_px; weight [N] of the observations, 0..1."""

    codes: np.ndarray
    rotation: np.ndarray
    shift: np.ndarray
    focal_px: float
    weight: np.ndarray


class AnchorModel:
    """Points of a head as linear functions of its codes, for given template points."""

    def __init__(self, prior: Prior) -> None:
        self.template = prior.template_points.astype(np.float64)
        self.mean = prior.anchor_mean.astype(np.float64)
        self.linear = prior.anchor_linear.astype(np.float64)
        self.sigma = prior.anchor_sigma.astype(np.float64)
        self._tree = cKDTree(self.template)

    def at(self, template: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Template points [N, 3] -> mean [N, 3], linear [N, 3, K] and sigma [N] of the points of heads there."""
        away, near = self._tree.query(template, NEIGHBOURS)
        w = 1 / (away**2 + 1e-6)
        w /= w.sum(1, keepdims=True)
        mean = template + np.einsum("nk,nkc->nc", w, self.mean[near] - self.template[near])
        linear = np.einsum("nk,nkcd->ncd", w, self.linear[near])
        return mean, linear, (w * self.sigma[near]).sum(1)


def start(points: np.ndarray, pixels: np.ndarray, focal_px: float, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and shift of a camera far away (scaled orthography) that shows points [N, 3] at pixels [N, 2]."""
    p, q = points - points.mean(0), pixels - pixels.mean(0)
    (rows, *_) = np.linalg.lstsq(p, q, rcond=None)
    a = rows.T
    scale = float(np.sqrt(np.linalg.norm(a[0]) * np.linalg.norm(a[1])))
    u, _, v = np.linalg.svd(np.stack([a[0], a[1], np.cross(a[0], a[1]) / max(scale, 1e-9)]))
    rotation = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
    depth = focal_px / scale
    middle = np.array([*((pixels.mean(0) - centre) * depth / focal_px), depth])
    return rotation, middle - rotation @ points.mean(0)


def fit_anchors(prior: Prior, seen: Observations, options: AnchorFitOptions) -> AnchorFit:
    """Raises ValueError for less than 20 observations."""
    if len(seen.template) < 20:
        raise ValueError(f"{len(seen.template)} template points are too few for a head.")
    mean, linear, model_sigma = AnchorModel(prior).at(seen.template)
    centre = np.array(options.centre_px)
    rotation, shift = start(mean, seen.pixels, options.focal_px, centre)
    count = linear.shape[2]
    expected, inverse = seen.codes[:, 0].astype(np.float64), np.exp(-2 * seen.codes[:, 1].astype(np.float64))
    z, log_focal, damping = expected.copy(), np.log(options.focal_px), 1e-3
    sigma_dm = np.hypot(seen.sigma, model_sigma)

    def residuals(rotation, shift, log_focal, z):
        """[N, 2] in sigmas, points in the camera, sigma [N] in pixels."""
        points = (mean + linear @ z) @ rotation.T + shift
        focal = np.exp(log_focal)
        depth = np.maximum(points[:, 2], 1e-3)
        sigma = np.hypot(options.pixel_sigma, sigma_dm * focal / depth)
        away = focal * points[:, :2] / depth[:, None] + centre - seen.pixels
        return away / sigma[:, None], points, sigma

    def robust(r):
        """Loss and weight of each observation."""
        square, limit = (r**2).sum(1), options.outlier_sigmas**2
        return limit * square / (limit + square), (limit / (limit + square)) ** 2

    def cost(r, z, log_focal):
        prior_focal = (log_focal - np.log(options.focal_px)) / options.log_focal_sigma
        return options.weight * robust(r)[0].sum() + (z - expected) ** 2 @ inverse + prior_focal**2

    r, points, sigma = residuals(rotation, shift, log_focal, z)
    now = cost(r, z, log_focal)
    for step in range(options.steps):
        focal, depth = np.exp(log_focal), np.maximum(points[:, 2], 1e-3)
        # Derivatives of the pixel by the point in the camera [N, 2, 3], in sigmas.
        by_point = np.zeros((len(points), 2, 3))
        by_point[:, 0, 0] = by_point[:, 1, 1] = focal / depth
        by_point[:, :, 2] = -focal * points[:, :2] / depth[:, None] ** 2
        by_point /= sigma[:, None, None]
        turned = points - shift
        cross = np.zeros((len(points), 3, 3))  # of the point by a small rotation w: w x (R x)
        cross[:, 0, 1], cross[:, 0, 2] = turned[:, 2], -turned[:, 1]
        cross[:, 1, 0], cross[:, 1, 2] = -turned[:, 2], turned[:, 0]
        cross[:, 2, 0], cross[:, 2, 1] = turned[:, 1], -turned[:, 0]
        by_focal = (focal * points[:, :2] / depth[:, None] / sigma[:, None])[..., None]
        by_codes = by_point @ (rotation @ linear)
        jacobian = np.concatenate([by_point @ cross, by_point, by_focal, by_codes], 2)
        weight = options.weight * robust(r)[1]
        j = (jacobian * np.sqrt(weight)[:, None, None]).reshape(-1, 7 + count)
        v = (r * np.sqrt(weight)[:, None]).reshape(-1)
        normal, gradient = j.T @ j, j.T @ v
        normal[7:, 7:] += np.diag(inverse)
        gradient[7:] += inverse * (z - expected)
        normal[6, 6] += options.log_focal_sigma**-2
        gradient[6] += (log_focal - np.log(options.focal_px)) / options.log_focal_sigma**2
        if step < 2:  # first the camera alone
            normal[7:, :7] = normal[:7, 7:] = 0
            gradient[7:] = 0
        for _ in range(6):
            change = -np.linalg.solve(normal + damping * np.diag(np.diag(normal)), gradient)
            tried = (
                Rotation.from_rotvec(change[:3]).as_matrix() @ rotation,
                shift + change[3:6],
                log_focal + float(np.clip(change[6], -1, 1)),
                z + change[7:],
            )
            r_tried, points_tried, sigma_tried = residuals(*tried)
            then = cost(r_tried, tried[3], tried[2])
            if then < now:
                break
            damping *= 10
        else:
            break
        rotation, shift, log_focal, z = tried
        r, points, sigma, now, damping = r_tried, points_tried, sigma_tried, then, max(damping / 10, 1e-6)
    return AnchorFit(z, rotation, shift, float(np.exp(log_focal)), robust(r)[1])
