"""Puts into the wheel what pyproject.toml cannot say: the installed SDK, and the C API's declarations for cffi.

MAQ_INSTALLED: the folder that `cmake --install` wrote. MAQ_CODECS: static codecs, for their licences. MAQ_SAMPLES:
files to try things with. MAQ_PLATFORM: the wheel's platform. `make wheel` sets all of them.
"""

import os
import platform
import shutil
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
        for folder in ("bin", "lib", "share/maquette/licenses", "share/maquette/samples"):
            (target / folder).mkdir(parents=True, exist_ok=True)
        program = installed / "bin/maquette"
        # By the name under which the command line looks for it.
        shutil.copyfile(library, target / "lib" / ".".join(library.resolve().name.split(".")[:4]))
        shutil.copytree(installed / "lib/maquette", target / "lib/maquette", dirs_exist_ok=True)
        shutil.copy(program, target / "bin/maquette")
        for share in ("licenses", "stub"):
            place = f"share/maquette/{share}"
            shutil.copytree(installed / place, target / place, dirs_exist_ok=True)
        for name in os.environ.get("MAQ_SAMPLES", "").split():
            shutil.copy(name, target / "share/maquette/samples")
        self._copy_licences(target / "share/maquette/licenses")

    def _copy_licences(self, target: Path) -> None:
        """Adds the licences of libraries that only wheels have inside."""
        codecs = os.environ.get("MAQ_CODECS")
        if codecs:
            shutil.copyfile("/usr/share/doc/libstdc++6/copyright", target / "libstdc++.txt")
            for licence in Path(codecs).glob("licenses/*.txt"):
                shutil.copyfile(licence, target / licence.name)


class NativeDistribution(Distribution):
    def has_ext_modules(self) -> bool:
        return True


class NativeWheel(bdist_wheel):
    def get_tag(self) -> tuple[str, str, str]:
        """For any Python 3, and for the systems that MAQ_PLATFORM says, else those as new as this one."""
        _, version = platform.libc_ver()
        return (
            "py3",
            "none",
            os.environ.get("MAQ_PLATFORM") or f"manylinux_{version.replace('.', '_')}_{platform.machine()}",
        )


setup(
    distclass=NativeDistribution,
    cmdclass={"build_py": BuildWithLibrary, "bdist_wheel": NativeWheel},
)
