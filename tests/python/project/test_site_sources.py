"""Pages of the site (scripts/site) that are made of the repository's; `make site` builds and checks the whole."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "scripts/site"))
import header_filter  # noqa: E402
import sources  # noqa: E402


def test_every_page_that_the_site_links_is_copied(tmp_path):
    pages = sources.copy_pages(ROOT, tmp_path, ["README.md", "docs/README.md"])
    assert {"docs/guide/link.md", "docs/reference/errors.md", "CHANGELOG.md"} <= set(pages)
    for page in pages:
        for _, link, _ in sources.LINK.findall("".join(sources.CODE.split((tmp_path / page).read_text())[::2])):
            path = link.split("#")[0]
            if path and not re.match(r"[a-z]+:", path) and "api/" not in path:
                assert ((tmp_path / page).parent / path).is_file(), f"{page}: {link}"


def test_links_lead_to_the_pages_of_headers_code_and_folders():
    text = "[a](../../sdk/include/maquette) [b](../../examples/c/people.c) [c](link.md#ship-it) [d](../../cmake)"
    changed, linked = sources.rewritten("docs/guide/dense-pose.md", text, ROOT)
    assert changed == "[a](../../api/c/README.md) [b](../../examples/c/people.c.md) [c](link.md#ship-it) [d](#)"
    assert linked == ["examples/c/people.c", "docs/guide/link.md"]


def test_comments_become_doxygen_s_with_their_text_unchanged():
    header = (
        "/* A file. */\n#ifndef A_H_\n/* Returns\n * 1 * 2. */\nint f(void);\nint a; /* one */\n#endif /* A_H_ */\n"
    )
    made = header_filter.for_doxygen(header)
    assert "/** @file\n@verbatim\nA file.\n" in made
    assert "/**\n@verbatim\nReturns\n1 * 2.\n@endverbatim */\nint f" in made
    assert "int a; /**<\n@verbatim\none\n" in made
    assert made.endswith("#endif /* A_H_ */\n")
