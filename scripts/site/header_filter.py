"""Prints a header with its plain comments as Doxygen reads them; each comment stays text of its own (verbatim).

python3 scripts/site/header_filter.py HEADER
"""

import re
import sys
from pathlib import Path

COMMENT = re.compile(r"/\*(?P<block>.*?)\*/|(?P<lines>//[^\n]*(?:\n[ \t]*//[^\n]*)*)", re.DOTALL)


def plain_text(match: re.Match) -> str:
    if match["block"] is not None:
        return re.sub(r"\n[ \t]*\* ?", "\n", match["block"]).strip()
    return re.sub(r"(?:^|\n)[ \t]*// ?", "\n", match["lines"]).strip()


def for_doxygen(header: str) -> str:
    is_first = True

    def replace(match: re.Match) -> str:
        nonlocal is_first
        text, before = plain_text(match), header[header.rfind("\n", 0, match.start()) + 1 : match.start()].strip()
        mark = "*" if is_first or not before else "*<"
        file, is_first = (" @file" if is_first else ""), False
        # A comment before a group of fields, or after a preprocessor line, belongs to no name.
        is_of_macro = before.startswith("#") and not before.startswith("#define")
        if is_of_macro or (not file and not before and text.endswith(":")):
            return match[0]
        return f"/*{mark}{file}\n@verbatim\n{text}\n@endverbatim */"

    return COMMENT.sub(replace, header)


if __name__ == "__main__":
    print(for_doxygen(Path(sys.argv[1]).read_text()))
