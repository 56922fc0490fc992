"""Each file of native tests is built and run: a file that no CMake list names would never fail."""

import re
from pathlib import Path

NATIVE = Path(__file__).parents[3] / "tests/native"


def test_each_file_of_native_tests_is_a_suite():
    words = set(re.findall(r"\w+", (NATIVE / "CMakeLists.txt").read_text()))
    files = {re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", word).lower() for word in words}
    forgotten = [path for path in NATIVE.rglob("test_*.cpp") if path.stem.removeprefix("test_") not in files]
    assert not forgotten
