"""Writes the networks of each system as a wheel: maquette_models_SYSTEM. Its files lie beside those of the `maquette`
wheel, where the library looks for them.

    python scripts/wheel/model_wheels.py SHARE FOLDER      SHARE: share/maquette of an installation
"""

import base64
import hashlib
import re
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
VERSION = re.search(r'^version = "([^"]+)"', (ROOT / "python/pyproject.toml").read_text(), re.MULTILINE)[1]


def write_wheel(bundle: Path, licence: Path, folder: Path) -> Path:
    """`bundle`: a folder such as densepose-b-int8. The same files give the same bytes."""
    system = bundle.name.split("-")[0]
    info = f"maquette_models_{system}-{VERSION}.dist-info"
    files = {
        f"maquette/share/maquette/models/{bundle.name}/{path.relative_to(bundle)}": path.read_bytes()
        for path in sorted(bundle.rglob("*"))
        if path.is_file()
    }
    files |= {
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: maquette-models-{system}\nVersion: {VERSION}\n"
        f"Summary: Networks of Maquette: {system}\nLicense: Apache-2.0\nRequires-Python: >=3.9\n".encode(),
        f"{info}/WHEEL": b"Wheel-Version: 1.0\nGenerator: maquette\nRoot-Is-Purelib: false\nTag: py3-none-any\n",
        f"{info}/licenses/LICENSE": licence.read_bytes(),
    }
    record = f"{info}/RECORD"
    lines = []
    for name, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        lines.append(f"{name},sha256={digest},{len(data)}")
    files[record] = "\n".join([*lines, f"{record},,", ""]).encode()
    wheel = folder / f"maquette_models_{system}-{VERSION}-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name)
            entry.external_attr = 0o644 << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, data, compresslevel=9)
    return wheel


if __name__ == "__main__":
    share, target = map(Path, sys.argv[1:])
    for model in sorted((share / "models").iterdir()):
        write_wheel(model, share / "licenses/LICENSE", target)
