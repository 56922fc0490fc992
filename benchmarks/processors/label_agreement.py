"""Compares the labels that `maquette densepose` gives on this processor with those on others, which qemu emulates.

The same bundle and the same images, with the preset for streams, on x86-64 with AVX2 but without VNNI (whose 8-bit
products saturate), and on aarch64 without and with the dot product and matrix instructions. Needs both builds and
Debian's qemu-user; `make test-isa` makes them and runs this.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.processors.emulated import ROOT, Processor, add_arguments, compared, run_maquette, write_junit
from export.evaluation.average_precision import box_iou

CLIP = ROOT / "tests/media/clip.mp4"
CLIP_FRAMES = (10, 50)
SOURCES = (str(ROOT / "tests/media/photo.jpg"), "stub:people?count=3&seed=7&size=480x270")
STUB_FRAMES = 2
BAR = 0.995
SAME_PERSON_IOU = 0.5

EPILOG = """\
examples:
  python -m benchmarks.processors.label_agreement                                five bundled images, all processors
  python -m benchmarks.processors.label_agreement --only avx2 my-photo.jpg       one processor, an image of one's own
  python -m benchmarks.processors.label_agreement --bundle .data/bundles/other   another bundle
"""


@dataclass
class Agreement:
    """Agreement of the labels of two folders of results, over all images."""

    pictures: int = 0
    people: int = 0  # people of the reference
    unmatched: int = 0  # people of either without a box of the other that overlaps by SAME_PERSON_IOU
    pixels: int = 0
    equal: int = 0
    person_pixels: int = 0  # pixels labelled in either
    person_equal: int = 0
    worst_image: float = 1.0  # the smallest fraction of equal pixels
    box_px: float = 0.0  # largest difference of a coordinate of a matched box, image pixels

    @property
    def fraction(self) -> float:
        """Returns the fraction of pixels with the same part, background included."""
        return self.equal / self.pixels

    @property
    def person_fraction(self) -> float:
        """Returns the same fraction among pixels that are a person in either; 1 if there are none."""
        return self.person_equal / self.person_pixels if self.person_pixels else 1.0

    def passes(self, bar: float) -> bool:
        """Returns whether enough pixels are the same and each person has a match. The worst image is reported without a
        threshold: one rounding step, from float sums in another order, changes an image of small people."""
        return self.fraction >= bar and self.unmatched == 0


def read_parts(path: Path) -> np.ndarray:
    """Reads the part of each pixel, uint8 [H, W], of an `_IUV.png`. Raises ValueError if it cannot be read."""
    image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if image is None:
        raise ValueError(f"{path} cannot be read; run maquette densepose again.")
    return image[..., 0]


def read_boxes(path: Path) -> np.ndarray:
    """Reads the boxes of the people, float64 [N, 4], of a JSON result."""
    people = json.loads(path.read_text())["people"]
    return np.array([person["box"] for person in people], np.float64).reshape(-1, 4)


def compare(reference: Path, other: Path) -> Agreement:
    """Compares two folders of results of the same images.

    Raises ValueError when they are not of the same images, or when the reference shows no people: then there is
    nothing to compare.
    """
    agreement = Agreement()
    names = sorted(path.name for path in reference.glob("*_IUV.png"))
    others = sorted(path.name for path in other.glob("*_IUV.png"))
    if names != others:
        raise ValueError(f"{reference} has results of {len(names)} images, but {other} of {len(others)} or others.")
    for name in names:
        ours, theirs = read_parts(reference / name), read_parts(other / name)
        if ours.shape != theirs.shape:
            raise ValueError(f"{name} is {ours.shape} in {reference}, but {theirs.shape} in {other}.")
        same, person = ours == theirs, (ours > 0) | (theirs > 0)
        agreement.pictures += 1
        agreement.pixels += same.size
        agreement.equal += int(same.sum())
        agreement.person_pixels += int(person.sum())
        agreement.person_equal += int((same & person).sum())
        agreement.worst_image = min(agreement.worst_image, float(same.mean()))
        stem = name.removesuffix("_IUV.png")
        compare_boxes(read_boxes(reference / f"{stem}.json"), read_boxes(other / f"{stem}.json"), agreement)
    if agreement.people == 0:
        raise ValueError(f"{reference} shows no people, so there is nothing to compare. Take images of people.")
    return agreement


def compare_boxes(ours: np.ndarray, theirs: np.ndarray, agreement: Agreement) -> None:
    """Adds the people of one image, boxes [N, 4] and [M, 4], to `agreement`; the most similar boxes are the same
    person."""
    iou = box_iou(ours, theirs)
    matched = 0
    while iou.size and iou.max() >= SAME_PERSON_IOU:
        i, j = np.unravel_index(iou.argmax(), iou.shape)
        agreement.box_px = max(agreement.box_px, float(np.abs(ours[i] - theirs[j]).max()))
        iou[i], iou[:, j] = -1, -1
        matched += 1
    agreement.people += len(ours)
    agreement.unmatched += len(ours) + len(theirs) - 2 * matched


def clip_frames(clip: Path, numbers: Sequence[int], folder: Path) -> list[str]:
    """Writes frames of a clip as PNG, so that all processors see the same pixels, and returns their paths."""
    capture, paths = cv2.VideoCapture(str(clip)), []
    for k in range(max(numbers) + 1):
        ok, frame = capture.read()
        if not ok:
            raise ValueError(f"{clip} has {k} frames, but frame {max(numbers)} was asked for.")
        if k in numbers:
            paths.append(str(folder / f"{clip.stem}_{k:03d}.png"))
            cv2.imwrite(paths[-1], frame)
    return paths


def run(processor: Processor, bundle: Path, sources: Sequence[str], out: Path) -> None:
    """Writes the results of the images into `out`, which is emptied first. Raises ValueError with the failure."""
    shutil.rmtree(out, ignore_errors=True)
    # Without crops: their place depends on the first labels, so that a rounding moves a crop by a cell.
    settings = ["--preset", "stream", "--bundle", str(bundle), "--out", str(out), "--threads", "1",
                "--max-frames", str(STUB_FRAMES)]  # fmt: skip
    run_maquette(processor, ["densepose", *sources, *settings])


def print_table(bundle: Path, results: dict[str, Agreement | str], bar: float) -> None:
    title = f"Labels of {bundle.name} against those on this processor"
    table = Table(title=title, title_justify="left")
    table.add_column("processor", no_wrap=True)
    for column in ("people", "unmatched", "same %", "worst %", "on people %", "box px"):
        table.add_column(column, justify="right")
    table.add_column("bar", no_wrap=True)
    for name, found in results.items():
        if isinstance(found, str):
            table.add_row(name, *["-"] * 6, "failed")
            continue
        found_fractions = (found.fraction, found.worst_image, found.person_fraction)
        fractions = [f"{100 * x:.3f}" for x in found_fractions]
        verdict = "held" if found.passes(bar) else "missed"
        table.add_row(name, str(found.people), str(found.unmatched), *fractions, f"{found.box_px:.2f}", verdict)
    Console(width=110).print(table)
    print(
        f"same: pixels with the same part, of all (bar: {100 * bar:g} %); worst: of the worst image; on people: of "
        "those painted in either;\nbox: the largest difference of a coordinate."
    )


def failure_of(found: Agreement | str, bar: float) -> str | None:
    """Returns the failure as a sentence; None if there is none."""
    if isinstance(found, str):
        return found
    if found.passes(bar):
        return None
    return (
        f"The same label on {100 * found.fraction:.3f} % of the pixels, where {100 * bar:g} % are asked for; "
        f"{found.unmatched} people without a match."
    )


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.processors.label_agreement",
        description=__doc__,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "pictures", nargs="*", help="default: the bundled photo, frames of the bundled clip, stub:people"
    )
    parser.add_argument("--bundle", type=Path, default=ROOT / "sdk/models/densepose-b-int8")
    parser.add_argument(
        "--bar", type=float, default=BAR, help="min. fraction of equal pixels, of all images (default %(default)s)"
    )
    add_arguments(parser, ROOT / "build/label-agreement")
    options = parser.parse_args(argv)

    options.out.mkdir(parents=True, exist_ok=True)
    sources = options.pictures or [*SOURCES, *clip_frames(CLIP, CLIP_FRAMES, options.out)]
    try:
        results = compared(options, lambda processor, out: run(processor, options.bundle, sources, out), compare)
    except (ValueError, OSError, subprocess.CalledProcessError) as error:
        print(f"label_agreement: {error}", file=sys.stderr)
        return 1
    print_table(options.bundle, results, options.bar)
    failures = {title: failure_of(found, options.bar) for title, found in results.items()}
    if options.junit:
        write_junit(options.junit, "label_agreement", failures)
    return 1 if any(failures.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
