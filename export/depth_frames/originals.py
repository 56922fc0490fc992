"""Real frames out of packages: stereo pairs, and scans of round metrics seen from where they were scanned."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np
import trimesh
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from export.depth_frames.frames import DepthFrame
from export.depth_frames.matching import Rectified, calibrated, depth_of, rectified, uncalibrated
from export.photos.packages import PackageError, PackageReader, fetch, load_packages

_MARGIN_PX = 17  # a little over 16 r
_HOLE_PX = 9
_EXAMPLES = "./usr/share/doc/opencv-doc/examples/"
_BOARD = 9, 6  # inner corners
_SQUARE_M = 0.025  # not known; it only sets the unit
_PAIRS = (1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13, 14)
_SCAN_PX, _SCAN_FOCAL_PX = (480, 640), 800.0  # height, width; a pixel is 0.8 mm there, points are 0.6 mm apart


@dataclass(frozen=True)
class Original:
    """package: its name in export/photos/packages.toml."""

    name: str
    package: str
    shows: str
    read: Callable[[PackageReader], Iterator[DepthFrame]]

    def frames(self) -> list[DepthFrame]:
        """Fetches the package unless it is here. Raises PackageError and MatchingError."""
        with PackageReader(fetch(load_packages()[self.package])) as reader:
            return list(self.read(reader))


def _grey(reader: PackageReader, member: str) -> np.ndarray:
    image = cv2.imdecode(np.frombuffer(reader.read(member), np.uint8), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise PackageError(f"{member} is no picture that can be read.")
    return image


def _nowhere(depth: np.ndarray) -> np.ndarray:
    return np.zeros(depth.shape, bool)


def _read_boards(reader: PackageReader) -> Iterator[DepthFrame]:
    pictures = [[_grey(reader, f"{_EXAMPLES}data/{s}{k:02d}.jpg") for s in ("left", "right")] for k in _PAIRS]
    found = [[cv2.findChessboardCornersSB(p, _BOARD) for p in both] for both in pictures]
    good = [k for k, both in enumerate(found) if all(ok for ok, _ in both)]
    board = np.zeros((_BOARD[0] * _BOARD[1], 3))
    board[:, :2] = np.mgrid[: _BOARD[0], : _BOARD[1]].T.reshape(-1, 2) * _SQUARE_M
    corners = tuple([found[k][side][1] for k in good] for side in range(2))
    cameras = calibrated(corners, board, pictures[0][0].shape[::-1])
    for k in good:
        pair = rectified(*pictures[k], cameras)
        depth = depth_of(pair, 128)
        ok, seen = cv2.findChessboardCornersSB(pair.left, _BOARD)
        flat = np.zeros(depth.shape, np.uint8)
        if ok:
            # A square of the print lies beyond the outer corners; those are as far from the board's border as that.
            cv2.fillConvexPoly(flat, cv2.convexHull(seen.reshape(-1, 2).astype(np.int32)), 1)
        yield DepthFrame(f"real/board-{_PAIRS[k]:02d}", depth, pair.intrinsics, (flat > 0) & (depth > 0))


def _away_from_borders(depth: np.ndarray) -> np.ndarray:
    """Known pixels with no jump of depth over 4 % and no end of the surface within 16 px; holes of a few pixels are no
    end."""
    known = (depth > 0).astype(np.uint8)
    low = cv2.erode(np.where(depth > 0, depth, np.inf).astype(np.float32), np.ones((3, 3)))
    high = cv2.dilate(depth, np.ones((3, 3)))
    torn = (known > 0) & (low < high / 1.04)
    closed = cv2.morphologyEx(known, cv2.MORPH_CLOSE, np.ones((_HOLE_PX,) * 2, np.uint8))
    border = torn | (closed == 0)
    return (known > 0) & (cv2.dilate(border.astype(np.uint8), np.ones((2 * _MARGIN_PX + 1,) * 2)) == 0)


def _read_walls(reader: PackageReader) -> Iterator[DepthFrame]:
    left, right = (_grey(reader, f"mvtbdata/images/walls-{s}.png") for s in ("l", "r"))
    left, right = (cv2.resize(p, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA) for p in (left, right))
    # A phone of 4.15 mm and pixels of 1.5 micrometres, by the book that the images belong to.
    pair = uncalibrated(left, right, 4.15e-3 / 1.5e-6 / 4)
    depth = depth_of(pair, 160)
    yield DepthFrame("real/walls", depth, pair.intrinsics, _nowhere(depth))


def _read_motorcycle(reader: PackageReader) -> Iterator[DepthFrame]:
    """Middlebury 2014 in the size of scikit-image, whose documentation has the camera."""
    left, right = (_grey(reader, f"skimage/data/motorcycle_{s}.png") for s in ("left", "right"))
    pair = Rectified(left, right, 994.978, 311.193, 254.877, 311.193 + 31.086, 0.193001)
    matched = depth_of(pair, 80)
    yield DepthFrame("real/motorcycle-matched", matched, pair.intrinsics, _nowhere(matched))
    with np.load(io.BytesIO(reader.read("skimage/data/motorcycle_disp.npz"))) as file:
        disparity = file["arr_0"]
    known = np.isfinite(disparity) & (disparity > 0)
    true = pair.focal_px * pair.baseline / (np.where(known, disparity, 1) + 31.086)
    true = np.where(known, true, 0).astype(np.float32)
    yield DepthFrame("real/motorcycle-true", true, pair.intrinsics, _nowhere(true))


def _read_scans(reader: PackageReader) -> Iterator[DepthFrame]:
    for name in ("rs1_normals", "rs22_proc2"):
        mesh = trimesh.load(
            io.BytesIO(reader.read(f"{_EXAMPLES}surface_matching/data/{name}.ply")), file_type="ply", process=False
        )
        # Millimetres, y up, seen from the origin along -z.
        yield scanned(f"real/{name}", np.asarray(mesh.vertices) * [0.001, -0.001, -0.001], np.asarray(mesh.faces))


def scanned(name: str, vertex: np.ndarray, triangle: np.ndarray) -> DepthFrame:
    """A scan of something round, vertices float64 [n, 3] in the scanner's camera coordinates, as a depth frame."""
    height, width = _SCAN_PX
    middle = np.median(vertex[:, :2] / vertex[:, 2:], axis=0) * _SCAN_FOCAL_PX
    cx, cy = (width - 1) / 2 - middle[0], (height - 1) / 2 - middle[1]
    y, x = np.mgrid[:height, :width]
    ray = np.stack([(x - cx) / _SCAN_FOCAL_PX, (y - cy) / _SCAN_FOCAL_PX, np.ones((height, width))], -1).reshape(-1, 3)
    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, vertex.astype(np.float32), triangle.astype(np.int32))
    hit = scene.run(np.zeros_like(ray, np.float32), ray.astype(np.float32))
    a, b, c = (vertex[triangle[hit, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    along = (normal * ray).sum(1)
    depth = np.where((hit >= 0) & (along != 0), (normal * a).sum(1) / np.where(along == 0, 1, along), 0)
    depth = depth.clip(0).reshape(height, width).astype(np.float32)
    smooth = _away_from_borders(depth)
    return DepthFrame(name, depth, (_SCAN_FOCAL_PX, _SCAN_FOCAL_PX, float(cx), float(cy)), smooth)


ORIGINALS = (
    Original("scans", "opencv-doc", "two scans of round toys: no edge is right", _read_scans),
    Original("boards", "opencv-doc", "a flat chessboard, stereo pairs: no edge on it is right", _read_boards),
    Original("walls", "mvtb-data", "a corner of a house with ground and planter, two photos", _read_walls),
    Original("motorcycle", "scikit-image", "a workshop, a stereo pair and its true depth", _read_motorcycle),
)
