"""Every file of the library includes the standard headers whose names it uses, by itself or by a header of ours. Builds
for Android compile several files as one, where a header that one of them lacks comes from another, and the C++ library
of this machine brings headers that Android's does not."""

import re
from functools import cache
from pathlib import Path

import pytest

FOLDERS = (Path("sdk/src"), Path("android/maquette/src/main/cpp"))
ROOTS = (Path("sdk/include"), Path("sdk/src"), FOLDERS[1])
NAMES = {
    "algorithm": "sort stable_sort nth_element partial_sort min_element max_element minmax_element minmax all_of "
    "any_of none_of find_if find_if_not find count count_if fill fill_n copy copy_n copy_if transform reverse rotate "
    "unique lower_bound upper_bound equal_range binary_search partition stable_partition remove_if remove "
    "replace generate min max clamp is_sorted for_each push_heap pop_heap make_heap equal mismatch "
    "lexicographical_compare set_intersection includes",
    "array": "array",
    "atomic": "atomic atomic_flag memory_order_relaxed memory_order_acquire memory_order_release",
    "charconv": "from_chars to_chars chars_format",
    "chrono": "chrono",
    "cmath": "sqrt floor ceil round lround llround isfinite isnan isinf exp exp2 log log2 log1p expm1 pow sin cos tan "
    "asin acos atan atan2 hypot fma cbrt nearbyint rint lrint trunc fabs tanh ldexp frexp copysign fmod "
    "remainder signbit fmax fmin",
    "condition_variable": "condition_variable cv_status",
    "cstdlib": "getenv strtol strtod free malloc calloc exit aligned_alloc",
    "cstring": "memcpy memset memcmp memmove memchr strlen strcmp strncmp strerror strchr strstr strrchr",
    "deque": "deque",
    "exception": "exception_ptr current_exception rethrow_exception terminate",
    "filesystem": "filesystem",
    "fstream": "ifstream ofstream",
    "functional": "function bind ref cref greater plus multiplies",
    "future": "future promise async",
    "iomanip": "setprecision setw setfill",
    "limits": "numeric_limits",
    "list": "list",
    "map": "map multimap",
    "memory": "unique_ptr shared_ptr weak_ptr make_unique make_shared enable_shared_from_this",
    "mutex": "mutex lock_guard unique_lock scoped_lock once_flag call_once",
    "new": "bad_alloc nothrow",
    "numeric": "accumulate iota inner_product partial_sum reduce gcd exclusive_scan",
    "optional": "optional nullopt",
    "queue": "queue priority_queue",
    "random": "mt19937 mt19937_64 uniform_real_distribution uniform_int_distribution normal_distribution",
    "set": "set multiset",
    "sstream": "ostringstream istringstream stringstream",
    "stdexcept": "runtime_error logic_error out_of_range invalid_argument length_error",
    "string": "string to_string stoi stod getline",
    "string_view": "string_view",
    "thread": "thread this_thread",
    "tuple": "tuple tie make_tuple",
    "unordered_map": "unordered_map",
    "unordered_set": "unordered_set",
    "utility": "exchange",
    "variant": "variant get_if holds_alternative visit monostate",
    "vector": "vector",
}  # fmt: skip
HEADER_OF = {name: header for header, names in NAMES.items() for name in names.split()}
INCLUDE = re.compile(r'^#include ([<"])([^>"]+)[>"]', re.MULTILINE)
COMMENT_OR_TEXT = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.DOTALL)
FILES = sorted(path for folder in FOLDERS for path in folder.rglob("*") if path.suffix in (".h", ".cpp"))


@cache
def included(path: Path) -> frozenset[str]:
    """The standard headers that a file of ours brings."""
    headers: set[str] = set()
    for quote, name in INCLUDE.findall(path.read_text()):
        if quote == "<":
            headers.add(name)
        for folder in (path.parent, *ROOTS):
            if (folder / name).is_file() and (folder / name) != path:
                headers |= included(folder / name)
                break
    return frozenset(headers)


def missing(text: str, headers: frozenset[str]) -> dict[str, str]:
    """Names of std in a source, and the headers that declare them, where those are not among `headers`."""
    used = re.findall(r"\bstd::(\w+)", COMMENT_OR_TEXT.sub("", text))
    return {name: HEADER_OF[name] for name in used if name in HEADER_OF and HEADER_OF[name] not in headers}


def test_a_missing_header_is_found():
    text = '// std::vector\nauto a = "std::map"; std::sort(b); std::sqrt(c);'
    assert missing(text, frozenset({"cmath"})) == {"sort": "algorithm"}


@pytest.mark.parametrize("folder", FOLDERS, ids=str)
def test_files_include_the_standard_headers_they_use(folder):
    lacking = {
        str(path): found
        for path in FILES
        if path.is_relative_to(folder) and (found := missing(path.read_text(), included(path)))
    }
    assert not lacking
