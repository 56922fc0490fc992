"""The test of a newcomer's first minutes knows the commands of today's README."""

from pathlib import Path

import pytest

from tests.newcomer.readme import (
    PAGES,
    PROMISES,
    READERS_FILES,
    UNTIL_INTERRUPTED,
    UNTIL_PRINTED,
    command_blocks,
    readme_blocks,
)

ROOT = Path(__file__).parents[3]


def test_every_entry_stands_in_the_readme():
    commands = "\n".join((ROOT / page).read_text() for page in PAGES)
    for text in [*PROMISES, *UNTIL_INTERRUPTED, *UNTIL_PRINTED, *READERS_FILES]:
        assert text in commands, f"{text!r} of tests/newcomer/readme.py is no command of the README any more"


def test_every_block_but_the_demos_promises_something():
    blocks = readme_blocks(ROOT)
    assert sum(len(block.lines) for block in blocks) >= 10
    assert [block.lines[0].split()[:2] for block in blocks if block.lines and not block.promises] == [
        ["make", "desktop-demo"]
    ]


def test_blocks_are_indented_lines_between_others():
    one = "# One\n\n    a \\\n        b   # why\n    c\n\ntext\n\n```c\n    no\n# no\n```\n\n"
    readme = one + "## Two\n\n    make test  # x\n    make demo"
    first, second = command_blocks(readme)
    assert (first.heading, first.lines) == ("One", ("a b   # why", "c"))
    assert (second.heading, second.lines) == ("Two", ("make test  # x", "make demo"))


@pytest.mark.parametrize("file", READERS_FILES.values())
def test_the_readers_files_exist(file):
    assert (ROOT / file).is_file()
