"""Makes one Markdown page a type of Dokka's pages (GFM), which has one a member."""

import html
import os
import re
from pathlib import Path

LINK = re.compile(r"\[([^]\n]*)\]\(([^)\s]+\.md)\)")
TYPE = re.compile(r"(?:\w+ )*(?:class|enum|interface|object) ")


class Types:
    def __init__(self, dokka: Path) -> None:
        (self.root,) = (path for path in dokka.glob("*/*") if path.is_dir())  # of the only package
        self.names = {}  # of the folder of a type
        self.texts = {}
        for page in sorted(self.root.rglob("index.md")):
            path, _, text = page.read_text().partition("\n")
            names = [match[0] for match in LINK.findall(path)][2:]
            text = re.sub(r"^\[JVM\]\\\n|\[JVM\]<br>", "", text, flags=re.MULTILINE)
            text = re.sub(
                r"^\| \[[^]]*\]\([^)]*#[^)]*\) .*\n", "", text, flags=re.MULTILINE
            )  # inherited from Android's
            text = re.sub(r"^## \w+\n+\| Name \| Summary \|\n\|---\|---\|\n(?!\|)", "", text, flags=re.MULTILINE)
            declared = re.search(r"\A\s*# .*\n+(.*)", text)
            if names and declared and TYPE.match(declared[1]):  # otherwise the value of an enumeration
                self.names[page.parent] = ".".join(names)
                self.texts[page.parent] = text

    def linked(self, text: str, folder: Path) -> str:
        """Links to members and to their pages become links to the page of the type, or names on that page itself."""

        def replace(match: re.Match) -> str:
            target = Path(os.path.normpath(folder / match[2])).parent
            while target not in self.names and target != self.root and target != target.parent:
                target = target.parent
            name = self.names.get(target)
            if name is None or target == folder:
                return match[1]
            return f"[{match[1]}]({name}.md)"

        return LINK.sub(replace, text)

    def page(self, folder: Path) -> str:
        text = self.linked(self.texts[folder], folder)
        declaration, rest = re.match(r"\s*# [^\n]*\n+([^\n]*)\n(.*)", text, re.DOTALL).groups()
        declaration = html.unescape(re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", declaration))
        if len(declaration) > 100:
            declaration = re.sub(
                r"\((.*)\)", lambda m: "(\n    " + re.sub(r", (?=va[lr] )", ",\n    ", m[1]) + "\n)", declaration
            )
        rest = re.sub(r"^## Constructors\n.*?(?=^## |\Z)", "", rest, flags=re.MULTILINE | re.DOTALL)
        rows = re.sub(r"^\| (\[[^|]*\)) \| .*?(?:<br>(.*))? \|$", r"| \1 | \2 |", rest, flags=re.MULTILINE)
        member = r"^\| (?!Name \|)([\w.]+) \| (.*?)(<br>.*)? \|$"
        rows = re.sub(member, r"| `\1` | <code>\2</code>\3 |", rows, flags=re.MULTILINE)
        return f"# {self.names[folder]}\n\n```kotlin\n{declaration}\n```\n{rows}"

    def index(self) -> str:
        rows = []
        for folder, name in sorted(self.names.items(), key=lambda item: item[1]):
            if "." not in name:
                about = re.match(r"\s*# .*\n+.*\n\n(?!#)(.*)", self.linked(self.texts[folder], folder))
                rows.append(f"| [{name}]({name}.md) | {about[1] if about else ''} |")
        head = "# Kotlin API\n\nBegin with [Maquette](Maquette.md). "
        head += "The [guide for Android](../../docs/guide/android.md) shows it at work.\n\n"
        return head + "| type | task |\n| --- | --- |\n" + "\n".join(rows) + "\n"

    def write(self, folder: Path) -> None:
        folder.mkdir(parents=True)
        for type_folder, name in self.names.items():
            (folder / f"{name}.md").write_text(self.page(type_folder))
        (folder / "README.md").write_text(self.index())
