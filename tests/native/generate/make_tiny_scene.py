"""Writes data/tiny_scene: scene networks with random weights, a captured place, and the descriptors that torch makes of
them.

`bundle`: an extractor of two convolutions with the interface of the real one, the basis network, a narrow refiner.
`capture`: 5 photos of noise by cameras that are held at different angles, one of them held out, and a cloud in two
layers, so that points hide each other. Places and cameras' centres are multiples of 1/256, which floats hold exactly.
`looks.bin`: for each point that a photo sees, in the cloud's order, little-endian: uint32 index and views, then float32
mean [8], slope [6][8], variation; computed by export/scenes, moments in float64, visibility at half of the size.
`background.bin`: float32 red, green, blue of what the photos show where no point is.

    python -m tests.native.generate.make_tiny_scene
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor, nn

from export.bundle import BundleInfo
from export.scenes.bundle import write_manifest
from export.scenes.captures import read_capture
from export.scenes.config import FEATURES, ExtractorConfig, RefinerConfig, SceneConfig
from export.scenes.export_onnx import export
from export.scenes.fitting import Options, fitted_to_views, seen_in
from export.scenes.networks.basis import directions
from export.scenes.networks.system import Networks

FOLDER = Path(__file__).parents[1] / "data" / "tiny_scene"
WIDTH, HEIGHT = 72, 56
HELD_OUT = 3


class TinyExtractor(nn.Module):
    """RGB [N, 3, H, W] -> features [N, 8, H, W], of which the first three are the photo's colours."""

    def __init__(self) -> None:
        super().__init__()
        self.first = nn.Conv2d(3, 6, 3, padding=1)
        self.second = nn.Conv2d(6, FEATURES - 3, 3, padding=1)

    def forward(self, image: Tensor) -> Tensor:
        return torch.cat([image, self.second(torch.relu(self.first(image)))], 1)


def exact(values: np.ndarray) -> np.ndarray:
    return np.round(values * 256) / 256


def write_bundle(folder: Path) -> Networks:
    networks = Networks(SceneConfig(ExtractorConfig(), RefinerConfig(widths=(4, 4, 4, 4))))
    networks.extractor = TinyExtractor()
    for parameter in networks.basis.parameters():
        parameter.data *= 2  # so that descriptors depend on the view more than by rounding
    for name, parameter in networks.refiner.named_parameters():
        if name.endswith("weight"):  # so that pictures have more than one colour
            parameter.data *= 6 if name.startswith("final") else 1.4
    export(networks.eval(), folder)
    write_manifest(folder, BundleInfo("tiny-scenes", "fp32", training_data=()))
    return networks


def pose(centre: np.ndarray, roll: float) -> np.ndarray:
    """Camera to world, axes of OpenGL: looks at the world's origin, turned by `roll` about the axis."""
    backward = centre / np.linalg.norm(centre)
    right = np.cross((0, 0, 1), backward)
    right /= np.linalg.norm(right)
    up = np.cross(backward, right)
    cosine, sine = math.cos(roll), math.sin(roll)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([cosine * right + sine * up, cosine * up - sine * right, backward], 1)
    matrix[:3, 3] = centre
    return matrix


def write_capture(folder: Path) -> None:
    (folder / "images").mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(5)
    frames = []
    for k, roll in enumerate((0.0, 0.2, -0.7, 0.4, 1.6)):
        angle = 2 * math.pi * k / 7
        centre = exact(np.array([3 * math.cos(angle), 3 * math.sin(angle), 0.8 + 0.2 * k]))
        photo = cv2.resize(rng.random((HEIGHT // 8, WIDTH // 8, 3)), (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC)
        name = f"images/{k}.png"
        cv2.imwrite(str(folder / name), np.clip(255 * photo, 0, 255).astype(np.uint8))
        frames.append({"file_path": name, "transform_matrix": pose(centre, roll).tolist()})
    table = {
        "w": WIDTH, "h": HEIGHT, "fl_x": 80.0, "fl_y": 78.0, "cx": 37.0, "cy": 27.5, "ply_file_path": "cloud.ply",
        "up": [0, 0, 1], "test_filenames": [frames[HELD_OUT]["file_path"]], "frames": frames,
    }  # fmt: skip
    (folder / "transforms.json").write_text(json.dumps(table, indent=1) + "\n")
    # Two balls, one inside the other: the inner one is seen through the gaps of the outer one.
    ball = rng.standard_normal((500, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    places = np.unique(exact(ball * np.where(np.arange(500) < 350, 0.8, 0.5)[:, None]), axis=0)
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(places)}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    (folder / "cloud.ply").write_bytes(head.encode() + places.astype("<f4").tobytes())


@torch.no_grad()
def write_descriptors(folder: Path, networks: Networks) -> None:
    capture = read_capture(folder / "capture")
    options = Options(up=capture.up, visibility_scale=0.5, precision=torch.float64)
    points = torch.from_numpy(capture.cloud.positions)
    views = [capture.view(k) for k in capture.sources()]
    model = fitted_to_views(points, views, networks, options)
    fit = model.fit
    model.background.numpy().astype("<f4").tofile(folder / "background.bin")
    sees = torch.stack([seen_in(points, view.camera, options) for view in views])
    (chosen,) = torch.where(sees.any(0))
    with (folder / "looks.bin").open("wb") as file:
        for at, index in enumerate(chosen.tolist()):
            centres = [v.camera.centre for v, seen in zip(views, sees[:, index], strict=True) if seen]
            away = [directions(points[index, None], torch.from_numpy(centre)) for centre in centres]
            h = networks.basis(torch.cat(away).float()).double()
            moves = (h - h.mean(0)) @ fit.slope[at]
            variation = moves.square().sum(1).mean().sqrt()
            file.write(np.array([index, len(centres)], "<u4").tobytes())
            values = [fit.mean[at], fit.slope[at].flatten(), variation[None]]
            file.write(torch.cat(values).numpy().astype("<f4").tobytes())
    print(f"{len(chosen)} of {len(points)} points are seen, {int((sees.sum(0) > 1).sum())} of them more than once")


def main() -> None:
    torch.manual_seed(11)
    networks = write_bundle(FOLDER / "bundle")
    write_capture(FOLDER / "capture")
    write_descriptors(FOLDER, networks)


if __name__ == "__main__":
    main()
