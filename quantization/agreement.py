"""Do the int8 networks say the same as the fp32 ones? Labels of both, pixel by pixel, through the C API.

The gate is label agreement: of the pixels of people in the fp32 result, the share that has the same part in the
int8 result. Both bundles run on the same images at the bundle's own threshold, as in an app.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from maquette import MaquetteError
from rich.console import Console
from rich.table import Table
from tqdm import tqdm

from export.bundle import MANIFEST, read_manifest, signed
from export.evaluation.backends import DEFAULT_PATHS, Backend, Prediction, open_backend
from export.evaluation.json_values import plain
from export.evaluation.sheet import pictures
from export.evaluation.surface_accuracy import fraction
from export.shards import count_images, read_images, shard_paths

GATE, STRETCH = 0.98, 0.99
FLOAT_BUNDLE, INT8_BUNDLE = DEFAULT_PATHS["onnx"], DEFAULT_PATHS["capi"]

EPILOG = """\
examples:
  python -m quantization.agreement
  python -m quantization.agreement --images .data/photos/val --int8 build/quantized
  python -m quantization.agreement --images tests/media/clip.mp4 --backend onnx
  python -m quantization.agreement --in-float trunk       what would be left if the trunk were not int8?

label agreement   of the pixels of people in fp32, the fraction with the same part in int8 (gate: 98 %)
where both paint  the same over the pixels of people in both: parts alone, without outlines
mask IoU          pixels of people, fp32 against int8
|dU|, |dV|        mean difference, 0..1, where the part is the same
The exit status is 1 when label agreement is below the gate.
"""


@dataclass(frozen=True)
class Agreement:
    """Fractions are 0..1, NaN where there was no person. images: how many; people: found by (fp32, int8); pixels:
    people's in fp32; labels: of these, the fraction with the same part in int8; parts: the same over pixels of people
    in both; mask_iou: of people's pixels; same_count: fraction of images with as many people; du, dv: mean difference
    where the part is the same."""

    images: int
    people: tuple[int, int]
    pixels: int
    labels: float
    parts: float
    mask_iou: float
    same_count: float
    du: float
    dv: float

    @property
    def passed(self) -> bool:
        """Whether label agreement reaches the gate. No people at all is no pass."""
        return self.labels >= GATE


class Tally:
    """Sums over pairs of results of the same image."""

    def __init__(self) -> None:
        self._images = self._same_count = self._pixels = self._both = self._same = self._either = 0
        self._people, self._difference = np.zeros(2, np.int64), np.zeros(2)

    def add(self, expected: Prediction, actual: Prediction) -> None:
        """expected: of the fp32 bundle; actual: of the int8 bundle."""
        first, second = expected.iuv[..., 0], actual.iuv[..., 0]
        same = (first > 0) & (first == second)
        self._images += 1
        self._people += len(expected.score), len(actual.score)
        self._same_count += len(expected.score) == len(actual.score)
        self._pixels += int((first > 0).sum())
        self._both += int(((first > 0) & (second > 0)).sum())
        self._either += int(((first > 0) | (second > 0)).sum())
        self._same += int(same.sum())
        gap = np.abs(expected.iuv[same][:, 1:].astype(np.int64) - actual.iuv[same][:, 1:])
        self._difference += gap.sum(0) / 255

    def metrics(self) -> Agreement:
        du, dv = (fraction(value, self._same) for value in self._difference)
        return Agreement(
            images=self._images,
            people=(int(self._people[0]), int(self._people[1])),
            pixels=self._pixels,
            labels=fraction(self._same, self._pixels),
            parts=fraction(self._same, self._both),
            mask_iou=fraction(self._both, self._either),
            same_count=fraction(self._same_count, self._images),
            du=du,
            dv=dv,
        )


def predictions(backend: Backend, images: Iterable[np.ndarray], desc: str = "") -> Iterator[Prediction]:
    """The people shown in each image at the bundle's own threshold. images: uint8 [H, W, 3] RGB."""
    for image in tqdm(images, desc=desc or str(backend.path), unit="image", leave=False, disable=None):
        yield backend.predict(image).above(backend.threshold)


def open_bundle(folder: Path, kind: str = "capi") -> Backend:
    """A backend of export.evaluation that shows what the bundle's own threshold shows."""
    backend = open_backend(f"{kind}={folder}", score_floor=0.05)
    return open_backend(f"{kind}={folder}", score_floor=backend.threshold)


def compare(expected: Iterable[Prediction], actual: Iterable[Prediction]) -> Agreement:
    """Results of two bundles on the same images in the same order."""
    tally = Tally()
    for first, second in zip(expected, actual, strict=True):
        tally.add(first, second)
    return tally.metrics()


def agreement(float_bundle: Path, int8_bundle: Path, images: list[np.ndarray], kind: str = "capi") -> Agreement:
    """How far the labels of two bundles agree on images uint8 [H, W, 3] RGB, through the C API (`kind`: or "onnx").

    Raises MaquetteError where libmaquette is not built, FileNotFoundError where a bundle is missing.
    """
    first, second = (open_bundle(folder, kind) for folder in (float_bundle, int8_bundle))
    return compare(predictions(first, images), predictions(second, images))


def mixed(float_bundle: Path, int8_bundle: Path, in_float: list[str], folder: Path) -> Path:
    """A copy of the int8 bundle in `folder` whose graphs `in_float` are the fp32 ones. Raises ValueError for a graph
    that neither has."""
    shutil.copytree(int8_bundle, folder, dirs_exist_ok=True)
    manifest = read_manifest(folder)
    for name in in_float:
        if name not in manifest["graphs"]:
            raise ValueError(f"{name} is not one of the graphs {', '.join(manifest['graphs'])}")
        file = manifest["graphs"][name]["file"]
        shutil.copyfile(float_bundle / file, folder / file)
        manifest["files"][file] = signed(folder / file)
    (folder / MANIFEST).write_text(json.dumps(manifest))
    return folder


def load_images(source: Path, limit: int | None = None) -> list[np.ndarray]:
    """RGB images uint8 [H, W, 3] of a folder of shards (`limit` of them, evenly spread), a photo, a folder of photos or
    a clip. Raises ShardError or FileNotFoundError for anything else."""
    if source.is_dir() and any(source.glob("shard-*.npz")):
        paths = shard_paths(source)
        count = count_images(paths)
        chosen = np.linspace(0, count - 1, min(count, limit or count)).round().astype(int)
        wanted = set(chosen.tolist())
        return [item.image for k, item in enumerate(read_images(paths)) if k in wanted]
    if not source.exists():
        raise FileNotFoundError(f"{source} is not there. Name shards, a photo, a folder of photos or a clip.")
    return [image for _, image in pictures(source, limit or 10**9, limit or 24)]


def print_metrics(metrics: Agreement, title: str, console: Console | None = None) -> None:
    table = Table(title=title, title_justify="left", show_header=False)
    for name, value in (
        ("label agreement", f"{100 * metrics.labels:.2f} %"),
        ("where both paint", f"{100 * metrics.parts:.2f} %"),
        ("mask IoU", f"{100 * metrics.mask_iou:.2f} %"),
        ("people, fp32 / int8", f"{metrics.people[0]} / {metrics.people[1]}"),
        ("images with as many people", f"{100 * metrics.same_count:.1f} % of {metrics.images}"),
        ("mean |dU|, |dV|", f"{metrics.du:.4f}, {metrics.dv:.4f}"),
    ):
        table.add_row(name, value)
    (console or Console()).print(table)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m quantization.agreement", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--float", dest="reference", type=Path, default=FLOAT_BUNDLE, metavar="DIR", help="fp32 bundle")
    parser.add_argument("--int8", type=Path, default=INT8_BUNDLE, metavar="DIR", help="int8 bundle")
    parser.add_argument(
        "--images", type=Path, default=Path(".data/people/val"), metavar="PATH",
        help="shards, a photo, a folder of photos or a clip (default: .data/people/val)",
    )  # fmt: skip
    parser.add_argument("--in-float", nargs="+", default=[], metavar="GRAPH", help="of the int8 bundle, not int8")
    parser.add_argument("--limit", type=int, metavar="N", help="at most so many images")
    parser.add_argument("--backend", choices=("capi", "onnx"), default="capi", help="default: capi")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the metrics there")
    arguments = parser.parse_args(argv)
    try:
        images = load_images(arguments.images, arguments.limit)
        with tempfile.TemporaryDirectory() as folder:
            int8 = mixed(arguments.reference, arguments.int8, arguments.in_float, Path(folder) / arguments.int8.name)
            metrics = agreement(arguments.reference, int8, images, arguments.backend)
    except (MaquetteError, FileNotFoundError, ValueError) as error:
        print(f"Nothing was compared: {error}", file=sys.stderr)
        return 1
    name = " with float ".join([str(arguments.int8), *filter(None, [", ".join(arguments.in_float)])])
    print_metrics(metrics, f"{name} against {arguments.reference}, {arguments.images}")
    if arguments.json:
        arguments.json.parent.mkdir(parents=True, exist_ok=True)
        document = {"schema": "maquette-agreement-1", "gate": GATE, "stretch": STRETCH, "images": str(arguments.images)}
        arguments.json.write_text(json.dumps(document | {"metrics": plain(asdict(metrics))}, indent=1) + "\n")
    verdict = "reaches" if metrics.passed else "misses"
    print(f"Label agreement {100 * metrics.labels:.2f} % {verdict} the gate of {100 * GATE:.0f} %.")
    return 0 if metrics.passed else 1


if __name__ == "__main__":
    sys.exit(main())
