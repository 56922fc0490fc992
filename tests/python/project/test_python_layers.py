"""Which Python package may import which, and what reads shards without a renderer."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
# A package, and those beside itself that it may import; files directly in export/ are packages of their own here.
ALLOWED = {
    "export.surface": set(),
    "export.surface_grid": {"export.surface"},
    "export.keypoints": set(),
    "export.shards": {"export.surface"},
    "export.average": set(),
    "export.camera": set(),
    "export.point_cloud": set(),
    "export.training": set(),
    "export.jobs": set(),
    "export.bundle": set(),
    "export.data_sources": {"export.bundle"},
    "export.xxh3": set(),
    "export.pack_file": set(),
    "export.checked_file": {"export.xxh3"},
    "export.onnx_graphs": {"export.bundle"},
    "export.photos": set(),
    "export.people": {
        "export.camera", "export.jobs", "export.keypoints", "export.shards", "export.surface", "export.surface_grid",
        "export.xxh3",
    },
    "export.places": {"export.camera", "export.jobs", "export.people", "export.photos", "export.point_cloud"},
    "export.solids": {"export.camera", "export.jobs", "export.photos"},
    "export.clips": {"export.camera", "export.jobs", "export.people", "export.places"},
    "export.densepose": {
        "export.bundle", "export.data_sources", "export.keypoints", "export.onnx_graphs", "export.shards",
        "export.surface", "export.surface_grid", "export.training",
    },
    "export.teachers": {
        "export.camera", "export.densepose", "export.jobs", "export.keypoints", "export.pack_file", "export.people",
        "export.photos", "export.shards", "export.surface",
    },
    "export.prediction": {
        "export.bundle", "export.checked_file", "export.clips", "export.data_sources", "export.densepose",
        "export.jobs", "export.onnx_graphs", "export.pack_file", "export.training",
    },
    "export.scenes": {
        "export.bundle", "export.camera", "export.data_sources", "export.densepose", "export.onnx_graphs",
        "export.point_cloud", "export.training", "export.xxh3",
    },
    "export.edges": {
        "export.bundle", "export.camera", "export.data_sources", "export.densepose", "export.onnx_graphs",
        "export.solids", "export.training",
    },
    "export.body": {
        "export.bundle", "export.checked_file", "export.data_sources", "export.keypoints", "export.people",
        "export.surface", "export.surface_grid", "export.teachers",
    },
    "export.heads": {
        "export.bundle", "export.camera", "export.checked_file", "export.data_sources", "export.densepose",
        "export.keypoints", "export.onnx_graphs", "export.people", "export.teachers", "export.training",
    },
    "export.depth_frames": {"export.edges", "export.photos", "export.solids"},
    "export.captures": {"export.camera", "export.photos", "export.places", "export.point_cloud", "export.scenes"},
    "export.evaluation": {
        "export.body", "export.bundle", "export.camera", "export.densepose", "export.jobs", "export.keypoints",
        "export.people", "export.photos", "export.shards", "export.surface", "export.teachers", "export.training",
    },
    "quantization": {"export"},
    "benchmarks": {"export", "quantization"},
}  # fmt: skip

# A room of a package, and what else of the package it may import.
ROOMS = {
    "export.scenes.networks": ("export.scenes.config",),
    "export.scenes.geometry": ("export.scenes.config",),
    "quantization.graphs": ("quantization.samples",),
    "quantization.analysis": ("quantization.graphs", "quantization.samples"),
}
TREES = ("export", "quantization", "benchmarks")
FOLDERS = sorted({path.parent.relative_to(ROOT) for tree in TREES for path in (ROOT / tree).rglob("*.py")})
MAX_FILES = 25


def package_of(module: str) -> str:
    parts = module.split(".")
    return ".".join(parts[:2]) if parts[0] == "export" else parts[0]


def modules(path: Path) -> set[str]:
    """Names that a file imports, anywhere in it, with their modules."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def imported(path: Path) -> set[str]:
    """Packages of this project that a file imports, anywhere in it."""
    return {package_of(name) for name in modules(path) if name.split(".")[0] in TREES}


@pytest.mark.parametrize("folder", TREES)
def test_packages_import_only_what_lies_below_them(folder):
    for path in sorted((ROOT / folder).rglob("*.py")):
        own = package_of(".".join(path.relative_to(ROOT).with_suffix("").parts))
        if own == "export.__init__":
            continue
        others = imported(path) - {own}
        allowed = ALLOWED[own]
        wrong = {name for name in others if name not in allowed and name.split(".")[0] not in allowed}
        assert not wrong, f"{path.relative_to(ROOT)} imports {', '.join(sorted(wrong))}"


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_import_only_what_lies_below_them(room):
    folder = ROOT.joinpath(*room.split("."))
    package = package_of(room)
    wrong = {
        f"{path.relative_to(ROOT)} imports {name}"
        for path in folder.glob("*.py")
        for name in modules(path)
        if name.startswith(f"{package}.") and not name.startswith((f"{room}.", *ROOMS[room]))
    }
    assert sorted(wrong) == []


@pytest.mark.parametrize("folder", FOLDERS, ids=str)
def test_every_folder_is_small_and_says_what_it_is_for(folder):
    """At most MAX_FILES modules, and a README that names no module that is not there."""
    assert len(list((ROOT / folder).glob("*.py"))) <= MAX_FILES
    text = (ROOT / folder / "README.md").read_text()
    named = re.findall(r"`([\w/]+\.py)`", text)
    homes = (ROOT / folder, ROOT / folder.parent, ROOT)
    assert [name for name in named if not any((home / name).is_file() for home in homes)] == []


def test_the_table_of_packages_has_no_circle():
    floors = {"export": set().union(*(names for own, names in ALLOWED.items() if own.startswith("export.")))}
    left = dict(ALLOWED)
    while left:
        ready = [own for own, names in left.items() if not any(name in left for name in names - floors.keys())]
        assert ready, f"a circle among {', '.join(left)}"
        for own in ready:
            del left[own]


READERS = (
    "export.prediction.train_autoencoder", "export.prediction.codes", "export.prediction.train_transformer",
    "export.densepose.train", "export.densepose.export_onnx", "export.scenes.train", "export.teachers.shards",
    "export.evaluation.__main__", "export.evaluation.gallery", "export.people.clips.clip_file",
    "export.heads.train_prior",
    "export.heads.encoder_training.train",
    "export.heads.export_onnx", "export.heads.bundle", "quantization.quantize", "quantization.choose",
    "quantization.report", "quantization.scenes", "quantization.heads",
)  # fmt: skip


def test_training_calibration_and_evaluation_need_no_renderer():
    pytest.importorskip("torch")
    program = "import importlib, sys\n"
    program += "for name in ('moderngl', 'igl', 'embreex'): sys.modules[name] = None  # an import of it fails\n"
    program += f"for name in {READERS}: importlib.import_module(name)"
    ran = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
