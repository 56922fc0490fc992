"""Fine-tunes the descriptors of one scene to its photos.

    maquette scene build PLACE --bundle BUNDLE --out place.maqs
    python -m export.scenes.finetune PLACE --scene place.maqs --networks BUNDLE --weights RUN/weights.pt \\
        --seconds 60 --out tuned.maqs

`--weights` names the weights that the bundle was exported from (export.scenes.train), because int8 graphs have no
gradients. The written scene has the same points in the same blocks, and works with the same bundle.
With `--save-at 10 60 600`, `--out` is a folder, and one run writes `10s.maqs`, `60s.maqs` and `600s.maqs` into it;
`python -m benchmarks --fine-tuned` reads a folder of such folders.

The training uses all photos that the scene was built from. It prints the PSNR of held-out photos before and after.
`--seconds` counts training only: preparation, saving and measuring take additional time.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from export.bundle import read_manifest
from export.densepose.graphs import session
from export.point_cloud import PointCloudError
from export.scenes.bundle import BASIS, identity
from export.scenes.captures import Capture, CaptureError, read_capture
from export.scenes.fitting import View
from export.scenes.geometry.cameras import upright, warped
from export.scenes.image_quality import psnr_db
from export.scenes.losses import LossWeights
from export.scenes.networks.extractor import STRIDE
from export.scenes.networks.feature_scale import factors_between, scaled
from export.scenes.networks.system import Networks, load_networks
from export.scenes.perceptual import load_perceptual
from export.scenes.scene_file import SceneFile, SceneFileError, read_scene_file, write_scene_file
from export.scenes.tuning import Rates, TunedScene, Tuning

MIN_FRACTION = 0.1  # of the learning rates, at the time of a save


def networks_of_bundle(weights: Path, bundle: Path, view: View, up: tuple[float, float, float]) -> Networks:
    """The bundle's networks in torch, from the weights that it was exported from; `view` is a photo to compare them on.

    Raises ValueError where the bundle is of other weights.
    """
    networks = load_networks(weights).eval()
    camera = upright(view.camera, np.asarray(up), STRIDE)
    image = torch.from_numpy(warped(view.image, view.camera, camera))[None]
    (features,) = session(bundle / "extractor.onnx").run(None, {"image": image.numpy()})
    basis = torch.from_numpy(np.fromfile(bundle / BASIS, "<f4"))
    own = torch.nn.utils.parameters_to_vector(networks.basis.parameters()).detach()
    if basis.shape != own.shape or not torch.allclose(basis, own, atol=1e-6):
        raise ValueError(f"{bundle} has another basis than {weights}; give the weights that it was exported from.")
    try:
        found = factors_between(networks, _first(image), _first(torch.from_numpy(features)))
    except ValueError as error:
        raise ValueError(f"{bundle} and {weights} do not belong together: {error}.") from None
    return scaled(networks, found)


def _first(channels_last: Tensor) -> Tensor:
    return channels_last.permute(0, 3, 1, 2)


def rate_fraction(spent_s: float, saves_s: Sequence[float]) -> float:
    """Fraction of the learning rates after `spent_s` seconds. From each save to the next it falls from 1 along a
    cosine, so that training has converged at each save."""
    begin = 0.0
    for end in saves_s:
        if spent_s < end:
            wave = 0.5 * (1 + math.cos(math.pi * (spent_s - begin) / (end - begin)))
            return MIN_FRACTION + (1 - MIN_FRACTION) * wave
        begin = end
    return MIN_FRACTION


def measured(scene: TunedScene, views: Iterable[View]) -> float:
    """Mean PSNR in dB of images of the scene."""
    return float(np.mean([psnr_db(scene.rendered(view.camera), view.image) for view in views]))


class Files:
    """Where a scene goes after so many seconds, and its networks beside it."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.saves_s: list[float] = options.save_at or [options.seconds]
        self._folder = options.out if options.save_at else None
        self._file: Path = options.out

    def scene(self, seconds: float) -> Path:
        return self._folder / f"{seconds:g}s.maqs" if self._folder else self._file


def tune(scene: SceneFile, networks: Networks, capture: Capture, options: argparse.Namespace) -> None:
    """Learns, saves and prints, as the head of this file says."""
    begin_s = time.monotonic()
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    model, files = TunedScene(scene, networks, device), Files(options)
    perceptual = load_perceptual(options.pretrained).to(device) if options.pretrained else None
    views = [capture.view(k, options.long_side) for k in capture.sources()]
    tuning = Tuning(model, views, Rates(), LossWeights(), perceptual)
    print(f"{len(model.mean)} points, {len(model.slope)} of which vary, {len(views)} photos")
    print(f"getting ready took {time.monotonic() - begin_s:.1f} s")

    def say(when: str) -> None:
        if capture.held_out and not options.unmeasured:
            found = measured(model, (capture.view(k, options.long_side) for k in sorted(capture.held_out)))
            print(f"{when}: {found:.2f} dB, mean PSNR of {len(capture.held_out)} held-out photos")

    say("before")
    spent_s, steps = 0.0, 0
    for due_s in files.saves_s:
        with tqdm(total=round(due_s), initial=round(spent_s), unit="s") as bar:
            while spent_s < due_s:
                begin_s = time.monotonic()
                loss = tuning.step(rate_fraction(spent_s, files.saves_s))
                spent_s, steps = spent_s + time.monotonic() - begin_s, steps + 1
                bar.set_postfix(step=steps, loss=f"{loss:.4f}", refresh=False)
                bar.update(min(round(spent_s), round(due_s)) - bar.n)
        begin_s = time.monotonic()
        tuned = scene.with_descriptors(*model.descriptors())
        write_scene_file(tuned, files.scene(due_s))
        print(f"{files.scene(due_s)}: {spent_s:.1f} s, {steps} steps; saved in {time.monotonic() - begin_s:.1f} s")
        say(f"after {due_s:g} s")


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("capture", type=Path, help="folder with transforms.json and the photos of the scene")
    parser.add_argument("--scene", type=Path, required=True, help="what maquette scene build made of it")
    parser.add_argument("--networks", type=Path, required=True, help="bundle that the scene was built with")
    parser.add_argument("--weights", type=Path, required=True, help="weights.pt that the bundle was exported from")
    parser.add_argument("--out", type=Path, required=True, help="the tuned scene; with --save-at a folder")
    parser.add_argument("--seconds", type=float, default=60, help="how long to learn")
    parser.add_argument("--save-at", type=float, nargs="+", metavar="SECONDS", help="save several times; no --seconds")
    parser.add_argument(
        "--pretrained", type=Path, help="compare images by these features too (export.teachers.backbone)"
    )
    parser.add_argument("--long-side", type=int, default=640, help="larger photos are made smaller, pixels")
    parser.add_argument("--unmeasured", action="store_true", help="do not measure on held-out photos")
    options = parser.parse_args()
    saves = options.save_at or [options.seconds]
    if not all(0 < a < math.inf for a in saves) or sorted(set(saves)) != saves:
        parser.error(f"seconds must be positive and rise, not {' '.join(f'{x:g}' for x in saves)}")
    if options.long_side < 32:
        parser.error(f"--long-side {options.long_side}: must be at least 32 pixels")
    return options


def main() -> None:
    options = parsed()
    torch.manual_seed(0)
    try:
        capture, scene = read_capture(options.capture), read_scene_file(options.scene)
        manifest = read_manifest(options.networks)
        if not capture.sources():
            raise CaptureError(f"All photos of {options.capture} are held out; there is none to learn from.")
        if identity(manifest) != scene.networks_sha256:
            raise SceneFileError(
                f"{options.scene} was built with other networks than {options.networks}; build it again."
            )
        view = capture.view(capture.sources()[0], options.long_side)
        networks = networks_of_bundle(options.weights, options.networks, view, scene.up)
        (options.out if options.save_at else options.out.parent).mkdir(parents=True, exist_ok=True)
    except (CaptureError, PointCloudError, SceneFileError, OSError, ValueError, KeyError) as error:
        raise SystemExit(str(error)) from None
    tune(scene, networks, capture, options)


if __name__ == "__main__":
    main()
