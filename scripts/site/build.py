"""Builds the site of guides and API reference into build/site; `make site` installs what it needs first.

    .venv/bin/python scripts/site/build.py [--without-kotlin]

C and C++ by Doxygen, Python by mkdocstrings, Kotlin by Dokka, pages of this repository; MkDocs gives all one look.
"""

import argparse
import re
import shutil
import subprocess
import sys
from pathlib import Path

import c_pages
import kotlin_pages
import sources
import yaml

ROOT = Path(__file__).resolve().parents[2]
WORK = ROOT / "build/site-work"
PAGES = WORK / "pages"
SITE = ROOT / "build/site"
PROJECT = ["ARCHITECTURE.md", "CONTRIBUTING.md", "SECURITY.md", "CODE_OF_CONDUCT.md", "CHANGELOG.md"]
FOLDERS = ["python/README.md", "android/README.md", "sdk/README.md", "examples/README.md"]
DOXYGEN = """
INPUT = sdk/include/maquette
FILE_PATTERNS = *.h *.hpp
OUTPUT_DIRECTORY = {work}/doxygen
INPUT_FILTER = "{python} {root}/scripts/site/header_filter.py"
GENERATE_HTML = NO
GENERATE_LATEX = NO
GENERATE_XML = YES
XML_PROGRAMLISTING = NO
EXTRACT_ALL = YES
MACRO_EXPANSION = YES
EXPAND_ONLY_PREDEF = YES
PREDEFINED = MAQ_API= __cplusplus
TYPEDEF_HIDES_STRUCT = YES
WARN_IF_UNDOCUMENTED = NO
QUIET = YES
"""


def run(*command: str | Path, **options) -> None:
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, **options)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout[-4000:]}{done.stderr[-4000:]}")


def write_c_pages() -> None:
    (WORK / "doxygen").mkdir()
    config = WORK / "Doxyfile"
    config.write_text(DOXYGEN.format(work=WORK, root=ROOT, python=sys.executable))
    run("doxygen", config)
    c_pages.Pages(WORK / "doxygen/xml").write(PAGES / "api")


def write_python_pages() -> None:
    """One page a module: with the names that the package exports, or with all names."""
    package = ROOT / "python/maquette"
    text = (package / "__init__.py").read_text()
    exported = set(re.findall(r'"(\w+)"', text.split("__all__ = [")[1].split("]")[0]))
    modules = {}
    for module, names in re.findall(r"^from maquette\.(\w+) import (\([^)]*\)|.*)$", text, re.MULTILINE):
        modules[module] = sorted(exported.intersection(re.findall(r"\w+", names)))
    for path in [package / "settings.py", *sorted(package.glob("adapters/[!_]*.py"))]:
        names = re.findall(r"^(?:class|def) ([A-Za-z]\w*)|^([A-Z]\w+) = ", path.read_text(), re.MULTILINE)
        modules[".".join(path.relative_to(package).with_suffix("").parts)] = ["".join(name) for name in names]
    folder = PAGES / "api/python"
    folder.mkdir(parents=True)
    rows = []
    for module, names in modules.items():
        text = "\n\n".join(f"::: maquette.{module}.{name}" for name in names)
        (folder / f"{module}.md").write_text(f"# maquette.{module}\n\n{text}\n")
        rows.append(f"| [maquette.{module}]({module}.md) | {', '.join(f'`{name}`' for name in names)} |")
    head = "# Python API\n\nThe package `maquette` exports all names but those of `settings` and `adapters`. "
    head += "[How to install it](../../python/README.md).\n\n| module | names |\n| --- | --- |\n"
    (folder / "README.md").write_text(head + "\n".join(rows) + "\n")


def write_kotlin_pages(is_left_out: bool) -> None:
    folder = PAGES / "api/kotlin"
    if is_left_out:
        folder.mkdir(parents=True)
        (folder / "README.md").write_text(
            "# Kotlin API\n\nThis copy of the site was built without Dokka (`--without-kotlin`).\n"
        )
        return
    shutil.rmtree(ROOT / "build/android-tests/dokka", ignore_errors=True)
    run("mvn", "--batch-mode", "--quiet", "-f", "tests/android/pom.xml", "org.jetbrains.dokka:dokka-maven-plugin:dokka")
    kotlin_pages.Types(ROOT / "build/android-tests/dokka").write(folder)


def navigation() -> list:
    def titled(folder: str) -> list:
        pages = sorted((PAGES / folder).rglob("*.md"), key=lambda page: page.with_suffix(""))
        names = [page.relative_to(PAGES).as_posix() for page in pages]
        return [name for name in names if name.startswith("api/") or (ROOT / name).is_file()]  # no pages of code

    def reference(folder: str) -> list:
        pages = [path for path in titled(folder) if not path.endswith("README.md")]
        return [f"{folder}/README.md", *[{Path(path).name.removesuffix(".md"): path} for path in pages]]

    return [
        {"Start": "README.md"},
        {"Guide": ["docs/README.md", *titled("docs/guide")]},
        {
            "API": [
                {"C": reference("api/c")},
                {"C++": reference("api/cpp")},
                {"Python": reference("api/python")},
                {"Kotlin": reference("api/kotlin")},
            ]
        },
        {"Reference": titled("docs/reference")},
        {"Research": titled("docs/research") + titled("docs/benchmarks")},
        {"Project": [*PROJECT, *FOLDERS]},
    ]


def build() -> None:
    config = yaml.safe_load((ROOT / "scripts/site/mkdocs.yml").read_text())
    config |= {"docs_dir": str(PAGES), "site_dir": str(SITE), "nav": navigation()}
    options = config["plugins"][1]["mkdocstrings"]["handlers"]["python"]
    options["paths"] = [str(ROOT / "python")]
    file = WORK / "mkdocs.yml"
    file.write_text(yaml.safe_dump(config, sort_keys=False))
    shutil.copytree(ROOT / "scripts/site/style", PAGES / "style")
    run(sys.executable, "-m", "mkdocs", "build", "--quiet", "--config-file", file)
    (SITE / "404.html").unlink()  # of a site at the root of its host
    print(f"{SITE}/index.html: {len(list(SITE.rglob('*.html')))} pages")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--without-kotlin", action="store_true", help="leave out Dokka, which needs Maven")
    arguments = parser.parse_args()
    shutil.rmtree(WORK, ignore_errors=True)
    shutil.rmtree(SITE, ignore_errors=True)
    PAGES.mkdir(parents=True)
    write_c_pages()
    write_python_pages()
    write_kotlin_pages(arguments.without_kotlin)
    sources.copy_pages(ROOT, PAGES, ["README.md", "docs/README.md", *PROJECT, *FOLDERS])
    build()


if __name__ == "__main__":
    main()
