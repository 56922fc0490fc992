"""Each public C function is bound in C++, Kotlin and Python, or stands in unbound_functions.toml with a reason."""

import re
import tomllib
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
BINDINGS = {
    "cpp": ("sdk/include/maquette", (".hpp",)),
    "kotlin": ("android/maquette/src/main", (".cpp", ".h", ".kt")),
    "python": ("python/maquette", (".py",)),
}
UNBOUND = tomllib.loads(Path(__file__).with_name("unbound_functions.toml").read_text())
# Functions that a binding calls by the type's name alone: maq_densepose stands for maq_densepose_create. Structs of
# Kotlin begin as zeros, the defaults: maq_densepose_config stands for maq_densepose_config_init.
BY_TYPE = {
    "cpp": re.compile(r"_(create|destroy|release|close|config_init)$"),
    "kotlin": re.compile(r"_init$"),
    "python": re.compile(r"_(create|destroy|release|close|config_init|init)$"),
}


def functions() -> set[str]:
    """The public C functions, out of the headers."""
    found: set[str] = set()
    for header in (ROOT / "sdk/include/maquette").glob("*.h"):
        text = re.sub(r"/\*.*?\*/", "", header.read_text(), flags=re.DOTALL)
        found |= set(re.findall(r"MAQ_API[^;(]*?\b(maq_\w+)\(", text))
    return found


def bound(binding: str) -> set[str]:
    """The functions that the sources of a binding name."""
    folder, suffixes = BINDINGS[binding]
    files = [path for path in sorted((ROOT / folder).rglob("*")) if path.suffix in suffixes]
    named = set(re.findall(r"\bmaq_\w+", "\n".join(path.read_text() for path in files)))
    return {name for name in functions() if {name, BY_TYPE[binding].sub("", name)} & named}


@pytest.mark.parametrize("binding", BINDINGS)
def test_each_function_is_bound_or_has_a_reason(binding):
    missing = functions() - bound(binding)
    without = sorted(name for name in missing if not any(fnmatch(name, pattern) for pattern in UNBOUND[binding]))
    assert without == [], f"bind them in {BINDINGS[binding][0]}, or give a reason in unbound_functions.toml"


@pytest.mark.parametrize("binding", BINDINGS)
def test_each_reason_is_still_needed(binding):
    missing = functions() - bound(binding)
    assert [pattern for pattern in UNBOUND[binding] if not any(fnmatch(name, pattern) for name in missing)] == []
    assert all(len(reason) > 10 for reason in UNBOUND[binding].values())
