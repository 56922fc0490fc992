"""Installs the wheels in bare systems without compiler and network, and compares what they make with the release build.

sudo python3 -m tests.wheel [RELEASE ...]      bullseye, bookworm, trixie
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
PLATFORMS = ("manylinux_2_28_x86_64", "manylinux2014_x86_64", "manylinux_2_17_x86_64")
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


def fetch_packages(python: str) -> None:
    """Fetches what the wheels need from PyPI, once."""
    WHEELHOUSE.mkdir(parents=True, exist_ok=True)
    if any(WHEELHOUSE.glob(f"numpy-*-cp{python.replace('.', '')}-*")):
        return
    platforms = [word for platform in PLATFORMS for word in ("--platform", platform)]
    run(sys.executable, "-m", "pip", "download", "-q", "--only-binary=:all:", "--python-version", python, *platforms,
        "--dest", WHEELHOUSE, "numpy", "cffi", FFMPEG)  # fmt: skip


def bare_system(release: str) -> Path:
    folder = ROOTS / release
    if not (folder / ".ready").exists():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        run("debootstrap", "--variant=minbase", "--include=python3,python3-venv", release, folder, MIRROR,
            stdout=subprocess.DEVNULL)  # fmt: skip
        (folder / ".ready").touch()
    return folder


def expected_files(out: Path) -> None:
    """By the release build and this checkout's Python package."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    release = ROOT / "build/release/stage"
    ffmpeg = out.parent / "ffmpeg"
    with zipfile.ZipFile(next(WHEELHOUSE.glob("imageio_ffmpeg-*"))) as archive:
        program = next(name for name in archive.namelist() if "/binaries/ffmpeg" in name)
        ffmpeg.write_bytes(archive.read(program))
    ffmpeg.chmod(0o755)
    environment = os.environ | {"PATH": f"{release / 'bin'}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT / "python"),
                                "MAQ_FFMPEG": str(ffmpeg)}  # fmt: skip
    media = ROOT / "tests/media"
    run("sh", HERE / "first_minute.sh", media, out, env=environment, stdout=subprocess.DEVNULL)
    run(ROOT / ".venv/bin/python", HERE / "first_minute.py", media, out, env=environment)


def made_files(release: str, work: Path) -> float:
    """Returns the seconds of installation and commands; the files are in work/out."""
    system = bare_system(release)
    shutil.rmtree(work, ignore_errors=True)
    (work / "wheels").mkdir(parents=True)
    (work / "out").mkdir()
    for wheel in [*WHEELHOUSE.glob("*.whl"), *(ROOT / "build/wheel").glob("*.whl")]:
        if "aarch64" not in wheel.name:
            os.link(wheel, work / "wheels" / wheel.name)
    shutil.copytree(ROOT / "tests/media", work / "media")
    for script in ("first_minute.sh", "first_minute.py"):
        shutil.copy(HERE / script, work)
    (system / "test").mkdir(exist_ok=True)
    mounts = f'mount --bind "{work}" "{system}/test" && mount -t proc proc "{system}/proc"'
    enter = f'{mounts} && exec chroot "{system}" sh -c "$1"'
    begin = time.monotonic()
    run("unshare", "--mount", "--net", "--pid", "--fork", "sh", "-c", enter, "sh", INSTALL,
        env={"HOME": "/root", "PATH": "/usr/sbin:/usr/bin:/sbin:/bin"})  # fmt: skip
    return time.monotonic() - begin


def main() -> int:
    releases = sys.argv[1:] or list(PYTHONS)
    if os.geteuid() != 0:
        sys.exit("Bare systems are made and entered by root: run it by sudo.")
    for release in releases:
        fetch_packages(PYTHONS[release])
    expected = ROOT / "build/test-wheel/expected"
    expected_files(expected)
    failed = 0
    for release in releases:
        work = ROOT / f"build/test-wheel/{release}"
        seconds = made_files(release, work)
        names = sorted(path.name for path in expected.iterdir())
        assert names == sorted(path.name for path in (work / "out").iterdir())
        other = [name for name in names if (expected / name).read_bytes() != (work / "out" / name).read_bytes()]
        equal = f"{len(names) - len(other)} of {len(names)} files equal the release build's"
        print(f"{'FAILED' if other else 'ok'}  {release}: {seconds:.0f} s; {equal} {other[:8] or ''}", flush=True)
        failed += bool(other)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
