"""Writes data/tiny_edges: an edge network with random weights, and what torch makes of two depth frames.

`bundle`: two scales, so that 18 px away from a pixel nothing matters. `<size>_depth.f32`, `<size>_slopes.f32`,
`<size>_planes.f32`: little-endian floats: a frame [height][width] in metres with holes, faults and steps; the network's
input [height' / 2][width' / 2][12], from float64 by export/edges/depth_input.py; its output
[height' / 2][width' / 2][16]. height' and width' are rounded up to multiples of 4. Focal lengths are 31 and 47 px.

    python -m tests.native.generate.make_tiny_edges
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch

from export.bundle import BundleInfo
from export.densepose.graphs import session
from export.edges.bundle import write_manifest
from export.edges.config import FOLD, NetworkConfig
from export.edges.depth_input import folded, mirrored, slopes
from export.edges.export_onnx import export
from export.edges.network import EdgeNetwork

FOLDER = Path(__file__).parents[1] / "data" / "tiny_edges"
CONFIG = NetworkConfig(widths=(4, 6))
FOCAL_PX = (31.0, 47.0)
SIZES = ((24, 20), (17, 31))  # of which one is padded


def write_bundle(folder: Path) -> None:
    torch.manual_seed(3)
    network = EdgeNetwork(CONFIG).eval()
    # Planes that are spread over what they can mean: distances 0 to eps_r, each kind somewhere.
    network.head.weight.data *= 32
    network.head.bias.data = torch.tensor([0.5, -2.0, 0.0, 0.0]).repeat_interleave(FOLD**2)
    export(network, folder, CONFIG.multiple)
    write_manifest(folder, BundleInfo("tiny-edges", "fp32"), CONFIG.multiple)


def depth_frame(width: int, height: int) -> np.ndarray:
    """A leaning wall, a box before it, noise, holes."""
    rng = np.random.default_rng(width)
    y, x = np.mgrid[:height, :width]
    depth = 1 / (0.5 + 0.01 * x - 0.004 * y)
    depth[height // 4 : height // 2, width // 3 : width - 3] = 0.8
    depth *= rng.normal(1, 0.002, depth.shape)
    depth[rng.random(depth.shape) < 0.08] = 0
    depth[0, 0] = 60.0  # a fault of the sensor
    return depth.astype(np.float32)


def main() -> None:
    write_bundle(FOLDER / "bundle")
    graph = session(FOLDER / "bundle" / "field.onnx")
    for width, height in SIZES:
        depth = depth_frame(width, height)
        planes = slopes(torch.from_numpy(depth.astype(np.float64))[None], torch.tensor([FOCAL_PX], dtype=torch.float64))
        given = np.ascontiguousarray(
            folded(mirrored(planes, CONFIG.multiple), FOLD).permute(0, 2, 3, 1).numpy().astype(np.float32)
        )
        (found,) = graph.run(None, {"slopes": given})
        for name, values in (("depth", depth), ("slopes", given), ("planes", found)):
            values.astype("<f4").tofile(FOLDER / f"{width}x{height}_{name}.f32")


if __name__ == "__main__":
    main()
