"""Everything that can find people in an image, behind one call, so that the same metrics are made for all.

A backend is written `kind` or `kind=path`:

    torch=CHECKPOINT   the networks as they were trained
    onnx=BUNDLE        the exported graphs, run by ONNX Runtime with the Python reference of decoding
    capi=BUNDLE        what an app gets: libmaquette through its C API

Fields of maq_densepose_config may follow capi, and what maq_densepose_set_roll is told, in degrees:
`capi?person_crops=1&long_side_px=384&roll_deg=30`.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from export.bundle import MANIFEST, read_manifest
from export.keypoints import COUNT

if TYPE_CHECKING:
    from maquette import DensePoseResult

DEFAULT_PATHS = {
    "torch": Path("export/weights/densepose-b.pt"),
    "onnx": Path(".data/bundles/densepose-b-fp32"),
    "capi": Path("sdk/models/densepose-b-int8"),
}


@dataclass(frozen=True)
class Prediction:
    """box: float32 [n, 4] x0, y0, x1, y1; score: float32 [n], best first. iuv: uint8 [H, W, 3] holding I,
    U*255, V*255, all people in one image, better scores in front. inds: uint8 [H, W], k for box k - 1, 0
    for nobody. keypoint: float32 [n, 33, 3] x, y and confidence (`export.keypoints`); None where the backend has none.
    """

    box: np.ndarray
    score: np.ndarray
    iuv: np.ndarray
    inds: np.ndarray
    keypoint: np.ndarray | None = None

    def above(self, threshold: float) -> Prediction:
        """The people with at least this score. As better scores are in front, this is what a run with the
        threshold would have given."""
        count = int((self.score >= threshold).sum())
        shown = self.inds <= count
        return Prediction(
            self.box[:count],
            self.score[:count],
            self.iuv * shown[..., None].astype(np.uint8),
            self.inds * shown.astype(np.uint8),
            None if self.keypoint is None else self.keypoint[:count],
        )


class Backend(Protocol):
    """kind, path: as asked for. precision: `fp32` or `int8`. threshold: score from which people are shown."""

    kind: str
    path: Path
    precision: str
    threshold: float

    def predict(self, image: np.ndarray) -> Prediction:
        """image: uint8 [H, W, 3] RGB."""


class TorchBackend:
    """The trained networks (their moving average) from a checkpoint of `export.densepose.train`."""

    kind, precision = "torch", "fp32"

    def __init__(self, path: Path, score_floor: float) -> None:
        import torch  # here, so that the C API is measured without torch

        from export.densepose.config import DecodeConfig, NetworkConfig
        from export.densepose.decode import Graphs
        from export.densepose.network import MobileParsingRCNN

        saved = torch.load(path, map_location="cpu", weights_only=True)
        self.path = path
        self.threshold = DecodeConfig().score_threshold
        self._network = NetworkConfig.of(saved)
        self._decode = DecodeConfig(score_threshold=score_floor)
        net = MobileParsingRCNN(self._network)
        net.load_state_dict(saved["ema"])
        self._graphs = Graphs.of_network(net.eval())

    def predict(self, image: np.ndarray) -> Prediction:
        from export.densepose.decode import infer

        result = infer(self._graphs, image, self._network, self._decode)
        return Prediction(result.boxes, result.scores, result.iuv, result.instance, result.keypoint)


class OnnxBackend:
    """The graphs of a bundle, run by ONNX Runtime, with the decoding of `export.densepose.decode`."""

    kind = "onnx"

    def __init__(self, path: Path, score_floor: float) -> None:
        from export.densepose import decode
        from export.densepose.graphs import open_bundle

        self._bundle = bundle = open_bundle(path)
        given = bundle.manifest["input"]
        if not np.allclose([given["mean"], given["std"]], [decode.MEAN, decode.STD]):
            raise ValueError(f"{path} normalises by {given['mean']}, {given['std']}: not as export.densepose does")
        self.path = path
        self.precision = bundle.manifest["precision"]
        self.threshold = bundle.decode.score_threshold
        self._decode = replace(bundle.decode, score_threshold=score_floor)

    def predict(self, image: np.ndarray) -> Prediction:
        from export.densepose.decode import infer

        result = infer(self._bundle.graphs, image, self._bundle.network, self._decode)
        return Prediction(result.boxes, result.scores, result.iuv, result.instance, result.keypoint)


class CApiBackend:
    """libmaquette with a bundle."""

    kind = "capi"

    def __init__(self, path: Path, score_floor: float, **settings: int) -> None:
        from maquette import DensePose

        manifest = read_manifest(path)
        self.path = path
        self.precision = manifest["precision"]
        self.threshold = manifest["box_head"]["score_threshold"]
        if settings:  # tables name columns by the kind
            self.kind = "capi?" + "&".join(f"{name}={value}" for name, value in settings.items())
        roll_deg = settings.pop("roll_deg", 0)
        self._has_keypoints = bool(settings.get("has_keypoints", 0))
        self._densepose = DensePose(path, score_threshold=score_floor, **settings)
        if roll_deg:
            self._densepose.set_roll(np.radians(roll_deg))

    def predict(self, image: np.ndarray) -> Prediction:
        return prediction_of(self._densepose.run(image), self._has_keypoints)


def prediction_of(result: DensePoseResult, has_keypoints: bool = False) -> Prediction:
    """The result of libmaquette in the form that all backends share. has_keypoints: the result has them."""
    box = np.array([person.box_px for person in result.people], np.float32).reshape(-1, 4)
    score = np.array([person.score for person in result.people], np.float32)
    keypoint = None
    if has_keypoints:
        keypoint = np.array([person.keypoints for person in result.people], np.float32).reshape(-1, COUNT, 3)
    return Prediction(box, score, np.stack([result.part, result.u, result.v], -1), result.person, keypoint)


def open_backend(text: str, score_floor: float) -> Backend:
    """text: `kind` or `kind=path`, for capi with settings. score_floor: people with lower scores are not asked for."""
    os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")
    named, _, settings = text.partition("?")
    kind, _, path = named.partition("=")
    kinds = {"torch": TorchBackend, "onnx": OnnxBackend, "capi": CApiBackend}
    if kind not in kinds:
        raise ValueError(f"unknown backend {kind!r}: write torch, onnx or capi, or e.g. capi={DEFAULT_PATHS['capi']}")
    chosen = Path(path) if path else DEFAULT_PATHS[kind]
    if not chosen.exists():
        raise FileNotFoundError(f"{kind}: {chosen} is not there. Name another with {kind}=PATH.")
    if settings and kind != "capi":
        raise ValueError(f"{text}: only capi takes settings")
    fields = {}
    for setting in settings.split("&") if settings else ():
        name, _, value = setting.partition("=")
        if not value.lstrip("-").isdigit():
            raise ValueError(f"{kind} takes maq_densepose_config's fields as name=number, not {setting!r}")
        fields[name] = int(value)
    return kinds[kind](chosen, score_floor, **fields)


def fingerprint(path: Path) -> str:
    """First 12 digits of the SHA-256 of a file, or of a bundle's manifest (which holds the others')."""
    file = path / MANIFEST if path.is_dir() else path
    with open(file, "rb") as data:
        return hashlib.file_digest(data, "sha256").hexdigest()[:12]
