"""Computes the mean head of a prior as a mesh, with which fitted heads are compared."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import igl
import numpy as np
import torch
from scipy.ndimage import zoom
from scipy.sparse.csgraph import connected_components

from benchmarks.heads.distances import Triangles
from export.heads.field import bases_of, geometry, surface
from export.heads.prior import Prior
from export.heads.prior_file import read_prior

CELL_DM = 0.025
COARSE = 4  # cells of the coarse grid that finds the surface
NEAR_DM = 0.12  # cells near the surface; farther away the coarse distances are used
CHUNK = 1 << 16
MM_PER_DM = 100


def read_mean_head(bundle: Path, cell_dm: float = CELL_DM) -> Triangles:
    """Returns the mean head of a bundle's prior (all codes 0), in mm."""
    return mesh_of(read_prior(bundle / "prior.maqp"), cell_dm)


def _weights(prior: Prior) -> tuple[list[torch.Tensor], ...]:
    bases = bases_of(prior)
    return bases.combine(torch.zeros(prior.shape_codes), torch.zeros(prior.colour_codes))


@torch.no_grad()
def mesh_of(prior: Prior, cell_dm: float = CELL_DM) -> Triangles:
    """Returns the mean head's largest piece, closed at its clip plane, in mm."""
    weights = _weights(prior)

    def distances(points: np.ndarray) -> np.ndarray:
        parts = torch.from_numpy(points.astype(np.float32)).split(CHUNK)
        field = torch.cat([geometry(prior.shape, weights, part)[:, 0] for part in parts]).numpy()
        return np.maximum(field, (points - prior.cut_point) @ prior.cut_normal)

    return mesh_of_distances(
        distances, prior.bounds_min.astype(np.float64), prior.bounds_max.astype(np.float64), cell_dm
    )


def mesh_of_distances(
    distances: Callable[[np.ndarray], np.ndarray], low: np.ndarray, high: np.ndarray, cell_dm: float = CELL_DM
) -> Triangles:
    """Returns the largest piece of the surface within the box low [3], high [3], dm; in mm. distances: of points [N,
    3], dm."""
    coarse = np.ceil((high - low) / (COARSE * cell_dm)).astype(int) + 1
    fine = COARSE * (coarse - 1) + 1
    axes = [a + cell_dm * np.arange(n) for a, n in zip(low, fine, strict=True)]
    # igl varies x fastest
    at = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    rough = distances(at[::COARSE, ::COARSE, ::COARSE].reshape(-1, 3)).reshape(coarse)
    values = zoom(rough, fine / coarse, order=1, grid_mode=False)
    near = np.abs(values) < NEAR_DM
    values[near] = distances(at[near])
    order = (2, 1, 0)
    grid = np.ascontiguousarray(at.transpose(*order, 3)).reshape(-1, 3)
    flat = np.ascontiguousarray(values.transpose(order)).ravel().astype(np.float64)
    points, faces, _ = igl.marching_cubes(flat, grid, *(int(n) for n in fine), 0.0)
    faces = np.asarray(faces, np.int64)
    mesh = Triangles(np.asarray(points) * MM_PER_DM, outwards(np.asarray(points), faces))
    return largest_piece(mesh)


@torch.no_grad()
def template_points(prior: Prior, points: np.ndarray) -> np.ndarray:
    """Returns points [N, 3] (dm) of the mean head at given points of the template head, float64 [N, 3], dm."""
    weights, found = _weights(prior), []
    for part in torch.from_numpy(points.astype(np.float32)).split(CHUNK):
        found.append(surface(prior.shape, weights, part, geometry(prior.shape, weights, part))[1])
    return torch.cat(found).numpy().astype(np.float64)


def outwards(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Orients triangles counter-clockwise from outside; the volume of a closed surface is then positive."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    return faces if (a * np.cross(b, c)).sum() > 0 else faces[:, ::-1].copy()


def largest_piece(mesh: Triangles) -> Triangles:
    """Returns the connected piece with the most triangles."""
    from scipy.sparse import coo_array

    count, edges = len(mesh.points), mesh.faces[:, [0, 1, 1, 2]].reshape(-1, 2)
    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    label = connected_components(graph, directed=False)[1]
    own = label == np.bincount(label[mesh.faces[:, 0]]).argmax()
    number = np.cumsum(own) - 1
    return Triangles(mesh.points[own], number[mesh.faces[own[mesh.faces[:, 0]]]])
