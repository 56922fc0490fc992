"""Runs clang-tidy on the C++ sources of a build, on every processor, and only where something changed.

    python scripts/clang_tidy.py [--build build/release] FILE...

A file is checked again when it, a header it includes, its compile command, .clang-tidy or clang-tidy itself changed:
the stamps under BUILD/clang-tidy hold the hashes of a clean run. Files that the build does not compile are named and
left out. Exit status 1 when clang-tidy has something to say.
"""

from __future__ import annotations

import argparse
import functools
import hashlib
import json
import os
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path


@functools.cache
def hash_of(path: Path) -> str:
    """Of a file's bytes; of a missing file, of nothing."""
    return hashlib.sha256(path.read_bytes() if path.is_file() else b"").hexdigest()


@dataclass(frozen=True)
class Compilation:
    """How the build compiles one source: `words` is the command, run in `folder`."""

    source: Path
    folder: Path
    words: tuple[str, ...]

    def dependencies(self) -> list[Path]:
        """The source and every header that it includes."""
        words, skip = [], False
        for word in self.words:
            if skip or word in ("-c", "-o"):
                skip = word == "-o"
                continue
            words.append(word)
        rule = subprocess.run([*words, "-M"], cwd=self.folder, capture_output=True, text=True, check=True).stdout
        return [self.folder / name for name in rule.replace("\\\n", " ").split(":", 1)[1].split()]


def compilations(build: Path) -> dict[Path, Compilation]:
    """The commands of a build by source, without a compiler cache before them."""
    found = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        words = shlex.split(entry["command"])
        if Path(words[0]).name == "ccache":
            words = words[1:]
        source = Path(entry["file"]).resolve()
        found[source] = Compilation(source, Path(entry["directory"]), tuple(words))
    return found


class Checker:
    """Checks sources and remembers the clean ones in `stamps`."""

    def __init__(self, build: Path, stamps: Path):
        self.build, self.stamps = build, stamps
        stamps.mkdir(parents=True, exist_ok=True)
        self.version = subprocess.run(["clang-tidy", "--version"], capture_output=True, text=True, check=True).stdout

    def stamp(self, compilation: Compilation) -> Path:
        settings = [hash_of(folder / ".clang-tidy") for folder in compilation.source.parents]
        key = "\0".join([self.version, *settings, str(compilation.source), *compilation.words])
        return self.stamps / f"{hashlib.sha256(key.encode()).hexdigest()[:32]}.json"

    def is_known_clean(self, compilation: Compilation) -> bool:
        stamp = self.stamp(compilation)
        if not stamp.is_file():
            return False
        return all(hash_of(Path(path)) == wanted for path, wanted in json.loads(stamp.read_text()).items())

    def check(self, compilation: Compilation) -> str:
        """What clang-tidy says of a source; nothing when it is clean."""
        if self.is_known_clean(compilation):
            return ""
        hashes = {str(path): hash_of(path) for path in compilation.dependencies()}
        command = ["clang-tidy", "-p", str(self.build), "--quiet", "--warnings-as-errors=*", str(compilation.source)]
        ran = subprocess.run(command, capture_output=True, text=True)
        if ran.returncode == 0:
            self.stamp(compilation).write_text(json.dumps(hashes))
            return ""
        return ran.stdout or ran.stderr or f"clang-tidy ended with status {ran.returncode} on {compilation.source}\n"


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=Path, default=Path("build/release"))
    parser.add_argument("files", type=Path, nargs="+", metavar="FILE")
    options = parser.parse_args(arguments)
    known = compilations(options.build)
    wanted = [path.resolve() for path in options.files]
    for path in wanted:
        if path not in known:
            print(f"not checked: {path}, which {options.build} does not compile")
    checker = Checker(options.build, options.build / "clang-tidy")
    failed = 0
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for text in pool.map(checker.check, [known[path] for path in wanted if path in known]):
            failed += bool(text)
            print(text, end="", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
