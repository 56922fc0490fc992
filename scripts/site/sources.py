"""Copies pages of the repository, from README.md on along their links, to a folder of which MkDocs makes the site.

A page keeps its path. A source file that a page links becomes a page with its code; a folder, its README.md; a public
header, its page of the API reference.
"""

import os
import re
import shutil
from pathlib import Path

LINK = re.compile(r"(\]\(\s*)([^)\s]+)(\s*\))")
CODE = re.compile(r"(^```.*?^```|`[^`\n]*`|^    .*?$)", re.MULTILINE | re.DOTALL)
HEADERS = "sdk/include/maquette"
LANGUAGES = {".c": "c", ".h": "c", ".cpp": "cpp", ".hpp": "cpp", ".py": "python", ".kt": "kotlin", ".toml": "toml",
             ".json": "json", ".sh": "bash", ".cmake": "cmake"}  # fmt: skip
IMAGES = (".png", ".jpg", ".gif", ".svg")


def target_of(path: str, root: Path) -> str | None:
    """The page or file of the site for a path of the repository; None if it has none."""
    file = root / path
    if path.rstrip("/") == HEADERS:
        return "api/c/README.md"
    if file.is_dir():
        page = f"{path.rstrip('/')}/README.md".removeprefix("./")
        return page if (root / page).is_file() else None
    if path.startswith(HEADERS):
        return f"api/{'cpp' if path.endswith('.hpp') else 'c'}/{file.name}.md"
    if not file.is_file():
        return None
    return path if file.suffix in (".md", *IMAGES) else f"{path}.md"


def with_anchors(text: str) -> str:
    """The page with an anchor at each heading, as GitHub and GitLab make them: repeated ones end in -1, -2, …"""
    found: dict[str, int] = {}
    lines, is_fenced = [], False
    for line in text.splitlines():
        is_fenced ^= line.startswith("```")
        if not is_fenced and re.match(r"#{1,6} ", line):
            shown = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", line.lstrip("# ").rstrip(" #"))
            name = re.sub(r"[^\w\- ]", "", shown.lower()).replace(" ", "-")
            found[name] = found.get(name, -1) + 1
            line += f" {{#{name}-{found[name]}}}" if found[name] else f" {{#{name}}}"
        lines.append(line)
    return "\n".join(lines) + text[len(text.rstrip("\n")) :]


def rewritten(page: str, text: str, root: Path) -> tuple[str, list[str]]:
    """The page with its links changed to the site's, and the repository's files that it links."""
    linked = []

    def replace(match: re.Match) -> str:
        link, _, anchor = match[2].partition("#")
        if not link or re.match(r"[a-z][a-z0-9+.-]*:", link):
            return match[0]
        path = os.path.normpath(os.path.join(os.path.dirname(page), link))
        target = target_of(path, root)
        if target is None:
            return match[1] + "#" + match[3]
        if not target.startswith("api/"):
            linked.append(target.removesuffix(".md") if not (root / target).is_file() else target)
        place = os.path.relpath(target, os.path.dirname(page) or ".")
        return f"{match[1]}{place}{'#' + anchor if anchor else ''}{match[3]}"

    parts = CODE.split(with_anchors(text))
    return "".join(p if i % 2 else LINK.sub(replace, p) for i, p in enumerate(parts)), linked


def copy_pages(root: Path, out: Path, first: list[str]) -> list[str]:
    """Copies the pages `first` and all that they lead to; returns the paths of the pages."""
    todo, pages = list(first), []
    seen = set(todo)
    while todo:
        path = todo.pop(0)
        place = out / path
        place.parent.mkdir(parents=True, exist_ok=True)
        if path.endswith(IMAGES):
            shutil.copyfile(root / path, place)
            continue
        if path.endswith(".md"):
            text, linked = rewritten(path, (root / path).read_text(), root)
            place.write_text(text)
            pages.append(path)
            todo += [new for new in dict.fromkeys(linked) if new not in seen]
            seen.update(linked)
        else:
            language = LANGUAGES.get(Path(path).suffix, "text")
            code = (root / path).read_text(errors="replace")
            place.with_name(place.name + ".md").write_text(f"# {path}\n\n~~~~{language}\n{code}\n~~~~\n")
    return pages
