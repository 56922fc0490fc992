"""The test of a newcomer's first minutes knows the commands of today's README."""

from pathlib import Path

import pytest

from tests.newcomer.readme import (
    LEFT_OUT,
    PAGES,
    PROMISES,
    READERS_FILES,
    UNTIL_INTERRUPTED,
    command_blocks,
    readme_blocks,
)

ROOT = Path(__file__).parents[3]


def test_every_entry_stands_in_the_readme():
    commands = "\n".join((ROOT / page).read_text() for page in PAGES)
    for text in [*LEFT_OUT, *PROMISES, *UNTIL_INTERRUPTED, *READERS_FILES]:
        assert text in commands, f"{text!r} of tests/newcomer/readme.py is no command of the README any more"


def test_all_commands_but_tests_are_run():
    blocks = readme_blocks(ROOT)
    left_out = [line for block in blocks for line, _ in block.left_out]
    assert [line.split("  ")[0] for line in left_out] == ["make test"]
    assert sum(len(block.lines) for block in blocks) >= 10
    assert [block.lines[0].split()[:2] for block in blocks if block.lines and not block.promises] == [
        ["make", "desktop-demo"]
    ]


def test_blocks_are_indented_lines_between_others():
    one = "# One\n\n    a \\\n        b   # why\n    c\n\ntext\n\n```c\n    no\n# no\n```\n\n"
    readme = one + "## Two\n\n    make test  # x\n    make demo"
    first, second = command_blocks(readme)
    assert (first.heading, first.lines, first.left_out) == ("One", ("a b   # why", "c"), ())
    assert (second.heading, second.lines) == ("Two", ("make demo",))
    assert [line for line, _ in second.left_out] == ["make test  # x"]


@pytest.mark.parametrize("file", READERS_FILES.values())
def test_the_readers_files_exist(file):
    assert (ROOT / file).is_file()
