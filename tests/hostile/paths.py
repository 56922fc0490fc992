"""Paths that lead to what is no file, and names that are no text; as input and as output."""

import os
import socket
from collections.abc import Callable
from pathlib import Path
from random import Random

from tests.hostile.samples import CAPTURE, DENSEPOSE, HEAD, PEOPLE_BUNDLE, SCENE_BUNDLE, Samples
from tests.hostile.trial import EITHER, REFUSED, WORKS, Trial


def _socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listener:
        here = os.open(path.parent, os.O_RDONLY)  # names of sockets are short
        listener.bind(f"/proc/self/fd/{here}/{path.name}")
        os.close(here)


def _huge(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(1 << 40)  # takes no room


def _unreadable(path: Path) -> None:
    path.write_bytes(b"x")
    path.chmod(0)


SPECIAL: dict[str, Callable[[Path], None]] = {
    "nothing": lambda path: None,
    "an empty file": lambda path: path.write_bytes(b""),
    "a folder": lambda path: path.mkdir(),
    "a FIFO without a writer": lambda path: os.mkfifo(path),
    "a socket": _socket,
    "a link to itself": lambda path: path.symlink_to(path.name),
    "a link to nothing": lambda path: path.symlink_to("gone"),
    "a link to /dev/zero": lambda path: path.symlink_to("/dev/zero"),
    "a link to /dev/full": lambda path: path.symlink_to("/dev/full"),
    "a link to /dev/null": lambda path: path.symlink_to("/dev/null"),
    "a link to /dev/tty": lambda path: path.symlink_to("/dev/tty"),
    "a link to /dev/urandom": lambda path: path.symlink_to("/dev/urandom"),
    "a link to /proc/self/mem": lambda path: path.symlink_to("/proc/self/mem"),
    "a link to /proc/self/maps": lambda path: path.symlink_to("/proc/self/maps"),
    "a file of a tebibyte of zeros": _huge,
    "a file that may not be read": _unreadable,
}
SCENE = ("--bundle", str(SCENE_BUNDLE))
SHOW = ("--path", "orbit", "--seconds", "0.1", "--size", "48x32", "--threads", "1")
# Commands that read {}.
INPUTS = (
    (*DENSEPOSE, "{}"), (*DENSEPOSE, "image:{}"), (*DENSEPOSE, "video:{}"), (*DENSEPOSE, "rec:{}"),
    (*DENSEPOSE, "file:{}"), (*DENSEPOSE, "v4l2:{}"), ("record", "{}", "b.maqrec", "--frames", "1"),
    ("densepose", "a.jpg", "--out", "out", "--bundle", "{}"), ("scene", "build", "{}", *SCENE, "--out", "b.maqs"),
    ("scene", "info", "{}"), ("scene", "render", "{}", *SCENE, *SHOW, "--out", "b.mp4"),
    ("scene", "render", "a.maqs", *SCENE, "--views", "all", "--capture", "{}", "--out", "b"),
    ("bench", "{}", "--bundle", str(PEOPLE_BUNDLE), "--runs", "1", "--seconds", "0", "--warm-up", "0"),
    ("head", "{}", *HEAD[2:], "--out", "b.glb"), ("head", "info", "{}"),
    ("head", "a.jpg", "--bundle", "{}", *HEAD[4:], "--out", "b.glb"),
)  # fmt: skip
# Commands that write {}.
OUTPUTS = (
    ("record", "a.jpg", "{}", "--frames", "1"), ("scene", "build", str(CAPTURE), *SCENE, "--out", "{}"),
    ("scene", "build", str(CAPTURE), *SCENE, "--out", "b.maqs", "--ply", "{}"),
    ("scene", "render", "a.maqs", *SCENE, *SHOW, "--out", "{}"),
    ("scene", "info", "a.maqs", "--json", "{}"), (*DENSEPOSE[:-1], "{}", "a.jpg", "--overlay"),
    ("play", "a.maqrec", "--no-image", "--json", "{}"), (*HEAD, "--save", "{}"),
)  # fmt: skip
NAMES: tuple[bytes, ...] = (
    b"a b", b"a\nb", b"a\tb", b"\x1b[31mred", b"\xff\xfe", b"caf\xe9", "ä€😀".encode(), "\u202egpj".encode(), b"%41",
    b"%", b"%00", b"a%20b", b"-", b"--", b"--help", b"-o", b"a?b", b"a?size=1x1", b"a&b=c", b"a=b", b"a:b",
    b"stub:people", b"~", b"$HOME", b"*", b"'", b'"', b"\\", b"{}", b"%s%n", b"a" * 240, b".hidden", b"...",
    "e\u0301".encode(),
)  # fmt: skip


def _prepared(samples: Samples, place: Callable[[Path], None]):
    def prepare(folder: Path) -> None:
        (folder / "a.jpg").write_bytes(samples.images["baseline.jpg"])
        (folder / "a.maqrec").write_bytes(samples.recordings["raw.maqrec"])
        (folder / "a.maqs").write_bytes(samples.scenes["8.maqs"])
        place(folder)

    return prepare


def _filled(words: tuple[str, ...], name: bytes) -> tuple[bytes, ...]:
    return tuple(word.encode().replace(b"{}", name) for word in words)


def inputs(samples: Samples, rng: Random, index: int) -> Trial:
    cases = [(words, what) for words in INPUTS for what in SPECIAL]
    words, what = cases[index % len(cases)]
    prepare = _prepared(samples, lambda folder: SPECIAL[what](folder / "it"))
    return Trial("paths", f"{what}: {' '.join(words)[:60]}", _filled(words, b"it"), prepare, REFUSED, as_user=True)


def outputs(samples: Samples, rng: Random, index: int) -> Trial:
    cases = [(words, what) for words in OUTPUTS for what in (*SPECIAL, "a missing folder")]
    words, what = cases[index % len(cases)]
    name = b"none/it" if what == "a missing folder" else b"it"
    prepare = _prepared(samples, lambda folder: SPECIAL.get(what, SPECIAL["nothing"])(folder / "it"))
    expects = REFUSED if what == "a link to /dev/full" else EITHER
    return Trial("paths", f"to {what}: {' '.join(words)[:60]}", _filled(words, name), prepare, expects, as_user=True)


def names(samples: Samples, rng: Random, index: int) -> Trial:
    """Images with odd names, which are read all the same; given as ./name, as who uses a shell does."""
    name = NAMES[index % len(NAMES)] + b".jpg"

    def place(folder: Path) -> None:
        (folder / os.fsdecode(name)).write_bytes(samples.images["baseline.jpg"])

    words: tuple[str | bytes, ...] = (*DENSEPOSE, b"./" + name)
    expects = EITHER if b"?" in name or b"%" in name else WORKS  # options and escapes of a URI
    if index // len(NAMES) % 2:
        words, expects = (*DENSEPOSE, "--json", b"image:" + name), EITHER
    return Trial("names", repr(name)[:60], words, _prepared(samples, place), expects)


def written_names(samples: Samples, rng: Random, index: int) -> Trial:
    name = NAMES[index % len(NAMES)]
    words = rng.choice(OUTPUTS)
    filled = tuple(word.encode().replace(b"{}", b"./" + name + b".x") for word in words)
    return Trial("names", f"to {name!r:.40}: {' '.join(words)[:40]}", filled, _prepared(samples, lambda folder: None))
