"""Writes what bundles and docs say about the atlas: the surface grid and an image of the charts.

    python -m export.people.surface_files

Only needed when the atlas changes; both files are kept in the repository.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np

from export import surface
from export.people.atlas import Atlas
from export.people.body import Body
from export.people.lookup import LabelLookup
from export.surface_grid import SurfaceGrid

NODES = 25
_LINES = 8  # U and V lines across a chart
_PICTURE_PX, _CHART_PX = 620, 150


def surface_grid(atlas: Atlas, nodes: int = NODES) -> SurfaceGrid:
    """Points of the template at the nodes of each chart."""
    points = np.full((surface.PART_COUNT, nodes, nodes, 3), np.nan, np.float32)
    u, v = np.meshgrid(*[np.linspace(0, 1, nodes)] * 2, indexing="ij")
    node = np.stack([u.ravel(), v.ravel()], 1)
    for part in range(1, surface.PART_COUNT + 1):
        faces = atlas.part == part
        corner, place = atlas.uv[faces].astype(np.float64), atlas.rest[atlas.faces[faces]]
        a, b, c = corner[:, 0], corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
        area = b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0]
        usable = np.abs(area) > 1e-12
        a, b, c, area, place = a[usable], b[usable], c[usable], area[usable], place[usable]
        away = node[:, None] - a
        second = (away[..., 0] * c[:, 1] - away[..., 1] * c[:, 0]) / area
        third = (b[:, 0] * away[..., 1] - b[:, 1] * away[..., 0]) / area
        weight = np.stack([1 - second - third, second, third], -1)
        best = weight.min(-1).argmax(1)  # the face that holds the node, or comes nearest to it
        weight = weight[np.arange(len(node)), best]
        inside = weight.min(1) > -1e-6
        found = np.einsum("kc,kcx->kx", weight, place[best])
        points[part - 1].reshape(-1, 3)[inside] = found[inside]
    return SurfaceGrid(points)


def colours() -> np.ndarray:
    """One colour for each part: uint8 [25, 3] BGR, 0 white."""
    hue = (np.arange(24) * 107 % 180).astype(np.uint8)
    value = np.where(np.arange(24) % 2, 200, 245).astype(np.uint8)
    hsv = np.stack([hue, np.full(24, 110, np.uint8), value], 1)[None]
    return np.concatenate([np.full((1, 3), 255, np.uint8), cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)[0]])


def painted(iuv: np.ndarray) -> np.ndarray:
    """iuv: uint8 [H, W, 3]. The parts' colours with lines of equal U (dark) and V (light)."""
    out = colours()[iuv[..., 0]].astype(np.float32)
    for channel, tone in ((1, 40), (2, 250)):
        step = np.floor(iuv[..., channel].astype(np.float32) / 256 * _LINES)
        line = np.zeros(step.shape, bool)
        for axis in (0, 1):
            other = np.roll(step, 1, axis)
            line |= (other != step) & (np.roll(iuv[..., 0], 1, axis) == iuv[..., 0]) & (iuv[..., 0] > 0)
        out[line] = 0.35 * out[line] + 0.65 * tone
    return out.astype(np.uint8)


def seen_from(atlas: Atlas, lookup: LabelLookup, azimuth: float) -> np.ndarray:
    """Labels of the template seen from one side: uint8 [H, W, 3]. azimuth: radians, 0 from the front."""
    turn = np.array([[np.cos(azimuth), -np.sin(azimuth), 0], [np.sin(azimuth), np.cos(azimuth), 0], [0, 0, 1]])
    # Points drawn densely and painted from far to near: slow, and short.
    rng = np.random.default_rng(0)
    corner = atlas.rest[atlas.faces]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    face = rng.choice(len(corner), 1_500_000, p=area / area.sum())
    weight = rng.dirichlet(np.ones(3), len(face))
    points = np.einsum("kc,kcx->kx", weight, corner[face])
    x, y, z = (points @ turn.T).T
    tall = z.max() - z.min()
    scale = (_PICTURE_PX - 20) / tall
    column = np.round(0.42 * _PICTURE_PX + scale * x).astype(int)
    row = np.round(10 + scale * (z.max() - z)).astype(int)
    order = np.argsort(-y)
    out = np.zeros((_PICTURE_PX, int(0.84 * _PICTURE_PX), 3), np.uint8)
    inside = (column >= 0) & (column < out.shape[1])
    order = order[inside[order]]
    out[row[order], column[order]] = lookup.iuv(points[order])
    return out


def picture(atlas: Atlas) -> np.ndarray:
    """Front and back of the template above its 24 charts, left and right beside each other: uint8 [H, W, 3] BGR."""
    lookup = LabelLookup(atlas)
    bodies = np.hstack([painted(seen_from(atlas, lookup, azimuth)) for azimuth in (0, np.pi)])
    tiles = []
    u, v = np.meshgrid(*[np.linspace(0, 255, _CHART_PX)] * 2, indexing="ij")
    for part in range(1, surface.PART_COUNT + 1):
        iuv = np.stack([np.full(u.shape, part), u, v], -1).astype(np.uint8)
        reached = np.zeros(u.shape, np.uint8)
        corner = np.round((_CHART_PX - 1) * atlas.uv[atlas.part == part][..., ::-1]).astype(np.int32)
        cv2.fillPoly(reached, list(corner), 1)
        iuv[reached == 0] = 0
        tile = np.full((_CHART_PX + 30, _CHART_PX + 12, 3), 255, np.uint8)
        tile[24 : 24 + _CHART_PX, 6 : 6 + _CHART_PX] = painted(iuv)
        cv2.putText(tile, f"{part} {surface.PART_NAMES[part]}", (6, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.36, (0, 0, 0), 1,
                    cv2.LINE_AA)  # fmt: skip
        tiles.append(tile)
    charts = np.vstack([np.hstack(tiles[k : k + 6]) for k in range(0, 24, 6)])
    margin = charts.shape[1] - bodies.shape[1]
    if margin < 0:
        charts = cv2.copyMakeBorder(charts, 0, 0, 0, -margin, cv2.BORDER_CONSTANT, value=(255, 255, 255))
    else:
        left = margin // 2
        bodies = cv2.copyMakeBorder(bodies, 0, 0, left, margin - left, cv2.BORDER_CONSTANT, value=(255, 255, 255))
    return np.vstack([bodies, charts])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--grid", type=Path, default=Path("export/densepose/surface.grid"))
    parser.add_argument("--picture", type=Path, default=Path("docs/images/atlas.png"))
    options = parser.parse_args()
    atlas = Atlas(Body())
    surface_grid(atlas).save(options.grid)
    cv2.imwrite(str(options.picture), picture(atlas))
    print(f"Written: {options.grid} ({options.grid.stat().st_size} bytes), {options.picture}")


if __name__ == "__main__":
    main()
