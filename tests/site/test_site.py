"""The site in build/site, as a reader meets it: each internal link leads to a page and a heading that exist.

make site
"""

import os
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

SITE = Path(os.environ.get("MAQ_SITE", Path(__file__).parents[2] / "build/site"))
PAGES = sorted(SITE.rglob("*.html"))


class Page(HTMLParser):
    def __init__(self, file: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.loaded: list[str] = []
        self.feed(file.read_text())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.anchors.update(values[name] for name in ("id", "name") if values.get(name))
        links = [values[name] for name in ("href", "src") if values.get(name)]
        self.links += links
        if tag != "a":
            self.loaded += links


def test_pages_of_all_parts_are_there():
    names = {path.relative_to(SITE).as_posix() for path in PAGES}
    parts = ["index", "docs/guide/link", "docs/reference/errors"]
    parts += ["api/c/source.h", "api/cpp/source.hpp", "api/python/densepose", "api/kotlin/index"]
    assert {f"{part}.html" for part in parts} <= names
    assert "maq_source_create" in (SITE / "api/c/source.h.html").read_text()


def test_every_internal_link_leads_to_a_page_and_a_heading():
    pages = {path: Page(path) for path in PAGES}
    wrong = []
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.is_file():
                wrong.append(f"{path.relative_to(SITE)}: {link}: no such file")
            elif parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors:
                wrong.append(f"{path.relative_to(SITE)}: {link}: no such heading")
    assert len(pages) > 100
    assert not wrong, "\n".join(["", *wrong])


def test_nothing_is_loaded_from_elsewhere():
    loaded = [(path, link) for path in PAGES for link in Page(path).loaded if urlsplit(link).netloc]
    assert loaded == []


@pytest.mark.skipif(shutil.which("chromium") is None, reason="chromium is missing")
def test_a_browser_shows_a_page_of_the_reference():
    command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"]
    page = SITE / "api/c/source.h.html"
    shown = subprocess.run([*command, page.resolve().as_uri()], capture_output=True, text=True, timeout=120).stdout
    assert "maq_source_create" in shown
