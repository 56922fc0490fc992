"""Products, and their running processes: one each, without a network."""

from __future__ import annotations

import contextlib
import functools
import json
import os
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import maquette
import numpy as np

from benchmarks.products.install import MEDIAPIPE, MediaPipe
from benchmarks.products.protocol import ProductError, receive, send
from export.evaluation.backends import Prediction

ROOT = Path(__file__).parents[2]
BUNDLE = ROOT / "sdk/models/densepose-b-int8"
NO_MASKS = ", no masks"  # ends the name of a product that computes none
LOW_THRESHOLD = 0.2  # of MediaPipe's detector, whose default is 0.5
_DOCUMENTS = (".md", ".tsv")  # of a bundle: not read by the library
_CUT_OFF = ("unshare", "--map-root-user", "--net")


@dataclass(frozen=True)
class Product:
    """name: as in the table. adapter: "module:Class" (`worker.Adapter`). version: name and version of the package.
    python: of its environment. networks, library: files and folders whose size counts. has_people: it finds single
    people, with joints. has_masks. has_threads: its setting `threads` is the number of cores."""

    name: str
    adapter: str
    settings: dict[str, object]
    version: str = ""
    python: Path = Path(sys.executable)
    networks: tuple[Path, ...] = ()
    library: tuple[Path, ...] = ()
    is_ours: bool = False
    has_people: bool = True
    has_masks: bool = True
    has_threads: bool = False

    def on(self, cores: int) -> Product:
        return replace(self, settings={**self.settings, "threads": cores}) if self.has_threads else self


def ours(bundle: Path = BUNDLE) -> list[Product]:
    """The two presets of the SDK."""
    library = maquette.library_path().resolve()
    runtime = sorted((library.parent / "maquette").glob("libonnxruntime*"))
    networks = tuple(sorted(path for path in bundle.iterdir() if path.suffix not in _DOCUMENTS))
    files = (library, *runtime, ROOT / "python/maquette")
    adapter = "benchmarks.products.maquette_product:MaquetteProduct"
    return [
        Product(f"Maquette {preset}", adapter, {"preset": preset, "bundle": str(bundle)},
                f"Maquette {maquette.__version__}", networks=networks,
                library=files, is_ours=True, has_threads=True)
        for preset in ("stream", "photo")
    ]  # fmt: skip


def of_mediapipe(installed: MediaPipe) -> list[Product]:
    """The pose landmarker of three sizes, with masks and without; the heavy one with a lower threshold of the detector,
    which finds more people; and the selfie segmenter."""

    version = f"MediaPipe {MEDIAPIPE}"

    def landmarker(name: str, size: str, has_masks: bool = True, **settings: object) -> Product:
        task = installed.tasks[size]
        return Product(
            f"MediaPipe {name}", "benchmarks.products.mediapipe_product:PoseLandmarker",
            {"task": str(task), "masks": has_masks, **settings}, version, installed.python, (task,),
            (installed.package,), has_masks=has_masks,
        )  # fmt: skip

    products = [landmarker(size, size) for size in installed.tasks]
    products.append(landmarker(f"heavy, detector {LOW_THRESHOLD}", "heavy", min_detection=LOW_THRESHOLD))
    products += [landmarker(f"{size}{NO_MASKS}", size, has_masks=False) for size in installed.tasks]
    segmenter = Product(
        "MediaPipe selfie", "benchmarks.products.mediapipe_product:SelfieSegmenter",
        {"network": str(installed.segmenter)}, version, installed.python, (installed.segmenter,), (installed.package,),
        has_people=False,
    )  # fmt: skip
    return [*products, segmenter]


def size_mb(paths: tuple[Path, ...]) -> float:
    """Megabytes of files, and of all files in folders but compiled Python."""
    every = [file for path in paths for file in ([path] if path.is_file() else path.rglob("*"))]
    return sum(file.stat().st_size for file in every if file.is_file() and "__pycache__" not in file.parts) / 1e6


@functools.cache
def cut_off() -> tuple[str, ...]:
    """The command that runs another one without a network; nothing where the system does not allow it."""
    try:
        subprocess.run([*_CUT_OFF, "true"], check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        print("The products run with a network: this system does not allow `unshare --net`.", file=sys.stderr)
        return ()
    return _CUT_OFF


@dataclass
class Running:
    """A process of a product, bound to the first `cores` processor cores. Raises ProductError whenever it fails. log:
    the file that gets its messages."""

    product: Product
    cores: int
    log: Path

    def __post_init__(self) -> None:
        product = self.product.on(self.cores)
        given = {"adapter": product.adapter, "settings": product.settings}
        command = [str(product.python), "-m", "benchmarks.products.worker", json.dumps(given)]
        inherited = os.environ.get("PYTHONPATH")
        path = os.pathsep.join([str(ROOT), str(ROOT / "python"), *([inherited] if inherited else [])])
        self.log.parent.mkdir(parents=True, exist_ok=True)
        with self.log.open("ab") as log:
            self._process = subprocess.Popen(
                [*cut_off(), *command], cwd=ROOT, env={**os.environ, "PYTHONPATH": path}, stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, stderr=log, preexec_fn=lambda: _bind(self.cores),
            )  # fmt: skip
        self._received()

    def ask(self, do: str, arrays: dict[str, np.ndarray] | None = None, **message: object) -> dict:
        return self._asked(do, arrays, message)[0]

    def photo(self, image: np.ndarray) -> Prediction:
        """image: uint8 [H, W, 3] RGB."""
        return _prediction(self._asked("photo", {"image": image}, {})[1])

    def frame(self, image: np.ndarray, sequence: int, time_ns: int) -> tuple[Prediction, np.ndarray]:
        """The people of a frame of a stream, and their ids [n]."""
        arrays = self._asked("frame", {"image": image}, {"sequence": sequence, "time_ns": time_ns})[1]
        return _prediction(arrays), arrays["id"]

    def _asked(self, do: str, arrays: dict | None, message: dict) -> tuple[dict, dict[str, np.ndarray]]:
        with contextlib.suppress(BrokenPipeError):  # the process has ended, which the next line says
            send(self._process.stdin, {"do": do, **message}, **arrays or {})
        return self._received()

    def _received(self) -> tuple[dict, dict[str, np.ndarray]]:
        answer = receive(self._process.stdout)
        if answer is None:
            raise ProductError(f"{self.product.name} ended with status {self._process.wait()}; see {self.log}")
        if "error" in answer[0]:
            raise ProductError(f"{self.product.name}: {answer[0]['error']}")
        return answer

    def close(self) -> None:
        self._process.stdin.close()
        self._process.wait(timeout=30)
        self._process.stdout.close()

    def __enter__(self) -> Running:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _bind(cores: int) -> None:
    """Binds this process, and all that it starts, to its first cores."""
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:cores])


def _prediction(arrays: dict[str, np.ndarray]) -> Prediction:
    """Products show people, but not all of them parts: each person is one part, which no metric here reads."""
    shown = (arrays["inds"] > 0).astype(np.uint8)
    iuv = np.stack([shown, 0 * shown, 0 * shown], -1)
    return Prediction(arrays["box"], arrays["score"], iuv, arrays["inds"], arrays["keypoint"])
