"""Assembles the AAR of android/maquette from its parts, and checks what an app's build and Android's linker ask of it.

    python3 scripts/android/aar.py --classes CLASSES --d8 "java -cp r8.jar com.android.tools.r8.D8 ..." \
        --native arm64-v8a build/android/arm64-v8a/*.so --version 0.3.0 --out build/android

Writes maquette-VERSION.aar, a Maven repository with it and its sources, and sizes.json, and prints the sizes.
Fails, with a line for each, where
- a native method of the Kotlin classes is missing in a library, or a library exports anything else;
- a library needs one that is neither Android's nor in the AAR, or has a segment that does not fit pages of 16 KB;
- D8 does not accept the classes;
- an entry of the AAR format is missing, or one ABI is larger than the limit.
"""

import argparse
import hashlib
import io
import json
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts/release"))
import sbom  # noqa: E402

MODULE = ROOT / "android/maquette"
MIN_SDK = 26
PAGE_BYTES = 16384
# Compressed, which is what is downloaded for one phone. Nine tenths of it are the official ONNX Runtime with all its
# operators; that of x86_64, for emulators, is 11.9 MB.
MAX_ABI_BYTES = {"arm64-v8a": 12_000_000, "x86_64": 14_000_000}
# Libraries of Android that every app may use (NDK: "stable APIs").
ANDROID_LIBRARIES = {"libc.so", "libm.so", "libdl.so", "liblog.so", "libandroid.so", "libjnigraphics.so", "libz.so"}
OURS = {"libmaquette.so": r"maq_\w+", "libmaquette_jni.so": r"(Java_dev_maquette_jni_\w+|JNI_OnLoad)"}


def output_of(*command: str | Path) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def exports_of(library: Path) -> set[str]:
    return {line.split()[-1] for line in output_of("nm", "--dynamic", "--defined-only", library).splitlines()}


def imports_of(library: Path) -> set[str]:
    return {line.split()[-1] for line in output_of("nm", "--dynamic", "--undefined-only", library).splitlines()}


def native_methods(classes: Path) -> set[str]:
    """The names that Java looks for in a library (JNI specification, "Resolving Native Method Names"). A method of
    Native has the name of the function of libmaquette.so that it calls; libmaquette_jni.so registers it."""
    files = sorted(classes.rglob("*.class"))
    names, name = set(), ""
    for line in output_of("javap", "-private", *files).splitlines():
        if found := re.match(r"(?:\w+ )*(?:class|interface) ([\w.$]+)", line):
            name = found[1]
        elif found := re.match(r"\s+.*\bnative\b.* (maq_\w+)\(", line):
            names.add(found[1])
        elif found := re.match(r"\s+.*\bnative\b.* (\w+)\(", line):
            mangled = "_".join(part.replace("_", "_1") for part in name.replace("$", "_00024").split("."))
            names.add(f"Java_{mangled}_{found[1].replace('_', '_1')}")
    return names


def problems_of_library(library: Path, packed: set[str], methods: set[str]) -> list[str]:
    problems = []
    headers = output_of("readelf", "--wide", "--program-headers", "--dynamic", library)
    for line in headers.splitlines():
        if line.split()[:1] == ["LOAD"] and int(line.split()[-1], 16) % PAGE_BYTES:
            problems.append(f"has a segment aligned to {line.split()[-1]}, but pages may have 16 KB")
    for needed in re.findall(r"\(NEEDED\).*\[(.+)\]", headers):
        if needed not in ANDROID_LIBRARIES | packed:
            problems.append(f"needs {needed}, which is neither Android's nor in the AAR")
    if re.findall(r"\(SONAME\).*\[(.+)\]", headers) != [library.name]:
        problems.append("has another SONAME than its file's name")
    if "(TEXTREL)" in headers:
        problems.append("has relocations in its code, which Android does not load")
    if library.name in OURS:
        exports = exports_of(library)
        problems += [f"exports {name}" for name in sorted(exports) if not re.fullmatch(OURS[library.name], name)]
    if library.name == "libmaquette_jni.so":
        problems += [f"lacks {name}" for name in sorted(methods - exports - imports_of(library))]
        problems += [f"has {name}, which no class declares" for name in sorted(exports - methods - {"JNI_OnLoad"})]
    return problems


def manifest() -> str:
    """The module's manifest with what Gradle would add to it."""
    text = (MODULE / "src/main/AndroidManifest.xml").read_text()
    added = (
        '<manifest xmlns:android="http://schemas.android.com/apk/res/android" package="dev.maquette">\n'
        f'    <uses-sdk android:minSdkVersion="{MIN_SDK}" />\n</manifest>'
    )
    if "<manifest />" not in text:
        raise SystemExit("AndroidManifest.xml is no longer empty; scripts/android/aar.py has to merge it.")
    return text.replace("<manifest />", added)


def jar_of(classes: Path) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as jar:
        for file in sorted(p for p in classes.rglob("*") if p.is_file()):
            add(jar, str(file.relative_to(classes)), file.read_bytes())
    return data.getvalue()


def add(archive: zipfile.ZipFile, name: str, data: bytes) -> None:
    entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))  # the same bytes each time
    entry.compress_type = zipfile.ZIP_DEFLATED
    archive.writestr(entry, data)


def write_aar(path: Path, classes: Path, native: dict[str, list[Path]]) -> None:
    """docs: developer.android.com/studio/projects/android-library, "Anatomy of an AAR file"."""
    with zipfile.ZipFile(path, "w") as aar:
        add(aar, "AndroidManifest.xml", manifest().encode())
        add(aar, "classes.jar", jar_of(classes))
        add(aar, "R.txt", b"")  # no resources
        add(aar, "proguard.txt", (MODULE / "consumer-rules.pro").read_bytes())
        metadata = "aarFormatVersion=1.0\naarMetadataVersion=1.0\nminCompileSdk=1\n"
        add(aar, "META-INF/com/android/build/gradle/aar-metadata.properties", metadata.encode())
        for file in sorted(p for p in (ROOT / "sdk/models").rglob("*") if p.is_file()):
            add(aar, f"assets/{file.relative_to(ROOT / 'sdk/models')}", file.read_bytes())
        for abi, libraries in native.items():
            for library in libraries:
                add(aar, f"jni/{abi}/{library.name}", library.read_bytes())
        add(aar, "META-INF/licenses/maquette/LICENSE", (ROOT / "LICENSE").read_bytes())
        for file in sorted(p for p in (ROOT / "sdk/licenses").rglob("*") if p.is_file()):
            add(aar, f"META-INF/licenses/{file.relative_to(ROOT / 'sdk/licenses')}", file.read_bytes())
    with zipfile.ZipFile(path, "a") as aar:
        hashes = {name: hashlib.sha256(aar.read(name)).hexdigest() for name in aar.namelist()}
        add(aar, "META-INF/sbom/maquette.cdx.json", sbom.text_of("maquette-android", hashes).encode())


def problems_of_aar(path: Path, abis: list[str]) -> list[str]:
    with zipfile.ZipFile(path) as aar:
        names = set(aar.namelist())
        needed = {"AndroidManifest.xml", "classes.jar", "R.txt", "proguard.txt"}
        needed |= {f"jni/{abi}/{name}" for abi in abis for name in OURS}
        needed |= {f"assets/{bundle.name}/manifest.json" for bundle in (ROOT / "sdk/models").iterdir()}
        problems = [f"lacks {name}" for name in sorted(needed - names)]
        for abi in abis:
            size = sum(e.compress_size for e in aar.infolist() if e.filename.startswith(f"jni/{abi}/"))
            if size > MAX_ABI_BYTES[abi]:
                problems.append(f"takes {size / 1e6:.2f} MB for {abi}; the limit is {MAX_ABI_BYTES[abi] / 1e6:.0f} MB")
    return problems


def sizes_of(path: Path) -> list[tuple[str, int, int]]:
    """Name, bytes and compressed bytes of each library, of the classes and of each model bundle."""
    groups: dict[str, list[int]] = {}
    with zipfile.ZipFile(path) as aar:
        for entry in aar.infolist():
            parts = entry.filename.split("/")
            name = "/".join(parts[:2]) if parts[0] == "assets" else entry.filename
            name = name if parts[0] in ("assets", "jni", "classes.jar") else "the rest"
            group = groups.setdefault(name, [0, 0])
            group[0] += entry.file_size
            group[1] += entry.compress_size
    return [(name, *sizes) for name, sizes in sorted(groups.items())]


def write_repository(out: Path, aar: Path, version: str, dependencies: list[str]) -> None:
    shutil.rmtree(out / "repository", ignore_errors=True)
    folder = out / "repository/dev/maquette/maquette" / version
    folder.mkdir(parents=True)
    (folder / aar.name).write_bytes(aar.read_bytes())
    (folder / f"{aar.stem}-sources.jar").write_bytes(jar_of(MODULE / "src/main/kotlin"))
    of_maven = "".join(
        "    <dependency><groupId>{}</groupId><artifactId>{}</artifactId><version>{}</version></dependency>\n".format(
            *dependency.split(":")
        )
        for dependency in dependencies
    )
    (folder / aar.with_suffix(".pom").name).write_text(f"""<?xml version="1.0" encoding="UTF-8"?>
<project xmlns="http://maven.apache.org/POM/4.0.0">
  <modelVersion>4.0.0</modelVersion>
  <groupId>dev.maquette</groupId>
  <artifactId>maquette</artifactId>
  <version>{version}</version>
  <packaging>aar</packaging>
  <name>Maquette</name>
  <description>On-device vision: dense pose and scenes from a camera, on the CPU</description>
  <licenses>
    <license><name>Apache-2.0</name><url>https://www.apache.org/licenses/LICENSE-2.0.txt</url></license>
  </licenses>
  <dependencies>
{of_maven}  </dependencies>
</project>
""")
    for file in list(folder.iterdir()):  # Maven and Gradle ask for these
        for algorithm in ("md5", "sha1", "sha256"):
            (folder / f"{file.name}.{algorithm}").write_text(
                hashlib.file_digest(file.open("rb"), algorithm).hexdigest()
            )


def problems_of_bytecode(classes: Path, d8: str) -> list[str]:
    with tempfile.TemporaryDirectory() as folder:
        jar = Path(folder) / "classes.jar"
        jar.write_bytes(jar_of(classes))
        run = subprocess.run([*shlex.split(d8), "--output", folder, jar], capture_output=True, text=True)
        if run.returncode == 0 and (Path(folder) / "classes.dex").exists():
            return []
        return [f"D8 does not accept the classes: {run.stderr.strip()[-500:]}"]


def write_junit(path: Path, checks: dict[str, list[str]]) -> None:
    suite = ElementTree.Element("testsuite", name="aar")
    for name, problems in checks.items():
        case = ElementTree.SubElement(suite, "testcase", classname="aar", name=name)
        if problems:
            ElementTree.SubElement(case, "failure", message="; ".join(problems))
    path.parent.mkdir(parents=True, exist_ok=True)
    ElementTree.ElementTree(suite).write(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--classes", type=Path, required=True, help="folder of the compiled Kotlin API")
    parser.add_argument("--native", nargs="+", action="append", required=True, metavar=("ABI", "LIBRARY"))
    parser.add_argument("--d8", required=True, help="command line of D8 up to its input")
    parser.add_argument("--dependency", action="append", default=[], help="GROUP:NAME:VERSION of the classes")
    parser.add_argument("--version", required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--junit", type=Path, help="a report of the checks to write")
    arguments = parser.parse_args()
    native = {abi: [Path(library) for library in libraries] for abi, *libraries in arguments.native}

    methods = native_methods(arguments.classes)
    checks = {"classes": [] if methods else [f"{arguments.classes}: no class has a native method"]}
    for abi, libraries in native.items():
        packed = {library.name for library in libraries}
        for library in libraries:
            name = f"{abi}/{library.name}"
            checks[name] = [f"{name} {problem}" for problem in problems_of_library(library, packed, methods)]

    arguments.out.mkdir(parents=True, exist_ok=True)
    aar = arguments.out / f"maquette-{arguments.version}.aar"
    write_aar(aar, arguments.classes, native)
    write_repository(arguments.out, aar, arguments.version, arguments.dependency)
    checks["layout and size"] = [f"{aar.name} {problem}" for problem in problems_of_aar(aar, list(native))]
    checks["Android's bytecode"] = problems_of_bytecode(arguments.classes, arguments.d8)

    sizes = sizes_of(aar)
    rows = [{"name": name, "bytes": size, "compressed_bytes": compressed} for name, size, compressed in sizes]
    (arguments.out / "sizes.json").write_text(json.dumps(rows, indent=1) + "\n")
    for name, size, compressed in [*sizes, ("all", sum(s[1] for s in sizes), aar.stat().st_size)]:
        print(f"{name:42} {size / 1e6:7.2f} MB, compressed {compressed / 1e6:6.2f} MB")
    if arguments.junit:
        write_junit(arguments.junit, checks)
    if problems := [problem for of_check in checks.values() for problem in of_check]:
        sys.exit("\n".join(problems))
    print(f"{aar}: {len(methods)} native methods in {len(native)} ABIs; {len(checks)} checks passed")


if __name__ == "__main__":
    main()
