"""Renders whole labelled views of real CAD parts: connectors, relays, switches, housings. No network trains on them.

    python -m benchmarks.edges.cad_parts --out .data/solids/kicad

The STEP files come from Debian's kicad-packages3d (379 MB, fetched once). `cad_parts.txt` lists one part of each
category; the parts were chosen at random before the first measurement. The solids of a file are fused. A part is
enlarged to the size of a rendered solid (2 cm to 5 m), because the noise of depth cameras depends on distance. The
name of a part decides its views. Shards that exist are kept.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tarfile
from functools import partial
from pathlib import Path
from zlib import crc32

import numpy as np
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_SOLID
from OCP.TopoDS import TopoDS_Shape
from scipy.spatial.transform import Rotation
from tqdm import tqdm

from export.jobs import Workers
from export.photos.packages import PackageError, fetch, load_packages
from export.solids import shapes as s
from export.solids.crops import MAGNIFIED, whole_views
from export.solids.draw import spread
from export.solids.recipe import Made, placed, size_spanning
from export.solids.records import Record, write_shard
from export.solids.subprocess_guard import LostError, called

VERSION = "cad-parts-1"
FOLDER = Path(__file__).parent
PACKAGE = "kicad-packages3d"
_INSIDE = "./usr/share/kicad/3dmodels/"
PARTS_OF_SHARD = 10
VIEWS = 2
SPAN_PX = 120, 450  # size of a part in a view; parts have many small faces
CPU_S = 180  # limit for one part; most take some seconds
_STAGES = {"alone": 0.4, "ground": 0.4, "corner": 0.2}
_ATTEMPTS = 3


def part_names() -> list[str]:
    """Returns the paths of the chosen parts, below the package's folder of models."""
    return (FOLDER / "cad_parts.txt").read_text().split()


def unpacked(archive: Path, names: list[str], folder: Path) -> list[Path]:
    """Returns the paths of these members in `folder`, and unpacks missing ones. The unpacked archive of 5.5 GB is
    streamed and never stored. Raises PackageError."""
    paths = {_INSIDE + name: folder / name.replace("/", "-") for name in names}
    missing = {member for member, path in paths.items() if not path.exists()}
    if missing:
        folder.mkdir(parents=True, exist_ok=True)
        with subprocess.Popen(["dpkg-deb", "--fsys-tarfile", archive], stdout=subprocess.PIPE) as process:
            with tarfile.open(fileobj=process.stdout, mode="r|") as members:
                for member in members:
                    if member.name in missing:
                        partial_path = paths[member.name].with_suffix(".partial")
                        partial_path.write_bytes(members.extractfile(member).read())
                        partial_path.replace(paths[member.name])
                        missing.remove(member.name)
                        if not missing:
                            break
            process.kill()
    if missing:
        raise PackageError(f"{archive.name} has no {', '.join(sorted(missing))}.")
    return list(paths.values())


def read_step(path: Path) -> TopoDS_Shape:
    """Returns the fused solids of a STEP file in its own units (OpenCascade: millimetres). Raises ShapeError."""
    reader = STEPControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone:
        raise s.ShapeError(f"{path} is not a readable STEP file")
    reader.TransferRoots()
    solids = s.elements(reader.OneShape(), TopAbs_SOLID) if reader.NbShapes() else []
    if not solids:
        raise s.ShapeError(f"{path} has no solid")
    return s.checked(s.fused(solids))


def made_of(shape: TopoDS_Shape, name: str) -> Made:
    """Returns the part on a ground or in a corner, with cameras. Raises ShapeError."""
    for attempt in range(_ATTEMPTS):
        rng = np.random.default_rng([24, crc32(name.encode()), attempt])
        stage = str(rng.choice(list(_STAGES), p=list(_STAGES.values())))
        pixels = spread(rng, *SPAN_PX)
        part = s.scaled(shape, size_spanning(rng, pixels) / float(np.ptp(s.bounds(shape), axis=0).max()))
        if rng.random() < 0.5:
            turned = Rotation.random(random_state=int(rng.integers(2**31)))
            part = s.moved(part, turned.as_matrix())
        try:
            return placed(rng, name.split(".3dshapes")[0], part, stage, pixels, VIEWS, MAGNIFIED)
        except s.ShapeError as error:
            last = error
    raise s.ShapeError(f"{_ATTEMPTS} attempts: {last}")


def views_of(path: Path, name: str, number: int) -> list[Record]:
    return whole_views(f"kicad/{number:06d}", made_of(read_step(path), name))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(".data/solids/kicad"))
    parser.add_argument("--step", type=Path, default=Path(".data/kicad"), help="where STEP files are unpacked")
    parser.add_argument("--count", type=int, help="only the first parts of the list")
    Workers.add_arguments(parser)
    options = parser.parse_args()
    names = part_names()[: options.count]
    try:
        paths = unpacked(fetch(load_packages(FOLDER / "packages.toml")[PACKAGE]), names, options.step)
    except PackageError as error:
        print(error, file=sys.stderr)
        return 1
    options.out.mkdir(parents=True, exist_ok=True)
    jobs = [(path, name, k) for k, (path, name) in enumerate(zip(paths, names, strict=True))]
    with tqdm(total=len(jobs), unit="part") as bar:
        for first in range(0, len(jobs), PARTS_OF_SHARD):
            target = options.out / f"solids-{first // PARTS_OF_SHARD:05d}.npz"
            own = jobs[first : first + PARTS_OF_SHARD]
            if target.exists():
                bar.update(len(own))
            else:
                _write(target, own, Workers.of(options), bar)
    print(f"{options.out}: {VIEWS} views of each part in two sizes")
    return 0


def _write(target: Path, jobs: list[tuple[Path, str, int]], workers: Workers, bar: tqdm) -> None:
    """Writes one shard when all its parts are done. A part that fails is named and left out."""
    found: dict[int, list[Record]] = {}
    for done in workers.run(_views_or_error, jobs):
        records, error = done.value if done.error is None else ([], str(done.error))
        if error:
            tqdm.write(f"{done.job[0].name} is left out: {error}")
        found[done.job[2]] = records
        bar.update()
    left_out = [k for k in sorted(found) if not found[k]]
    meta = {"generator": VERSION, "split": "kicad", "left_out": left_out}
    write_shard(target, [record for k in sorted(found) for record in found[k]], meta)


def _views_or_error(job: tuple[Path, str, int]) -> tuple[list[Record], str]:
    try:
        return called(partial(views_of, *job), cpu_s=CPU_S), ""
    except (s.ShapeError, LostError) as error:
        return [], str(error)


if __name__ == "__main__":
    sys.exit(main())
