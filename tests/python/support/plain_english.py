"""Prints each sentence that breaks the language rules. Exit status 1 if there is one.

python tests/python/support/plain_english.py [FILE...]
"""

import argparse
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

# (files, maximum number of words in a sentence); the first match counts.
MAX_WORDS = [
    (r"sdk/include/maquette/.*\.h(pp)?", 25),
    (r"sdk/tools/.*\.cpp|desktop_demo/src/main\.cpp", 25),
    (r"(README|ARCHITECTURE|CONTRIBUTING|SECURITY|CODE_OF_CONDUCT)\.md|docs/(guide|reference)/.*\.md", 30),
]
OPENING = re.compile(r"(Of|What|Those|Whose)\b")
PHRASE = re.compile(
    r"\b[Ll]ikewise\b|\baimed at\b|\bas (?!if\b)(\w+('s)?|its \w+|the \w+) has (it|them)\b", re.IGNORECASE
)
CODE = re.compile(r".*\.(h|hpp|c|cpp|kt|py|sh)")
TEXT = re.compile(r".*\.(h|hpp|c|cpp|kt|py|sh|md|toml)")
# Texts of others, pages that a command writes, and the rules themselves.
SKIPPED = re.compile(
    r"sdk/licenses/.*|desktop_demo/licenses/.*|docs/benchmarks/.*|docs/reference/model-card\.md|sdk/models/.*|CHANGELOG\.md"
    r"|tests/python/support/plain_english\.py|tests/python/project/test_words\.py"
)
LINE_COMMENT = re.compile(r"(?:(?<=\s)|^)(?://+|#)!?\s?(.*)$")
BLOCK_COMMENT = re.compile(r"/\*+(.*?)\*/", re.DOTALL)
DOCSTRING = re.compile(r'"""(.*?)"""', re.DOTALL)
LITERALS = re.compile(r'"(?:\\.|[^"\\\n])*"(?:\s*"(?:\\.|[^"\\\n])*")*')


def comments(path: str, text: str) -> Iterator[tuple[int, str]]:
    """(line, text) of each comment of a source; line comments that follow each other are one."""
    if path.endswith((".py", ".sh")):
        blocks, mark = (DOCSTRING.finditer(text) if path.endswith(".py") else ()), "#"
    else:
        blocks, mark = BLOCK_COMMENT.finditer(text), "//"
    for match in blocks:
        yield text.count("\n", 0, match.start()) + 1, re.sub(r"\n\s*\* ?", "\n", match[1]).strip()
    first, lines, is_whole = 0, [], False
    for number, line in enumerate([*text.splitlines(), ""], 1):
        found = LINE_COMMENT.search(line) if mark in line else None
        starts_line = found is not None and line.lstrip().startswith(mark)
        if found is None or not (starts_line and is_whole and lines):
            if lines:
                yield first, "\n".join(lines)
            lines = []
        if found is not None:
            first = number if not lines else first
            lines.append(found[1])
        is_whole = starts_line
    return


def help_texts(text: str) -> Iterator[tuple[int, str]]:
    """(line, text) of the string literals of a source; those that follow each other are one."""
    for match in LITERALS.finditer(text):
        parts = re.findall(r'"((?:\\.|[^"\\\n])*)"', match[0])
        joined = "".join(parts).replace('\\"', '"').replace("\\n", "\n")
        yield text.count("\n", 0, match.start()) + 1, joined


def paragraphs(page: str) -> Iterator[tuple[int, str]]:
    """(line, text) of the prose of a Markdown page without code; each item of a list or a cell by itself."""
    first, lines, is_fenced = 0, [], False
    for number, line in enumerate([*page.splitlines(), ""], 1):
        is_fence = line.lstrip().startswith("```")
        is_fenced ^= is_fence
        is_code = is_fenced or is_fence or (line.startswith("    ") and not lines)
        ends = (
            is_code or not line.strip() or line.startswith(("#", "|", "!", "<")) or re.match(r"\s*([-*]|\d+\.) ", line)
        )
        if ends and lines:
            yield first, "\n".join(lines)
            lines = []
        if is_code or not line.strip() or line.startswith(("!", "<")):
            continue
        if line.startswith("|"):
            yield from ((number, item) for item in re.split(r"[|;]", line))
            continue
        first = number if not lines else first
        lines.append(re.sub(r"^\s*(#+|[-*]|\d+\.) ", "", line))


def sentences(text: str) -> Iterator[str]:
    text = re.sub(r"`[^`]*`", "Code", text)
    text = re.sub(r"!?\[([^]]*)\]\([^)]*\)", r"\1", text)
    for part in re.split(r"\n\s*\n|\n(?=\s*[-*] )|\n(?= {2,}\S)", text):
        yield from re.split(r"(?<!e\.g\.)(?<!i\.e\.)(?<=[.!?])[\"')*]*\s+", " ".join(part.split()))


def words(sentence: str) -> int:
    return sum(any(letter.isalnum() for letter in word) for word in sentence.split())


def faults(path: str, text: str) -> Iterator[tuple[int, str, str]]:
    """(line, kind, text) of each sentence that breaks a rule; kinds: long, opening, phrase."""
    limit = next((most for pattern, most in MAX_WORDS if re.fullmatch(pattern, path)), None)
    noted = list(comments(path, text)) if CODE.fullmatch(path) else []
    if limit is not None:
        if path.endswith(".md"):
            read = paragraphs(text)
        else:
            read = iter(noted) if path.startswith("sdk/include") else help_texts(text)
        for line, passage in read:
            yield from ((line, "long", s) for s in sentences(passage) if words(s) > limit)
    yield from ((line, "opening", comment) for line, comment in noted if OPENING.match(comment))
    for match in PHRASE.finditer(text):
        yield text.count("\n", 0, match.start()) + 1, "phrase", match[0]


def checked_files() -> list[str]:
    listed = subprocess.run(["git", "ls-files"], capture_output=True, text=True, check=True).stdout.splitlines()
    return [name for name in listed if TEXT.fullmatch(name) and not SKIPPED.fullmatch(name) and Path(name).is_file()]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", help="default: all files of the repository")
    names = parser.parse_args().files or checked_files()
    found = [
        f"{name}:{line}: {kind}: {' '.join(text.split())[:200]}"
        for name in names
        for line, kind, text in faults(name, Path(name).read_text())
    ]
    for fault in found:
        print(fault)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
