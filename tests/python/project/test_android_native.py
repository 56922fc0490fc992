"""The generated part of the Android binding fits the headers of the C API and the Kotlin code that uses it."""

import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "scripts/android"))

import native  # noqa: E402


@pytest.mark.parametrize("path", native.written(), ids=lambda path: path.name)
def test_the_generated_files_are_up_to_date(path):
    assert path.read_text() == native.written()[path], "run: .venv/bin/python scripts/android/native.py"


def test_each_default_of_a_struct_is_zero_unless_kotlin_sets_it():
    """Kotlin fills structs with zeros and calls no `_init`: fields with another default are set by each caller."""
    sources = "\n".join(path.read_text() for path in sorted((ROOT / "sdk/src/api").glob("*.cpp")))
    defaults = set(re.findall(r"\bdefaults?\.(\w+) = (?!0;)", sources))
    assert defaults <= {"clock"}
