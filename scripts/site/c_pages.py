"""Makes Markdown pages of the C and C++ API from Doxygen's XML: a page for each header, in the header's order."""

import re
import textwrap
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

NAME = re.compile(r"`?\b(maq_\w+|MAQ_\w+)\b(?:\(\))?`?")
THREADS = re.compile(r"\n(?=(Any thread|One at a time|Once for each)\b)")


@dataclass
class Item:
    """One declaration: its name, its code, the text of its comment, and rows of its fields or values."""

    header: str
    line: int
    name: str
    kind: str
    code: str
    text: str
    columns: tuple[str, ...] = ()
    rows: list[tuple[str, ...]] = field(default_factory=list)
    members: list["Item"] = field(default_factory=list)


def comment(node: ElementTree.Element) -> str:
    texts = ["".join(part.itertext()) for kind in ("briefdescription", "detaileddescription", "inbodydescription")
             for found in node.findall(kind) for part in found.iter("verbatim")]  # fmt: skip
    return "\n\n".join(text.strip("\n") for text in texts)


def plain(node: ElementTree.Element | None) -> str:
    return "" if node is None else " ".join("".join(node.itertext()).split())


def tidy(code: str) -> str:
    """Spaces as the headers have them: none inside angle brackets, asterisks beside the type."""
    code = re.sub(r"< (?=\w)", "<", code.replace("maquette::", ""))
    while (closer := re.sub(r"(?<=[\w>*]) >", ">", code)) != code:
        code = closer
    return re.sub(r" ([*&]+) ?", r"\1 ", code).replace("(* ", "(*").replace(") (", ")(").rstrip()


def signature(member: ElementTree.Element) -> str:
    code = plain(member.find("definition"))
    if member.get("kind") != "typedef":
        code += plain(member.find("argsstring"))
    code = tidy(code)
    if len(code) <= 100 or "(" not in code or member.get("kind") == "typedef":
        return code
    head, _, rest = code.partition("(")
    arguments, _, tail = rest.rpartition(")")
    lines = re.split(r", (?![^<(]*[>)])", arguments)
    return f"{head}(\n    " + ",\n    ".join(lines) + f"){tail}"


def item_of(member: ElementTree.Element) -> Item:
    kind, location = member.get("kind"), member.find("location")
    item = Item(Path(location.get("file")).name, int(location.get("line")), plain(member.find("name")), kind, "",
                comment(member))  # fmt: skip
    if kind == "define":
        parameters = ", ".join(plain(p) for p in member.findall("param/defname"))
        head = f"{item.name}({parameters})" if parameters else item.name
        item.code = f"#define {head} {plain(member.find('initializer'))}"
    elif kind == "enum":
        item.columns = ("value", "number", "meaning")
        item.rows = [(plain(v.find("name")), plain(v.find("initializer")).lstrip("= "), comment(v))
                     for v in member.findall("enumvalue")]  # fmt: skip
    else:
        item.code = signature(member) + ";"
    return item


def class_of(compound: ElementTree.Element) -> Item:
    location = compound.find("location")
    name = plain(compound.find("compoundname")).replace("maquette::", "")
    item = Item(Path(location.get("file")).name, int(location.get("line")), name, compound.get("kind"), "",
                comment(compound))  # fmt: skip
    members = [m for m in compound.iter("memberdef") if m.get("prot") == "public"]
    if compound.get("kind") == "struct" and not any(m.get("kind") == "function" for m in members):
        item.columns = ("field", "type", "meaning")
        item.rows = [
            (plain(m.find("name")), tidy(plain(m.find("type")) + plain(m.find("argsstring"))), comment(m))
            for m in members
        ]
    else:
        item.members = sorted((item_of(m) for m in members), key=lambda member: member.line)
    return item


def items(xml: Path) -> Iterator[Item]:
    """All declarations, and for each header an item of kind `file` with its comment."""
    for path in sorted(xml.glob("*.xml")):
        for compound in ElementTree.parse(path).getroot().findall("compounddef"):
            kind = compound.get("kind")
            if kind == "file":
                yield Item(plain(compound.find("compoundname")), 0, "", "file", "", comment(compound))
            if kind in ("file", "namespace"):
                yield from (item_of(member) for member in compound.findall("sectiondef/memberdef"))
            elif kind in ("struct", "class", "union") and "detail" not in plain(compound.find("compoundname")):
                yield class_of(compound)


class Pages:
    def __init__(self, xml: Path) -> None:
        found: dict[tuple[str, int, str], Item] = {}
        for item in items(xml):  # a member of a namespace is in two files
            if item.name.endswith("_H_") or item.name.endswith("_HPP_") or item.name == "MAQ_API":
                continue
            # An opaque handle is declared as a typedef and as a struct without fields.
            found.setdefault((item.header, item.line, item.name), item)
        self.headers: dict[str, list[Item]] = {}
        for item in sorted(found.values(), key=lambda item: (item.header, item.line)):
            self.headers.setdefault(item.header, []).append(item)
        self.places: dict[str, tuple[str, str]] = {}  # of a name: its page and anchor
        for header, declared in self.headers.items():
            for item in declared:
                if item.name and header.endswith(".h"):
                    self.places.setdefault(item.name, (header, item.name))
                    self.places.update({row[0]: (header, item.name) for row in item.rows if row[0].isupper()})

    def linked(self, text: str, header: str) -> str:
        def link(match: re.Match) -> str:
            page, anchor = self.places.get(match[1], ("", ""))
            if not page:
                return match[0]
            folder = "" if header.endswith(".h") else "../c/"
            return f"[`{match[1]}`]({folder}{page}.md#{anchor})"

        return NAME.sub(link, text)

    def prose(self, text: str, header: str) -> str:
        """A comment as Markdown: aligned lines after an empty line are code, the rest are paragraphs and lists."""
        out, is_code, before = [], False, ""
        for line in THREADS.sub("\n\n", text).splitlines():
            starts_code = not before.strip() and line.startswith("  ") and not line.lstrip().startswith("- ")
            if is_code and line.strip() and not line.startswith("  "):
                out.append("```")
                is_code = False
            elif starts_code and not is_code:
                out += ["", "```c"]
                is_code = True
            if is_code:
                out.append(line[2:])
            else:
                escaped = re.sub(r"(?<!`)([*<\[])(?![^`]*`(?:[^`]*`[^`]*`)*[^`]*$)", r"\\\1", line)
                out.append(self.linked(escaped, header))
            before = line
        return "\n".join([*out, *(["```"] if is_code else [])])

    def cell(self, text: str, header: str) -> str:
        return " ".join(self.linked(re.sub(r"([*<\[|])", r"\\\1", text), header).split())

    def members(self, item: Item) -> list[str]:
        """The public members of a class, in the order of the header, without bodies."""
        lines = []
        for member in item.members:
            if member.kind == "friend":
                continue
            text = " ".join(member.text.split())
            lines += [f"  // {line}" for line in textwrap.wrap(text, 100)]
            code = member.code.replace(f"{item.name}::", "", 1) if member.kind == "function" else member.code
            lines += [f"  {line}" for line in code.splitlines()]
        return lines

    def section(self, item: Item, anchors: dict[str, int]) -> str:
        count = anchors[item.name] = anchors.get(item.name, 0) + 1
        anchor = re.sub(r"\W+", "-", item.name) + (f"-{count}" if count > 1 else "")
        out = [f"## {item.name.replace('<', '&lt;')} {{#{anchor}}}", ""] if count == 1 or not item.code else []
        out += ["```cpp", item.code, "```", ""] if item.code else []
        out += [self.prose(item.text, item.header), ""] if item.text else []
        if item.rows:
            out += [f"| {' | '.join(item.columns)} |", "|" + " --- |" * len(item.columns)]
            out += [
                f"| `{row[0]}` | {f'`{row[1]}`' if row[1] else ''} | {self.cell(row[2], item.header)} |"
                for row in item.rows
            ]
            out.append("")
        if item.members:
            out += ["```cpp", f"{item.kind} {item.name} {{", *self.members(item), "};", "```", ""]
        return "\n".join(out)

    def page(self, header: str) -> str:
        described = next((item.text for item in self.headers[header] if item.kind == "file"), "")
        out = [f"# {header}", "", f"```c\n#include <maquette/{header}>\n```", "", self.prose(described, header), ""]
        anchors: dict[str, int] = {}
        out += [self.section(item, anchors) for item in self.headers[header] if item.kind != "file"]
        return "\n".join(out) + "\n"

    def index(self, title: str, suffix: str, first: str) -> str:
        out = [f"# {title}", "", f"Begin with [{first}]({first}.md).", "", "| header | content |", "| --- | --- |"]
        for header, declared in self.headers.items():
            if header.endswith(suffix):
                described = next((item.text for item in declared if item.kind == "file"), "").split("\n\n")[0]
                out.append(f"| [{header}]({header}.md) | {self.cell(described, header)} |")
        return "\n".join(out) + "\n"

    def write(self, out: Path) -> None:
        for name, suffix, title, first in (
            ("c", ".h", "C API", "maquette.h"),
            ("cpp", ".hpp", "C++ API", "maquette.hpp"),
        ):
            folder = out / name
            folder.mkdir(parents=True)
            (folder / "README.md").write_text(self.index(title, suffix, first))
            for header in self.headers:
                if header.endswith(suffix):
                    (folder / f"{header}.md").write_text(self.page(header))
