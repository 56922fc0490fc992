"""Model bundles: damaged files whose checksums fit, manifests with extreme values, graphs that do not fit."""

import hashlib
import json
import shutil
from pathlib import Path
from random import Random

from tests.hostile.damage import damaged, damaged_json, flip
from tests.hostile.samples import (
    CAPTURE,
    DENSEPOSE,
    HEAD,
    HEADS_BUNDLE,
    PEOPLE_BUNDLE,
    PREDICTION_BUNDLE,
    SCENE_BUNDLE,
    Samples,
)
from tests.hostile.trial import EITHER, REFUSED, Trial

PEOPLE_RUN = (
    "densepose", "stub:people?size=64x48&frames=2", *DENSEPOSE[3:], "--bundle", "bundle", "--keypoints",
)  # fmt: skip
SCENE_RUN = ("scene", "build", str(CAPTURE), "--bundle", "bundle", "--out", "a.maqs", "--threads", "1")
HEAD_RUN = (*(word if word != str(HEADS_BUNDLE) else "bundle" for word in HEAD), "--out", "a.glb")
SAMPLES_RUN = ("predict", "stub:people?size=64x48&frames=6", "--from", "3", "--frames", "1", "--samples", "1",
               "--bundle", "bundle", "--threads", "1", "--out", "a.mp4")  # fmt: skip
KINDS = ((PEOPLE_BUNDLE, PEOPLE_RUN), (SCENE_BUNDLE, SCENE_RUN), (HEADS_BUNDLE, HEAD_RUN),
         (PREDICTION_BUNDLE, SAMPLES_RUN))  # fmt: skip


def _copied(source: Path, changes: dict[str, bytes], is_signed: bool):
    """changes: files by name. is_signed: whether the manifest says what they are now."""

    def prepare(folder: Path) -> None:
        bundle = folder / "bundle"
        shutil.copytree(source, bundle)
        for name, data in changes.items():
            (bundle / name).write_bytes(data)
        if is_signed:
            manifest = json.loads((bundle / "manifest.json").read_text())
            for name in changes:
                manifest["files"][name] = {"sha256": hashlib.sha256(changes[name]).hexdigest(),
                                           "bytes": len(changes[name])}  # fmt: skip
            (bundle / "manifest.json").write_text(json.dumps(manifest))

    return prepare


def _files(source: Path) -> list[str]:
    return sorted(path.name for path in source.iterdir() if path.name != "manifest.json")


def damaged_files(samples: Samples, rng: Random, index: int) -> Trial:
    """With valid checksums: the runtime itself meets the damage."""
    source, words = KINDS[index % len(KINDS)]
    name = rng.choice(_files(source))
    how, data = damaged((source / name).read_bytes(), rng)
    return Trial("bundle files", f"{name}: {how}", words, _copied(source, {name: data}, True), EITHER)


def exchanged_files(samples: Samples, rng: Random, index: int) -> Trial:
    """A file in another's place, or none, with valid checksums."""
    source, words = KINDS[index % len(KINDS)]
    name = rng.choice(_files(source))
    other = rng.choice([*(file for file in _files(source) if file != name), "nothing", "zeros"])
    data = {"nothing": b"", "zeros": bytes(100_000)}.get(other) if other in ("nothing", "zeros") else None
    data = (source / other).read_bytes() if data is None else data
    return Trial("bundle files", f"{name} is {other}", words, _copied(source, {name: data}, True), REFUSED)


def unsigned_files(samples: Samples, rng: Random, index: int) -> Trial:
    source, words = KINDS[index % len(KINDS)]
    name = rng.choice(_files(source))
    how, data = flip((source / name).read_bytes(), rng)
    while data == (source / name).read_bytes():  # the same bit twice
        how, data = flip(data, rng)
    return Trial("bundle files", f"{name}: {how}, unsigned", words, _copied(source, {name: data}, False), REFUSED)


def manifests(samples: Samples, rng: Random, index: int) -> Trial:
    source, words = KINDS[index % len(KINDS)]
    how, text = damaged_json(json.loads((source / "manifest.json").read_text()), rng)
    data = text.encode("utf-8", "surrogatepass")
    return Trial("manifests", how, words, _copied(source, {"manifest.json": data}, False), EITHER)
