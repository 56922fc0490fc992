"""Point clouds as a scanner or a reconstruction would give them, from the depth of the source views."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field

import numpy as np

from export.camera import Camera


@dataclass(frozen=True)
class CloudFaults:
    """Errors of a point cloud. All zero: exact, each point lies on the ray through the centre of some pixel.

    points: how many at most. noise: standard deviation along the ray, as a share of the depth. drift: the same for
    whole views (a depth camera that is wrong by a factor). missing: share of the points that balls cut out hold.
    grazing: surfaces seen at less than this angle, degrees, have no points. outliers: share of points anywhere.
    patchiness: 0 spreads points evenly over pixels, 1 leaves some regions with a tenth of others.
    spread: 0 takes pixels as they come (near things get more points), 1 spreads points evenly over surfaces.
    """

    points: int = 1_000_000
    noise: float = 0.0
    drift: float = 0.0
    missing: float = 0.0
    grazing: float = 0.0
    outliers: float = 0.0
    patchiness: float = 0.0
    spread: float = 0.0

    def named(self) -> dict[str, float]:
        return asdict(self)


def draw_faults(rng: np.random.Generator, small: bool = False) -> CloudFaults:
    """50,000 to a million points (small: a quarter), and each fault in some of the clouds."""
    u = rng.uniform

    def some(share: float, low: float, high: float) -> float:
        return float(np.exp(u(np.log(low), np.log(high)))) if u() < share else 0.0

    points = int(np.exp(u(np.log(50_000), np.log(1_000_000))))
    return CloudFaults(
        points // 4 if small else points,
        noise=some(0.7, 0.0003, 0.006),
        drift=some(0.4, 0.0003, 0.003),
        missing=some(0.6, 0.02, 0.2),
        grazing=float(u(5, 25)) if u() < 0.4 else 0.0,
        outliers=some(0.5, 0.0005, 0.02),
        patchiness=float(u(0.2, 1)) if u() < 0.5 else 0.0,
        spread=float(u(0, 1)) if u() < 0.6 else 0.0,
    )


@dataclass
class CloudMaker:
    """Takes one source view after the other; `cloud()` then gives the points."""

    faults: CloudFaults
    views: int
    rng: np.random.Generator
    xyz: list[np.ndarray] = field(default_factory=list)
    rgb: list[np.ndarray] = field(default_factory=list)

    def add(self, camera: Camera, depth: np.ndarray, image: np.ndarray) -> None:
        """depth: float32 [H, W] metres, 0 nothing; image: uint8 [H, W, 3]."""
        faults, rng = self.faults, self.rng
        seen = depth > 0
        slant = grazing_cosine(depth, camera)
        if faults.grazing:
            seen &= slant > np.sin(np.radians(faults.grazing))
        y, x = np.nonzero(seen)
        if not len(x):
            return
        z = depth[y, x].astype(np.float64)
        # A pixel covers more of a surface that is farther away or oblique: points there must be more likely.
        weight = (z**2 / np.maximum(slant[y, x], 0.1)) ** faults.spread
        count = min(-(-self.faults.points * 3 // (2 * self.views)), len(x))
        if count < len(x):
            # The smallest of exponential times: a weighted draw without replacement (Efraimidis, Spirakis 2006).
            time = rng.exponential(size=len(x)) / weight
            chosen = np.sort(np.argpartition(time, count)[:count])
            x, y, z = x[chosen], y[chosen], z[chosen]
        drift = 1 + faults.drift * rng.normal()
        far = z * drift * (1 + faults.noise * rng.normal(size=len(z)))
        self.xyz.append(camera.lifted(np.stack([x, y], 1).astype(np.float64), far).astype(np.float32))
        self.rgb.append(image[y, x])

    def cloud(self) -> tuple[np.ndarray, np.ndarray]:
        """float32 [N, 3] metres and uint8 [N, 3], in no order."""
        faults, rng = self.faults, self.rng
        if not self.xyz:
            raise ValueError("no view sees anything: there is no cloud")
        xyz, rgb = np.concatenate(self.xyz), np.concatenate(self.rgb)
        keep = np.ones(len(xyz), bool)
        if faults.patchiness:
            keep &= rng.random(len(xyz)) < 1 - 0.9 * faults.patchiness * _patches(xyz, rng)
        if faults.missing:
            keep &= ~_holes(xyz, faults.missing, rng)
        left = np.flatnonzero(keep)
        if not len(left):
            left = np.arange(len(xyz))
        left = rng.permutation(left)[: faults.points]
        xyz, rgb = xyz[left], rgb[left]
        count = round(faults.outliers * len(xyz))
        if count:
            low, high = xyz.min(0), xyz.max(0)
            xyz[:count] = rng.uniform(low - 0.1 * (high - low), high + 0.1 * (high - low), (count, 3))
            order = rng.permutation(len(xyz))
            xyz, rgb = xyz[order], rgb[order]
        return xyz, rgb


def grazing_cosine(depth: np.ndarray, camera: Camera) -> np.ndarray:
    """Cosine between each pixel's ray and the surface's normal, float32 [H, W]; about 0 at steps in depth."""
    height, width = depth.shape
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    k = camera.intrinsics
    rays = np.stack([(x - k[0, 2]) / k[0, 0], (y - k[1, 2]) / k[1, 1], np.ones_like(x)], -1).astype(np.float32)
    points = rays * depth[..., None]
    across, down = np.gradient(points, axis=1), np.gradient(points, axis=0)
    normal = np.cross(across, down)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True) + 1e-20
    cosine = np.abs((normal * rays).sum(2)) / np.linalg.norm(rays, axis=2)
    return np.where(depth > 0, cosine, 0).astype(np.float32)


def _patches(xyz: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A smooth random field over the points, 0..1."""
    size = float(np.ptp(xyz, axis=0).max()) + 1e-9
    waves = rng.normal(0, 2 * np.pi * 1.5 / size, (3, 6))
    field = np.cos(xyz @ waves + rng.uniform(0, 2 * np.pi, 6)).sum(1)
    return np.clip(0.5 + 0.35 * field, 0, 1)


def _holes(xyz: np.ndarray, share: float, rng: np.random.Generator) -> np.ndarray:
    """Points within balls around some of them: about `share` of all."""
    inside = np.zeros(len(xyz), bool)
    size = float(np.linalg.norm(np.ptp(xyz, axis=0)))
    for _ in range(60):
        if inside.mean() >= share:
            break
        middle = xyz[rng.integers(len(xyz))]
        ball = ((xyz - middle) ** 2).sum(1) < (size * rng.uniform(0.01, 0.06)) ** 2
        if (inside | ball).mean() < 1.3 * share + 0.01:
            inside |= ball
    return inside
