"""Commands, files, symbols and options in the documentation exist. Guides begin with an image and a command."""

import re
import subprocess
from pathlib import Path

import pytest

GUIDES = sorted(Path("docs/guide").glob("*.md"))
PAGES = [
    *map(Path, ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "SECURITY.md")),
    *map(Path, ("docs/README.md", "python/README.md")),
    *GUIDES,
    *sorted(Path("docs/reference").rglob("*.md")),
]
FOLDERS = "android|benchmarks|cmake|desktop_demo|docs|examples|export|python|quantization|scripts|sdk|tests"
HEADERS = "".join(path.read_text() for path in sorted(Path("sdk/include/maquette").glob("*.h*")))
SYMBOLS = set(re.findall(r"\bmaq_\w+|\bMAQ_\w+", HEADERS))
TRACKED = subprocess.run(["git", "ls-files"], capture_output=True, text=True, check=True).stdout.splitlines()


def options_of(folder: str) -> set[str]:
    """Names of the options in the C++ sources of a folder, from literals such as "-n,--frames"."""
    literals = [s for path in Path(folder).rglob("*.cpp") for s in re.findall(r'"(-[^" ]*)"', path.read_text())]
    return {name for literal in literals for name in re.findall(r"--[a-z][\w-]*", literal)}


PROGRAMS = {"maquette": options_of("sdk/tools"), "maquette-demo": options_of("desktop_demo/src")}
SUBCOMMANDS = {
    name
    for path in Path("sdk/tools").rglob("*.cpp")
    for name in re.findall(r'add_subcommand\(\s*"(\w+)"', path.read_text())
}


def codes(page: Path) -> list[tuple[int, str]]:
    """(line, text) of the page's code: indented and fenced lines, and what stands in backticks."""
    found, is_fenced = [], False
    for number, line in enumerate(page.read_text().splitlines(), 1):
        if line.startswith("```"):
            is_fenced = not is_fenced
        elif is_fenced or line.startswith("    "):
            found.append((number, line))
        else:
            found += [(number, text) for text in re.findall(r"`([^`]+)`", line)]
    return found


def wrong(page: Path, names: re.Pattern, is_there) -> list[str]:
    return [
        f"{page}:{line}: {match[0]}"
        for line, text in codes(page)
        for match in names.finditer(text)
        if not is_there(match)
    ]


def module_exists(match: re.Match) -> bool:
    path = Path(match[1].replace(".", "/"))
    return (
        path.with_suffix(".py").is_file()
        or (path / "__main__.py").is_file()
        or match[1] in ("pytest", "pip", "maquette")
    )


def file_exists(match: re.Match) -> bool:
    name = match[0].rstrip("/.")
    return any(Path().glob(name)) or "<" in name or "…" in name or name.startswith("docs/images/")


def symbol_exists(match: re.Match) -> bool:
    name = match[0]
    if name.endswith("_"):  # maq_pipeline_*
        return any(symbol.startswith(name) for symbol in SYMBOLS)
    return name in SYMBOLS or (name.isupper() and name in SETTINGS)


# Environment variables and CMake options.
SETTINGS = set()
for _name in TRACKED:
    if _name.startswith(
        ("sdk/", "cmake/", "python/", "CMakeLists.txt", "desktop_demo/", "scripts/", "tests/release/")
    ) and _name.endswith((".cpp", ".h", ".txt", ".cmake", ".py", ".sh")):
        SETTINGS.update(re.findall(r"\bMAQ_\w+", Path(_name).read_text()))


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_modules_that_a_page_runs_exist(page):
    assert wrong(page, re.compile(r"python3? -m ([\w.]+)"), module_exists) == []


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_files_that_a_page_names_exist(page):
    names = re.compile(rf"(?<![\w/.~-])(?:{FOLDERS})/[\w./*-]*(?![\w<…{{])")
    assert wrong(page, names, file_exists) == []


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_symbols_that_a_page_names_exist(page):
    assert wrong(page, re.compile(r"\b(?:maq|MAQ)_\w+"), symbol_exists) == []


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_commands_of_the_programs_that_a_page_shows_exist(page):
    faults = []
    for line, text in codes(page):
        for match in re.finditer(r"(?:^|[\s;]|bin/)(maquette(?:-demo)?)((?: +[^#;|&\n]+)?)", text):
            words = re.findall(r"'[^']*'|\S+", match[2])
            if match[1] == "maquette" and words and re.fullmatch(r"[a-z]+", words[0]) and words[0] not in SUBCOMMANDS:
                faults.append(f"{page}:{line}: maquette {words[0]}")
            options = [word.split("=")[0] for word in words if word.startswith("--") and len(word) > 2]
            faults += [
                f"{page}:{line}: {match[1]} {name}" for name in options if name not in PROGRAMS[match[1]] | {"--help"}
            ]
    assert faults == []


@pytest.mark.parametrize("page", [*GUIDES, Path("docs/reference/options.md")], ids=str)
def test_options_in_backticks_exist(page):
    known = set().union(*PROGRAMS.values()) | {"--help"}
    for name in TRACKED:
        if name.startswith(("export/", "quantization/", "benchmarks/", "scripts/")) and name.endswith((".py", ".sh")):
            known.update(re.findall(r"--[a-z][\w-]*", Path(name).read_text()))
    named = {name for _, text in codes(page) if text.startswith("--") for name in re.findall(r"--[a-z][\w-]*", text)}
    assert named - known == set()


def test_fields_in_the_table_of_options_exist():
    rows = [
        line.split("|")[2]
        for line in Path("docs/reference/options.md").read_text().splitlines()
        if line.startswith("| `--")
    ]
    fields = {name for cell in rows for name in re.findall(r"`([a-z_]+)`", cell)}
    assert len(fields) > 30
    assert {name for name in fields if not re.search(rf"\b{name}\b", HEADERS)} == set()


def test_every_status_is_explained():
    statuses = re.findall(
        r"^  (MAQ_\w+) = \d+", HEADERS.split("typedef enum maq_status")[1].split("}")[0], re.MULTILINE
    )
    explained = re.findall(r"^\| `(MAQ_\w+)`", Path("docs/reference/errors.md").read_text(), re.MULTILINE)
    assert sorted(explained) == sorted(statuses)


@pytest.mark.parametrize("page", GUIDES, ids=str)
def test_a_guide_is_short_and_begins_with_an_image_and_a_command(page):
    lines = page.read_text().splitlines()
    assert len(lines) <= 200
    assert any(line.startswith("![") for line in lines[:4])
    assert any(line.startswith("    ") for line in lines[:8])


def test_the_readme_is_short_and_every_page_is_in_the_index():
    assert len(Path("README.md").read_text().splitlines()) <= 130
    index = Path("docs/README.md").read_text()
    pages = [
        path.relative_to("docs").as_posix()
        for shelf in ("guide", "reference", "research")
        for path in sorted(Path("docs", shelf).rglob("*.md"))
    ]
    assert [page for page in pages if f"({page})" not in index] == []


def test_names_that_do_not_exist_are_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "`maq_nothing`, `MAQ_NO_THING`, `maq_pipeline_*`\n\n    python -m export.nothing\n    python -m export.photos\n"
    )
    assert [fault.split(": ")[1] for fault in wrong(page, re.compile(r"\b(?:maq|MAQ)_\w+"), symbol_exists)] == [
        "maq_nothing",
        "MAQ_NO_THING",
    ]
    assert len(wrong(page, re.compile(r"python3? -m ([\w.]+)"), module_exists)) == 1


def test_readmes_begin_with_a_heading():
    """A formatter for C++ that gets a README joins its lines and takes the space after `#`."""
    readmes = [name for name in TRACKED if Path(name).name == "README.md"]
    assert [name for name in readmes if not Path(name).read_text().startswith("# ")] == []
