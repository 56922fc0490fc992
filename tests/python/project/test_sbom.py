"""The list of a package's content (scripts/release/sbom.py)."""

import base64
import csv
import hashlib
import io
import json
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "scripts/release"))
import sbom  # noqa: E402

FILES = {
    "lib/libmaquette.so.0.3": b"1",
    "lib/maquette/libonnxruntime.so.1": b"2",
    "models/edges-int8/manifest.json": b"{}",
}


@pytest.fixture(autouse=True)
def _any_system(monkeypatch):
    """The versions of libraries are Debian's, which may not be installed."""
    found = sbom.version_of
    monkeypatch.setattr(sbom, "version_of", lambda source: found(source) if ":" in source else "1.0")


def test_files_libraries_and_models_are_listed(tmp_path):
    for name, data in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(data)
    made = sbom.sbom("maquette-linux", sbom.hashes_of(tmp_path))
    parts = {part["name"]: part for part in made["components"]}
    assert {"onnxruntime", "xxHash", "nlohmann-json", "edges-int8", *FILES} == set(parts)
    assert parts["onnxruntime"]["purl"].startswith("pkg:github/microsoft/onnxruntime@v1.")
    assert parts["models/edges-int8/manifest.json"]["hashes"][0]["content"] == hashlib.sha256(b"{}").hexdigest()
    assert made["specVersion"] == "1.6"
    assert made == sbom.sbom("maquette-linux", sbom.hashes_of(tmp_path))


def test_a_wheel_gets_its_list_once_and_its_record_fits(tmp_path):
    wheel = tmp_path / "maquette-0.3.0-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        for name, data in FILES.items():
            archive.writestr(name, data)
        archive.writestr("maquette-0.3.0.dist-info/RECORD", "a,sha256=b,1\nmaquette-0.3.0.dist-info/RECORD,,\n")
    for _ in range(2):
        sbom.add_to_wheel(wheel)
        with zipfile.ZipFile(wheel) as archive:
            data = archive.read("maquette-0.3.0.dist-info/sboms/maquette.cdx.json")
            record = archive.read("maquette-0.3.0.dist-info/RECORD").decode()
        rows = list(csv.reader(io.StringIO(record)))
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        assert rows[1] == ["maquette-0.3.0.dist-info/sboms/maquette.cdx.json", f"sha256={digest}", str(len(data))]
        assert len(rows) == 3
        assert json.loads(data)["metadata"]["component"]["name"] == "maquette"
