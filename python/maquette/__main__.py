"""`python -m maquette`: the command line of the SDK, `maquette`, and `scene make`, which needs packages of Python."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from maquette.native import library_path, name_ffmpeg


def program() -> Path | None:
    """The program beside the library, in the folder of an installation, a wheel or a checkout's build."""
    name = "maquette.exe" if os.name == "nt" else "maquette"
    library = library_path()
    places = (library.parent.parent / "bin" / name, library.parent / name)
    return next((place for place in places if place.exists()), None)


def main() -> int:
    if sys.argv[1:3] == ["scene", "make"]:
        from maquette.scene_making.command import run

        return run(sys.argv[3:])
    found = program()
    if found is None:
        print(
            f"maquette: the command line is not beside {library_path()}. Build the SDK (make build).", file=sys.stderr
        )
        return 1
    name_ffmpeg()
    arguments = [str(found), *sys.argv[1:]]
    if os.name == "nt":
        return subprocess.run(arguments, check=False).returncode
    os.execv(found, arguments)


if __name__ == "__main__":
    sys.exit(main())
