"""Draws the outfit that the desktop demo's try-on view puts on people: a striped jersey, jeans, shoes and a hat.

    python -m export.people.outfit [--out outfit.png]

The image is a DensePose texture atlas: 4 columns of 6 square tiles, part p in column (p - 1) // 6 and row
(p - 1) % 6; in a tile U grows to the right and V upwards (as DensePose's notebook of texture transfer reads them).
The colour of a place is a function of its point on the template body, so what is drawn goes on across chart borders.
Ours alone: it may be used like the code.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt

from export import surface
from export.surface_grid import FILE, SurfaceGrid

OUTFIT = Path("desktop_demo/assets/outfit.png")
GRID = Path("sdk/models/densepose-b-int8") / FILE
TILE_PX, COLUMNS, ROWS = 128, 4, 6
_FINER = 3  # samples along a texel
_TONE_STEP = 4  # tones between the steps cannot be told apart, and would double the file

# sRGB
CREAM, NAVY, RED, WHITE = (243, 233, 210), (34, 52, 92), (208, 58, 52), (250, 250, 248)
DENIM, DENIM_WORN, STITCH, LEATHER, BRASS = (58, 92, 146), (116, 150, 196), (222, 164, 78), (96, 62, 40), (226, 190, 96)
SKIN, SKIN_LINE = (222, 176, 146), (196, 146, 118)

# Metres on the template: x to the body's left, y to its back, z up.
STRIPE_M, RIB_M = 0.048, 0.018
HEM_Z, BELT_Z, ANKLE_Z, HAT_Z = 1.045, 1.005, 0.098, 1.735
SHOULDER, WRIST = np.array([0.165, -0.03, 1.5]), np.array([0.5, -0.19, 1.125])
NECK_Y, COLLAR_M = -0.015, 0.082
TORSO, HANDS, FEET, LEGS, ARMS, HEAD = (1, 2), (3, 4), (5, 6), range(7, 15), range(15, 23), (23, 24)

# Letters as strokes in a square of side 1, x to the right and y up.
LETTER_M = [[(0, 0), (0, 1), (0.5, 0.35), (1, 1), (1, 0)]]
DIGIT_2 = [[(0, 0.8), (0.2, 1), (0.8, 1), (1, 0.8), (1, 0.6), (0, 0), (1, 0)]]
DIGIT_4 = [[(0.75, 0), (0.75, 1), (0, 0.3), (1, 0.3)]]


def tile(part: int) -> tuple[slice, slice]:
    """Rows and columns of the part's tile."""
    column, row = divmod(part - 1, ROWS)
    return (slice(row * TILE_PX, (row + 1) * TILE_PX), slice(column * TILE_PX, (column + 1) * TILE_PX))


def looked_up(texture: np.ndarray, part: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """The texture's pixels at the parts (1..24) and U, V (0..1): the outermost texels are those of 0 and 1."""
    side = texture.shape[1] // COLUMNS
    column, row = np.divmod(np.asarray(part, int) - 1, ROWS)
    at = np.round(np.clip(uv, 0, 1) * (side - 1)).astype(int)
    return texture[row * side + side - 1 - at[..., 1], column * side + at[..., 0]]


def stroke_distance(at: np.ndarray, strokes: list) -> np.ndarray:
    """at: [K, 2]. How far each point is from the nearest of the lines."""
    nearest = np.full(len(at), np.inf)
    for stroke in strokes:
        for start, end in zip(np.array(stroke[:-1], float), np.array(stroke[1:], float), strict=True):
            along = end - start
            share = np.clip((at - start) @ along / (along @ along), 0, 1)[:, None]
            nearest = np.minimum(nearest, np.linalg.norm(at - start - share * along, axis=1))
    return nearest


def in_square(across: np.ndarray, z: np.ndarray, centre: tuple[float, float], side_m: float) -> np.ndarray:
    """Coordinates in a letter's square around `centre`."""
    return np.stack([across - centre[0], z - centre[1]], 1) / side_m + 0.5


class Painter:
    """Colours of points: each rule paints over what the rules before it did."""

    def __init__(self, count: int, colour: tuple[int, int, int]):
        self.rgb = np.tile(np.array(colour, np.float32), (count, 1))

    def paint(self, where: np.ndarray, colour: tuple[int, int, int], opacity: float | np.ndarray = 1.0) -> None:
        share = (where * opacity)[:, None].astype(np.float32)
        self.rgb += share * (np.array(colour, np.float32) - self.rgb)


def knitted(canvas: Painter, along: np.ndarray, across: np.ndarray) -> None:
    """Stripes along a coordinate, with the fine ribs of knitting across. Both in metres."""
    canvas.paint(np.floor(along / STRIPE_M).astype(int) % 2 == 0, NAVY)
    canvas.rgb *= np.where(np.cos(2 * np.pi * across / RIB_M) > 0, 0.93, 1.0)[:, None]


def jeans(canvas: Painter, points: np.ndarray, across: np.ndarray | None) -> None:
    """across: V of leg charts, whose ends are the seams; None on the torso."""
    _, y, z = points.T
    canvas.paint(np.ones(len(z), bool), DENIM)
    worn = np.exp(-(((z - 0.72) / 0.16) ** 2)) + 0.8 * np.exp(-(((z - 0.5) / 0.05) ** 2))
    canvas.paint(y < -0.02, DENIM_WORN, 0.75 * worn * np.clip((-0.02 - y) / 0.06, 0, 1))
    if across is None:
        return
    from_seam = np.minimum(across, 1 - across)
    canvas.paint(from_seam < 0.022, NAVY, 0.7)
    canvas.paint((from_seam > 0.035) & (from_seam < 0.07), STITCH)
    canvas.paint(z < ANKLE_Z + 0.03, DENIM_WORN, 0.6)  # turned-up ends
    canvas.paint(np.abs(z - ANKLE_Z - 0.031) < 0.004, NAVY, 0.7)


def torso(points: np.ndarray, is_front: bool) -> np.ndarray:
    x, y, z = points.T
    canvas = Painter(len(x), CREAM)
    knitted(canvas, z - HEM_Z, x)
    canvas.paint(z < HEM_Z + 0.03, NAVY)
    canvas.paint((np.hypot(x, y - NECK_Y) < COLLAR_M) & (z > 1.515 + 0.6 * y), NAVY)
    if is_front:
        badge = np.hypot(x, z - 1.335)
        canvas.paint(badge < 0.094, CREAM)
        canvas.paint(badge < 0.084, RED)
        canvas.paint(stroke_distance(in_square(x, z, (0, 1.335), 0.078), LETTER_M) < 0.15, WHITE)
    else:
        for digit, centre_x in ((DIGIT_2, 0.062), (DIGIT_4, -0.062)):
            # Seen from behind the body's left is on the left.
            distance = stroke_distance(in_square(-x, z, (-centre_x, 1.325), 0.1) * (1, 0.62) + (0, 0.19), digit)
            canvas.paint(distance < 0.25, CREAM)
            canvas.paint(distance < 0.15, RED)
    below = Painter(len(x), DENIM)
    jeans(below, points, None)
    if is_front:
        below.paint(np.abs(x) < 0.004, NAVY, 0.7)
        below.paint((np.abs(x - 0.016) < 0.004) & (z > 0.92), STITCH)
        for side in (-1, 1):
            edge = stroke_distance(np.stack([side * x, z], 1), [[(0.085, BELT_Z), (0.1, 0.965), (0.155, 0.945)]])
            below.paint(edge < 0.004, STITCH)
    else:
        below.paint(np.abs(x) < 0.004, STITCH)
        corners = [(0.04, 0.985), (0.125, 0.985), (0.12, 0.91), (0.0825, 0.888), (0.045, 0.91), (0.04, 0.985)]
        for side in (-1, 1):
            below.paint(stroke_distance(np.stack([side * x, z], 1), [corners]) < 0.005, STITCH)
    below.paint(z > BELT_Z, LEATHER)
    if is_front:
        below.paint((z > BELT_Z + 0.004) & (z < HEM_Z - 0.004) & (np.abs(x) < 0.024), BRASS)
        below.paint((z > BELT_Z + 0.013) & (z < HEM_Z - 0.013) & (np.abs(x) < 0.014), LEATHER)
    canvas.rgb[z < HEM_Z] = below.rgb[z < HEM_Z]
    return canvas.rgb


def arm(points: np.ndarray) -> np.ndarray:
    mirrored = points * np.where(points[:, :1] < 0, (-1, 1, 1), (1, 1, 1))
    length_m = np.linalg.norm(WRIST - SHOULDER)
    along = (mirrored - SHOULDER) @ (WRIST - SHOULDER) / length_m
    canvas = Painter(len(points), CREAM)
    knitted(canvas, along, 1.4 * (mirrored[:, 0] + mirrored[:, 2]))
    canvas.paint(along > length_m - 0.045, NAVY)
    return canvas.rgb


def leg(points: np.ndarray, v: np.ndarray) -> np.ndarray:
    canvas = Painter(len(points), DENIM)
    jeans(canvas, points, v)
    return canvas.rgb


def shoe(points: np.ndarray) -> np.ndarray:
    x, y, z = points.T
    middle = np.abs(np.abs(x) - 0.205)
    canvas = Painter(len(x), RED)
    laces = (y < -0.04) & (y > -0.13) & (middle < 0.022) & (z > 0.03)
    canvas.paint(laces, WHITE, 0.35)
    canvas.paint(laces & (np.floor(y / 0.011).astype(int) % 2 == 0), WHITE)
    canvas.paint((y < -0.172) & (z > 0.012), WHITE)  # the cap over the toes
    canvas.paint((z > 0.028) & (z < 0.062) & (np.abs(y + 0.01 - 0.6 * (z - 0.045)) < 0.009), WHITE)
    canvas.paint(z < 0.018, WHITE)
    canvas.paint(z < 0.006, NAVY)
    canvas.paint(z > 0.085, WHITE)
    return canvas.rgb


def head(points: np.ndarray) -> np.ndarray:
    x, y, z = points.T
    canvas = Painter(len(x), SKIN)
    # The guide lines of an artist's head instead of a face.
    canvas.paint((np.abs(x) < 0.0035) & (y < -0.06), SKIN_LINE)
    canvas.paint((np.abs(z - 1.7) < 0.0035) & (y < -0.06), SKIN_LINE)
    edge = HAT_Z - 0.25 * (y + 0.06)
    hat = Painter(len(x), RED)
    hat.rgb *= (1 - 0.08 * (1 + np.cos(28 * np.arctan2(y + 0.06, x))) / 2)[:, None]
    hat.paint(z < edge + 0.035, NAVY)
    canvas.rgb[z > edge] = hat.rgb[z > edge]
    return canvas.rgb


def colours(part: int, v: np.ndarray, points: np.ndarray) -> np.ndarray:
    """sRGB, float32 [K, 3], of points of one part and their V."""
    if part in TORSO:
        return torso(points, part == 2)
    if part in FEET:
        return shoe(points)
    if part in LEGS:
        return leg(points, v)
    if part in ARMS:
        return arm(points)
    if part in HEAD:
        return head(points)
    return Painter(len(points), SKIN).rgb


def shading(nodes: np.ndarray) -> np.ndarray:
    """nodes: [n, n, 3] points of a chart. [n, n]: how bright the surface is under light from the front, the back and
    above, so that the outfit looks round; .9 where the chart does not reach."""
    normal = np.cross(*np.gradient(nodes, axis=(0, 1)))
    with np.errstate(invalid="ignore"):
        normal = np.abs(normal / np.linalg.norm(normal, axis=-1, keepdims=True))
    return np.nan_to_num(0.74 + 0.26 * np.maximum(normal[..., 1], normal[..., 2]), nan=0.9).astype(np.float32)


def drawn(grid: SurfaceGrid) -> np.ndarray:
    """The atlas: uint8 [768, 512, 3] BGR."""
    texture = np.zeros((ROWS * TILE_PX, COLUMNS * TILE_PX, 3), np.uint8)
    fine = TILE_PX * _FINER
    # Texels stand for U, V of 0 to 1 with their middles, so that no tile needs its neighbours.
    step = np.clip(((np.arange(fine) + 0.5) / _FINER - 0.5) / (TILE_PX - 1), 0, 1)
    u, v = np.meshgrid(step, step[::-1])
    uv = np.stack([u.ravel(), v.ravel()], 1)
    for part in range(1, surface.PART_COUNT + 1):
        points = grid.point_of(np.full(len(uv), part), uv)
        reached = ~np.isnan(points).any(1)
        picture = np.zeros((fine * fine, 3), np.float32)
        picture[reached] = colours(part, uv[reached, 1], points[reached].astype(np.float64))
        picture = picture.reshape(fine, fine, 3)
        # nodes are [U, V]; rows of the tile are V from above.
        light = cv2.GaussianBlur(shading(grid.points[part - 1]), (3, 3), 0.8).T[::-1]
        picture *= cv2.resize(np.ascontiguousarray(light), (fine, fine))[..., None]
        # Networks answer with places off the chart too: they take the nearest colour on it.
        nearest = distance_transform_edt(~reached.reshape(fine, fine), return_distances=False, return_indices=True)
        picture = cv2.resize(picture[tuple(nearest)], (TILE_PX, TILE_PX), interpolation=cv2.INTER_AREA)
        texture[tile(part)] = np.minimum(_TONE_STEP * np.round(picture[..., ::-1] / _TONE_STEP), 255).astype(np.uint8)
    return texture


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=OUTFIT)
    options = parser.parse_args()
    grid = SurfaceGrid.load(GRID)
    texture = drawn(grid)
    if not cv2.imwrite(str(options.out), texture, [cv2.IMWRITE_PNG_COMPRESSION, 9]):
        parser.exit(1, f"{options.out} could not be written.\n")
    print(f"Written: {options.out} ({options.out.stat().st_size} bytes)")


if __name__ == "__main__":
    main()
