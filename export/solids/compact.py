"""Crops of solids in a ninth of the bytes of their shards, to train on a machine that cannot render them.

    python -m export.solids.compact .data/solids/train --out crops.xz --max-mib 15

Depth is kept within 0.01 r: of each smooth patch a plane of inverse depth, which is exact where the patch is flat, or a
cubic, and how far each pixel is off it in whole steps. Distances are kept within 1/32 r; kind, what is left out and
patches as they are, patches numbered anew. One xz file of arrays, as np.savez writes them.
"""

from __future__ import annotations

import argparse
import io
import lzma
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from export.solids.records import LIMIT_R, NO_PATCH, Record, RecordError, read_records

VERSION = 1
STEP_R = 0.02  # of depth, where it is farthest
LEVELS = 255  # of distance, 0..LIMIT_R
FLAT = 3  # coefficients of a plane; those of a cubic are all
_FILTERS = [{"id": lzma.FILTER_LZMA2, "preset": 7, "lc": 0, "lp": 0, "pb": 0}]


@dataclass(frozen=True, eq=False)
class CompactCrop:
    """A crop as `Record` gives it: the same planes, with the errors that the head of this file says."""

    name: str
    height: int
    width: int
    intrinsics: tuple[float, float, float, float]
    planes: dict[str, np.ndarray]

    def decoded(self) -> dict[str, np.ndarray]:
        """As `Record.decoded`."""
        return self.planes


def _powers(height: int, width: int) -> np.ndarray:
    """float64 [H W, 10]: 1, x, y and the other powers of a cubic, of pixels within -1..1."""
    y, x = (np.linspace(-1, 1, side) for side in (height, width))
    orders = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)]
    return np.stack([np.outer(y**j, x**i).ravel() for i, j in orders], 1)


def _differences(plane: np.ndarray) -> np.ndarray:
    """Residual of each number against the prediction from its left, upper and upper left neighbours, mapped to
    natural numbers."""
    off = np.diff(np.diff(plane, axis=-2, prepend=0), axis=-1, prepend=0)
    return (off << 1) ^ (off >> 63)


def _undone(off: np.ndarray) -> np.ndarray:
    off = off.astype(np.int64)
    return ((off >> 1) ^ -(off & 1)).cumsum(-2).cumsum(-1)


def _fitted(powers: np.ndarray, value: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients, float32 [3] where a plane is within half a step everywhere, else [10]; steps that each is off."""
    for count in (FLAT, powers.shape[1]):
        own = powers[:, :count]
        found = np.linalg.lstsq(own, value, rcond=None)[0].astype(np.float32)
        off = np.rint((value - own @ found.astype(np.float64)) / step).astype(np.int64)
        if not off.any():
            break
    return found, off


def _packed(record: Record) -> dict[str, np.ndarray]:
    planes = record.decoded()
    depth = planes["depth"].astype(np.float64)
    known, shape = depth > 0, depth.shape
    patches, patch = np.unique(np.where(known, planes["patch"], NO_PATCH), return_inverse=True)
    patch = patch.reshape(shape)
    if len(patches) > 256:
        raise RecordError(f"{record.name} has {len(patches)} patches; 256 can be kept")
    step = STEP_R / (record.intrinsics[0] * depth.max()) if known.any() else 1.0
    powers, off, fits = _powers(*shape), np.zeros(shape, np.int64), []
    for number in range(len(patches)):
        own = (patch == number) & known
        if not own.any():
            fits.append(np.zeros(0, np.float32))
            continue
        fit, off[own] = _fitted(powers[own.ravel()], 1 / depth[own], step)
        fits.append(fit)
    steps = _differences(off)
    distance = np.rint(planes["distance"].astype(np.float32) * (LEVELS / LIMIT_R)).astype(np.int64)
    kind = planes["kind"].astype(np.int64) | planes["ignore"].astype(np.int64) << 2 | known.astype(np.int64) << 3
    return {
        "steps": np.stack([steps >> shift & 255 for shift in (0, 8, 16, 24)]).astype(np.uint8),
        # Differences wrap around at eight bits, and so do the sums that undo them.
        "distance": np.diff(np.diff(distance, axis=0, prepend=0), axis=1, prepend=0).astype(np.uint8),
        "kind": np.diff(kind, axis=1, prepend=0).astype(np.uint8),
        "patch": np.diff(patch, axis=0, prepend=0).astype(np.uint8),
        "fit": np.concatenate(fits),
        "fit_size": np.array([len(fit) for fit in fits], np.uint8),
        "step": np.array(step),
    }


def _unpacked(part: dict[str, np.ndarray], powers: np.ndarray) -> dict[str, np.ndarray]:
    shape = part["patch"].shape
    off = _undone(sum(part["steps"][k].astype(np.int64) << 8 * k for k in range(4)))
    kind = part["kind"].cumsum(1, dtype=np.uint8)
    patch = part["patch"].cumsum(0, dtype=np.uint8)
    known = kind >> 3 > 0
    inverse = off.ravel() * float(part["step"])
    ends = np.cumsum(part["fit_size"], dtype=int)
    for number, fit in enumerate(np.split(part["fit"], ends[:-1])):
        if len(fit):
            own = (patch.ravel() == number) & known.ravel()
            inverse[own] += powers[own, : len(fit)] @ fit.astype(np.float64)
    depth = np.where(known, 1 / np.where(known, inverse.reshape(shape), 1), 0)
    distance = part["distance"].cumsum(0, dtype=np.uint8).cumsum(1, dtype=np.uint8)
    return {
        "depth": depth.astype(np.float32),
        "distance": (distance.astype(np.float32) * (LIMIT_R / LEVELS)).astype(np.float16),
        "kind": kind & 3,
        "ignore": kind >> 2 & 1 > 0,
        "patch": np.where(known, patch.astype(np.uint16), np.uint16(NO_PATCH)),
    }


def write_compact(path: Path, records: Sequence[Record]) -> None:
    """Atomically. Crops have one size. Raises RecordError for others, and for none."""
    if len({(r.height, r.width) for r in records}) != 1:
        raise RecordError(f"{len(records)} crops of different sizes, or none, make no file of compact crops.")
    parts = [_packed(record) for record in records]
    arrays = {
        name: np.concatenate([p[name] for p in parts]) if name.startswith("fit") else np.stack([p[name] for p in parts])
        for name in parts[0]
    }
    arrays["steps"] = arrays["steps"].swapaxes(0, 1)  # low bytes of all crops, then the next
    arrays["patches"] = np.array([len(p["fit_size"]) for p in parts], np.int32)
    arrays["intrinsics"] = np.array([r.intrinsics for r in records])
    arrays["name"] = np.array([r.name for r in records], dtype=np.str_)
    buffer = io.BytesIO()
    np.savez(buffer, version=VERSION, **arrays)
    temporary = path.with_suffix(".partial")
    temporary.write_bytes(lzma.compress(buffer.getvalue(), filters=_FILTERS))
    temporary.replace(path)


def read_compact(path: Path) -> Iterator[CompactCrop]:
    """All crops in order. Raises RecordError, FileNotFoundError."""
    try:
        with np.load(io.BytesIO(lzma.decompress(path.read_bytes()))) as file:
            arrays = {name: file[name] for name in file.files}
        version = int(arrays.pop("version"))
    except (lzma.LZMAError, EOFError, ValueError, KeyError) as error:
        raise RecordError(f"{path} cannot be read ({error}); make it again: export.solids.compact") from error
    if version != VERSION:
        raise RecordError(f"{path} is of version {version}, this program reads {VERSION}; make it again")
    _, height, width = arrays["patch"].shape
    powers = _powers(height, width)
    sizes = np.split(arrays["fit_size"], np.cumsum(arrays["patches"])[:-1])
    fits = np.split(arrays["fit"], np.cumsum([size.sum(dtype=int) for size in sizes])[:-1])
    for k, (fit, size) in enumerate(zip(fits, sizes, strict=True)):
        own = {name: arrays[name][k] for name in ("distance", "kind", "patch", "step")}
        own |= {"steps": arrays["steps"][:, k], "fit": fit, "fit_size": size}
        crop = CompactCrop(str(arrays["name"][k]), height, width, tuple(map(float, arrays["intrinsics"][k])), {})
        yield replace(crop, planes=_unpacked(own, powers))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("shards", type=Path, help="folder of export.solids.dataset")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--max-mib", type=float, default=15, help="a larger file is an error (default %(default)s)")
    options = parser.parse_args()
    try:
        records = list(read_records(options.shards))
        write_compact(options.out, records)
    except RecordError as error:
        raise SystemExit(str(error)) from None
    size = options.out.stat().st_size
    print(f"{len(records)} crops, {size / 2**20:.2f} MiB, {size / len(records):.0f} bytes a crop")
    if size > options.max_mib * 2**20:
        parser.error(f"{options.out} has {size / 2**20:.1f} MiB, more than {options.max_mib:g}: pack fewer crops")


if __name__ == "__main__":
    main()
