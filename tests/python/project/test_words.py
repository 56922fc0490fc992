"""One language: the field's words, none of the private ones that they replaced, and sentences that are read once."""

import re
import subprocess
import sys
from pathlib import Path

import plain_english
import pytest

EVERYWHERE = ("sdk", "desktop_demo", "export", "quantization", "benchmarks", "tests", "docs", "scripts", "README.md",
              "CONTRIBUTING.md")  # fmt: skip
NATIVE = ("sdk", "desktop_demo", "tests/native", "benchmarks/native", "docs", "README.md")
# Where somebody is no person in a picture.
MACHINERY = tuple(f"sdk/src/{name}/" for name in ("api", "core", "image", "nn", "pipeline", "scene", "sources")) + (
    "sdk/app/",)  # fmt: skip
TEXT = (".h", ".hpp", ".c", ".cpp", ".py", ".md", ".txt", ".cmake", ".sh", ".json", ".toml", ".in")
HERE = Path("tests/python/project/test_words.py")

# (pattern, the field's word, where to look). Words are matched as written, so `\\b` and case matter.
WORDS = [
    # Descriptors of points, in place of "looks".
    (r"\blooks_(?!like|at)\w|(?<=\w)_looks\b|\bLook[A-Z]|(?<=[a-z])Looks?\b", "descriptor", EVERYWHERE),
    (r"\bhow (it|they|the points|points) looks?\b", "descriptors", NATIVE),
    (r"\bwild\b|\bwild_\w+|\bWild[A-Z]\w*", "outlier", EVERYWHERE),
    (r"[Mm]odelled_?[Pp]oints|[Mm]odelling_?[Ss]tate", "fitted points, state of fitting", EVERYWHERE),
    (r"second_look\w*|looks_again|\bsecond looks?\b", "second pass (of the box head)", EVERYWHERE),
    # Positions, indices and poses, in place of "places".
    (r"PointPlaces?|place_kind|PlaceKind|PlaceInPicture|\bplaces_bytes\b", "position", EVERYWHERE),
    (r"\bturn_in\b", "givens_rotate", EVERYWHERE),
    (
        r"\bturned_\w+|\bTurned[A-Z]\w*|\bturning_\w+|\bturn_ms\b|(?<=\w)_turn_?[sn]s\b",
        "rotated, aligned; iteration",
        NATIVE,
    ),
    (r"[Uu]pright_?[Ff]rame", "gravity alignment", EVERYWHERE),
    (r"\bis_folded\b", "is_space_to_depth", EVERYWHERE),
    (r"Reach_px\b|\breach_px\b", "receptive field radius", EVERYWHERE),
    # What is visible.
    (r"[Pp]icture_?[Cc]over\b|[Ss]ureness|_SURENESS", "coverage, confidence", EVERYWHERE),
    (r"k?[Hh]iding_?[Ss]hare|\bunhidden\b|\bshines? through\b", "occlusion, depth tolerance", EVERYWHERE),
    (r"\b(who )?wins? (a|the|its|their|each|every|that) pixels?\b", "is front-most at, is visible at", EVERYWHERE),
    # Amounts.
    (r"\b_?least_(?!squares)\w+|\bkLeast\w*|\b_?LEAST_\w+", "min", EVERYWHERE),
    (r"\b_?most_[a-z]\w*|\bkMost\w*|\b_?MOST_\w+", "max", EVERYWHERE),
    (
        r"(?<=[a-z])_shares?\b|\bshares?_[a-z]|(?<=[a-z])Share\b|(?<=[A-Z])_SHARE\b",
        "fraction, ratio, rate",
        EVERYWHERE,
    ),
    (r"[\"`]at_(least|most)[\"`]|^at_(least|most) = ", "min, max", ("benchmarks", "tests/python/benchmarks", "docs")),
    # Measurements: keys of JSON and texts.
    (
        r"[\"`](drops|doubts|promised_fps|missing_numbers|times_not_later|begin_monotonic_s)[\"`]|\bdoubts_of\b",
        "dropped_frames, warnings, nominal_fps, missing_sequence_numbers, non_increasing_timestamps",
        EVERYWHERE,
    ),
    (
        r"\bin turns\b|\btook turns\b|\btake turns every\b",
        "alternately",
        ("benchmarks", "quantization", "sdk/tools", "docs"),
    ),
    (r"\ba second, %.* lost\b|\d lost\"", "dropped", ("sdk/tools",)),
    # Files.
    (r"\bwhole or not at all\b|\bNewFile\b|\bnew_file\b", "atomically, AtomicFile", EVERYWHERE),
    (r"\b(?!is_)\w+_endings?\b|\bfile(name)? endings?\b|\bending of (a|the) (file|name)\b", "extension", EVERYWHERE),
    (r"\bown_folder\b|\bOwnFolder\b", "library folder", EVERYWHERE),
    (r"\bdrop_counts\b|\bsentence_part\b", "import report", NATIVE),
    # Objects that are lent and asked for.
    (r"\bhand_out\b|\btake_back\b", "lend, return", EVERYWHERE),
    (r"Wish\b|\bstruct Orders\b|\bOrders\b", "request, command", NATIVE),
    (r"\b(T|bool|u?int\d*(_t)?|float|double|string&?|Value&?) otherwise[,)]", "fallback", NATIVE),
    (r"\bplayed_camera\b|\bplayed as cameras?\b", "replay", EVERYWHERE),
    (r"\b(struct|class) Figures\b", "parameters, metrics", NATIVE),
    # Riddles and speech of another day.
    (
        r"\bthat (is|are) none\b|\b(is|are) none of\b|\bis no camera\b",
        "say what is wrong: invalid, is not a …",
        EVERYWHERE,
    ),
    (r"\bis answered by\b", "is paired with", NATIVE),
    (r"\bblocks shortly\b|\bmust return soon\b", "blocks briefly, returns promptly", NATIVE),
    (r"\bkept[ _]out\b", "held out", EVERYWHERE),
    (r"\b[Ww]hoever\b", "the caller, the thread that", EVERYWHERE),
    (r"\b([Ss]omebody|[Nn]obody)\b", "a caller, no thread, no pixel", MACHINERY),
    (r"\bby and by\b|\bfor ever\b|\bcameras? of glass\b", "gradually, indefinitely, physical camera", EVERYWHERE),
    (r"\b[Qq]uantis", "quantiz", EVERYWHERE),
]

# Texts of others, and figures as a run wrote them.
SKIPPED = (
    "sdk/licenses/",
    "desktop_demo/licenses/",
    "docs/benchmarks/",
    "docs/research/progress.json",
    "docs/research/ablation.json",
)
# Where a pattern finds what means something else: (file, line) as regular expressions, each with its reason.
EXCEPTIONS = [
    (r"quantization", r"\bshare_scales\b"),  # shares: is in common
]


def texts() -> dict[str, str]:
    """Every text of the repository, by the name of its file."""
    listed = subprocess.run(["git", "ls-files", *EVERYWHERE], capture_output=True, text=True, check=True).stdout
    paths = [Path(name) for name in listed.splitlines()
             if name.endswith(TEXT) and not name.startswith(SKIPPED) and Path(name) != HERE]  # fmt: skip
    return {path.as_posix(): path.read_text() for path in paths if path.is_file()}


TEXTS = texts()


@pytest.mark.parametrize(("pattern", "word", "where"), WORDS, ids=[word for _, word, _ in WORDS])
def test_no_private_word_comes_back(pattern, word, where):
    found = re.compile(pattern, re.MULTILINE)
    wrong = []
    for file, text in TEXTS.items():
        for match in found.finditer(text) if file.startswith(where) else ():
            line = text[text.rfind("\n", 0, match.start()) + 1 : text.find("\n", match.end())]
            if not any(re.search(path, file) and re.search(excused, line) for path, excused in EXCEPTIONS):
                wrong.append(f"{file}:{text.count(chr(10), 0, match.start()) + 1}: '{match[0]}'; say: {word}")
    assert not wrong, "\n".join(["", *wrong])


def test_sentences_are_short_and_name_the_noun():
    """At most 25 words in headers and help, 30 in docs. No comment begins with Of, What, Those or Whose."""
    program = [sys.executable, "tests/python/support/plain_english.py"]
    found = subprocess.run(program, capture_output=True, text=True)
    assert found.returncode == 0, "\n" + found.stdout + found.stderr


@pytest.mark.parametrize(
    ("path", "text", "kinds"),
    [
        ("a.cpp", "int a;  // Of a frame.\n// Returns b.\n// Of the next line this is no comment.\n", ["opening"]),
        ("a.py", 'def a():\n    """What it is."""\n    # Those\n    return "Of"\n', ["opening", "opening"]),
        ("a.md", "It is likewise what is aimed at, as X has it.\n", ["phrase"] * 3),
        ("README.md", "one " * 31 + "\n\n| " + "one " * 30 + "|\n\n    " + "one " * 31, ["long"]),
        ("README.md", "one " * 20 + "end. " + "two " * 20 + "`a.b c`. " + "three " * 20, []),
        ("sdk/include/maquette/a.h", "/* " + "one\n * " * 26 + "*/ int a; /* b */", ["long"]),
        ("sdk/tools/a.cpp", 'f("' + "one " * 20 + '"\n  "' + "two " * 6 + '"); // ' + "three " * 30, ["long"]),
    ],
)
def test_each_rule_finds_its_sentences(path, text, kinds):
    assert [kind for _, kind, _ in plain_english.faults(path, text)] == kinds
