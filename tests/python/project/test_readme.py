"""Programs and commands that the documentation shows are those that are tested."""

import re
from pathlib import Path

README = Path("README.md").read_text()


def test_the_c_program_is_the_one_that_the_native_tests_build_against_an_installed_sdk():
    program = Path("examples/c/people.c").read_text()
    assert f"```c\n{program}```" in Path("docs/guide/link.md").read_text()
    assert len(program.splitlines()) <= 30


def test_every_make_target_that_it_names_exists():
    makefile = Path("Makefile").read_text()
    for target in re.findall(r"(?<!scene )make ([a-z][a-z-]*)", README):
        assert f"\n{target}:" in makefile, target


def test_every_native_test_that_the_list_of_extreme_cases_names_exists():
    listed = Path("tests/native/README.md").read_text().split("## Extreme cases")[1]
    tests = {
        (suite, name)
        for path in Path("tests/native").rglob("test_*.cpp")
        for suite, name in re.findall(r"^TEST(?:_F)?\((\w+), (\w+)\)", path.read_text(), re.MULTILINE)
    }
    named, suite = [], ""
    for written_suite, name in re.findall(r"`(\w*)\.([A-Z]\w+)`", listed):
        suite = written_suite or suite  # `.Name` is of the suite before it
        named.append((suite, name))
    assert len(named) > 20
    assert [test for test in named if test not in tests] == []
