"""Writes maquette/settings.py, the keyword arguments of the package for type checkers, from the headers of the SDK.

python python/write_settings.py
"""

from __future__ import annotations

import re
import sys
import textwrap
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "maquette"))
from declarations import enum_names, read_headers  # noqa: E402  the package itself needs numpy

# Classes of the module: the struct, and its fields that are arguments of their own or not for Python.
SETTINGS = {
    "SourceSettings": ("maq_source_config", ()),
    "RecorderSettings": ("maq_recorder_config", ()),
    "ModelSettings": ("maq_model_options", ("bundle_files", "bundle_file_count")),
    "DensePoseSettings": ("maq_densepose_config", ()),
    "BodySettings": ("maq_body_config", ()),
    "EdgesSettings": ("maq_edges_config", ()),
    "CurvesSettings": ("maq_edges_curves_config", ()),
    "EdgesFusionSettings": ("maq_edges_fusion_config", ()),
    "PredictorSettings": ("maq_predictor_config", ("method", "shared_with")),
    "ConcealerSettings": ("maq_concealer_config", ("max_gap_ms", "method")),
    "SceneBuildSettings": ("maq_scene_build_config", ("points",)),
    "DenseCloudSettings": ("maq_dense_cloud_config", ()),
    "SceneRendererSettings": ("maq_scene_renderer_config", ()),
    "HeadBuilderSettings": ("maq_head_builder_config", ("texture",)),
    "HeadRendererSettings": ("maq_head_renderer_config", ("shading", "use_background", "background")),
    "PipelineSettings": ("maq_pipeline_config", ("source",)),
}
ENUMS = {
    "PartColours": "maq_densepose_colours",
    "HeadShading": "maq_head_shading",
    "PredictorMethod": "maq_predictor_method",
    "SourceControl": "maq_source_control",
}


def settings_module(headers: Path) -> str:
    """Returns the text of settings.py: a TypedDict for each config, with the comments of the headers."""
    ffi = read_headers(headers)
    text = "\n".join(path.read_text() for path in sorted(headers.glob("*.h")))
    names = {c: f'"{name}"' for kind in ffi.list_types()[0] if ffi.typeof(kind).kind == "enum"
             for c, name in _names_in_c(ffi.typeof(kind))}  # fmt: skip
    classes = [
        '"""Keyword arguments of the classes: the configs of the C API. Written by python/write_settings.py."""\n\n'
        "from __future__ import annotations\n\nimport os\nfrom collections.abc import Sequence\n"
        "from typing import Literal, TypedDict\n\n"
        + "\n".join(f"{name} = {_literal(ffi.typeof(enum), 0)}" for name, enum in ENUMS.items())
    ]
    for name, (struct, left_out) in SETTINGS.items():
        fields = dict(ffi.typeof(struct).fields)
        base = "ModelSettings" if "model" in fields else "TypedDict"
        body = re.search(rf"struct {struct} {{(.*?)^}}", text, re.DOTALL | re.MULTILINE)[1]
        lines = [
            f"    {field}: {_type(kind.type)}" + _docstring(body, field, names)
            for field, kind in fields.items()
            if field not in ("struct_size", "model", *left_out) and not field.endswith(("_callback", "_user_data"))
        ]
        classes.append(f'class {name}({base}, total=False):\n    """Fields of {struct}."""\n\n' + "\n\n".join(lines))
    return "\n\n\n".join(classes) + "\n"


def _names_in_c(kind: Any) -> list[tuple[str, str]]:
    return [(kind.elements[value], name) for name, value in enum_names(kind).items()]


def _literal(kind: Any, indent: int) -> str:
    names = ", ".join(f'"{name}"' for name in enum_names(kind))
    if len(names) + indent < 95:
        return f"Literal[{names}]"
    return f"Literal[\n    {names}\n]"  # one line, as ruff formats it


def _type(kind: Any) -> str:
    if kind.kind == "enum":
        return _literal(kind, 30)
    if kind.kind == "array":
        return "Sequence[int]"
    return {"float": "float", "double": "float", "char *": "str | os.PathLike[str]"}.get(kind.cname, "int")


def _docstring(body: str, field: str, names: dict[str, str]) -> str:
    """The comment of a field, with names of Python in place of C's."""
    comment = re.search(rf"\b{field}(?:\[\d+\])?;\s*/\*(.*?)\*/", body, re.DOTALL)
    if comment is None:
        return ""
    words = re.sub(r"MAQ_\w+", lambda found: names.get(found[0], found[0]), " ".join(comment[1].split()))
    words = words.replace("NULL", "None")
    sentence = f'"""{words[0].upper()}{words[1:]}{"" if words.endswith(".") else "."}"""'
    return "\n" + textwrap.indent("\n".join(textwrap.wrap(sentence, 116)), "    ")


if __name__ == "__main__":
    (HERE / "maquette/settings.py").write_text(settings_module(HERE.parent / "sdk/include/maquette"))
