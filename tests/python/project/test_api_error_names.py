"""Errors of the C API name its parameters as the headers do: an app's developer looks for that name."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
HEADERS = sorted((ROOT / "sdk/include/maquette").glob("*.h"))
SOURCES = sorted((ROOT / "sdk/src/api").rglob("api_*.cpp"))

NAMED = re.compile(
    r"""(?:require_argument|require_struct_size|require_range|require_index|write_struct|read_config|destroy|return_handle
        |guarded_alone)\(
        (?:[^";]*?,\s*)?"(\w+)""",
    re.VERBOSE,
)


def parameters(text: str) -> list[str]:
    """Names of the parameters of a declaration: the last word of each."""
    return [re.findall(r"\w+", re.sub(r"\[\d*\]", "", part))[-1] for part in text.split(",")]


def declared() -> dict[str, list[str]]:
    texts = "".join(re.sub(r"/\*.*?\*/", "", path.read_text(), flags=re.DOTALL) for path in HEADERS)
    return {name: parameters(rest) for name, rest in re.findall(r"MAQ_API [^;(]*?(\w+)\(([^;]*)\);", texts)}


def bodies() -> dict[str, str]:
    found = {}
    for path in SOURCES:
        for match in re.finditer(
            r"^(?:maq_status|void) (maq_\w+)\(.*?\{(.*?)(?:^\}|\}\n\n)", path.read_text(), re.S | re.M
        ):
            found[match[1]] = match[2]
    return found


DECLARED = declared()


@pytest.mark.parametrize(("function", "body"), bodies().items(), ids=bodies().keys())
def test_an_error_names_parameters_as_the_header_does(function: str, body: str):
    wrong = set(NAMED.findall(body)) - set(DECLARED[function])
    assert not wrong, f"{function}({', '.join(DECLARED[function])}) tells of {', '.join(sorted(wrong))}"


def test_the_struct_of_an_init_function_has_the_name_that_its_errors_use():
    names = {function: names[0] for function, names in DECLARED.items() if function.endswith("_init")}
    told = {
        function: (re.search(r'"(\w+)"\);', body) or ["", "config"])[1]
        for function, body in bodies().items()
        if function.endswith("_init")
    }
    assert told == names


def test_functions_were_found():
    assert len(bodies()) > 60
    assert sum(len(NAMED.findall(body)) for body in bodies().values()) > 150
