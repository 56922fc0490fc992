"""Installs the wheels in bare systems without compiler and network, and compares what they make with the release build.

sudo python3 -m tests.wheel [SYSTEM ...]      bullseye, bookworm, trixie, bookworm-aarch64

Without names: all systems whose wheels are in build/wheel. bookworm-aarch64 runs under qemu, and is compared with
build/aarch64 (scripts/test-isa.sh builds it).
"""

import os
import shutil
import subprocess
import sys
import time
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERE = ROOT / "tests/wheel"
ROOTS, WHEELHOUSE = ROOT / ".deps/roots", ROOT / ".deps/wheelhouse"
PYTHONS = {"bullseye": "3.9", "bookworm": "3.11", "trixie": "3.13"}
SYSTEMS = (*PYTHONS, "bookworm-aarch64")
PLATFORMS = ("manylinux_2_28", "manylinux2014", "manylinux_2_17")
EMULATOR = Path("/usr/lib/binfmt.d/qemu-aarch64.conf")  # how Linux starts aarch64 programs, by qemu-user-static
EMULATED = Path("/proc/sys/fs/binfmt_misc")
COLMAP = "pycolmap==4.2.1"  # of scenes; wheels are for Python 3.10 and newer on x86-64
FFMPEG = "imageio-ffmpeg==0.6.0"  # one for all: other versions may round colours of clips otherwise
MIRROR = os.environ.get("DEBIAN_MIRROR", "http://deb.debian.org/debian")
INSTALL = """
set -e
python3 -m venv /test/venv
/test/venv/bin/pip install -q --no-index --find-links /test/wheels 'maquette[all,clips]'
export PATH=/test/venv/bin:/usr/bin:/bin
! command -v cc gcc
sh /test/first_minute.sh /test/media /test/out
python /test/first_minute.py /test/media /test/out
"""


def run(*words: object, **options: object) -> None:
    subprocess.run([str(word) for word in words], check=True, **options)


def parts(system: str) -> tuple[str, str]:
    """Debian's release and the machine of a system."""
    release, _, machine = system.partition("-")
    return release, machine or "x86_64"


def wheels_of(machine: str, folder: Path) -> list[Path]:
    other = {"x86_64": "aarch64", "aarch64": "x86_64"}[machine]
    return [wheel for wheel in folder.glob("*.whl") if other not in wheel.name]


def emulate_aarch64() -> None:
    if not (EMULATED / "register").exists():
        run("mount", "-t", "binfmt_misc", "none", EMULATED)
    if not (EMULATED / "qemu-aarch64").exists():
        (EMULATED / "register").write_text(EMULATOR.read_text())


def fetch_packages(system: str) -> None:
    """Fetches what the wheels need from PyPI, once."""
    release, machine = parts(system)
    python = PYTHONS[release]
    WHEELHOUSE.mkdir(parents=True, exist_ok=True)
    if any(WHEELHOUSE.glob(f"numpy-*-cp{python.replace('.', '')}-*{machine}.whl")):
        return
    platforms = [word for platform in PLATFORMS for word in ("--platform", f"{platform}_{machine}")]
    colmap = [COLMAP] if machine == "x86_64" and python != "3.9" else []
    run(sys.executable, "-m", "pip", "download", "-q", "--only-binary=:all:", "--python-version", python, *platforms,
        "--dest", WHEELHOUSE, "numpy", "cffi", FFMPEG, *colmap)  # fmt: skip


def bare_system(system: str) -> Path:
    release, machine = parts(system)
    folder = ROOTS / system
    if not (folder / ".ready").exists():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        run("debootstrap", "--variant=minbase", "--include=python3,python3-venv",
            f"--arch={'arm64' if machine == 'aarch64' else 'amd64'}", release, folder, MIRROR,
            stdout=subprocess.DEVNULL)  # fmt: skip
        (folder / ".ready").touch()
    return folder


def expected_files(machine: str, out: Path) -> None:
    """By the release build or, for aarch64, the aarch64 build; and by this checkout's Python package."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    programs = out.parent / f"programs-{machine}"
    programs.mkdir(exist_ok=True)
    ffmpeg = programs / "ffmpeg"
    with zipfile.ZipFile(next(WHEELHOUSE.glob(f"imageio_ffmpeg-*{machine}.whl"))) as archive:
        name = next(name for name in archive.namelist() if "/binaries/ffmpeg" in name)
        ffmpeg.write_bytes(archive.read(name))
    ffmpeg.chmod(0o755)
    build, emulator = "release", ""
    if machine == "aarch64":
        build, emulator = "aarch64", f'qemu-aarch64 -L "{ROOT}/.deps/aarch64-sysroot"'
    (programs / "maquette").write_text(f'#!/bin/sh\nexec {emulator} "{ROOT}/build/{build}/stage/bin/maquette" "$@"\n')
    (programs / "maquette").chmod(0o755)
    environment = os.environ | {"PATH": f"{programs}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT / "python"),
                                "MAQ_FFMPEG": str(ffmpeg)}  # fmt: skip
    media = ROOT / "tests/media"
    run("sh", HERE / "first_minute.sh", media, out, env=environment, stdout=subprocess.DEVNULL)
    run(ROOT / ".venv/bin/python", HERE / "first_minute.py", media, out, env=environment)


def made_files(system: str, work: Path) -> float:
    """Returns the seconds of installation and commands; the files are in work/out."""
    folder = bare_system(system)
    machine = parts(system)[1]
    shutil.rmtree(work, ignore_errors=True)
    (work / "wheels").mkdir(parents=True)
    (work / "out").mkdir()
    for wheel in wheels_of(machine, WHEELHOUSE) + wheels_of(machine, ROOT / "build/wheel"):
        os.link(wheel, work / "wheels" / wheel.name)
    shutil.copytree(ROOT / "tests/media", work / "media")
    for script in ("first_minute.sh", "first_minute.py"):
        shutil.copy(HERE / script, work)
    (folder / "test").mkdir(exist_ok=True)
    mounts = f'mount --bind "{work}" "{folder}/test" && mount -t proc proc "{folder}/proc"'
    # ONNX Runtime learns from /sys what an aarch64 processor can do, and takes other kernels without it.
    mounts += f' && mount --bind /sys "{folder}/sys"'
    enter = f'{mounts} && exec chroot "{folder}" sh -c "$1"'
    begin = time.monotonic()
    run("unshare", "--mount", "--net", "--pid", "--fork", "sh", "-c", enter, "sh", INSTALL,
        env={"HOME": "/root", "PATH": "/usr/sbin:/usr/bin:/sbin:/bin"})  # fmt: skip
    return time.monotonic() - begin


def main() -> int:
    machines = {
        machine for machine in ("x86_64", "aarch64") if any((ROOT / "build/wheel").glob(f"maquette-*{machine}.whl"))
    }
    systems = sys.argv[1:] or [system for system in SYSTEMS if parts(system)[1] in machines]
    if os.geteuid() != 0:
        sys.exit("Bare systems are made and entered by root: run it by sudo.")
    failed = 0
    for system in systems:
        machine = parts(system)[1]
        if machine == "aarch64":
            emulate_aarch64()
        fetch_packages(system)
        expected = ROOT / f"build/test-wheel/expected-{machine}"
        if system == next(other for other in systems if parts(other)[1] == machine):
            expected_files(machine, expected)
        work = ROOT / f"build/test-wheel/{system}"
        seconds = made_files(system, work)
        names = sorted(path.name for path in expected.iterdir())
        assert names == sorted(path.name for path in (work / "out").iterdir())
        other = [name for name in names if (expected / name).read_bytes() != (work / "out" / name).read_bytes()]
        equal = f"{len(names) - len(other)} of {len(names)} files equal those of the build for {machine}"
        print(f"{'FAILED' if other else 'ok'}  {system}: {seconds:.0f} s; {equal} {other[:8] or ''}", flush=True)
        failed += bool(other)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
