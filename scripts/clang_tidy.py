"""Runs clang-tidy on the C++ sources of a build, on every processor, and only where something changed.

    python scripts/clang_tidy.py [--build build/lint] FILE...        (in the project's root)

A file is checked together with those that the build compiles with it, and again when one of them, a header that they
include, their compile command, .clang-tidy or clang-tidy itself changed: the stamps under ~/.cache/maquette/clang-tidy
(XDG_CACHE_HOME is obeyed) hold the hashes of a clean run, for all checkouts of this machine. Files that the build does
not compile are named and left out. Exit status 1 when clang-tidy has something to say.
"""

from __future__ import annotations

import argparse
import functools
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path


def cache_folder() -> Path:
    """Where this user's programs keep what can be made again."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "maquette"


@functools.cache
def hash_of(path: Path) -> str:
    """Returns the SHA-256 of a file's bytes; of no bytes if the file is missing."""
    return hashlib.sha256(path.read_bytes() if path.is_file() else b"").hexdigest()


@dataclass(frozen=True)
class Compilation:
    """How the build compiles `sources` together: `words` is the command, run in `folder`, of the file `unit`."""

    sources: tuple[Path, ...]
    unit: Path
    folder: Path
    words: tuple[str, ...]

    def dependencies(self) -> list[Path]:
        """The sources and every header that they include."""
        words, skip = [], False
        for word in self.words:
            if skip or word in ("-c", "-o"):
                skip = word == "-o"
                continue
            words.append(word)
        rule = subprocess.run([*words, "-M"], cwd=self.folder, capture_output=True, text=True, check=True).stdout
        names = rule.replace("\\\n", " ").split(":", 1)[1].split()
        included = [self.folder / name for name in names if self.folder / name != self.unit]
        return [*included, *self.sources]


def compilations(build: Path) -> list[Compilation]:
    """The commands of a build, without a compiler cache before them. What CMake compiles as one (UNITY_BUILD) is
    checked as one, in half the time of one by one; the analyzer follows functions of included sources where the file
    that includes them is called UnifiedSource."""
    found = []
    for entry in json.loads((build / "compile_commands.json").read_text()):
        words = shlex.split(entry["command"])
        cache = next((i for i, word in enumerate(words) if Path(word).name == "ccache"), -1)
        words = words[cache + 1 :]
        unit = Path(entry["file"])
        sources = (unit.resolve(),)
        if unit.parent.name == "Unity":
            text = unit.read_text()
            sources = tuple(Path(name).resolve() for name in re.findall(r'^#include "(.+)"$', text, re.MULTILINE))
            unit = unit.with_name(f"UnifiedSource-{unit.stem}.cpp")
            if not unit.is_file() or unit.read_text() != text:
                unit.write_text(text)
        command = tuple(str(unit) if word == entry["file"] else word for word in words)
        found.append(Compilation(sources, unit, Path(entry["directory"]), command))
    return found


class Checker:
    """Checks compilations and remembers the clean ones in `stamps`, by paths that do not tell where the checkout is."""

    def __init__(self, stamps: Path, root: Path):
        self.stamps, self.root = stamps, root
        stamps.mkdir(parents=True, exist_ok=True)
        self.version = subprocess.run(["clang-tidy", "--version"], capture_output=True, text=True, check=True).stdout

    def stamp(self, compilation: Compilation) -> Path:
        settings = [hash_of(folder / ".clang-tidy") for folder in compilation.sources[0].parents]
        key = "\0".join([self.version, *settings, *map(str, compilation.sources), *compilation.words])
        key = key.replace(str(self.root), ".")
        return self.stamps / f"{hashlib.sha256(key.encode()).hexdigest()[:32]}.json"

    def is_known_clean(self, compilation: Compilation) -> bool:
        stamp = self.stamp(compilation)
        if not stamp.is_file():
            return False
        return all(hash_of(self.root / path) == wanted for path, wanted in json.loads(stamp.read_text()).items())

    def check(self, compilation: Compilation) -> str:
        """Returns clang-tidy's messages for the sources; nothing when they are clean."""
        if self.is_known_clean(compilation):
            return ""
        paths = [Path(os.path.normpath(path)) for path in compilation.dependencies()]
        hashes = {
            str(path.relative_to(self.root) if path.is_relative_to(self.root) else path): hash_of(path)
            for path in paths
        }
        command = ["clang-tidy", "--quiet", "--warnings-as-errors=*", str(compilation.unit)]
        if compilation.unit.name.startswith("UnifiedSource"):
            command.insert(1, "--checks=-bugprone-suspicious-include")  # which is of sources that are included
        ran = subprocess.run(
            [*command, "--", *compilation.words[1:]], cwd=compilation.folder, capture_output=True, text=True
        )
        if ran.returncode == 0:
            self.stamp(compilation).write_text(json.dumps(hashes))
            return ""
        return ran.stdout or ran.stderr or f"clang-tidy ended with status {ran.returncode} on {compilation.unit}\n"


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=Path, default=Path("build/lint"))
    parser.add_argument("files", type=Path, nargs="+", metavar="FILE")
    options = parser.parse_args(arguments)
    known = compilations(options.build)
    wanted = {path.resolve() for path in options.files}
    for path in sorted(wanted.difference(*(compilation.sources for compilation in known))):
        print(f"not checked: {path}, which {options.build} does not compile")
    chosen: list[Compilation] = []
    for compilation in sorted(known, key=lambda compilation: len(compilation.sources), reverse=True):
        if wanted.intersection(compilation.sources):  # else another has checked them
            chosen.append(compilation)
            wanted.difference_update(compilation.sources)
    checker = Checker(cache_folder() / "clang-tidy", Path.cwd())
    failed = 0
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for text in pool.map(checker.check, chosen):
            failed += bool(text)
            print(text, end="", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
