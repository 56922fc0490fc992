"""The manifest of a bundle of scene networks (docs/reference/formats.md): extractor, refiner and `basis.bin`."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

from export import data_sources as sources
from export.bundle import LICENCE, BundleInfo, signature_of
from export.bundle import write_manifest as write_bundle_manifest

GRAPHS = ("extractor", "refiner")
BASIS = "basis.bin"
TRUNK = sources.DETECTOR_TRUNK.used_for("first weights of the extractor's trunk; comparing pictures")


def training_data(places: Path) -> list[dict[str, str]]:
    """Training data of networks that were trained on the rendered environments in a folder, for a manifest: all assets
    by package, and the source of the trunk. Raises ValueError for environments that do not name their assets."""
    packages: dict[tuple[str, str], set[str]] = {}
    count = 0
    for path in sorted(places.glob("*/transforms.json")):
        count += 1
        try:
            for asset in json.loads(path.read_text())["maquette"]["assets"]:
                key = f"{asset['package']} {asset['version']}", asset["licence"]
                packages.setdefault(key, set()).add(asset["name"].split()[0].rstrip(":"))
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"{path} does not name its assets: {error!r}") from None
    if not count:
        raise ValueError(f"{places} has no places in it")
    rendered = {"name": f"Maquette rendered places ({count})", "licence": LICENCE, "used_for": "training, calibration"}
    used = [
        {"name": f"{package}: {', '.join(sorted(kinds))}", "licence": licence, "used_for": "rendering"}
        for (package, licence), kinds in sorted(packages.items())
    ]
    return [rendered, *used, TRUNK]


def with_earlier(data: list[dict[str, str]], bundle: Path) -> list[dict[str, str]]:
    """Training data and that of a bundle whose weights the training began with. Raises OSError, ValueError."""
    earlier = json.loads((bundle / "manifest.json").read_text())["training_data"]
    return data + [entry for entry in earlier if entry not in data]


def identity(manifest: dict) -> str:
    """Identity of the networks in a bundle, in hexadecimal; scenes built with them store it
    (docs/reference/formats.md)."""
    names = (*(manifest["graphs"][graph]["file"] for graph in GRAPHS), manifest["basis"]["file"])
    digests = "".join(manifest["files"][name]["sha256"] for name in names)
    return hashlib.sha256(digests.encode()).hexdigest()


def write_manifest(folder: Path, info: BundleInfo) -> dict:
    """Describes the graphs that lie in `folder`, of any precision, and writes `manifest.json`, which it returns."""
    graphs = {name: signature_of(folder / f"{name}.onnx") for name in GRAPHS}
    task_keys = {"basis": {"file": BASIS}}
    return write_bundle_manifest(folder, "scenes", info, graphs, files=(BASIS,), task_keys=task_keys)
