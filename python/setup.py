"""Puts into the wheel what pyproject.toml cannot say: the installed SDK, and the C API's declarations for cffi.

MAQ_INSTALLED: the folder that `cmake --install` wrote (`make wheel` sets it).
"""

import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py

sys.path.insert(0, str(Path(__file__).parent / "maquette"))
from declarations import write_module  # of the package, which cannot be imported without its library


class BuildWithLibrary(build_py):
    def run(self) -> None:
        super().run()
        installed = Path(os.environ.get("MAQ_INSTALLED", ""))
        library = installed / "lib/libmaquette.so"
        if not library.exists():
            sys.exit(f"{library} is not there. Run `make wheel`, or set MAQ_INSTALLED to what `cmake --install` wrote.")
        target = Path(self.build_lib) / "maquette"
        write_module(installed / "include/maquette", target / "_generated.py")
        (target / "lib").mkdir(exist_ok=True)
        shutil.copyfile(library, target / "lib/libmaquette.so")
        shutil.copytree(installed / "lib/maquette", target / "lib/maquette", dirs_exist_ok=True)
        for share in ("models", "licenses", "stub"):
            place = f"share/maquette/{share}"
            shutil.copytree(installed / place, target / place, dirs_exist_ok=True)
        for needed in _jpeg_libraries(library):
            shutil.copyfile(needed, target / "lib" / needed.name)
            licence = target / "share/maquette/licenses/libjpeg-turbo.txt"
            shutil.copyfile("/usr/share/doc/libturbojpeg0/copyright", licence)


def _jpeg_libraries(library: Path) -> list[Path]:
    """libjpeg-turbo, which few machines without a desktop have."""
    listed = subprocess.run(["ldd", str(library)], capture_output=True, text=True, check=True).stdout
    found = (line.split(" => ")[1].split(" (")[0] for line in listed.splitlines() if "libturbojpeg.so" in line)
    return [Path(path) for path in found]


class NativeDistribution(Distribution):
    def has_ext_modules(self) -> bool:
        return True


class NativeWheel(bdist_wheel):
    def get_tag(self) -> tuple[str, str, str]:
        """For any Python 3, and for systems with the C library of this one or a newer one."""
        _, version = platform.libc_ver()
        return "py3", "none", f"manylinux_{version.replace('.', '_')}_{platform.machine()}"


setup(
    distclass=NativeDistribution,
    cmdclass={"build_py": BuildWithLibrary, "bdist_wheel": NativeWheel},
)
