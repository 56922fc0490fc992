"""What the README shows is what is tested."""

import re
from pathlib import Path

README = Path("README.md").read_text()


def test_the_c_program_is_the_one_that_the_native_tests_build_against_an_installed_sdk():
    program = Path("tests/consumers/people.c").read_text()
    assert f"```c\n{program}```" in README
    assert len(program.splitlines()) <= 30


def test_every_file_that_it_links_to_is_there():
    targets = re.findall(r"\]\(([^)#]+)\)", README)
    assert [target for target in targets if not Path(target).exists()] == []


def test_every_make_target_that_it_names_exists():
    makefile = Path("Makefile").read_text()
    for target in re.findall(r"make ([a-z]+)", README):
        assert f"\n{target}:" in makefile, target
