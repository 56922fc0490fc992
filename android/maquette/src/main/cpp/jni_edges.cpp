// Edges of depth frames: network, fields, and the curves, corners and boxes in them.
#include "jni_config.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::object;
using maq_jni::sized;

namespace {

void append(std::vector<jdouble>& values, const double* from, size_t count) {
  values.insert(values.end(), from, from + count);
}

}  // namespace

// `values` as in Edges.Config.
MAQ_NATIVE_OF(NativeEdges, jlong, create)
(JNIEnv* env, jclass, jlong context, jbyteArray folder, jobjectArray names, jobjectArray buffers, jdoubleArray values) {
  return call(env, [&] {
    const maq_jni::Bundle bundle(env, folder, names, buffers);
    const std::vector<jdouble> from = maq_jni::numbers(env, values, 6);
    maq_edges_config config;
    check(maq_edges_config_init(&config, sizeof config));
    bundle.put_into(config.model);
    config.model.threads = int32_t(from[0]);
    config.result_pool_size = maq_jni::count_of(from[1]);
    config.model.spinning = from[2] != 0 ? MAQ_SPINNING_ON : MAQ_SPINNING_OFF;
    config.model.provider = maq_provider(int32_t(from[3]));
    config.skip_planes = int32_t(from[4]);
    config.average_frames = int32_t(from[5]);
    maq_edges* edges = nullptr;
    check(maq_edges_create(object<maq_context>(context), &config, &edges));
    return handle(edges);
  });
}

MAQ_NATIVE_OF(NativeEdges, void, destroy)(JNIEnv*, jclass, jlong edges) { maq_edges_destroy(object<maq_edges>(edges)); }

MAQ_NATIVE_OF(NativeEdges, jlong, run)(JNIEnv* env, jclass, jlong edges, jlong frame) {
  return call(env, [&] {
    maq_edges_result* result = nullptr;
    check(maq_edges_run(object<maq_edges>(edges), object<maq_frame>(frame), &result));
    return handle(result);
  });
}

MAQ_NATIVE_OF(NativeEdges, void, cancel)(JNIEnv* env, jclass, jlong edges) {
  call(env, [&] { check(maq_edges_cancel(object<maq_edges>(edges))); });
}

MAQ_NATIVE_OF(NativeEdges, void, releaseResult)(JNIEnv*, jclass, jlong result) {
  maq_edges_result_release(object<maq_edges_result>(result));
}

MAQ_NATIVE_OF(NativeEdges, void, saveResult)(JNIEnv* env, jclass, jlong result, jbyteArray path) {
  call(env, [&] { check(maq_edges_result_save(object<maq_edges_result>(result), maq_jni::text(env, path).c_str())); });
}

// Returns the largest distance, then the intrinsics, which have the size of the planes.
MAQ_NATIVE_OF(NativeEdges, jdoubleArray, fieldOfResult)(JNIEnv* env, jclass, jlong result) {
  return call(env, [&] {
    auto field = sized<maq_edges_field>();
    check(maq_edges_result_get_field(object<maq_edges_result>(result), &field));
    std::vector<jdouble> values = maq_jni::values_of(field.intrinsics);
    values.insert(values.begin(), field.eps_r);
    return maq_jni::doubles_of(env, values);
  });
}

// A plane as a direct buffer over the result's own memory; rows follow each other without padding.
MAQ_NATIVE_OF(NativeEdges, jobject, planeOfResult)(JNIEnv* env, jclass, jlong result, jint plane, jint value_bytes) {
  return call(env, [&]() -> jobject {
    auto field = sized<maq_edges_field>();
    auto* const from = object<maq_edges_result>(result);
    check(maq_edges_result_get_field(from, &field));
    const void* data = nullptr;
    size_t stride = 0;
    check(maq_edges_result_get_plane(from, maq_edges_plane(plane), &data, &stride));
    if (stride != size_t(field.width_px) * size_t(value_bytes)) {
      throw maq_jni::StatusError{MAQ_ERROR_INTERNAL, "rows of a plane have padding"};
    }
    // Java gets it read-only (Kotlin: asReadOnlyBuffer).
    return env->NewDirectByteBuffer(const_cast<void*>(data), jlong(stride) * field.height_px);
  });
}

// Times of the stages in milliseconds, then counts, in the order of maq_edges_stats.
MAQ_NATIVE_OF(NativeEdges, jdoubleArray, statsOfResult)(JNIEnv* env, jclass, jlong result) {
  return call(env, [&] {
    auto s = sized<maq_edges_stats>();
    check(maq_edges_result_get_stats(object<maq_edges_result>(result), &s));
    return maq_jni::doubles_of(
        env, {s.depth_ms, s.skip_ms, s.slopes_ms, s.network_ms, s.decode_ms, s.total_ms, double(s.known_pixel_count),
              double(s.network_pixel_count), double(s.broken_pixel_count), double(s.provider), double(s.threads),
              double(s.is_threads_measured), double(s.averaged_pixel_count)});
  });
}

// `values` as in EdgeCurves.Config.
MAQ_NATIVE_OF(NativeEdges, jlong, findCurves)(JNIEnv* env, jclass, jlong result, jdoubleArray values) {
  return call(env, [&] {
    const std::vector<jdouble> from = maq_jni::numbers(env, values, 7);
    maq_edges_curves_config config;
    check(maq_edges_curves_config_init(&config, sizeof config));
    float* const numbers[] = {&config.vote_radius_px, &config.min_votes,       &config.flying_pixel_band_px,
                              &config.fit_band_px,    &config.split_angle_deg, &config.min_length_px};
    for (size_t i = 0; i < 6; ++i) *numbers[i] = float(from[i]);
    config.skip_boxes = int32_t(from[6]);
    maq_edges_curves* curves = nullptr;
    check(maq_edges_result_find_curves(object<maq_edges_result>(result), &config, &curves));
    return handle(curves);
  });
}

MAQ_NATIVE_OF(NativeEdges, void, releaseCurves)(JNIEnv*, jclass, jlong curves) {
  maq_edges_curves_release(object<maq_edges_curves>(curves));
}

// Returns the numbers of curves, corners and boxes, then the times for curves and boxes in milliseconds.
MAQ_NATIVE_OF(NativeEdges, jdoubleArray, countsOfCurves)(JNIEnv* env, jclass, jlong curves) {
  return call(env, [&] {
    auto* const from = object<maq_edges_curves>(curves);
    auto stats = sized<maq_edges_curves_stats>();
    check(maq_edges_curves_get_stats(from, &stats));
    return maq_jni::doubles_of(
        env, {double(maq_edges_curves_get_curve_count(from)), double(maq_edges_curves_get_corner_count(from)),
              double(maq_edges_curves_get_box_count(from)), stats.curves_ms, stats.boxes_ms});
  });
}

// Returns type, kind, convexity, closed, corners, length and residual; then the points of the polyline.
MAQ_NATIVE_OF(NativeEdges, jdoubleArray, curve)(JNIEnv* env, jclass, jlong curves, jint index) {
  return call(env, [&] {
    auto curve = sized<maq_edges_curve>();
    check(maq_edges_curves_get_curve(object<maq_edges_curves>(curves), uint32_t(index), &curve));
    std::vector<jdouble> values = {double(curve.type),      double(curve.kind),       double(curve.convexity),
                                   double(curve.is_closed), double(curve.corners[0]), double(curve.corners[1]),
                                   curve.length_m,          curve.rms_footprints};
    append(values, curve.points_m, size_t(3) * curve.point_count);
    return maq_jni::doubles_of(env, values);
  });
}

// Returns the number of curves that end in the corner, then x, y, z.
MAQ_NATIVE_OF(NativeEdges, jdoubleArray, corner)(JNIEnv* env, jclass, jlong curves, jint index) {
  return call(env, [&] {
    auto corner = sized<maq_edges_corner>();
    check(maq_edges_curves_get_corner(object<maq_edges_curves>(curves), uint32_t(index), &corner));
    std::vector<jdouble> values = {double(corner.curve_count)};
    append(values, corner.point_m, 3);
    return maq_jni::doubles_of(env, values);
  });
}

// Returns the number of visible corners, the lengths of the sides, their tolerances, their directions, the centre.
MAQ_NATIVE_OF(NativeEdges, jdoubleArray, box)(JNIEnv* env, jclass, jlong curves, jint index) {
  return call(env, [&] {
    auto box = sized<maq_edges_box>();
    check(maq_edges_curves_get_box(object<maq_edges_curves>(curves), uint32_t(index), &box));
    std::vector<jdouble> values = {double(box.corner_count)};
    append(values, box.size_m, 3);
    append(values, box.size_tolerance_m, 3);
    append(values, &box.axes[0][0], 9);
    append(values, box.centre_m, 3);
    return maq_jni::doubles_of(env, values);
  });
}

// Returns the target (maq_edges_snap_target), its indices, x, y, z, and the distance in pixels.
MAQ_NATIVE_OF(NativeEdges, jdoubleArray, snap)
(JNIEnv* env, jclass, jlong curves, jdouble x_px, jdouble y_px, jdouble radius_px) {
  return call(env, [&] {
    auto snap = sized<maq_edges_snap>();
    check(maq_edges_curves_snap_to_pixel(object<maq_edges_curves>(curves), x_px, y_px, radius_px, &snap));
    std::vector<jdouble> values = {double(snap.target), double(snap.index), double(snap.adjacent_plane_index)};
    append(values, snap.point_m, 3);
    values.push_back(snap.distance_px);
    return maq_jni::doubles_of(env, values);
  });
}

MAQ_NATIVE_OF(NativeEdges, void, saveCurves)(JNIEnv* env, jclass, jlong curves, jbyteArray path) {
  call(env, [&] { check(maq_edges_curves_save(object<maq_edges_curves>(curves), maq_jni::text(env, path).c_str())); });
}
