"""Writes the list of a package's content (SBOM) as CycloneDX 1.6 JSON: files, libraries of others, model bundles.

    python3 scripts/release/sbom.py --name maquette-linux --root FOLDER --out FILE     of the files in a folder
    python3 scripts/release/sbom.py --wheel FILE.whl       into the wheel, at its place by PEP 770 (.dist-info/sboms)

The same content and commit give the same bytes. libraries.toml names the libraries.
"""

import argparse
import base64
import hashlib
import json
import re
import subprocess
import tomllib
import uuid
import zipfile
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LIBRARIES = tomllib.loads(Path(__file__).with_name("libraries.toml").read_text())["library"]
NOT_LISTED = re.compile(
    r".*\.dist-info/RECORD|.*\.cdx\.json|DEBIAN/.*"
)  # they depend on the list, or are no files of it


def output_of(*command: str) -> str:
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def version() -> str:
    return re.search(r"project\(maquette VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text())[1]


def version_of(source: str) -> str:
    """The version of a library: of a Debian package, or by the pattern after the name of a file."""
    if ":" not in source:
        return output_of("dpkg-query", "-W", "-f=${Version}", source)
    file, pattern = source.split(":", 1)
    return re.search(pattern, (ROOT / file).read_text())[1]


def licences(expression: str) -> list[dict]:
    return [{"expression": expression}] if " " in expression else [{"license": {"id": expression}}]


def sbom(name: str, hashes: dict[str, str]) -> dict:
    """The list for a package `name` of files with these SHA-256 hashes."""
    hashes = {file: digest for file, digest in sorted(hashes.items()) if not NOT_LISTED.fullmatch(file)}
    parts = []
    for library in LIBRARIES:
        if any(re.fullmatch(library["files"], Path(file).name) for file in hashes):
            found = version_of(library["version"])
            purl = library["purl"].format(version=found)
            parts.append({"type": "library", "bom-ref": purl, "name": library["name"], "version": found,
                          "licenses": licences(library["licence"]), "purl": purl})  # fmt: skip
    for file in hashes:
        if file.endswith("/manifest.json"):
            bundle = Path(file).parent.name
            manifest = json.loads((ROOT / "sdk/models" / bundle / "manifest.json").read_text())
            parts.append({"type": "machine-learning-model", "bom-ref": f"model:{bundle}", "name": bundle,
                          "version": manifest["version"], "licenses": licences("Apache-2.0")})  # fmt: skip
    files = [
        {"type": "file", "bom-ref": f"file:{file}", "name": file, "hashes": [{"alg": "SHA-256", "content": digest}]}
        for file, digest in hashes.items()
    ]
    commit = output_of("git", "rev-parse", "HEAD")
    time = datetime.fromtimestamp(int(output_of("git", "log", "-1", "--format=%ct")), UTC)
    package = {"type": "library", "bom-ref": name, "name": name, "version": version(),
               "licenses": licences("Apache-2.0"), "purl": f"pkg:generic/{name}@{version()}",
               "properties": [{"name": "maquette:commit", "value": commit}]}  # fmt: skip
    content = json.dumps([package, parts, files], sort_keys=True)
    return {
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, content)}",
        "version": 1,
        "metadata": {"timestamp": time.strftime("%Y-%m-%dT%H:%M:%SZ"), "component": package},
        "components": parts + files,
        "dependencies": [{"ref": name, "dependsOn": [part["bom-ref"] for part in parts]}],
    }


def text_of(name: str, hashes: dict[str, str]) -> str:
    return json.dumps(sbom(name, hashes), indent=1) + "\n"


def hashes_of(root: Path) -> dict[str, str]:
    files = (path for path in root.rglob("*") if path.is_file() and not path.is_symlink())
    return {path.relative_to(root).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def add_to_wheel(wheel: Path) -> None:
    """Adds the list and its line of RECORD; all other entries keep their bytes."""
    with zipfile.ZipFile(wheel) as archive:
        entries = [(entry, archive.read(entry)) for entry in archive.infolist() if not entry.is_dir()]
    (record,) = (entry.filename for entry, _ in entries if entry.filename.endswith(".dist-info/RECORD"))
    place = record.replace("RECORD", "sboms/maquette.cdx.json")
    hashes = {entry.filename: hashlib.sha256(data).hexdigest() for entry, data in entries}
    data = text_of(wheel.name.split("-")[0].replace("_", "-"), hashes).encode()
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
    partial = wheel.with_suffix(".part")
    with zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED) as archive:
        for entry, content in entries:
            if entry.filename == place:  # of an earlier run
                continue
            if entry.filename == record:
                added = zipfile.ZipInfo(place, entry.date_time)
                added.compress_type, added.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
                archive.writestr(added, data)
                lines = [line for line in content.decode().splitlines() if not line.startswith(place)]
                content = "\n".join([*lines[:-1], f"{place},sha256={digest},{len(data)}", lines[-1], ""]).encode()
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    partial.replace(wheel)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wheel", type=Path)
    parser.add_argument("--name")
    parser.add_argument("--root", type=Path)
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    if arguments.wheel:
        add_to_wheel(arguments.wheel)
    elif arguments.name and arguments.root and arguments.out:
        arguments.out.parent.mkdir(parents=True, exist_ok=True)
        arguments.out.write_text(text_of(arguments.name, hashes_of(arguments.root)))
    else:
        parser.error("give --wheel, or --name, --root and --out")


if __name__ == "__main__":
    main()
