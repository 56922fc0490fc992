"""Writes the part of the Android binding that follows from the headers of the C API:

    .venv/bin/python scripts/android/native.py [--check]

Reads sdk/include/maquette and the Kotlin sources of android/maquette, and writes, for the functions, structs, fields
and constants that these sources name:
- Native.kt: the functions as native methods, the structs as classes of Memory, the constants;
- methods.inc: the same functions, which jni_methods.cpp registers, and the layout of the structs for the compiler.

Run it after a change of the headers, or after Kotlin code uses another function. --check writes nothing and fails where
a file would change.
"""

from __future__ import annotations

import re
import sys
import textwrap
from pathlib import Path

from cffi import FFI

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python"))

from maquette.declarations import declarations  # noqa: E402

HEADERS = ROOT / "sdk/include/maquette"
MAIN = ROOT / "android/maquette/src/main"
KOTLIN = MAIN / "kotlin/dev/maquette/jni/Native.kt"
METHODS = MAIN / "cpp/methods.inc"
NOTE = "Written by scripts/android/native.py from sdk/include/maquette: do not edit."
# C type -> Kotlin type, and the function of Memory that reads and writes it.
NUMBERS = {
    "int32_t": ("Int", "int"),
    "uint32_t": ("Int", "int"),
    "int64_t": ("Long", "long"),
    "uint64_t": ("Long", "long"),
    "size_t": ("Long", "long"),
    "float": ("Float", "float"),
    "double": ("Double", "double"),
}


class Api:
    """The C API, and the words of the Kotlin sources, which tell what of it is used."""

    def __init__(self) -> None:
        self.text = declarations(HEADERS)
        self.ffi = FFI()
        self.ffi.cdef(self.text)
        self.constants = self.ffi.dlopen(None)
        sources = [path for path in sorted(MAIN.rglob("*.kt")) if path != KOTLIN]
        self.used = set(re.findall(r"\w+", "\n".join(path.read_text() for path in sources)))

    def functions(self) -> dict[str, tuple[str, list[tuple[str, str]]]]:
        """Name -> type of the result, and type and name of each parameter; of the functions that are used."""
        found = {}
        pattern = r"^([\w ]+?\**) ?(maq_\w+)\(([^)]*)\);"
        for result, name, parameters in re.findall(pattern, self.text, re.MULTILINE):
            pairs = [re.fullmatch(r"(.*?)(\w+)((?:\[\d*\])*)", p.strip()) for p in parameters.split(",")]
            kept = [(m[1].strip() + "*" * bool(m[3]), m[2]) for m in pairs if m[1]]
            found[name] = (result.strip(), kept)
        return {name: found[name] for name in sorted(found) if name in self.used}

    def structs(self) -> dict[str, FFI.CType]:
        """The structs that are used, after those that they hold."""
        found = {}

        def add(name: str) -> None:
            kind = self.ffi.typeof(name)
            if kind.kind != "struct" or not kind.fields or name in found:
                return
            for field_name, field in kind.fields:
                if field.type.kind == "struct" and field_name in self.used:
                    add(field.type.cname.removeprefix("struct "))
            found[name] = kind

        for name in self.ffi.list_types()[0]:
            if name in self.used:
                add(name)
        return found

    def groups_of_constants(self) -> list[list[tuple[str, int]]]:
        """Name and value of the constants that are used: those of each enum, then the rest."""
        enums = [self.ffi.typeof(name) for name in self.ffi.list_types()[0]]
        groups = [[(kind.elements[n], n) for n in sorted(kind.elements)] for kind in enums if kind.kind == "enum"]
        names = set(re.findall(r"\bMAQ_\w+", self.text)) - {name for group in groups for name, _ in group}
        major, minor, patch = (getattr(self.constants, f"MAQ_VERSION_{part}") for part in ("MAJOR", "MINOR", "PATCH"))
        rest = [(name, getattr(self.constants, name)) for name in sorted(names)]
        rest = [(name, n - (1 << 32) if n >> 31 == 1 else n) for name, n in rest]  # an Int
        groups.append([("MAQ_HEADER_VERSION", major * 10000 + minor * 100 + patch), *rest])
        used = [[(name, n) for name, n in group if name in self.used] for group in groups]
        return [group for group in used if group]

    def is_opaque(self, pointed: FFI.CType) -> bool:
        return pointed.kind == "struct" and pointed.fields is None

    def parameter(self, c_type: str) -> str | None:
        """The Kotlin type of a parameter; None: a new handle, which the method returns."""
        if c_type in NUMBERS:
            return NUMBERS[c_type][0]
        kind = self.ffi.typeof(c_type)
        if kind.kind == "enum":
            return "Int"
        item = kind.item if kind.kind == "pointer" else kind
        if item.kind == "pointer" and self.is_opaque(item.item) and "const" not in c_type:
            return None
        is_address = item.kind == "function" or self.is_opaque(item) or c_type == "void*"
        return "Long" if is_address else "Memory?"

    def result(self, c_type: str) -> str:
        if c_type in ("maq_status", "void"):
            return ""
        return ": Int" if c_type in NUMBERS else ": Long"

    def field(self, name: str, field, is_input: bool) -> str:
        """The property of a field."""
        at, kind = field.offset, field.type
        if kind.kind == "struct":
            return f"val {name} = {kind.cname.removeprefix('struct ')}(this, {at})"
        is_address = kind.kind == "function" or (kind.kind == "pointer" and self.is_opaque(kind.item))
        if is_address or name.endswith("user_data"):
            return _property(name, "Long", f"long({at})", f"long({at}, v)", is_input)
        if kind.kind in ("pointer", "array"):
            count = 1
            while kind.kind == "array":
                count, kind = count * kind.length, kind.item
            if kind.kind == "pointer":
                return f"val {name} get() = " + (f"pointers({at}, {count})" if count > 1 else f"Pointer(this, {at})")
            if kind.cname == "char":
                return f"val {name} get() = text({at}, {count})"
            if kind.cname == "uint8_t":
                return _property(name, "ByteArray", f"bytes({at}, {count})", f"bytes({at}, v)", is_input)
            kotlin, read = NUMBERS[kind.cname]
            return _property(name, f"List<{kotlin}>", f"{read}s({at}, {count})", f"{read}s({at}, v)", is_input)
        kotlin, read = NUMBERS.get(kind.cname, NUMBERS["int32_t"])
        if name.endswith("_ms") and kotlin == "Float":  # times are Double in Kotlin
            return f"val {name} get() = float({at}).toDouble()"
        return _property(name, kotlin, f"{read}({at})", f"{read}({at}, v)", is_input)

    def inputs(self) -> set[str]:
        """The structs that the library reads."""
        names = set(re.findall(r"\bconst (maq_\w+)\*", self.text))
        for name, kind in reversed(self.structs().items()):
            held = {field.type.cname.removeprefix("struct ") for _, field in kind.fields if field.type.kind == "struct"}
            names |= held if name in names else set()
        return names


def _property(name: str, kotlin: str, read: str, write: str, is_input: bool) -> str:
    return f"var {name}: {kotlin} get() = {read}; set(v) = {write}" if is_input else f"val {name} get() = {read}"


def _packed(declarations: list[str], indent: str) -> list[str]:
    """Several declarations a line."""
    text = "; ".join(declaration.replace(" ", "~") for declaration in declarations)
    lines = textwrap.wrap(text, 120 - len(indent), break_long_words=False, break_on_hyphens=False)
    return [indent + line.rstrip(";").replace("~", " ") for line in lines]


def _method(api: Api, name: str, result: str, parameters: list[tuple[str, str]]) -> list[str]:
    typed = [(parameter, api.parameter(c_type)) for c_type, parameter in parameters]
    returned = ": Long" if any(kotlin is None for _, kotlin in typed) else api.result(result)
    listed = ", ".join(f"{parameter}:~{kotlin}" for parameter, kotlin in typed if kotlin)
    line = f"@JvmStatic external fun {name}({listed}){returned}"
    wrapped = textwrap.wrap(line, 120, initial_indent="    ", subsequent_indent="        ")
    return [part.replace("~", " ") for part in wrapped]


def kotlin(api: Api) -> str:
    lines = [
        f"// {NOTE}",
        '@file:Suppress("ClassName", "FunctionName", "PropertyName")',
        "",
        "package dev.maquette.jni",
        "",
        "/**",
        " * The functions of the C API under their own names, as its headers describe them. A handle or address is a",
        " * Long. A function that makes a handle returns it. A status other than MAQ_OK becomes a MaquetteException.",
        " */",
        "internal object Native {",
        "    init {",
        '        System.loadLibrary("maquette_jni")',
        "    }",
        "",
    ]
    for name, (result, parameters) in api.functions().items():
        lines += _method(api, name, result, parameters)
    lines += ["}", ""]
    for group in api.groups_of_constants():
        lines += _packed([f"internal const val {name} = {value}" for name, value in group], "")
    inputs = api.inputs()
    for name, kind in api.structs().items():
        fields = dict(kind.fields)
        base = "Struct" if "struct_size" in fields else "Memory"
        lines += [
            "",
            f"internal class {name}(outer: Memory? = null, at: Int = 0) : {base}({api.ffi.sizeof(kind)}, outer, at) {{",
        ]
        used = [name for name in fields if name in api.used and name != "struct_size"]
        lines += _packed([api.field(one, fields[one], name in inputs) for one in used], "    ")
        lines.append("}")
    return "\n".join(lines) + "\n"


def methods(api: Api) -> str:
    """The arguments of two macros: METHOD(function), LAYOUT(struct, bytes, AT(field, offset) ...)."""
    lines = [f"// {NOTE}", "#ifdef METHOD"]
    lines += textwrap.wrap(" ".join(f"METHOD({name})" for name in api.functions()), 120)
    lines += ["#endif", "#ifdef LAYOUT"]
    for name, kind in api.structs().items():
        fields = " ".join(f"AT({name},~{field.offset})" for name, field in kind.fields if name in api.used)
        lines += textwrap.wrap(f"LAYOUT({name},~{api.ffi.sizeof(kind)},~{fields})", 120, subsequent_indent="  ")
    lines.append("#endif")
    return "\n".join(lines).replace("~", " ") + "\n"


def written() -> dict[Path, str]:
    api = Api()
    return {KOTLIN: kotlin(api), METHODS: methods(api)}


def main() -> None:
    if sys.argv[1:] not in ([], ["--check"]):
        sys.exit(__doc__)
    for path, text in written().items():
        if sys.argv[1:] == [] and (not path.exists() or path.read_text() != text):
            path.write_text(text)
        elif not path.exists() or path.read_text() != text:
            sys.exit(f"{path.relative_to(ROOT)} does not fit the headers: run scripts/android/native.py")


if __name__ == "__main__":
    main()
