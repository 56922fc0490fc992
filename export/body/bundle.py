"""The bundle for bodies (docs/reference/formats.md): the body and its manifest. It has no network.

    python -m export.body.bundle --surface sdk/models/densepose-b-int8 --out sdk/models/body

--surface: the bundle of dense pose whose labels the body's surface has.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from export import data_sources as sources
from export.body.body_file import FILE, write_body
from export.body.body_model import VERTICES, BodyModel, make_body_model
from export.bundle import BundleInfo
from export.bundle import write_manifest as write_bundle_manifest
from export.surface_grid import FILE as SURFACE_FILE
from export.surface_grid import SurfaceGrid

DATA = (
    sources.BODIES_AND_SLIDERS.used_for("mesh, skeleton, shapes, skin weights, keypoints"),
    sources.MOTIONS.used_for("prior of poses"),
    sources.LABELS_OF_PEOPLE.used_for("prior of poses: poses of photographs"),
)


def write_bundle(folder: Path, model: BodyModel, name: str = "body") -> dict:
    """Writes the body and the manifest. Returns the manifest. Raises BodyFileError, OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    write_body(model, folder / FILE)
    info = BundleInfo(name, "int16", training_data=DATA)
    return write_bundle_manifest(folder, "body", info, {}, files=(FILE,), task_keys={"body": {"file": FILE}})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--surface", type=Path, default=Path("sdk/models/densepose-b-int8"), help="folder of a bundle")
    parser.add_argument("--out", type=Path, default=Path("sdk/models/body"))
    parser.add_argument("--vertices", type=int, default=VERTICES)
    options = parser.parse_args()
    grid = SurfaceGrid.load(options.surface / SURFACE_FILE)
    write_bundle(options.out, make_body_model(grid, vertices=options.vertices))
    sizes = {path.name: path.stat().st_size for path in sorted(options.out.iterdir())}
    print(", ".join(f"{name} {size / 1e6:.3f} MB" for name, size in sizes.items()))


if __name__ == "__main__":
    main()
