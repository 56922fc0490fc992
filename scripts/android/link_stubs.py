"""Makes link stubs of Android's own libraries for one ABI, where there is no NDK.

    python3 scripts/android/link_stubs.py --abi arm64-v8a --out FOLDER --libraries libonnxruntime.so libc++_shared.so \
        --more tests/android/bionic.txt

A stub has the name of a library and of its functions, and nothing in them: enough to link against, so that a function
that Android does not have is an error of the linker. Which functions there are is read off the imports of libraries
that were made for Android; `--more` names further ones.
"""

import argparse
import subprocess
from pathlib import Path

TARGETS = {"arm64-v8a": "aarch64-linux-android26", "x86_64": "x86_64-linux-android26"}
# Other names are of the C library. (libm and libdl are apart on Android; which of the three has a name is not checked.)
PREFIXES = {"liblog": "__android_log_", "libandroid": "A", "libz": ("inflate", "deflate")}


def symbols(library: Path) -> tuple[set[str], set[str]]:
    """Names that a shared library imports, and those that it exports."""
    command = ["readelf", "--wide", "--dyn-syms", library]
    imported, exported = set(), set()
    for line in subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines():
        columns = line.split()
        if len(columns) < 8 or not columns[0].endswith(":"):
            continue
        name = columns[7].split("@")[0]
        if columns[6] == "UND":
            imported.add(name)
        elif columns[4] in ("GLOBAL", "WEAK"):
            exported.add(name)
    return imported, exported


def library_of(name: str) -> str:
    for library, prefix in PREFIXES.items():
        if name.startswith(prefix) and (prefix != "A" or name[1:2].isupper()):
            return library
    return "libc"


def write_stub(out: Path, library: str, names: set[str], target: str) -> None:
    # As assembly: a compiler would object to functions that it knows by other types.
    lines = [f".globl {name}\n.type {name}, %function\n{name}:" for name in sorted(names)]
    source = out / f"{library}.s"
    source.write_text(".text\n" + "\n".join(lines) + "\n")
    command = ["clang-14", f"--target={target}", "-shared", "-nostdlib", "-fuse-ld=lld-14", f"-Wl,-soname,{library}.so"]
    subprocess.run([*command, source, "-o", out / f"{library}.so"], check=True)
    source.unlink()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--abi", choices=TARGETS, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--libraries", type=Path, nargs="+", required=True, help="made for Android and this ABI")
    parser.add_argument("--more", type=Path, required=True, help="names, one a line; # begins a comment")
    arguments = parser.parse_args()

    imported, exported = set(), set()
    for library in arguments.libraries:
        needs, has = symbols(library)
        imported |= needs
        exported |= has
    lines = (line.split("#")[0].split() for line in arguments.more.read_text().splitlines())
    names = {name for name in imported - exported if name} | {words[0] for words in lines if words}
    stubs = {"libc": set(), "libm": set(), "libdl": set(), **{library: set() for library in PREFIXES}}
    for name in names:
        stubs[library_of(name)].add(name)
    for library, of_it in stubs.items():
        write_stub(arguments.out, library, of_it, TARGETS[arguments.abi])


if __name__ == "__main__":
    main()
