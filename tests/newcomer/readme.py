"""Commands of README.md and of the guide to linking, in order, and what the test knows of them."""

import re
from dataclasses import dataclass
from pathlib import Path

PAGES = ("README.md", "docs/guide/link.md")

# Run until the reader presses Ctrl-C: text of the command, and the seconds that the reader looks at it.
UNTIL_INTERRUPTED = {"make desktop-demo": 15, "maquette play": 5}

# Ended early: text of the command, and a pattern of the output after which it is ended. The groups of tests that follow
# run in continuous integration.
UNTIL_PRINTED = {"make test": r"(?m)^# [\w-]+ passed in \d+ s"}

# Files that the reader has beforehand, by the names that the README uses: name in the README, file of the clone.
READERS_FILES = {"photo.jpg": "tests/media/photo.jpg", "clip.mp4": "tests/media/clip.mp4"}

# Promises of commands: text of the command, and a pattern of files of the clone, or of its output.
PRINTS = "prints:"
PROMISES = {
    "make demo": "demo-output/*.png",
    "densepose photo.jpg": "results/photo_IUV.png",
    "densepose clip.mp4": "results/clip*_IUV.png",
    "maquette edges": "results/box_depth_edges.json",
    "scene build": "room.maqs",
    "head photo.jpg": "head.glb",
    "maquette body": "body.glb",
    "scene render": "room.mp4",
    "./people": PRINTS + r"person 0\.\d+ at x \d+ y \d+",
    "make wheel": "build/wheel/maquette-*.whl",
    "maquette play": PRINTS + r"\d+ frames",
}


@dataclass(frozen=True)
class Block:
    """Commands that share a shell: lines of a README that follow each other, indented by four spaces."""

    heading: str
    lines: tuple[str, ...]

    @property
    def script(self) -> str:
        return "\n".join(self.lines) + "\n"

    @property
    def seconds_until_interrupted(self) -> int | None:
        """How long it runs until Ctrl-C; None if it ends by itself."""
        return next((seconds for text, seconds in UNTIL_INTERRUPTED.items() if text in self.script), None)

    @property
    def last_words(self) -> str | None:
        """A pattern of the output after which it is ended; None if it ends by itself."""
        return next((pattern for text, pattern in UNTIL_PRINTED.items() if text in self.script), None)

    @property
    def promises(self) -> list[str]:
        return [promise for text, promise in PROMISES.items() if text in self.script]


def command_blocks(readme: str) -> list[Block]:
    """The README's indented blocks from top to bottom; fenced code is not one."""
    blocks: list[Block] = []
    heading, lines, is_fenced = "", [], False
    for line in [*readme.splitlines(), ""]:
        if line.startswith("    ") and not is_fenced:
            lines.append(line[4:])
            continue
        if lines:
            commands = re.sub(r"\\\n\s*", "", "\n".join(lines)).splitlines()
            blocks.append(Block(heading, tuple(commands)))
            lines = []
        if line.startswith("```"):
            is_fenced = not is_fenced
        elif line.startswith("#") and not is_fenced:
            heading = line.lstrip("# ")
    return blocks


def readme_blocks(root: Path) -> list[Block]:
    return [block for page in PAGES for block in command_blocks((root / page).read_text())]
