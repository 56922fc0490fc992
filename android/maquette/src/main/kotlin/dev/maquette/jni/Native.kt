// Written by scripts/android/native.py from sdk/include/maquette: do not edit.
@file:Suppress("ClassName", "FunctionName", "PropertyName")

package dev.maquette.jni

/**
 * The functions of the C API under their own names, as its headers describe them. A handle or address is a
 * Long. A function that makes a handle returns it. A status other than MAQ_OK becomes a MaquetteException.
 */
internal object Native {
    init {
        System.loadLibrary("maquette_jni")
    }

    @JvmStatic external fun maq_body_clip_add_result(clip: Long, result: Long)
    @JvmStatic external fun maq_body_clip_create(body: Long): Long
    @JvmStatic external fun maq_body_clip_destroy(clip: Long)
    @JvmStatic external fun maq_body_clip_get_person_count(clip: Long): Int
    @JvmStatic external fun maq_body_clip_save(clip: Long, path: Memory?)
    @JvmStatic external fun maq_body_clip_save_person(clip: Long, index: Int, path: Memory?)
    @JvmStatic external fun maq_body_create(context: Long, config: Memory?): Long
    @JvmStatic external fun maq_body_destroy(body: Long)
    @JvmStatic external fun maq_body_get_mesh(body: Long, mesh: Memory?)
    @JvmStatic external fun maq_body_reset(body: Long)
    @JvmStatic external fun maq_body_result_get_person(result: Long, index: Int, person: Memory?)
    @JvmStatic external fun maq_body_result_get_person_count(result: Long): Int
    @JvmStatic external fun maq_body_result_get_sizes(result: Long, index: Int, sizes: Memory?)
    @JvmStatic external fun maq_body_result_release(result: Long)
    @JvmStatic external fun maq_body_run(body: Long, input: Memory?): Long
    @JvmStatic external fun maq_camera_event_get_name(event: Int): Long
    @JvmStatic external fun maq_camera_health_copy_map(health: Long, values: Memory?, capacity: Long)
    @JvmStatic external fun maq_camera_health_create(context: Long): Long
    @JvmStatic external fun maq_camera_health_destroy(health: Long)
    @JvmStatic external fun maq_camera_health_get_stats(health: Long, stats: Memory?)
    @JvmStatic external fun maq_camera_health_push(health: Long, frame: Long, result: Memory?)
    @JvmStatic external fun maq_camera_health_reset(health: Long)
    @JvmStatic external fun maq_camera_list_create(context: Long): Long
    @JvmStatic external fun maq_camera_list_destroy(list: Long)
    @JvmStatic external fun maq_camera_list_get_camera(list: Long, index: Int, info: Memory?)
    @JvmStatic external fun maq_camera_list_get_count(list: Long): Int
    @JvmStatic external fun maq_camera_list_get_mode(list: Long, index: Int, mode_index: Int, mode: Memory?)
    @JvmStatic external fun maq_capture_destroy(capture: Long)
    @JvmStatic external fun maq_capture_get_drop(capture: Long, index: Int, drop: Memory?)
    @JvmStatic external fun maq_capture_get_info(capture: Long, info: Memory?)
    @JvmStatic external fun maq_capture_get_view(capture: Long, index: Int, view: Memory?)
    @JvmStatic external fun maq_capture_load_view(capture: Long, index: Int): Long
    @JvmStatic external fun maq_capture_open(context: Long, folder: Memory?): Long
    @JvmStatic external fun maq_concealer_acquire_frame(concealer: Long, timeout_ns: Long): Long
    @JvmStatic external fun maq_concealer_create(context: Long, source: Long, config: Memory?): Long
    @JvmStatic external fun maq_concealer_destroy(concealer: Long)
    @JvmStatic external fun maq_concealer_get_stats(concealer: Long, stats: Memory?)
    @JvmStatic external fun maq_context_create(header_version: Int, config: Memory?): Long
    @JvmStatic external fun maq_context_destroy(context: Long)
    @JvmStatic external fun maq_context_get_onnxruntime(context: Long, version: Memory?, library_path: Memory?)
    @JvmStatic external fun maq_dense_cloud_create(context: Long, config: Memory?, photos: Memory?, photo_count: Int,
        sparse: Memory?): Long
    @JvmStatic external fun maq_dense_cloud_destroy(cloud: Long)
    @JvmStatic external fun maq_dense_cloud_get_points(cloud: Long, points: Memory?, rgb: Memory?)
    @JvmStatic external fun maq_dense_cloud_load_depth(cloud: Long, index: Int, camera: Memory?): Long
    @JvmStatic external fun maq_densepose_cancel(densepose: Long)
    @JvmStatic external fun maq_densepose_create(context: Long, config: Memory?): Long
    @JvmStatic external fun maq_densepose_destroy(densepose: Long)
    @JvmStatic external fun maq_densepose_get_keypoint_name(keypoint: Int): Long
    @JvmStatic external fun maq_densepose_get_part_colour(part: Int, rgb: Memory?)
    @JvmStatic external fun maq_densepose_get_part_name(part: Int): Long
    @JvmStatic external fun maq_densepose_get_surface(densepose: Long, surface: Memory?)
    @JvmStatic external fun maq_densepose_model_create(context: Long, config: Memory?): Long
    @JvmStatic external fun maq_densepose_model_get_stats(model: Long, stats: Memory?)
    @JvmStatic external fun maq_densepose_model_get_surface(model: Long, surface: Memory?)
    @JvmStatic external fun maq_densepose_model_set_frame_budget(model: Long, budget_ms: Double)
    @JvmStatic external fun maq_densepose_model_set_roll(model: Long, roll_rad: Float)
    @JvmStatic external fun maq_densepose_reset(densepose: Long)
    @JvmStatic external fun maq_densepose_result_find_pixel(result: Long, index: Int, part: Int, u: Float, v: Float,
        pixel_px: Memory?, distance: Memory?)
    @JvmStatic external fun maq_densepose_result_get_head_box(result: Long, index: Int, box_px: Memory?)
    @JvmStatic external fun maq_densepose_result_get_keypoints(result: Long, index: Int, keypoints: Memory?)
    @JvmStatic external fun maq_densepose_result_get_person(result: Long, index: Int, person: Memory?)
    @JvmStatic external fun maq_densepose_result_get_person_count(result: Long): Int
    @JvmStatic external fun maq_densepose_result_get_plane(result: Long, plane: Int, pixels: Memory?,
        stride_bytes: Memory?)
    @JvmStatic external fun maq_densepose_result_get_size(result: Long, width_px: Memory?, height_px: Memory?)
    @JvmStatic external fun maq_densepose_result_get_stats(result: Long, stats: Memory?)
    @JvmStatic external fun maq_densepose_result_release(result: Long)
    @JvmStatic external fun maq_densepose_result_save(result: Long, path: Memory?)
    @JvmStatic external fun maq_densepose_run(densepose: Long, frame: Long): Long
    @JvmStatic external fun maq_densepose_set_roll(densepose: Long, roll_rad: Float)
    @JvmStatic external fun maq_densepose_texture_add_person(texture: Long, result: Long, index: Int, frame: Long)
    @JvmStatic external fun maq_densepose_texture_create(context: Long, config: Memory?): Long
    @JvmStatic external fun maq_densepose_texture_destroy(texture: Long)
    @JvmStatic external fun maq_densepose_texture_draw(texture: Long, rgba: Memory?, stride_bytes: Long,
        size_bytes: Long)
    @JvmStatic external fun maq_densepose_texture_get_size(texture: Long, width_px: Memory?, height_px: Memory?)
    @JvmStatic external fun maq_densepose_texture_save(texture: Long, path: Memory?)
    @JvmStatic external fun maq_edges_cancel(edges: Long)
    @JvmStatic external fun maq_edges_create(context: Long, config: Memory?): Long
    @JvmStatic external fun maq_edges_curves_get_box(curves: Long, index: Int, box: Memory?)
    @JvmStatic external fun maq_edges_curves_get_box_count(curves: Long): Int
    @JvmStatic external fun maq_edges_curves_get_corner(curves: Long, index: Int, corner: Memory?)
    @JvmStatic external fun maq_edges_curves_get_corner_count(curves: Long): Int
    @JvmStatic external fun maq_edges_curves_get_curve(curves: Long, index: Int, curve: Memory?)
    @JvmStatic external fun maq_edges_curves_get_curve_count(curves: Long): Int
    @JvmStatic external fun maq_edges_curves_get_stats(curves: Long, stats: Memory?)
    @JvmStatic external fun maq_edges_curves_release(curves: Long)
    @JvmStatic external fun maq_edges_curves_save(curves: Long, path: Memory?)
    @JvmStatic external fun maq_edges_curves_snap_to_pixel(curves: Long, x_px: Double, y_px: Double, radius_px: Double,
        snap: Memory?)
    @JvmStatic external fun maq_edges_destroy(edges: Long)
    @JvmStatic external fun maq_edges_result_find_curves(result: Long, config: Memory?): Long
    @JvmStatic external fun maq_edges_result_get_field(result: Long, field: Memory?)
    @JvmStatic external fun maq_edges_result_get_plane(result: Long, plane: Int, values: Memory?, stride_bytes: Memory?)
    @JvmStatic external fun maq_edges_result_get_stats(result: Long, stats: Memory?)
    @JvmStatic external fun maq_edges_result_release(result: Long)
    @JvmStatic external fun maq_edges_result_save(result: Long, path: Memory?)
    @JvmStatic external fun maq_edges_run(edges: Long, frame: Long): Long
    @JvmStatic external fun maq_frame_convert_yuv(context: Long, image: Memory?): Long
    @JvmStatic external fun maq_frame_copy_pixels(frame: Long, format: Int, pixels: Memory?, stride_bytes: Long,
        size_bytes: Long)
    @JvmStatic external fun maq_frame_decode(context: Long, data: Memory?, size_bytes: Long): Long
    @JvmStatic external fun maq_frame_get_depth(frame: Long, desc: Memory?)
    @JvmStatic external fun maq_frame_get_desc(frame: Long, desc: Memory?)
    @JvmStatic external fun maq_frame_get_origin(frame: Long, origin: Memory?)
    @JvmStatic external fun maq_frame_release(frame: Long)
    @JvmStatic external fun maq_frame_resize(frame: Long, width_px: Int, height_px: Int): Long
    @JvmStatic external fun maq_frame_save(frame: Long, path: Memory?)
    @JvmStatic external fun maq_frame_wrap(context: Long, desc: Memory?, release_callback: Long, user_data: Long): Long
    @JvmStatic external fun maq_get_sdk_version(): Long
    @JvmStatic external fun maq_head_builder_add_head(builder: Long, head: Long)
    @JvmStatic external fun maq_head_builder_add_photo(builder: Long, frame: Long, photo: Memory?)
    @JvmStatic external fun maq_head_builder_cancel(builder: Long)
    @JvmStatic external fun maq_head_builder_clear(builder: Long)
    @JvmStatic external fun maq_head_builder_create(context: Long, config: Memory?): Long
    @JvmStatic external fun maq_head_builder_destroy(builder: Long)
    @JvmStatic external fun maq_head_builder_fit(builder: Long, seconds: Double): Long
    @JvmStatic external fun maq_head_builder_get_photo(builder: Long, index: Int, info: Memory?)
    @JvmStatic external fun maq_head_builder_get_stats(builder: Long, stats: Memory?)
    @JvmStatic external fun maq_head_builder_set_preview(builder: Long, interval_s: Double, preview: Long,
        user_data: Long)
    @JvmStatic external fun maq_head_destroy(head: Long)
    @JvmStatic external fun maq_head_get_camera(head: Long, index: Int, camera: Memory?)
    @JvmStatic external fun maq_head_get_info(head: Long, info: Memory?)
    @JvmStatic external fun maq_head_get_landmark(head: Long, name: Memory?, landmark: Memory?)
    @JvmStatic external fun maq_head_get_landmark_name(head: Long, index: Int): Long
    @JvmStatic external fun maq_head_mesh_create(head: Long, config: Memory?): Long
    @JvmStatic external fun maq_head_mesh_destroy(mesh: Long)
    @JvmStatic external fun maq_head_mesh_get_data(mesh: Long, data: Memory?)
    @JvmStatic external fun maq_head_mesh_get_morph_target(mesh: Long, index: Int, target: Memory?)
    @JvmStatic external fun maq_head_mesh_save(mesh: Long, path: Memory?)
    @JvmStatic external fun maq_head_open(context: Long, path: Memory?): Long
    @JvmStatic external fun maq_head_open_memory(context: Long, data: Memory?, size_bytes: Long): Long
    @JvmStatic external fun maq_head_renderer_create(context: Long, config: Memory?, mesh: Long): Long
    @JvmStatic external fun maq_head_renderer_destroy(renderer: Long)
    @JvmStatic external fun maq_head_renderer_get_camera(renderer: Long, yaw_rad: Double, pitch_rad: Double,
        width_px: Int, height_px: Int, camera: Memory?)
    @JvmStatic external fun maq_head_renderer_run(renderer: Long, camera: Memory?): Long
    @JvmStatic external fun maq_head_renderer_set_shading(renderer: Long, shading: Int)
    @JvmStatic external fun maq_head_save(head: Long, path: Memory?)
    @JvmStatic external fun maq_head_scale_by_depth(head: Long, index: Int, frame: Long): Long
    @JvmStatic external fun maq_head_scale_by_distance(head: Long, from: Memory?, to: Memory?, distance_m: Double): Long
    @JvmStatic external fun maq_image_get_plane(image: Long, plane: Int, pixels: Memory?, stride_bytes: Memory?)
    @JvmStatic external fun maq_image_get_scene_stats(image: Long, stats: Memory?)
    @JvmStatic external fun maq_image_get_size(image: Long, width_px: Memory?, height_px: Memory?)
    @JvmStatic external fun maq_image_release(image: Long)
    @JvmStatic external fun maq_image_save(image: Long, path: Memory?, alpha: Int)
    @JvmStatic external fun maq_model_destroy(model: Long)
    @JvmStatic external fun maq_pipeline_acquire_result(pipeline: Long, timeout_ns: Long): Long
    @JvmStatic external fun maq_pipeline_create(context: Long, config: Memory?): Long
    @JvmStatic external fun maq_pipeline_destroy(pipeline: Long)
    @JvmStatic external fun maq_pipeline_get_info(pipeline: Long, info: Memory?)
    @JvmStatic external fun maq_pipeline_get_stats(pipeline: Long, stats: Memory?)
    @JvmStatic external fun maq_pipeline_result_get_densepose(result: Long): Long
    @JvmStatic external fun maq_pipeline_result_get_frame(result: Long): Long
    @JvmStatic external fun maq_pipeline_result_get_stats(result: Long, stats: Memory?)
    @JvmStatic external fun maq_pipeline_result_release(result: Long)
    @JvmStatic external fun maq_pipeline_set_model(pipeline: Long, model: Long)
    @JvmStatic external fun maq_pipeline_set_paused(pipeline: Long, is_paused: Int)
    @JvmStatic external fun maq_pipeline_set_recording(pipeline: Long, path: Memory?)
    @JvmStatic external fun maq_pipeline_set_source(pipeline: Long, uri: Memory?)
    @JvmStatic external fun maq_pipeline_stop(pipeline: Long)
    @JvmStatic external fun maq_predictor_acquire_sample(predictor: Long, sample_index: Int, frame_index: Int): Long
    @JvmStatic external fun maq_predictor_cancel(predictor: Long)
    @JvmStatic external fun maq_predictor_copy_entropy_map(predictor: Long, sample_index: Int, frame_index: Int,
        bits: Memory?, capacity: Long)
    @JvmStatic external fun maq_predictor_create(context: Long, config: Memory?): Long
    @JvmStatic external fun maq_predictor_destroy(predictor: Long)
    @JvmStatic external fun maq_predictor_get_stats(predictor: Long, stats: Memory?)
    @JvmStatic external fun maq_predictor_predict(predictor: Long, ahead_s: Double): Long
    @JvmStatic external fun maq_predictor_push(predictor: Long, frame: Long)
    @JvmStatic external fun maq_predictor_reset(predictor: Long)
    @JvmStatic external fun maq_predictor_sample(predictor: Long, sample_count: Int, frame_count: Int, step_s: Double)
    @JvmStatic external fun maq_recorder_add_frame(recorder: Long, frame: Long)
    @JvmStatic external fun maq_recorder_create(context: Long, path: Memory?, source: Long, config: Memory?): Long
    @JvmStatic external fun maq_recorder_destroy(recorder: Long)
    @JvmStatic external fun maq_recorder_finish(recorder: Long)
    @JvmStatic external fun maq_recorder_get_info(recorder: Long, info: Memory?)
    @JvmStatic external fun maq_scene_build(context: Long, config: Memory?, capture: Long): Long
    @JvmStatic external fun maq_scene_builder_add_view(builder: Long, photo: Long, camera: Memory?,
        seen_point_count: Memory?)
    @JvmStatic external fun maq_scene_builder_cancel(builder: Long)
    @JvmStatic external fun maq_scene_builder_create(context: Long, config: Memory?, cloud: Memory?): Long
    @JvmStatic external fun maq_scene_builder_destroy(builder: Long)
    @JvmStatic external fun maq_scene_builder_finish(builder: Long): Long
    @JvmStatic external fun maq_scene_builder_get_stats(builder: Long, stats: Memory?)
    @JvmStatic external fun maq_scene_destroy(scene: Long)
    @JvmStatic external fun maq_scene_get_build_stats(scene: Long, stats: Memory?)
    @JvmStatic external fun maq_scene_get_info(scene: Long, info: Memory?)
    @JvmStatic external fun maq_scene_open(context: Long, path: Memory?): Long
    @JvmStatic external fun maq_scene_open_memory(context: Long, data: Memory?, size_bytes: Long): Long
    @JvmStatic external fun maq_scene_renderer_create(context: Long, config: Memory?, scene: Long): Long
    @JvmStatic external fun maq_scene_renderer_destroy(renderer: Long)
    @JvmStatic external fun maq_scene_renderer_run(renderer: Long, camera: Memory?): Long
    @JvmStatic external fun maq_scene_save(scene: Long, path: Memory?)
    @JvmStatic external fun maq_scene_save_ply(scene: Long, path: Memory?)
    @JvmStatic external fun maq_source_acquire_frame(source: Long, timeout_ns: Long): Long
    @JvmStatic external fun maq_source_create(context: Long, uri: Memory?, config: Memory?): Long
    @JvmStatic external fun maq_source_destroy(source: Long)
    @JvmStatic external fun maq_source_get_control(source: Long, control: Int, info: Memory?)
    @JvmStatic external fun maq_source_get_info(source: Long, info: Memory?)
    @JvmStatic external fun maq_source_get_intrinsics(source: Long, intrinsics: Memory?)
    @JvmStatic external fun maq_source_get_scheme(index: Int, scheme: Memory?)
    @JvmStatic external fun maq_source_get_scheme_count(): Int
    @JvmStatic external fun maq_source_seek(source: Long, time_ns: Long)
    @JvmStatic external fun maq_source_set_control(source: Long, control: Int, value: Double)
    @JvmStatic external fun maq_source_stop(source: Long)
}

internal const val MAQ_BODY_ANGLE_LEFT_ELBOW = 0; internal const val MAQ_BODY_ANGLE_RIGHT_ELBOW = 1
internal const val MAQ_BODY_ANGLE_LEFT_KNEE = 2; internal const val MAQ_BODY_ANGLE_RIGHT_KNEE = 3
internal const val MAQ_BODY_ANGLE_LEFT_HIP = 4; internal const val MAQ_BODY_ANGLE_RIGHT_HIP = 5
internal const val MAQ_BODY_ANGLE_LEFT_SHOULDER = 6; internal const val MAQ_BODY_ANGLE_RIGHT_SHOULDER = 7
internal const val MAQ_BODY_FIT_FITTED = 0; internal const val MAQ_BODY_FIT_TOO_FEW_PIXELS = 1
internal const val MAQ_BODY_FIT_UNRELIABLE = 2
internal const val MAQ_CAMERA_OK = 0; internal const val MAQ_CAMERA_CUT = 1; internal const val MAQ_CAMERA_FREEZE = 2
internal const val MAQ_CAMERA_BLACK = 3; internal const val MAQ_CAMERA_COVERED = 4
internal const val MAQ_CAMERA_MOVED = 5; internal const val MAQ_CAMERA_OBJECT = 6
internal const val MAQ_CLOCK_MEDIA = 1; internal const val MAQ_CLOCK_MONOTONIC = 2
internal const val MAQ_DENSEPOSE_CROPS_DEFAULT = 0; internal const val MAQ_DENSEPOSE_CROPS_AUTO = 1
internal const val MAQ_DENSEPOSE_CROPS_ALL = 2; internal const val MAQ_DENSEPOSE_CROPS_OFF = 3
internal const val MAQ_DENSEPOSE_DETAIL_SURFACE = 0; internal const val MAQ_DENSEPOSE_DETAIL_PART = 1
internal const val MAQ_DENSEPOSE_PLANE_PART = 1; internal const val MAQ_DENSEPOSE_PLANE_U = 2
internal const val MAQ_DENSEPOSE_PLANE_V = 3; internal const val MAQ_DENSEPOSE_PLANE_PERSON = 4
internal const val MAQ_DENSEPOSE_PRESET_STREAM = 0; internal const val MAQ_DENSEPOSE_PRESET_PHOTO = 1
internal const val MAQ_EDGES_CONVEXITY_UNKNOWN = 0; internal const val MAQ_EDGES_CONVEXITY_CONVEX = 1
internal const val MAQ_EDGES_CONVEXITY_CONCAVE = 2
internal const val MAQ_EDGES_CURVE_LINE = 0; internal const val MAQ_EDGES_CURVE_ARC = 1
internal const val MAQ_EDGES_CURVE_SPLINE = 2
internal const val MAQ_EDGES_KIND_NONE = 0; internal const val MAQ_EDGES_KIND_CREASE = 1
internal const val MAQ_EDGES_KIND_BOUNDARY = 2
internal const val MAQ_EDGES_PLANE_DISTANCE = 1; internal const val MAQ_EDGES_PLANE_EXPECTED_ERROR = 2
internal const val MAQ_EDGES_PLANE_KIND = 3; internal const val MAQ_EDGES_PLANE_DEPTH = 4
internal const val MAQ_EDGES_SNAP_NOTHING = 0; internal const val MAQ_EDGES_SNAP_CORNER = 1
internal const val MAQ_EDGES_SNAP_CURVE = 2; internal const val MAQ_EDGES_SNAP_PLANE = 3
internal const val MAQ_FRAME_CAPTURED = 1
internal const val MAQ_HEAD_SCALE_PRIOR = 0; internal const val MAQ_HEAD_SCALE_GIVEN = 1
internal const val MAQ_HEAD_SCALE_DEPTH = 2
internal const val MAQ_HEAD_SHADING_COLOUR = 0; internal const val MAQ_HEAD_SHADING_SHAPE = 1
internal const val MAQ_HEAD_SHADING_NORMALS = 2; internal const val MAQ_HEAD_SHADING_TEMPLATE = 3
internal const val MAQ_HEAD_SHADING_DEPTH = 4
internal const val MAQ_HEAD_TEXTURE_DEFAULT = 0; internal const val MAQ_HEAD_TEXTURE_OFF = 1
internal const val MAQ_HEAD_TEXTURE_ON = 2
internal const val MAQ_IMAGE_ALPHA_OFF = 0; internal const val MAQ_IMAGE_ALPHA_ON = 1
internal const val MAQ_IMAGE_PLANE_BGR = 1; internal const val MAQ_IMAGE_PLANE_ALPHA = 2
internal const val MAQ_IMAGE_PLANE_DEPTH = 3; internal const val MAQ_IMAGE_PLANE_NORMALS = 4
internal const val MAQ_IMAGE_PLANE_TEMPLATE_POINTS = 5
internal const val MAQ_LOG_OFF = -1; internal const val MAQ_LOG_ERROR = 1; internal const val MAQ_LOG_WARNING = 2
internal const val MAQ_LOG_INFO = 3; internal const val MAQ_LOG_DEBUG = 4
internal const val MAQ_PIPELINE_STOPPED = 0; internal const val MAQ_PIPELINE_OPENING = 1
internal const val MAQ_PIPELINE_LOADING = 2; internal const val MAQ_PIPELINE_RUNNING = 3
internal const val MAQ_PIPELINE_PAUSED = 4; internal const val MAQ_PIPELINE_STALLED = 5
internal const val MAQ_PIPELINE_RECONNECTING = 6; internal const val MAQ_PIPELINE_ENDED = 7
internal const val MAQ_PIPELINE_FAILED = 8
internal const val MAQ_PIXEL_RGB8 = 1; internal const val MAQ_PIXEL_BGR8 = 2; internal const val MAQ_PIXEL_RGBA8 = 3
internal const val MAQ_PIXEL_GREY8 = 4; internal const val MAQ_PIXEL_NV12 = 5; internal const val MAQ_PIXEL_YUYV = 6
internal const val MAQ_PIXEL_DEPTH16 = 7; internal const val MAQ_PIXEL_DEPTH32F = 8
internal const val MAQ_PREDICTOR_AUTO = 0; internal const val MAQ_PREDICTOR_LAST = 1
internal const val MAQ_PREDICTOR_MOTION = 2; internal const val MAQ_PREDICTOR_SAMPLED = 3
internal const val MAQ_PROVIDER_CPU = 0; internal const val MAQ_PROVIDER_XNNPACK = 1
internal const val MAQ_PROVIDER_NNAPI = 2
internal const val MAQ_SOURCE_CONTROL_AUTO_EXPOSURE = 1; internal const val MAQ_SOURCE_CONTROL_EXPOSURE = 2
internal const val MAQ_SOURCE_CONTROL_GAIN = 3; internal const val MAQ_SOURCE_CONTROL_AUTO_FOCUS = 4
internal const val MAQ_SOURCE_CONTROL_FOCUS = 5; internal const val MAQ_SOURCE_CONTROL_AUTO_WHITE_BALANCE = 6
internal const val MAQ_SOURCE_CONTROL_WHITE_BALANCE = 7; internal const val MAQ_SOURCE_CONTROL_BRIGHTNESS = 8
internal const val MAQ_SOURCE_STARTED = 1; internal const val MAQ_SOURCE_STALLED = 2
internal const val MAQ_SOURCE_LOST = 3; internal const val MAQ_SOURCE_RECONNECTING = 4
internal const val MAQ_SOURCE_RECONNECTED = 5
internal const val MAQ_OK = 0; internal const val MAQ_ERROR_INVALID_ARGUMENT = 1
internal const val MAQ_ERROR_VERSION_MISMATCH = 2; internal const val MAQ_ERROR_NOT_FOUND = 3
internal const val MAQ_ERROR_UNREADABLE = 4; internal const val MAQ_ERROR_IMAGE_SIZE = 5
internal const val MAQ_ERROR_BAD_BUNDLE = 6; internal const val MAQ_ERROR_UNSUPPORTED = 7
internal const val MAQ_ERROR_RUNTIME_LIBRARY = 8; internal const val MAQ_ERROR_POOL_EMPTY = 9
internal const val MAQ_ERROR_INFERENCE = 10; internal const val MAQ_ERROR_OUT_OF_MEMORY = 11
internal const val MAQ_ERROR_INTERNAL = 12; internal const val MAQ_END_OF_STREAM = 13
internal const val MAQ_TIMEOUT = 14; internal const val MAQ_ERROR_DEVICE_LOST = 15
internal const val MAQ_ERROR_BUSY = 16; internal const val MAQ_ERROR_NO_PERMISSION = 17
internal const val MAQ_ERROR_UNWRITABLE = 18; internal const val MAQ_CANCELLED = 19
internal const val MAQ_HEADER_VERSION = 300; internal const val MAQ_BODY_KEYPOINT_COUNT = 33
internal const val MAQ_DENSEPOSE_KEYPOINT_COUNT = 33; internal const val MAQ_HEAD_ALL_TRIANGLES = -1
internal const val MAQ_HEAD_SHADING_STRENGTH_OFF = -1; internal const val MAQ_SCENE_LONG_SIDE_FULL = -1
internal const val MAQ_SCENE_VARIATION_ALL = -1; internal const val MAQ_THREADS_MEASURED = -1
internal const val MAQ_WAIT_FOREVER = -1

internal class maq_model_options(outer: Memory? = null, at: Int = 0) : Memory(32, outer, at) {
    var threads: Int get() = int(0); set(v) = int(0, v); var provider: Int get() = int(4); set(v) = int(4, v)
    var bundle_file_count: Int get() = int(8); set(v) = int(8, v); val bundle_path get() = Pointer(this, 16)
    val bundle_files get() = Pointer(this, 24)
}

internal class maq_body_config(outer: Memory? = null, at: Int = 0) : Struct(48, outer, at) {
    val model = maq_model_options(this, 8); var result_pool_size: Int get() = int(40); set(v) = int(40, v)
}

internal class maq_body_input(outer: Memory? = null, at: Int = 0) : Struct(104, outer, at) {
    var width_px: Int get() = int(4); set(v) = int(4, v); var height_px: Int get() = int(8); set(v) = int(8, v)
    val part get() = Pointer(this, 16); val u get() = Pointer(this, 24); val v get() = Pointer(this, 32)
    val person get() = Pointer(this, 40); var stride_bytes: Long get() = long(48); set(v) = long(48, v)
    var person_count: Int get() = int(56); set(v) = int(56, v); val ids get() = Pointer(this, 64)
    val keypoints get() = Pointer(this, 72); val intrinsics get() = Pointer(this, 80)
    var timestamp_ns: Long get() = long(88); set(v) = long(88, v); val heights_m get() = Pointer(this, 96)
}

internal class maq_body_mesh(outer: Memory? = null, at: Int = 0) : Struct(56, outer, at) {
    val vertex_count get() = int(4); val triangle_count get() = int(8); val triangles get() = Pointer(this, 16)
    val joint_count get() = int(24); val joint_names get() = Pointer(this, 32)
    val joint_parents get() = Pointer(this, 40); val shape_count get() = int(48)
}

internal class maq_body_person(outer: Memory? = null, at: Int = 0) : Struct(168, outer, at) {
    val fit get() = int(4); val id get() = long(8); val inlier_fraction get() = float(16)
    val error_px get() = float(20); val iteration_count get() = int(24); val seen_joints get() = int(28)
    val is_metric get() = int(32); val pelvis_m get() = floats(36, 3); val pelvis_px get() = floats(48, 2)
    val scale_px_per_m get() = float(56); val orientation get() = floats(60, 9); val angles_deg get() = floats(96, 8)
    val shape get() = Pointer(this, 128); val joint_rotations get() = Pointer(this, 136)
    val joints_m get() = Pointer(this, 144); val keypoints_m get() = Pointer(this, 152)
    val vertices_m get() = Pointer(this, 160)
}

internal class maq_body_size(outer: Memory? = null, at: Int = 0) : Memory(12, outer, at) {
    val value_m get() = float(0); val low_m get() = float(4); val high_m get() = float(8)
}

internal class maq_body_sizes(outer: Memory? = null, at: Int = 0) : Struct(68, outer, at) {
    val is_height_known get() = int(4); val height = maq_body_size(this, 8); val chest = maq_body_size(this, 20)
    val waist = maq_body_size(this, 32); val hip = maq_body_size(this, 44); val inseam = maq_body_size(this, 56)
}

internal class maq_camera_health_result(outer: Memory? = null, at: Int = 0) : Struct(48, outer, at) {
    val event get() = int(4); val state get() = int(8); val began_ns get() = long(16); val x_px get() = float(24)
    val y_px get() = float(28); val unexplained get() = float(32); val columns get() = int(36)
    val rows get() = int(40); val is_stream_start get() = int(44)
}

internal class maq_camera_health_stats(outer: Memory? = null, at: Int = 0) : Struct(32, outer, at) {
    val push_ms get() = float(4).toDouble(); val pushed_count get() = long(8); val event_count get() = long(16)
    val stream_start_count get() = long(24)
}

internal class maq_camera_info(outer: Memory? = null, at: Int = 0) : Struct(56, outer, at) {
    val uri get() = Pointer(this, 8); val name get() = Pointer(this, 16); val bus get() = Pointer(this, 24)
    val status get() = int(32); val problem get() = Pointer(this, 40); val mode_count get() = int(48)
}

internal class maq_camera_mode(outer: Memory? = null, at: Int = 0) : Struct(32, outer, at) {
    val format get() = text(4, 8); val is_usable get() = int(12); val width_px get() = int(16)
    val height_px get() = int(20); val fps get() = double(24)
}

internal class maq_capture_drop(outer: Memory? = null, at: Int = 0) : Struct(24, outer, at) {
    val reason get() = Pointer(this, 8); val count get() = long(16)
}

internal class maq_capture_info(outer: Memory? = null, at: Int = 0) : Struct(48, outer, at) {
    val view_count get() = int(4); val point_count get() = long(8); val drop_count get() = int(16)
    val up get() = doubles(24, 3)
}

internal class maq_intrinsics(outer: Memory? = null, at: Int = 0) : Memory(104, outer, at) {
    var width_px: Int get() = int(0); set(v) = int(0, v); var height_px: Int get() = int(4); set(v) = int(4, v)
    var fx_px: Double get() = double(8); set(v) = double(8, v)
    var fy_px: Double get() = double(16); set(v) = double(16, v)
    var cx_px: Double get() = double(24); set(v) = double(24, v)
    var cy_px: Double get() = double(32); set(v) = double(32, v)
    var distortion: List<Double> get() = doubles(40, 8); set(v) = doubles(40, v)
}

internal class maq_pinhole_camera(outer: Memory? = null, at: Int = 0) : Struct(208, outer, at) {
    val intrinsics = maq_intrinsics(this, 8)
    var rotation: List<Double> get() = doubles(112, 9); set(v) = doubles(112, v)
    var centre: List<Double> get() = doubles(184, 3); set(v) = doubles(184, v)
}

internal class maq_capture_view(outer: Memory? = null, at: Int = 0) : Struct(232, outer, at) {
    val is_held_out get() = int(4); val name get() = Pointer(this, 8); val camera = maq_pinhole_camera(this, 16)
}

internal class maq_concealer_config(outer: Memory? = null, at: Int = 0) : Struct(20, outer, at) {
    var max_gap_ms: Int get() = int(4); set(v) = int(4, v); var threads: Int get() = int(8); set(v) = int(8, v)
    var method: Int get() = int(12); set(v) = int(12, v); var frame_pool_size: Int get() = int(16); set(v) = int(16, v)
}

internal class maq_concealer_stats(outer: Memory? = null, at: Int = 0) : Struct(56, outer, at) {
    val captured_count get() = long(8); val predicted_count get() = long(16); val late_count get() = long(24)
    val dropped_count get() = long(32); val latest_gap_ms get() = float(40).toDouble()
    val latest_wait_ms get() = float(44).toDouble(); val max_wait_ms get() = float(48).toDouble()
}

internal class maq_context_config(outer: Memory? = null, at: Int = 0) : Struct(32, outer, at) {
    var log_level: Int get() = int(4); set(v) = int(4, v); var log_callback: Long get() = long(8); set(v) = long(8, v)
    val onnxruntime_library get() = Pointer(this, 24)
}

internal class maq_dense_cloud_config(outer: Memory? = null, at: Int = 0) : Struct(32, outer, at) {
    var threads: Int get() = int(4); set(v) = int(4, v); var max_points: Long get() = long(8); set(v) = long(8, v)
    var progress_callback: Long get() = long(16); set(v) = long(16, v)
}

internal class maq_densepose_config(outer: Memory? = null, at: Int = 0) : Struct(96, outer, at) {
    val model = maq_model_options(this, 8); var preset: Int get() = int(40); set(v) = int(40, v)
    var long_side_px: Int get() = int(44); set(v) = int(44, v)
    var score_threshold: Float get() = float(48); set(v) = float(48, v)
    var max_people: Int get() = int(52); set(v) = int(52, v)
    var max_proposals: Int get() = int(56); set(v) = int(56, v)
    var key_frame_interval: Int get() = int(60); set(v) = int(60, v)
    var min_person_height_px: Int get() = int(64); set(v) = int(64, v)
    var detail: Int get() = int(68); set(v) = int(68, v); var person_crops: Int get() = int(72); set(v) = int(72, v)
    var person_crop_px: Int get() = int(76); set(v) = int(76, v)
    var result_pool_size: Int get() = int(80); set(v) = int(80, v)
    var has_keypoints: Int get() = int(84); set(v) = int(84, v)
    var steadiness: Float get() = float(88); set(v) = float(88, v)
}

internal class maq_densepose_model_stats(outer: Memory? = null, at: Int = 0) : Struct(12, outer, at) {
    val key_frame_interval get() = int(4); val long_side_px get() = int(8)
}

internal class maq_densepose_person(outer: Memory? = null, at: Int = 0) : Struct(32, outer, at) {
    val score get() = float(4); val box_px get() = floats(8, 4); val id get() = long(24)
}

internal class maq_densepose_stats(outer: Memory? = null, at: Int = 0) : Struct(104, outer, at) {
    val preprocess_ms get() = float(4).toDouble(); val trunk_ms get() = float(8).toDouble()
    val proposals_ms get() = float(12).toDouble(); val box_head_ms get() = float(16).toDouble()
    val dense_head_ms get() = float(20).toDouble(); val crops_ms get() = float(24).toDouble()
    val decode_ms get() = float(28).toDouble(); val total_ms get() = float(32).toDouble()
    val network_width_px get() = int(36); val network_height_px get() = int(40); val proposal_count get() = int(44)
    val person_count get() = int(48); val crop_count get() = int(52); val dropped_box_count get() = int(56)
    val body_pixel_count get() = long(64); val clamped_pixel_count get() = long(72); val is_key_frame get() = int(80)
    val provider get() = int(84); val threads get() = int(88); val is_threads_measured get() = int(92)
    val keypoints_ms get() = float(96).toDouble()
}

internal class maq_densepose_surface(outer: Memory? = null, at: Int = 0) : Struct(16, outer, at) {
    val nodes get() = int(4); val points_m get() = Pointer(this, 8)
}

internal class maq_densepose_texture_config(outer: Memory? = null, at: Int = 0) : Struct(8, outer, at) {
    var tile_px: Int get() = int(4); set(v) = int(4, v)
}

internal class maq_edges_box(outer: Memory? = null, at: Int = 0) : Struct(160, outer, at) {
    val corner_count get() = int(4); val size_m get() = doubles(8, 3); val size_tolerance_m get() = doubles(32, 3)
    val axes get() = doubles(56, 9); val centre_m get() = doubles(128, 3); val includes_focal_tolerance get() = int(152)
}

internal class maq_edges_config(outer: Memory? = null, at: Int = 0) : Struct(56, outer, at) {
    val model = maq_model_options(this, 8); var result_pool_size: Int get() = int(40); set(v) = int(40, v)
    var skip_planes: Int get() = int(44); set(v) = int(44, v)
    var average_frames: Int get() = int(48); set(v) = int(48, v)
}

internal class maq_edges_corner(outer: Memory? = null, at: Int = 0) : Struct(32, outer, at) {
    val curve_count get() = int(4); val point_m get() = doubles(8, 3)
}

internal class maq_edges_curve(outer: Memory? = null, at: Int = 0) : Struct(232, outer, at) {
    val type get() = int(4); val kind get() = int(8); val convexity get() = int(12); val is_closed get() = int(16)
    val corners get() = ints(20, 2); val length_m get() = double(32); val rms_footprints get() = double(40)
    val points_m get() = Pointer(this, 48); val point_count get() = int(56); val centre_m get() = doubles(72, 3)
}

internal class maq_edges_curves_config(outer: Memory? = null, at: Int = 0) : Struct(16, outer, at) {
    var min_length_px: Float get() = float(4); set(v) = float(4, v)
    var skip_boxes: Int get() = int(8); set(v) = int(8, v)
    var focal_tolerance: Float get() = float(12); set(v) = float(12, v)
}

internal class maq_edges_curves_stats(outer: Memory? = null, at: Int = 0) : Struct(40, outer, at) {
    val curves_ms get() = float(4).toDouble(); val boxes_ms get() = float(8).toDouble()
}

internal class maq_edges_field(outer: Memory? = null, at: Int = 0) : Struct(120, outer, at) {
    val width_px get() = int(4); val height_px get() = int(8); val eps_r get() = float(12)
    val intrinsics = maq_intrinsics(this, 16)
}

internal class maq_edges_snap(outer: Memory? = null, at: Int = 0) : Struct(56, outer, at) {
    val target get() = int(4); val index get() = int(8); val point_m get() = doubles(16, 3)
    val distance_px get() = double(40)
}

internal class maq_edges_stats(outer: Memory? = null, at: Int = 0) : Struct(88, outer, at) {
    val depth_ms get() = float(4).toDouble(); val skip_ms get() = float(8).toDouble()
    val slopes_ms get() = float(12).toDouble(); val network_ms get() = float(16).toDouble()
    val decode_ms get() = float(20).toDouble(); val total_ms get() = float(24).toDouble()
    val known_pixel_count get() = long(32); val network_pixel_count get() = long(40)
    val broken_pixel_count get() = long(48); val provider get() = int(56); val threads get() = int(60)
    val is_threads_measured get() = int(64); val averaged_pixel_count get() = long(72)
    val far_pixel_count get() = long(80)
}

internal class maq_frame_desc(outer: Memory? = null, at: Int = 0) : Struct(176, outer, at) {
    var format: Int get() = int(4); set(v) = int(4, v); var width_px: Int get() = int(8); set(v) = int(8, v)
    var height_px: Int get() = int(12); set(v) = int(12, v); val planes get() = pointers(16, 2)
    var stride_bytes: List<Long> get() = longs(32, 2); set(v) = longs(32, v)
    var timestamp_ns: Long get() = long(48); set(v) = long(48, v); var clock: Int get() = int(56); set(v) = int(56, v)
    var sequence: Long get() = long(64); set(v) = long(64, v); val intrinsics = maq_intrinsics(this, 72)
}

internal class maq_frame_origin(outer: Memory? = null, at: Int = 0) : Struct(40, outer, at) {
    val kind get() = int(4); val horizon_ns get() = long(8); val age_ns get() = long(16)
    val captured_timestamp_ns get() = long(24); val captured_sequence get() = long(32)
}

internal class maq_head_build_stats(outer: Memory? = null, at: Int = 0) : Struct(40, outer, at) {
    val photo_count get() = int(4); val used_photo_count get() = int(8); val encode_ms get() = float(12).toDouble()
    val pose_ms get() = float(16).toDouble(); val fit_ms get() = float(20).toDouble()
    val total_ms get() = float(24).toDouble(); val step_count get() = int(28); val provider get() = int(32)
    val threads get() = int(36)
}

internal class maq_head_builder_config(outer: Memory? = null, at: Int = 0) : Struct(72, outer, at) {
    val model = maq_model_options(this, 8); var texture: Int get() = int(40); set(v) = int(40, v)
    var texture_px: Int get() = int(44); set(v) = int(44, v)
    var delight_texture: Int get() = int(48); set(v) = int(48, v)
    var progress_callback: Long get() = long(56); set(v) = long(56, v)
}

internal class maq_head_info(outer: Memory? = null, at: Int = 0) : Struct(24, outer, at) {
    val photo_count get() = int(4); val landmark_count get() = int(8); val scale get() = int(12)
    val scale_sigma get() = float(16); val texture_px get() = int(20)
}

internal class maq_head_landmark(outer: Memory? = null, at: Int = 0) : Struct(32, outer, at) {
    val sigma_m get() = float(4); val point_m get() = doubles(8, 3)
}

internal class maq_head_mesh_config(outer: Memory? = null, at: Int = 0) : Struct(56, outer, at) {
    val model = maq_model_options(this, 8); var triangle_count: Int get() = int(40); set(v) = int(40, v)
    var cell_m: Double get() = double(48); set(v) = double(48, v)
}

internal class maq_head_mesh_data(outer: Memory? = null, at: Int = 0) : Struct(80, outer, at) {
    val vertex_count get() = int(4); val triangle_count get() = int(8); val morph_target_count get() = int(12)
    val positions_m get() = Pointer(this, 16); val normals get() = Pointer(this, 24)
    val colours_rgb get() = Pointer(this, 32); val template_points_m get() = Pointer(this, 40)
    val triangles get() = Pointer(this, 48); val texture_coordinates get() = Pointer(this, 56)
    val texture_jpeg get() = Pointer(this, 64); val texture_bytes get() = int(72)
    val simplification_error_m get() = float(76)
}

internal class maq_head_morph_target(outer: Memory? = null, at: Int = 0) : Struct(32, outer, at) {
    val vertex_count get() = int(4); val name get() = Pointer(this, 8); val vertices get() = Pointer(this, 16)
    val deltas_m get() = Pointer(this, 24)
}

internal class maq_head_photo(outer: Memory? = null, at: Int = 0) : Struct(28, outer, at) {
    var box_px: List<Float> get() = floats(4, 4); set(v) = floats(4, v)
    var roll_rad: Float get() = float(20); set(v) = float(20, v)
    var focal_px: Float get() = float(24); set(v) = float(24, v)
}

internal class maq_head_photo_info(outer: Memory? = null, at: Int = 0) : Struct(36, outer, at) {
    val box_px get() = floats(4, 4); val head_coverage get() = float(20); val is_used get() = int(24)
    val focal_px get() = float(28); val rms_px get() = float(32)
}

internal class maq_head_renderer_config(outer: Memory? = null, at: Int = 0) : Struct(40, outer, at) {
    var threads: Int get() = int(4); set(v) = int(4, v); var near_m: Double get() = double(8); set(v) = double(8, v)
    var shading: Int get() = int(16); set(v) = int(16, v)
    var shading_strength: Float get() = float(20); set(v) = float(20, v)
    var disable_antialiasing: Int get() = int(24); set(v) = int(24, v)
    var use_background: Int get() = int(28); set(v) = int(28, v)
    var background: ByteArray get() = bytes(32, 3); set(v) = bytes(32, v)
    var image_pool_size: Int get() = int(36); set(v) = int(36, v)
}

internal class maq_memory_file(outer: Memory? = null, at: Int = 0) : Memory(24, outer, at) {
    val name get() = Pointer(this, 0); val data get() = Pointer(this, 8)
    var size_bytes: Long get() = long(16); set(v) = long(16, v)
}

internal class maq_pipeline_config(outer: Memory? = null, at: Int = 0) : Struct(56, outer, at) {
    var result_pool_size: Int get() = int(4); set(v) = int(4, v); val source get() = Pointer(this, 8)
    var state_callback: Long get() = long(32); set(v) = long(32, v)
    var state_user_data: Long get() = long(40); set(v) = long(40, v); var nice: Int get() = int(48); set(v) = int(48, v)
}

internal class maq_pipeline_info(outer: Memory? = null, at: Int = 0) : Struct(32, outer, at) {
    val state get() = int(4); val status get() = int(8); val problem get() = Pointer(this, 16)
    val source_uri get() = Pointer(this, 24)
}

internal class maq_pipeline_result_stats(outer: Memory? = null, at: Int = 0) : Struct(40, outer, at) {
    val number get() = long(8); val wait_ms get() = double(16); val run_ms get() = double(24)
    val age_ms get() = double(32)
}

internal class maq_pipeline_stats(outer: Memory? = null, at: Int = 0) : Struct(64, outer, at) {
    val result_count get() = long(8); val dropped_result_count get() = long(16)
    val dropped_frame_count get() = long(24); val results_per_second get() = double(32); val wait_ms get() = double(40)
    val run_ms get() = double(48); val age_ms get() = double(56)
}

internal class maq_point_cloud(outer: Memory? = null, at: Int = 0) : Struct(72, outer, at) {
    var point_count: Long get() = long(8); set(v) = long(8, v); val xyz get() = Pointer(this, 16)
    var origin: List<Double> get() = doubles(24, 3); set(v) = doubles(24, v)
    var up: List<Double> get() = doubles(48, 3); set(v) = doubles(48, v)
}

internal class maq_posed_photo(outer: Memory? = null, at: Int = 0) : Struct(232, outer, at) {
    var photo: Long get() = long(8); set(v) = long(8, v); var mask: Long get() = long(16); set(v) = long(16, v)
    val camera = maq_pinhole_camera(this, 24)
}

internal class maq_predictor_config(outer: Memory? = null, at: Int = 0) : Struct(72, outer, at) {
    val model = maq_model_options(this, 8); var method: Int get() = int(40); set(v) = int(40, v)
    var frame_pool_size: Int get() = int(44); set(v) = int(44, v)
    var temperature: Float get() = float(48); set(v) = float(48, v)
    var seed: Long get() = long(56); set(v) = long(56, v)
}

internal class maq_predictor_stats(outer: Memory? = null, at: Int = 0) : Struct(88, outer, at) {
    val luma_ms get() = float(4).toDouble(); val flow_ms get() = float(8).toDouble()
    val weights_ms get() = float(12).toDouble(); val push_ms get() = float(16).toDouble()
    val project_ms get() = float(20).toDouble(); val warp_ms get() = float(24).toDouble()
    val predict_ms get() = float(28).toDouble(); val networks_ms get() = float(32).toDouble()
    val method get() = int(36); val motion_fraction get() = float(40); val pushed_count get() = long(48)
    val predicted_count get() = long(56); val reset_count get() = long(64); val sampled_frame_count get() = int(72)
    val step_count get() = int(76); val cell_count get() = int(80)
}

internal class maq_recorder_config(outer: Memory? = null, at: Int = 0) : Struct(12, outer, at) {
    var jpeg_quality: Int get() = int(4); set(v) = int(4, v); var keep_predicted: Int get() = int(8); set(v) = int(8, v)
}

internal class maq_recorder_info(outer: Memory? = null, at: Int = 0) : Struct(24, outer, at) {
    val frame_count get() = long(8); val size_bytes get() = long(16)
}

internal class maq_scene_build_config(outer: Memory? = null, at: Int = 0) : Struct(128, outer, at) {
    val model = maq_model_options(this, 8); var long_side_px: Int get() = int(40); set(v) = int(40, v)
    var coefficient_bits: Int get() = int(44); set(v) = int(44, v)
    var min_variation: Double get() = double(48); set(v) = double(48, v)
    var visibility_scale: Double get() = double(56); set(v) = double(56, v)
    var near_depth: Double get() = double(64); set(v) = double(64, v)
    var max_points: Long get() = long(72); set(v) = long(72, v)
    var max_memory_bytes: Long get() = long(80); set(v) = long(80, v)
    var progress_callback: Long get() = long(88); set(v) = long(88, v)
    var max_views: Int get() = int(104); set(v) = int(104, v)
    var use_held_out: Int get() = int(108); set(v) = int(108, v); var points: Int get() = int(112); set(v) = int(112, v)
}

internal class maq_scene_build_stats(outer: Memory? = null, at: Int = 0) : Struct(96, outer, at) {
    val view_count get() = int(4); val unused_view_count get() = int(8); val cloud_point_count get() = long(16)
    val seen_point_count get() = long(24); val load_ms get() = double(32); val visibility_ms get() = double(40)
    val align_ms get() = double(48); val extract_ms get() = double(56); val accumulate_ms get() = double(64)
    val solve_ms get() = double(72); val pack_ms get() = double(80); val depth_ms get() = double(88)
}

internal class maq_scene_info(outer: Memory? = null, at: Int = 0) : Struct(136, outer, at) {
    val coefficient_bits get() = int(4); val point_count get() = long(8); val view_dependent_count get() = long(16)
    val block_count get() = long(24); val up get() = doubles(32, 3); val bounds_min get() = doubles(56, 3)
    val bounds_max get() = doubles(80, 3); val networks_sha256 get() = bytes(104, 32)
}

internal class maq_scene_render_stats(outer: Memory? = null, at: Int = 0) : Struct(64, outer, at) {
    val project_ms get() = float(4).toDouble(); val shade_ms get() = float(8).toDouble()
    val refine_ms get() = float(12).toDouble(); val resample_ms get() = float(16).toDouble()
    val total_ms get() = float(20).toDouble(); val drawn_block_count get() = int(24)
    val drawn_point_count get() = long(32); val shaded_point_count get() = long(40)
    val refined_pixel_count get() = long(48); val provider get() = int(56)
}

internal class maq_scene_renderer_config(outer: Memory? = null, at: Int = 0) : Struct(64, outer, at) {
    val model = maq_model_options(this, 8); var near_depth: Double get() = double(40); set(v) = double(40, v)
    var use_background: Int get() = int(48); set(v) = int(48, v)
    var background: ByteArray get() = bytes(52, 3); set(v) = bytes(52, v)
    var image_pool_size: Int get() = int(56); set(v) = int(56, v)
}

internal class maq_source_config(outer: Memory? = null, at: Int = 0) : Struct(56, outer, at) {
    var frame_pool_size: Int get() = int(4); set(v) = int(4, v)
    var queue_length: Int get() = int(8); set(v) = int(8, v); var stall_ms: Int get() = int(12); set(v) = int(12, v)
    var reconnect_ms: Int get() = int(16); set(v) = int(16, v)
    var state_callback: Long get() = long(24); set(v) = long(24, v)
    var state_user_data: Long get() = long(32); set(v) = long(32, v)
    var real_time: Int get() = int(40); set(v) = int(40, v); var loop: Int get() = int(44); set(v) = int(44, v)
    var max_side_px: Int get() = int(48); set(v) = int(48, v)
}

internal class maq_source_control_info(outer: Memory? = null, at: Int = 0) : Struct(48, outer, at) {
    val min get() = double(8); val max get() = double(16); val step get() = double(24)
    val default_value get() = double(32); val value get() = double(40)
}

internal class maq_source_info(outer: Memory? = null, at: Int = 0) : Struct(56, outer, at) {
    val width_px get() = int(4); val height_px get() = int(8); val fps get() = double(16)
    val frame_count get() = long(24); val is_live get() = int(32); val clock get() = int(36)
    val frame_pool_size get() = int(40); val dropped_frame_count get() = long(48)
}

internal class maq_source_scheme(outer: Memory? = null, at: Int = 0) : Struct(40, outer, at) {
    val name get() = Pointer(this, 8); val example get() = Pointer(this, 16); val summary get() = Pointer(this, 24)
    val is_camera get() = int(32)
}

internal class maq_yuv_image(outer: Memory? = null, at: Int = 0) : Struct(120, outer, at) {
    var width_px: Int get() = int(4); set(v) = int(4, v); var height_px: Int get() = int(8); set(v) = int(8, v)
    val planes get() = pointers(16, 3); var size_bytes: List<Long> get() = longs(40, 3); set(v) = longs(40, v)
    var stride_bytes: List<Int> get() = ints(64, 3); set(v) = ints(64, v)
    var pixel_stride_bytes: List<Int> get() = ints(76, 3); set(v) = ints(76, v)
    var is_video_range: Int get() = int(88); set(v) = int(88, v)
    var rotation_deg: Int get() = int(92); set(v) = int(92, v)
    var timestamp_ns: Long get() = long(96); set(v) = long(96, v)
    var clock: Int get() = int(104); set(v) = int(104, v); var sequence: Long get() = long(112); set(v) = long(112, v)
}
