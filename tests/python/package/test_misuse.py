"""Every function of the C API refuses NULL where it needs an object, and structs of another size, by their names."""

import re
from pathlib import Path
from types import SimpleNamespace

import maquette
import numpy as np
import pytest
from maquette.declarations import declarations
from maquette.native import native

ROOT = Path(__file__).parents[3]
DATA, MODELS = ROOT / "tests/native/data", ROOT / "build/release/stage/share/maquette/models"
TEXT = declarations(ROOT / "sdk/include/maquette")
FUNCTIONS = {name: " ".join(arguments.split()) for name, arguments in
             re.findall(r"maq_status (maq_\w+)\(([^)]*(?:\([^)]*\)[^)]*)*)\);", TEXT)}  # fmt: skip
VERSION = re.findall(r"MAQ_VERSION_(?:MAJOR|MINOR|PATCH) = (\d+)", TEXT)
HEADERS = int(VERSION[0]) * 10000 + int(VERSION[1]) * 100 + int(VERSION[2])
INITS = sorted(name for name in FUNCTIONS if name.endswith("_init"))
RELEASES = sorted(re.findall(r"void (maq_\w+_(?:destroy|release))\(", TEXT))

# Arguments that may be NULL: in every function, or in one.
MAY_BE_NULL = {"config", "user_data", "release_callback", "preview", "seen_point_count", "version", "library_path",
               "width_px", "height_px", "maq_edges_model_create curves",
               "maq_recorder_create source", "maq_head_builder_add_photo photo", "maq_pipeline_set_model model",
               "maq_pipeline_set_recording path", "maq_edges_fusion_copy_points points",
               "maq_densepose_result_find_pixel distance", "maq_dense_cloud_get_points rgb"}  # fmt: skip
# Arguments that are looked at after something that the objects of this test lack: cameras, controls, depth, room.
LATER = {"maq_camera_list_get_camera info", "maq_camera_list_get_mode mode", "maq_source_get_control info",
         "maq_capture_get_drop drop", "maq_capture_load_depth camera", "maq_dense_cloud_create photos",
         "maq_frame_get_depth desc", "maq_pipeline_result_get_camera_health health",
         "maq_densepose_get_surface surface", "maq_densepose_model_get_surface surface",
         "maq_densepose_result_draw frame", "maq_densepose_result_draw drawing",
         "maq_densepose_result_draw rgba"}  # fmt: skip

NAN = float("nan")
# Fields of the config with values out of their range, and words of the message where the field is not in it.
OUT_OF_RANGE = {
    "maq_source_create": {"frame_pool_size": (65,), "queue_length": (65,)},
    "maq_recorder_create": {"jpeg_quality": (101,), "keep_predicted": (2, -1)},
    "maq_concealer_create": {"frame_pool_size": (65,)},
    "maq_densepose_create": {
        "long_side_px": (31, 2049), "score_threshold": (1.5, -0.1, NAN), "max_people": (256,), "max_proposals": (1001,),
        "result_pool_size": (65,), "key_frame_interval": (-1,), "min_person_height_px": (-1,), "detail": (2,),
        "person_crops": (4,), "preset": (2,), "person_crop_px": (63, 513),
        "has_keypoints": (2, -1), "steadiness": (-0.5, -2, 0.96, NAN)},
    "maq_edges_create": {"result_pool_size": (65,), "average_frames": (-1, 65)},
    "maq_edges_result_find_curves": {
        "min_length_px": (3, 2e6, NAN), "skip_boxes": (2, -1), "focal_tolerance": (-0.1, 0.6, NAN)},
    "maq_predictor_create": {"method": (4,), "frame_pool_size": (65,)},
    "maq_scene_build": {
        "long_side_px": (-2, 16385), "coefficient_bits": (9,), "min_variation": (-0.5, NAN),
        "visibility_scale visibility scale": (1.01, NAN), "near_depth nearest point": (-1, NAN), "use_held_out": (2,),
        "points": (3,), "splat_fit_s": (-1, 1e5, NAN)},
    "maq_dense_cloud_create": {"threads": (65, -1)},
    "maq_scene_renderer_create": {"image_pool_size": (65,), "near_depth": (-1, NAN), "use_background": (2,)},
    "maq_pipeline_create": {"result_pool_size": (65,), "nice": (20,)},
    "maq_head_mesh_create": {"cell_m": (-1, 1e-5, 1, NAN)},
    "maq_head_renderer_create": {
        "near_m": (-1, NAN), "shading": (9,), "shading_strength": (1.5, -0.5, NAN), "disable_antialiasing": (2,),
        "use_background": (-1,), "image_pool_size": (65,), "threads": (65,)}}  # fmt: skip


def parameters(function: str) -> list[tuple[str, str]]:
    """Returns (type, name) of each parameter."""
    found = [re.fullmatch(r"(?:const )?(.+?[ *])(\w+)(\[\d+\])?", part.strip()) for part in
             FUNCTIONS[function].split(",")]  # fmt: skip
    return [
        (" ".join((match[1] + ("*" if match[3] else "")).replace("*", " * ").split()), match[2])
        for match in found
        if match
    ]


def dense_cloud() -> maquette.DenseCloud:
    """Returns the cloud of a wall with noise, from three photos."""
    pattern = np.kron(np.random.default_rng(0).integers(30, 220, (24, 48)), np.ones((3, 3))).astype(np.uint8)
    photos = [pattern[:, 20 - shift : 120 - shift] for shift in (0, 10, -10)]
    intrinsics = maquette.Intrinsics.centred(100, 72, fov_deg=60)
    step = 10 * 2 / intrinsics.fx_px
    cameras = [maquette.PinholeCamera(intrinsics, np.eye(3), np.array([-k * step, 0, 0])) for k in (0, 1, -1)]
    x, y = np.meshgrid(np.linspace(-0.8, 0.8, 8), np.linspace(-0.5, 0.5, 8))
    return maquette.DenseCloud(photos, cameras, np.stack([x.ravel(), y.ravel(), 2 + 0.1 * x.ravel()], 1))


@pytest.fixture(scope="module")
def objects(tmp_path_factory) -> SimpleNamespace:
    """One object of each type, by the name of its type."""
    n = native()
    made: dict[str, object] = {"maq_context": n.context}

    def create(kind: str, *arguments, function: str = "", release: str = "") -> object:
        made[kind] = n.create(kind, *arguments, function=function, release=release)
        return made[kind]

    def model(kind: str, folder: Path):
        return n.config(kind, {"bundle_path": folder, "threads": 1})

    def frame_of(uri: str) -> object:
        source = create("maq_source", n.context, uri.encode(), n.ffi.NULL)
        return create("maq_frame", source, -1, function="maq_source_acquire_frame", release="maq_frame_release")

    folder = tmp_path_factory.mktemp("misuse")
    depth = frame_of("stub:solids?scene=box&seed=1&size=320x240")
    edges = create("maq_edges", n.context, model("maq_edges_config", MODELS / "edges-int8"))
    result = create("maq_edges_result", edges, depth, function="maq_edges_run", release="maq_edges_result_release")
    create("maq_edges_curves", result, n.ffi.NULL, function="maq_edges_result_find_curves",
           release="maq_edges_curves_release")  # fmt: skip
    create("maq_edges_fusion", n.context, n.ffi.NULL)
    frame = frame_of("stub:people?count=1&size=320x256&live=1")
    densepose = create("maq_densepose", n.context, model("maq_densepose_config", DATA / "tiny_bundle"))
    create("maq_densepose_result", densepose, frame, function="maq_densepose_run",
           release="maq_densepose_result_release")  # fmt: skip
    planes, labels = (
        n.ffi.new("uint8_t[]", 256),
        n.config("maq_body_input", {"width_px": 16, "height_px": 16, "person_count": 1}),
    )
    labels.part = labels.u = labels.v = planes
    body = create("maq_body", n.context, model("maq_body_config", MODELS / "body"))
    create("maq_body_result", body, labels, function="maq_body_run", release="maq_body_result_release")
    create("maq_body_clip", body)
    create("maq_densepose_texture", n.context, n.ffi.NULL)
    create("maq_model", n.context, n.ffi.NULL, function="maq_densepose_model_create", release="maq_model_destroy")
    n.call("maq_predictor_push", create("maq_predictor", n.context, n.ffi.NULL), frame)
    health = create("maq_camera_health", n.context)
    n.call("maq_camera_health_push", health, frame, n.sized("maq_camera_health_result"))
    create("maq_concealer", n.context, made["maq_source"], n.ffi.NULL)
    capture = create("maq_capture", n.context, bytes(DATA / "tiny_scene/capture"), function="maq_capture_open")
    building = model("maq_scene_build_config", DATA / "tiny_scene/bundle")
    scene = create("maq_scene", n.context, building, capture, function="maq_scene_build")
    cloud = n.sized("maq_point_cloud")
    xyz = n.ffi.new("float[3]")
    cloud.point_count, cloud.xyz, cloud.up[2] = 1, xyz, 1
    create("maq_scene_builder", n.context, building, cloud)
    made["maq_dense_cloud"] = (dense := dense_cloud()).handle
    made["kept"] = dense
    renderer = create("maq_scene_renderer", n.context, model("maq_scene_renderer_config", DATA / "tiny_scene/bundle"),
                      scene)  # fmt: skip
    camera = n.sized("maq_capture_view")
    n.call("maq_capture_get_view", capture, 0, camera)
    pinhole = n.ffi.new("maq_pinhole_camera *", camera.camera)
    create("maq_image", renderer, pinhole, function="maq_scene_renderer_run", release="maq_image_release")
    builder = create("maq_head_builder", n.context, model("maq_head_builder_config", DATA / "round_heads/bundle"))
    photo = n.config("maq_head_photo", {})
    photo.box_px[2], photo.box_px[3] = 90, 120
    grey, desc = n.ffi.new("uint8_t[]", bytes([130]) * 320 * 240), n.config("maq_frame_desc", {})
    desc.format, desc.width_px, desc.height_px = n.lib.MAQ_PIXEL_GREY8, 320, 240
    desc.planes[0] = grey
    plain = n.create("maq_frame", n.context, desc, n.ffi.NULL, n.ffi.NULL, function="maq_frame_wrap",
                     release="maq_frame_release")  # fmt: skip
    n.call("maq_head_builder_add_photo", builder, plain, n.ffi.NULL)
    head = create("maq_head", builder, 0, function="maq_head_builder_fit")
    mesh = create("maq_head_mesh", head, n.ffi.NULL)
    create("maq_head_renderer", n.context, n.ffi.NULL, mesh)
    pipeline = create("maq_pipeline", n.context, n.ffi.NULL)
    n.call("maq_pipeline_set_source", pipeline, b"stub:pattern?size=16x16&frames=1")
    create("maq_pipeline_result", pipeline, -1, function="maq_pipeline_acquire_result",
           release="maq_pipeline_result_release")  # fmt: skip
    create("maq_recorder", n.context, bytes(folder / "a.maqrec"), n.ffi.NULL, n.ffi.NULL)
    create("maq_clip", n.context, bytes(folder / "a.mp4"), 10)
    create("maq_camera_list", n.context)
    return SimpleNamespace(n=n, made=made, kept=[xyz, grey, plain, planes])


def valid(objects: SimpleNamespace, function: str) -> list[object]:
    """Returns arguments with which a function has all that it needs."""
    ffi, values = objects.n.ffi, []
    for kind, name in parameters(function):
        struct = kind.removesuffix(" *")
        if kind == "char *":
            values.append(ffi.new("char[]", b"chin"))
        elif struct in objects.made:
            values.append(objects.made[struct])
        elif kind.endswith("*") and struct.startswith("maq_") and " *" not in struct and struct.endswith("config"):
            values.append(objects.n.config(struct, {}))
        elif kind.endswith("*") and struct.startswith("maq_") and "*" not in struct:
            fields = dict(ffi.typeof(struct).fields or []) if ffi.typeof(struct).kind == "struct" else {}
            values.append(objects.n.sized(struct) if "struct_size" in fields else ffi.new(f"{struct} *"))
        elif kind.endswith("*"):
            values.append(ffi.new("double[512]", [1.0] * 512))
        elif kind.endswith("_callback"):
            values.append(ffi.NULL)
        else:
            values.append(HEADERS if name == "header_version" else int(kind.startswith("maq_") or name.endswith("_px")))
    return values


def refused(objects: SimpleNamespace, function: str, values: list[object], text: str) -> None:
    ffi = objects.n.ffi
    kinds = ffi.typeof(getattr(objects.n.lib, function)).args
    given = [ffi.cast(kind, value) if kind.kind == "pointer" else value
             for kind, value in zip(kinds, values, strict=True)]  # fmt: skip
    assert objects.n.status_name(objects.n.ask(function, *given)) == "MAQ_ERROR_INVALID_ARGUMENT", text
    assert text in ffi.string(objects.n.lib.maq_last_error(ffi.NULL)).decode()


@pytest.mark.parametrize("function", sorted(set(FUNCTIONS) - set(INITS)))
def test_null_and_structs_of_another_size_are_refused_by_name(objects, function):
    for index, (kind, name) in enumerate(parameters(function)):
        if f"{function} {name}" in LATER:
            continue
        is_needed = kind.endswith("*") and name not in MAY_BE_NULL and f"{function} {name}" not in MAY_BE_NULL
        if is_needed:
            values = valid(objects, function)
            values[index] = objects.n.ffi.NULL
            refused(objects, function, values, f"{function}: {name} is NULL.")
        values = valid(objects, function)
        if hasattr(values[index], "struct_size"):
            for size in (0, 4, values[index].struct_size + 8, 0xFFFFFFFF):
                values[index].struct_size = size
                refused(objects, function, values, f"{name}.struct_size is {size}, but this library expects")


@pytest.mark.parametrize("function", sorted(set(FUNCTIONS) - set(INITS)))
def test_handles_of_another_type_and_indices_out_of_range_are_refused_by_name(objects, function):
    for index, (kind, name) in enumerate(parameters(function)):
        values = valid(objects, function)
        struct = kind.removesuffix(" *")
        if struct in objects.made and f"{function} {name}" not in LATER:
            other = "maq_clip" if struct != "maq_clip" else "maq_recorder"
            values[index] = objects.made[other]
            refused(objects, function, values, f"{name} is a {other}, but must be a {struct}.")
        elif name == "index":
            values[index] = 0xFFFFFFFF
            refused(objects, function, values, "index is 4294967295")


def has_model(kind: str) -> bool:
    struct = kind.removesuffix(" *")
    return struct.endswith("_config") and any(name == "model" for name, _ in native().ffi.typeof(struct).fields)


@pytest.mark.parametrize("function", sorted(set(FUNCTIONS) - set(INITS) - {"maq_head_mesh_create"}))
def test_model_options_out_of_range_are_refused_by_name(objects, function):
    for index, (kind, name) in enumerate(parameters(function)):
        for option, value in (("threads", -2), ("threads", 65), ("provider", 9)):
            if has_model(kind):
                values = valid(objects, function)
                setattr(values[index].model, option, value)
                refused(objects, function, values, f"{name}.model.{option} is {value}")


@pytest.mark.parametrize("function", OUT_OF_RANGE)
def test_settings_out_of_range_are_refused_by_name(objects, function):
    index = next(i for i, (kind, _) in enumerate(parameters(function)) if kind.endswith("_config *"))
    for field, wrongs in OUT_OF_RANGE[function].items():
        name, _, words = field.partition(" ")
        for wrong in wrongs:
            values = valid(objects, function)
            setattr(values[index], name, wrong)
            refused(objects, function, values, words or f"{name} is")


@pytest.mark.parametrize("function", INITS)
def test_an_init_function_checks_the_size_and_sets_it(function):
    n = native()
    kind, name = parameters(function)[0]
    struct = n.ffi.new(kind)
    right = n.ffi.sizeof(kind.removesuffix(" *"))
    wrongs = [(struct, wrong, f"struct_size is {wrong},") for wrong in (0, right - 1, right + 8)]
    for pointer, size, text in [(n.ffi.NULL, right, f"{name} is NULL."), *wrongs]:
        assert n.ask(function, pointer, size) != 0
        assert f"{function}: {text}" in n.ffi.string(n.lib.maq_last_error(n.ffi.NULL)).decode()
        assert not any(bytes(n.ffi.buffer(struct))), "nothing is written"
    assert n.ask(function, struct, right) == 0
    assert struct.struct_size == right


def test_null_is_given_back_without_harm():
    n = native()
    assert len(RELEASES) > 25
    for release in RELEASES:
        getattr(n.lib, release)(n.ffi.NULL)
