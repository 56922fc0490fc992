"""Too little memory, too few threads, files and file sizes; output that is lost; signals at any time."""

import signal
from pathlib import Path
from random import Random

from tests.hostile.samples import CAPTURE, DENSEPOSE, HEAD, PEOPLE_BUNDLE, SCENE_BUNDLE, Samples
from tests.hostile.trial import EITHER, REFUSED, Trial

SCENE = ("--bundle", str(SCENE_BUNDLE))
SHOW = ("--path", "orbit", "--seconds", "0.1", "--size", "48x32")
# Commands that end by themselves.
COMMANDS = (
    (*DENSEPOSE, "a.jpg", "--overlay"), (*DENSEPOSE, "a.mp4", "--overlay"),
    ("densepose", "a.jpg", "--out", "out", "--threads", "4"), (*DENSEPOSE, "stub:people?size=64x48&live=1", "--json"),
    ("record", "stub:pattern?size=64x48&frames=40", "b.maqrec"), ("record", "a.mp4", "b.maqrec", "--quality", "80"),
    ("play", "a.maqrec", "--no-image", "--json", "b.json"),
    ("scene", "build", str(CAPTURE), *SCENE, "--out", "b.maqs", "--ply", "b.ply", "--json", "b.json"),
    ("scene", "render", "a.maqs", *SCENE, *SHOW, "--out", "b.mp4", "--json", "b.json"),
    ("scene", "render", "a.maqs", *SCENE, "--views", "all", "--capture", str(CAPTURE), "--out", "b"),
    ("scene", "info", "a.maqs", "--json", "b.json"), ("info",), ("sources",),
    ("bench", "stub:people?size=64x48", "--bundle", str(PEOPLE_BUNDLE), "--runs", "3", "--seconds", "0", "--warm-up",
     "0", "--json", "b.json"),
    (*HEAD, "--out", "b.glb", "--save", "b.maqh"), ("head", "info", "a.maqh"),
)  # fmt: skip
# Commands that a signal has to end.
ENDLESS = (
    (*DENSEPOSE[:5], "--out", "out", "stub:people?size=64x48&stall=@3", "--overlay"),
    (*DENSEPOSE[:5], "--out", "out", "a.mp4", "--overlay", "--json"),
    ("record", "stub:pattern?size=64x48&stall=@3", "b.maqrec"),
    ("record", "stub:pattern?size=64x48&live=1", "b.maqrec"),
    ("play", "stub:people?size=64x48&unplug=60s@2", "--no-image"), ("play", "stub:people?size=64x48&hang=60s@2"),
    ("scene", "render", "a.maqs", *SCENE, "--path", "orbit", "--seconds", "600", "--size", "48x32", "--out", "b.mp4"),
    ("scene", "render", "a.maqs", *SCENE, "--views", "all", "--capture", str(CAPTURE), "--repeat", "10000", "--out",
     "b"),
    ("scene", "build", str(CAPTURE), *SCENE, "--out", "b.maqs"),
    ("bench", "stub:people?size=64x48", "--bundle", str(PEOPLE_BUNDLE), "--seconds", "600"),
    (*HEAD, "--seconds", "600", "--out", "b.glb", "--save", "b.maqh"),
)  # fmt: skip
MEMORY_MIB = (16, 24, 32, 40, 48, 56, 64, 80, 96, 112, 128, 160, 192, 224, 256, 320, 384, 512)
OUTPUT_LOST = (">/dev/full", ">&-", "2>&-", ">&- 2>&-", "2>/dev/full", "<&-", "<&- >&- 2>&-", "<&- >/dev/full")


def _prepared(samples: Samples):
    def prepare(folder: Path) -> None:
        (folder / "a.jpg").write_bytes(samples.images["baseline.jpg"])
        (folder / "a.mp4").write_bytes(samples.clips["clip.mp4"])
        (folder / "a.maqrec").write_bytes(samples.recordings["raw.maqrec"])
        (folder / "a.maqs").write_bytes(samples.scenes["8.maqs"])
        (folder / "a.maqh").write_bytes(samples.heads["a.maqh"])

    return prepare


def _limited(samples: Samples, words: tuple[str, ...], name: str, value: int, must_say: str) -> Trial:
    return Trial("limits", f"{name} = {value}: {' '.join(words)[:60]}", words, _prepared(samples), must_say=must_say,
                 limits={name: value}, as_user=True)  # fmt: skip


def memory(samples: Samples, rng: Random, index: int) -> Trial:
    words = COMMANDS[index % len(COMMANDS)]
    limit = MEMORY_MIB[index // len(COMMANDS) % len(MEMORY_MIB)] << 20
    return _limited(samples, words, "as", limit + rng.randrange(8 << 20), "memory")


def threads(samples: Samples, rng: Random, index: int) -> Trial:
    """The user has the program's own process and so many threads."""
    words = COMMANDS[index % len(COMMANDS)]
    return _limited(samples, words, "nproc", 1 + index // len(COMMANDS) % 6, "thread|process|memory|cannot be started")


def files(samples: Samples, rng: Random, index: int) -> Trial:
    words = COMMANDS[index % len(COMMANDS)]
    return _limited(samples, words, "nofile", 3 + index // len(COMMANDS) % 12, "")


def file_sizes(samples: Samples, rng: Random, index: int) -> Trial:
    words = COMMANDS[index % len(COMMANDS)]
    return _limited(samples, words, "fsize", rng.choice((0, 1, 100, 4096, 20_000, 100_000)), "")


def lost_output(samples: Samples, rng: Random, index: int) -> Trial:
    words = COMMANDS[index % len(COMMANDS)]
    redirect = OUTPUT_LOST[index // len(COMMANDS) % len(OUTPUT_LOST)]
    expects = REFUSED if redirect in (">/dev/full", "<&- >/dev/full") else EITHER
    return Trial("lost output", f"{redirect}: {' '.join(words)[:60]}", words, _prepared(samples), expects,
                 redirect=redirect)  # fmt: skip


def signals(samples: Samples, rng: Random, index: int) -> Trial:
    words = ENDLESS[index % len(ENDLESS)]
    number = rng.choice((signal.SIGINT, signal.SIGTERM, signal.SIGHUP))
    after_s = rng.choice((0.0, 0.005, 0.02, 0.05, 0.1, 0.3, 0.6, 1.0))
    name = f"{number.name} after {after_s} s: {' '.join(words)[:60]}"
    return Trial("signals", name, words, _prepared(samples), number=int(number), after_s=after_s)
