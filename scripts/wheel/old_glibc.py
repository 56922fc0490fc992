"""Makes libraries to link against, with the symbols that glibc had in an old version, from the glibc of this machine.

    python3 scripts/wheel/old_glibc.py FOLDER [--prefix aarch64-linux-gnu-] [--version 2.28]

A newer glibc keeps every old version of its functions. The libraries here name, for each function, the newest of its
versions that is old enough. A program that is linked against them runs on that glibc and all newer ones. `compat.c`,
which becomes part of it, has the few functions that came later. The folder gets libc.so, libm.so, others that old
systems need, and compat.o and start.o.
"""

import argparse
import re
import subprocess
from pathlib import Path

HERE = Path(__file__).parent
# Each library by the name of its file, and its name at run time. Functions of libpthread and libdl moved to libc in
# 2.34; before, nothing else loads these two.
LIBRARIES = {
    "libc.so": "libc.so.6",
    "libm.so": "libm.so.6",
    "libpthread.so": "libpthread.so.0",
    "libdl.so": "libdl.so.2",
}
LOADER = {"x86_64": "ld-linux-x86-64.so.2", "aarch64": "ld-linux-aarch64.so.1"}  # libld.so
SYMBOL = re.compile(  # size, type, section, name, version
    r"\d+: +[0-9a-f]+ +(\d+) +(\w+) +(?:GLOBAL|WEAK) +DEFAULT +(\w+) +(\S+?)@@?GLIBC_([\d.]+)$", re.MULTILINE
)


def numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in version.split("."))


def old_symbols(library: str, limit: tuple[int, ...]) -> dict[str, tuple[str, str, int]]:
    """For each name: version, type and size of its newest old symbol."""
    listed = subprocess.run(["readelf", "--dyn-syms", "-W", library], check=True, capture_output=True, text=True).stdout
    found: dict[str, tuple[str, str, int]] = {}
    for size, kind, section, name, version in SYMBOL.findall(listed):
        if section == "UND" or kind == "TLS" or numbers(version) > limit:
            continue
        if name not in found or numbers(version) > numbers(found[name][0]):
            found[name] = (version, "object" if kind == "OBJECT" else "function", int(size))
    return found


def link(folder: Path, compiler: str, file: str, symbols: dict[str, tuple[str, str, int]]) -> None:
    lines = []
    for number, (name, (version, kind, size)) in enumerate(sorted(symbols.items())):
        label = f"maq_{number}"
        lines += [f'.section {".data" if kind == "object" else ".text"}', f".globl {label}", f".type {label}, %{kind}",
                  f"{label}: .zero {max(size, 8) if kind == 'object' else 4}", f".size {label}, {size}",
                  f".symver {label}, {name}@@GLIBC_{version}"]  # fmt: skip
    versions = sorted({version for version, _, _ in symbols.values()}, key=numbers)
    source, script = folder / f"{file}.s", folder / f"{file}.map"
    source.write_text("\n".join([*lines, '.section .note.GNU-stack,"",%progbits', ""]))
    script.write_text("".join(f"GLIBC_{version} {{ }};\n" for version in versions) or "{ local: *; };\n")
    command = [compiler, "-shared", "-nostdlib", f"-Wl,-soname,{LIBRARIES[file]}", f"-Wl,--version-script={script}"]
    subprocess.run([*command, "-o", folder / file, source], check=True)
    source.unlink()
    script.unlink()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--prefix", default="", help="of the compiler's name, with its final hyphen")
    parser.add_argument("--version", default="2.28")
    arguments = parser.parse_args()
    compiler = f"{arguments.prefix}gcc"
    arguments.folder.mkdir(parents=True, exist_ok=True)
    machine = subprocess.run([compiler, "-dumpmachine"], check=True, capture_output=True, text=True).stdout.split("-")[
        0
    ]
    LIBRARIES["libld.so"] = LOADER[machine]
    for file, soname in LIBRARIES.items():
        ask = [compiler, f"-print-file-name={soname}"]
        library = subprocess.run(ask, check=True, capture_output=True, text=True).stdout.strip()
        own = file not in ("libpthread.so", "libdl.so")
        link(arguments.folder, compiler, file, old_symbols(library, numbers(arguments.version)) if own else {})
    for source in ("compat", "start"):
        subprocess.run([compiler, "-O2", "-fPIC", "-ffp-contract=off", "-fno-builtin", "-fvisibility=hidden", "-Wall",
                        "-Wextra", "-Werror", "-c", HERE / f"{source}.c", "-o", arguments.folder / f"{source}.o"],
                       check=True)  # fmt: skip


if __name__ == "__main__":
    main()
