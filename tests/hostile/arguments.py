"""URIs, options of every command, and the environment, with values that no one means."""

import re
import subprocess
from functools import cache
from pathlib import Path
from random import Random

from tests.hostile.samples import CAPTURE, DENSEPOSE, HEAD, PEOPLE_BUNDLE, SCENE_BUNDLE, Samples
from tests.hostile.trial import EITHER, REFUSED, Trial

SCHEMES = ("stub:people", "stub:pattern", "stub:", "stub:x", "image:a.jpg", "video:a.mp4", "rec:a.maqrec", "file:a.jpg",
           "a.jpg", "v4l2:/dev/tty", "v4l2:/dev/null", "v4l2:0", "v4l2:99", "libcamera:0", "depthai:", "depthai:x",
           "android:0", "camera:", "http://localhost/a.jpg", "file:///a.jpg", ":", "", "image:",
           "IMAGE:a.jpg")  # fmt: skip
# Waits are short: a stall, or a second between frames, is no hang.
KEYS = ("size", "count", "seed", "frames", "from", "to", "drop", "corrupt", "fault_seed", "exposure", "gain", "loop",
        "format", "nonsense", "", "%73ize", "size%00")  # fmt: skip
VALUES = ("", "0", "-1", "1", "nan", "inf", "1e400", "1e-320", "4294967296", "99999999999999999999", "0x0", "1x0",
          "0x10", "1x1", "99999x99999", "-1x-1", "640x", "x", "640x480x3", "1.5x2", "%", "%0", "%zz", "%00", "%ff%fe",
          "a&b", "a=b", "?", "\x1b[2J", "ä", "１", " 1", "1 ", "1,5", "9" * 500)  # fmt: skip
OPTION_VALUES = ("", " ", "-1", "0", "1", "nan", "inf", "-inf", "1e400", "0x10", "010", "1e1", "99999999999999999999",
                 "-99999999999999999999", "1,5", "１", "1 2", "1x", "..", "/", "\x1b[31mred", "%n%s", "A" * 1000,
                 b"\xff\xfe", "\n", "--help", "-")  # fmt: skip
ENVIRONMENT = ("MAQ_BUNDLE", "MAQ_SCENE_BUNDLE", "MAQ_HEADS_BUNDLE", "MAQ_ONNXRUNTIME_LIB", "LC_ALL", "LANG", "HOME",
               "TMPDIR", "TERM", "COLUMNS", "OPENCV_LOG_LEVEL", "TZ")  # fmt: skip
PLACES = ("", "/", ".", "/dev/zero", "/dev/null", "/nonexistent", "a.jpg", "/etc/passwd", "x" * 1000, "\x1b[2J",
          b"\xff\xfe", "-1", "C.UTF-8", "de_DE.UTF-8")  # fmt: skip


def _with_files(samples: Samples):
    def prepare(folder: Path) -> None:
        (folder / "a.jpg").write_bytes(samples.images["baseline.jpg"])
        (folder / "a.maqrec").write_bytes(samples.recordings["raw.maqrec"])
        (folder / "a.mp4").write_bytes(samples.clips["clip.mp4"])
        (folder / "a.maqs").write_bytes(samples.scenes["8.maqs"])
        (folder / "a.maqh").write_bytes(samples.heads["a.maqh"])

    return prepare


def uris(samples: Samples, rng: Random, index: int) -> Trial:
    uri = SCHEMES[index % len(SCHEMES)]
    pairs = rng.choice((0, 1, 1, 1, 2, 3, 20))
    if pairs:
        chosen = ((rng.choice(KEYS), rng.choice(VALUES)) for _ in range(pairs))
        uri += "?" + "&".join(f"{key}={value}" for key, value in chosen)
    words = (*DENSEPOSE, uri) if index % 3 else ("record", uri, "b.maqrec", "--frames", "2")
    return Trial("URIs", uri[:80], words, _with_files(samples))


@cache
def _options(program: Path, command: tuple[str, ...]) -> tuple[str, ...]:
    """Returns the options that take a value, by the program's own help."""
    text = subprocess.run([program, *command, "--help"], capture_output=True, text=True, check=True).stdout
    return tuple(re.findall(r"^  (?:-\w,)?(--[\w-]+) (?:TEXT|INT|UINT|FLOAT)", text, re.MULTILINE))


SCENE = ("--bundle", str(SCENE_BUNDLE))
COMMANDS = {
    ("densepose",): (*DENSEPOSE[1:], "a.jpg"),
    ("play",): ("a.maqrec", "--no-image"),
    ("record",): ("a.maqrec", "b.maqrec"),
    ("bench",): ("stub:people?size=64x48", "--bundle", str(PEOPLE_BUNDLE), "--seconds", "0", "--runs", "1", "--warm-up",
                 "0", "--threads", "1"),
    ("scene", "build"): (str(CAPTURE), *SCENE, "--out", "b.maqs", "--threads", "1"),
    ("scene", "render"): ("a.maqs", *SCENE, "--path", "orbit", "--seconds", "0.1", "--size", "48x32", "--out", "b.mp4"),
    ("scene", "info"): ("a.maqs",),
    ("head",): (*HEAD[1:], "--out", "b.glb"),
    ("predict",): ("a.maqrec", "--frames", "2", "--out", "b"),
}  # fmt: skip


def options(samples: Samples, rng: Random, index: int) -> Trial:
    """Each option that takes a value, with each of the values, in place of the one that the command has."""
    cases = [(command, option) for command in COMMANDS for option in _options(samples.program, command)]
    command, option = cases[index % len(cases)]
    value = OPTION_VALUES[(index // len(cases) + index) % len(OPTION_VALUES)]
    words = list(COMMANDS[command])
    if option in words:
        del words[words.index(option) : words.index(option) + 2]
    shown = value if isinstance(value, str) else repr(value)
    return Trial("options", f"{' '.join(command)} {option} {shown[:30]!r}", (*command, *words, option, value),
                 _with_files(samples))  # fmt: skip


WRONG_USES = (
    ("frobnicate",), ("scene",), ("scene", "frobnicate"), ("",), ("\x1b[2J",), (b"\xff",), ("--frobnicate",), ("-x",),
    ("densepose",), ("densepose", "a.jpg"), ("densepose", "", "--out", "out"), ("densepose", "a.jpg", "--out"),
    ("densepose", "a.jpg", "a.jpg", "--out", "out", "--out", "out"), ("record", "a.jpg"), ("record", "a.jpg", "a.jpg"),
    ("record", "a.maqrec", "a.maqrec"), ("scene", "render", "a.maqs", "--out", "b.mp4"),
    ("scene", "render", "a.maqs", "--out", "b.mp4", "--path", "orbit", *SCENE, "--size", "1x1"),
    ("scene", "render", "a.maqs", "--out", "b.xyz", "--path", "orbit", *SCENE),
    ("scene", "render", "a.maqs", "--out", "noext", "--path", "orbit", *SCENE),
    ("scene", "render", "a.maqs", "--out", "b.mov", "--path", "orbit", *SCENE, "--size", "48x32", "--seconds", "0.1"),
    ("scene", "render", "a.maqs", "--out", "b.mp4", "--path", "through", *SCENE),
    ("scene", "render", "a.maqs", "--out", "b", "--views", "no.png", "--capture", str(CAPTURE), *SCENE),
    ("scene", "render", "a.maqs", "--out", "b", "--views", ",,", "--capture", str(CAPTURE), *SCENE),
    ("scene", "render", "a.jpg", "--out", "b.mp4", "--path", "orbit", *SCENE),
    ("scene", "render", "a.maqs", "--out", "b.mp4", "--path", "orbit"), ("scene", "info", "a.jpg"),
    ("scene", "build", "a.jpg", "--out", "b.maqs"),
    ("scene", "build", str(CAPTURE), "--out", "b.maqs", "--bundle", "."),
    ("scene", "build", str(CAPTURE), "--out", "b.maqs", "--bundle", str(PEOPLE_BUNDLE)),
    ("densepose", "a.jpg", "--out", "out", "--bundle", str(SCENE_BUNDLE)), ("play", "b.maqrec"), ("play", "a.maqs"),
    ("bench", "nothing.jpg", "--bundle", str(PEOPLE_BUNDLE)), ("bench", "--bundle", "/nonexistent"),
    ("head",), ("head", "a.jpg"), ("head", "a.jpg", "--out", "b.stl"), ("head", "a.maqs", *HEAD[2:], "--out", "b.glb"),
    ("head", "a.jpg", "--out", "b.glb", "--bundle", str(PEOPLE_BUNDLE)), ("head", "info", "a.jpg"), ("head", "info"),
    (*HEAD[:-1], "90,10,95,40", "--out", "b.glb"), ("predict",), ("predict", "a.maqrec", "--out", "b.xyz"),
    ("predict", "b.maqrec", "--out", "b.mp4"), ("predict", "a.maqs", "--out", "b"),
    ("predict", "a.maqrec", "--from", "99", "--out", "b"),
)  # fmt: skip


def wrong_uses(samples: Samples, rng: Random, index: int) -> Trial:
    words = WRONG_USES[index % len(WRONG_USES)]
    return Trial("options", " ".join(map(str, words))[:80], words, _with_files(samples), REFUSED)


def environment(samples: Samples, rng: Random, index: int) -> Trial:
    name, value = ENVIRONMENT[index % len(ENVIRONMENT)], rng.choice(PLACES)
    words = (*DENSEPOSE, "a.jpg")
    if name == "MAQ_BUNDLE":
        words = ("densepose", "a.jpg", "--out", "out")
    elif name == "MAQ_SCENE_BUNDLE":
        words = ("scene", "build", str(CAPTURE), "--out", "b.maqs")
    elif name == "MAQ_HEADS_BUNDLE":
        words = (*HEAD[:2], *HEAD[4:], "--out", "b.glb")
    return Trial("environment", f"{name}={value!r:.40}", words, _with_files(samples), EITHER, environment={name: value})
