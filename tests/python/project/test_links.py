"""Every relative link of a page leads to a file, and every anchor to a heading."""

import re
import subprocess
from pathlib import Path

import pytest

PAGES = subprocess.run(["git", "ls-files", "*.md"], capture_output=True, text=True, check=True).stdout.split()
CODE = re.compile(r"^```.*?^```|`[^`\n]*`", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(\s*<?([^)\s>]+)>?[^)]*\)")


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub and GitLab make them: repeated ones end in -1, -2, …"""
    found: dict[str, int] = {}
    names = set()
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    for heading in re.findall(r"^#{1,6} +(.+?) *#*$", text, re.MULTILINE):
        shown = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading)
        name = re.sub(r"[^\w\- ]", "", shown.lower()).replace(" ", "-")
        names.add(f"{name}-{found[name]}" if name in found else name)
        found[name] = found.get(name, 0) + 1
    return names


def broken_links(page: Path) -> list[str]:
    wrong = []
    for link in LINK.findall(CODE.sub("", page.read_text())):
        if re.match(r"[a-z][a-z0-9+.-]*:", link):  # a URL
            continue
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        if not target.exists():
            wrong.append(f"{page}: {link}: no such file")
        elif anchor and target.suffix == ".md" and anchor not in anchors(target):
            wrong.append(f"{page}: {link}: no such heading; there are {', '.join(sorted(anchors(target)))}")
    return wrong


@pytest.mark.parametrize("page", PAGES)
def test_every_relative_link_leads_somewhere(page):
    wrong = broken_links(Path(page))
    assert not wrong, "\n".join(["", *wrong])


def test_broken_files_and_anchors_are_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "# A `title`, twice\n# A `title`, twice\n"
        "[good](page.md#a-title-twice-1) [code] `[x](none.md)` [web](https://example.com/none.md)\n"
        "[file](none.md) [anchor](#a-title) ![picture](none.png)\n"
    )
    assert [wrong.split(": ")[1] for wrong in broken_links(page)] == ["none.md", "#a-title", "none.png"]
