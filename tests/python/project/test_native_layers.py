"""Who may include whom in the C++ code, how large a folder is, and that each says what it is for."""

import re
from collections import Counter, defaultdict
from pathlib import Path

import pytest

SRC = Path("sdk/src")
ROOTS = {"sdk/src": SRC, "sdk/app": Path("sdk/app"), "sdk/tools": Path("sdk/tools"), "demo": Path("desktop_demo/src")}
LIBRARIES = (SRC, ROOTS["sdk/app"], ROOTS["sdk/tools"])  # the demo has its README one folder up
CODE = (".h", ".hpp", ".cpp")
MAX_FILES, SMALL_UNIT_LINES = 25, 60

# Each folder of sdk/src, and the folders that its files may include beside their own. A folder in a folder is a room of
# its own: "scene" means the files of sdk/src/scene, not those of its rooms.
BASE = {"core", "core/files", "core/json", "core/math", "image", "image/geometry", "image/clips", "image/files", "nn"}
BACKEND = BASE - {"nn"} | {"sources"}
CAPTURE = BASE | {"scene"}
FITTED = CAPTURE | {"scene/capture", "scene/networks", "scene/format"}
SEEN = FITTED | {"scene/visibility"}
FUSED = CAPTURE | {"scene/capture", "scene/stereo"}
SCENE = SEEN | FUSED | {"scene/fusion", "scene/assembly", "scene/render", "scene/splats", "scene/splats/files"}
DENSEPOSE = {"densepose/bundle", "densepose/crops", "densepose/detector", "densepose/keypoints", "densepose/surface",
             "densepose/texture", "densepose/tracking"}  # fmt: skip
CURVES = {"edges", "edges/curves"}
HEAD = {"head", "head/camera", "head/field", "head/fit", "head/mesh", "head/texture", "head/registration"}
SYSTEMS = (
    SCENE
    | CURVES
    | HEAD
    | DENSEPOSE
    | {"densepose", "edges/files", "edges/fusion", "edges/measuring", "head/reconstruction", "head/bundle",
       "head/files", "head/render", "prediction", "prediction/blend", "prediction/codec", "prediction/flow",
       "prediction/health", "prediction/sampling", "prediction/transformer", "sources",
       "sources/recording"}
)  # fmt: skip
MAY_INCLUDE = {
    "core": set(),
    "core/files": {"core"},
    "core/json": set(),
    "core/math": set(),
    "core/trace": set(),
    "image": {"core", "image/geometry"},
    "image/clips": {"core", "core/files", "image"},
    "image/files": {"core", "core/files", "image"},
    "image/files/android": {"core", "core/files", "image", "image/files"},
    "image/geometry": {"core", "image"},
    "nn": {"core", "core/files", "core/json", "nn/portable"},
    "nn/portable": {"core"},
    "densepose": BASE | DENSEPOSE | {"core/trace"},
    "densepose/bundle": BASE,
    "densepose/detector": BASE | {"core/trace", "densepose/bundle"},
    "densepose/surface": BASE | {"densepose/bundle", "densepose/detector"},
    "densepose/texture": BASE | {"densepose/surface"},
    "densepose/tracking": BASE | {"densepose/detector", "densepose/surface"},
    "densepose/keypoints": BASE | {"densepose/bundle"},
    "densepose/crops": BASE | DENSEPOSE - {"densepose/crops", "densepose/keypoints", "densepose/tracking"},
    "body/model": BASE,
    "body/pose": {"core", "core/math", "body/model"},
    "body/sizes": {"core", "core/math", "body/model", "body/pose"},
    "body/fit": {"core", "core/math", "body/model", "body/pose", "body/sizes"},
    "body/files": {"core", "core/files", "core/math", "body/fit", "body/model", "body/pose"},
    "edges": BASE,
    "edges/curves": BASE - {"nn"} | {"edges"},
    "edges/files": BASE - {"nn"} | CURVES,
    "edges/fusion": BASE - {"nn"} | CURVES,
    "edges/measuring": BASE - {"nn"} | CURVES,
    "head": {"core", "core/math", "head/camera", "head/field"},
    "head/bundle": BASE | {"head", "head/field", "head/files", "head/fit"},
    "head/reconstruction": BASE | {"head/bundle"} | HEAD,
    "head/camera": {"core", "core/math"},
    "head/field": {"core", "core/math"},
    "head/files": {"core", "core/files", "core/math", "head", "head/camera", "head/field"},
    "head/fit": BASE - {"nn"} | {"head", "head/camera", "head/field"},
    "head/mesh": BASE - {"nn"} | {"head/camera"},
    "head/render": BASE - {"nn"} | {"head/camera", "head/mesh"},
    "head/texture": BASE - {"nn"} | {"head", "head/camera", "head/mesh"},
    "head/registration": {"core", "core/math", "head"},
    "prediction": {"core", "image"},
    "prediction/flow": {"core", "image"},
    "prediction/blend": {"core", "image", "prediction", "prediction/flow"},
    "prediction/codec": BASE,
    "prediction/transformer": BASE | {"prediction", "prediction/blend", "prediction/codec"},
    "prediction/health": {"core", "image", "prediction/flow"},
    "prediction/sampling": BASE | {"prediction", "prediction/blend", "prediction/codec", "prediction/flow",
                                   "prediction/transformer"},
    "scene": BASE - {"nn"},
    "scene/capture": CAPTURE,
    "scene/networks": CAPTURE,
    "scene/format": CAPTURE | {"scene/networks"},
    "scene/visibility": FITTED - {"scene/capture"},
    "scene/stereo": CAPTURE - {"nn"},
    "scene/fusion": FUSED - {"nn"},
    "scene/assembly": SEEN | {"scene/fusion"},
    "scene/render": SEEN - {"scene/capture"},
    "scene/splats": CAPTURE - {"nn"} | {"scene/capture", "scene/format"},
    "scene/splats/files": CAPTURE - {"nn"} | {"scene/capture", "scene/splats"},
    "sources": BACKEND | {"sources/android", "sources/v4l2", "sources/libcamera", "sources/depthai",
                          "sources/recording", "sources/files", "sources/synthetic"},
    "sources/android": BACKEND,
    "sources/v4l2": BACKEND,
    "sources/libcamera": BACKEND,
    "sources/depthai": BACKEND,
    "sources/recording": BACKEND,
    "sources/files": BACKEND,
    "sources/synthetic": BACKEND | {"sources/recording"},
    "concealment": BASE - {"nn"} | {"prediction", "prediction/blend", "sources"},
    "pipeline": {"core", "core/trace", "image", "sources", "sources/recording"},
    "api": SYSTEMS | {"pipeline"},
    "api/body": BASE | {"api", "body/files", "body/fit", "body/model", "body/pose", "body/sizes"},
    "api/densepose": BASE | DENSEPOSE | {"api", "densepose", "pipeline"},
    "api/edges": BASE | CURVES | {"api", "edges/files", "edges/fusion", "edges/measuring", "pipeline"},
    "api/head": SYSTEMS | {"api", "api/image"},
    "api/image": BASE | {"api"},
    "api/prediction": SYSTEMS | {"api", "concealment", "pipeline"},
    "api/scene": SCENE | {"api", "api/image"},
}  # fmt: skip

# Each folder of sdk/tools, and those that its files may include beside their own; "." is sdk/tools itself, without the
# two programs, which know everything.
TOOLS_MAY_INCLUDE = {
    ".": set(),
    "arguments": {"."},
    "output": {"."},
    "commands": {".", "arguments", "output"},
    "commands/body": {".", "arguments", "commands", "output"},
    "commands/head": {".", "arguments", "commands", "output"},
    "commands/prediction": {".", "arguments", "commands", "output"},
}

# Files of sdk/src and sdk/app that the tools compile: there is one way to write a file atomically, and one to draw
# edges.
COMPILED_IN = {
    ("sdk/tools/output/output_file.cpp", "core/files/atomic_file.h"),
    ("sdk/tools/output/edge_overlay.cpp", "app/edge_picture.h"),
}

# sources/registry.cpp alone knows every backend; the other files of the folder know none.
REGISTRY = "sources/registry.cpp"

# Foreign headers, and the files that may include them.
FOREIGN = {
    r"onnxruntime.*": r"sdk/src/nn/.*",
    r"linux/videodev2\.h": r"sdk/src/sources/v4l2/.*",
    r"(camera|media)/Ndk.*": r"sdk/src/sources/android/camera2_functions\.cpp",
    r"libcamera/.*": r"sdk/src/sources/libcamera/.*",
    r"depthai/.*": r"sdk/src/sources/depthai/depthai_session\.cpp",
    r"nlohmann/.*": r"sdk/src/core/json/.*\.cpp|sdk/tools/.*|desktop_demo/src/.*",
    r"opencv2/.*": r"nowhere",
    r"png\.h": r"sdk/src/image/files/png\.cpp",
    r"webp/.*": r"sdk/src/image/files/webp\.cpp",
    r"turbojpeg\.h": r"sdk/src/image/files/jpeg\.cpp",
    r"vpx/.*": r"sdk/src/image/clips/vp9_encoder\.cpp",
    r"zlib\.h": r"sdk/src/(image/files/(png|tiff)|scene/splats/files/gzip_file)\.cpp",
    r"GLFW/.*|epoxy/.*|imgui.*|backends/imgui.*": r"desktop_demo/src/.*",
    r"CLI/.*": r"sdk/tools/.*|desktop_demo/src/.*",
}

# Units under 60 lines that one other unit uses, each with its reason to be one.
DEFENDED = {
    "densepose/detector/rotated_input": "geometry with a test of its own",
    "image/files/webp": "the one place of libwebp",
    "head/fit/adam": "an algorithm of the literature, with a test of its own",
    "head/fit/pose_rays": "geometry with a test of its own, against finite differences",
    "prediction/transformer/philox": "an algorithm of the literature with a test of its own",
    "scene/render/refiner_roi": "geometry with tests of its own, against every pixel that the refiner reads",
}


def code_files(root: Path) -> list[Path]:
    return sorted(path for path in root.rglob("*") if path.suffix in CODE)


def includes(path: Path) -> list[str]:
    return re.findall(r'^\s*#\s*include\s+[<"]([^>"]+)[>"]', path.read_text(), re.MULTILINE)


def folder_of(path: Path) -> str:
    """Returns the folder of a file of sdk/src, by its name in MAY_INCLUDE."""
    return path.parent.relative_to(SRC).as_posix()


def arrows() -> list[tuple[Path, Path]]:
    """Includes within sdk/src, as (file, included file)."""
    return [
        (path, SRC / name) for path in code_files(SRC) for name in includes(path) if (SRC / name).is_file()
    ]  # fmt: skip


def units(root: Path) -> dict[str, list[Path]]:
    """The files of each unit: a header and the source of its name."""
    found = defaultdict(list)
    for path in code_files(root):
        found[path.with_suffix("").as_posix()].append(path)
    return found


def test_every_folder_has_its_layer():
    folders = {folder_of(path) for path in code_files(SRC)}
    assert sorted(folders - MAY_INCLUDE.keys()) == []
    assert sorted(name for name, known in MAY_INCLUDE.items() if known - MAY_INCLUDE.keys()) == []


def test_no_include_goes_up_or_across():
    wrong = []
    for path, included in arrows():
        here, there = folder_of(path), folder_of(included)
        known = there in MAY_INCLUDE[here] and not (here == "sources" and there.startswith("sources/"))
        if here == there or known:
            continue
        if path.relative_to(SRC).as_posix() == REGISTRY and there in MAY_INCLUDE["sources"]:
            continue
        wrong.append(f"{path} includes {included.relative_to(SRC)}: {here} may not know {there}")
    assert wrong == []


def test_the_folders_have_no_cycle():
    """The written layers; image with its two folders, and sources with its backends, count as one layer each."""

    def whole(folder: str) -> str:
        return folder.split("/")[0] if folder.startswith(("image", "sources")) else folder

    below = defaultdict(set)
    for folder, known in MAY_INCLUDE.items():
        below[whole(folder)] |= {whole(name) for name in known} - {whole(folder)}
    while below:
        ends = [folder for folder, known in below.items() if not known & below.keys()]
        assert ends, f"a cycle between {sorted(below)}"
        for folder in ends:
            del below[folder]


def test_no_file_includes_itself_by_way_of_others():
    below = defaultdict(set)
    for path, included in arrows():
        below[path].add(included)
    while True:
        ends = [path for path, known in below.items() if not known & below.keys()]
        if not ends:
            break
        for path in ends:
            del below[path]
    assert sorted(map(str, below)) == []


def test_what_stands_on_the_public_headers_includes_nothing_of_the_library():
    """The app library, the tools and the demo know include/maquette, their own files, and the app library."""
    wrong = []
    for name in ("sdk/app", "sdk/tools", "demo"):
        root = ROOTS[name]
        for path in code_files(root):
            for header in includes(path):
                own = (path.parent / header).is_file() or (root / header).is_file()
                if not own and (SRC / header).is_file() and (path.as_posix(), header) not in COMPILED_IN:
                    wrong.append(f"{path} includes {header} of sdk/src")
                if name == "sdk/app" and header.startswith(("opencv2/", "GLFW/", "epoxy/", "imgui")):
                    wrong.append(f"{path} includes {header}")
                if name == "sdk/tools" and header.startswith("app/") and (path.as_posix(), header) not in COMPILED_IN:
                    wrong.append(f"{path} includes {header}")
    assert wrong == []


@pytest.mark.parametrize("header", FOREIGN)
def test_foreign_headers_stay_behind_their_doors(header):
    files = [path for root in ROOTS.values() for path in code_files(root)]
    users = {path.as_posix() for path in files for name in includes(path) if re.fullmatch(header, name)}
    assert sorted(path for path in users if not re.fullmatch(FOREIGN[header], path)) == []


def test_no_folder_has_more_files_than_a_reader_takes_in():
    counts = Counter(path.parent.as_posix() for root in ROOTS.values() for path in code_files(root))
    assert {folder: count for folder, count in counts.items() if count > MAX_FILES} == {}


def test_the_rooms_of_the_tools_know_only_what_lies_below_them():
    root = ROOTS["sdk/tools"]
    wrong = []
    for path in code_files(root):
        here = path.parent.relative_to(root).as_posix()
        if path.name in ("main.cpp", "bench_main.cpp"):
            continue
        for name in includes(path):
            there = Path(name).parent.as_posix()
            if (root / name).is_file() and there not in TOOLS_MAY_INCLUDE[here] | {here}:
                wrong.append(f"{path} includes {name}")
    assert wrong == []


@pytest.mark.parametrize("folder", sorted({path.parent for root in LIBRARIES for path in code_files(root)}), ids=str)
def test_every_folder_says_what_it_is_for(folder):
    """In 8 to 30 lines, and names no file that is not there."""
    text = (folder / "README.md").read_text()
    assert 8 <= len(text.splitlines()) <= 30
    named = re.findall(r"`([\w/.]+\.(?:h|hpp|cpp))`", text)
    homes = (folder, folder.parent, SRC, Path())
    assert [name for name in named if not any((home / name).is_file() for home in homes)] == []


def test_small_units_with_one_user_have_a_reason():
    """A unit of less than 60 lines that one other unit includes is a part of that one, unless DEFENDED says why not."""
    found = units(SRC)
    unit_of = {path: name for name, files in found.items() for path in files}
    users = defaultdict(set)
    for path, included in arrows():
        if unit_of[path] != unit_of[included]:
            users[unit_of[included]].add(unit_of[path])
    for root in (Path("tests/native"), Path("benchmarks/native")):
        for path in code_files(root):
            for name in includes(path):
                if SRC / name in unit_of:
                    users[unit_of[SRC / name]].add("tests")
    small = {
        Path(name).relative_to(SRC).as_posix()
        for name, files in found.items()
        if any(path.suffix == ".h" for path in files)
        and sum(len(path.read_text().splitlines()) for path in files) < SMALL_UNIT_LINES
        and len(users[name] - {"tests"}) <= 1
    }
    assert sorted(small - DEFENDED.keys()) == []
    assert sorted(DEFENDED.keys() - small) == [], "no longer small with one user: take it off the list"
