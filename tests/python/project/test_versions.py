"""Every file that has the version has the same one."""

import re
from pathlib import Path

VERSION = re.search(r"project\(maquette VERSION ([0-9.]+)", Path("CMakeLists.txt").read_text())[1]
FILES = {
    "pyproject.toml": r'^version = "(.*)"',
    "python/pyproject.toml": r'^version = "(.*)"',
    "desktop_demo/CMakeLists.txt": r"project\(maquette_demo VERSION ([0-9.]+)",
    "android/maquette/build.gradle.kts": r'^version = "(.*)"',
    "android/sample/build.gradle.kts": r'versionName = "(.*)"',
    "tests/android/pom.xml": r"<artifactId>maquette-android-tests</artifactId>\s*<version>(.*)</version>",
    "docs/reference/packages.md": r"dev\.maquette:maquette:([0-9.]+)",
    "docs/guide/android.md": r"dev\.maquette:maquette:([0-9.]+)",
    "CHANGELOG.md": r"^## ([0-9.]+)",
}


def test_all_files_have_the_version_of_the_build():
    found = {file: re.search(pattern, Path(file).read_text(), re.MULTILINE) for file, pattern in FILES.items()}
    assert {file: match and match[1] for file, match in found.items()} == dict.fromkeys(FILES, VERSION)
    header = Path("sdk/include/maquette/types.h").read_text()
    assert ".".join(re.findall(r"#define MAQ_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", header)) == VERSION
    assert f"newest minor version ({VERSION.rsplit('.', 1)[0]})" in Path("SECURITY.md").read_text()
