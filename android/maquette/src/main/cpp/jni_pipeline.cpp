// Pipelines: a source and dense pose on a thread of the library.
#include "jni_config.h"
#include "jni_threads.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::object;

namespace {

using ListenedPipeline = maq_jni::Listened<maq_pipeline>;

maq_pipeline* pipeline_of(jlong listened) { return ListenedPipeline::of(listened); }

void tell(void* listened, maq_pipeline_state state, maq_status status, const char* problem) {
  ListenedPipeline::tell(listened, state, status, problem);
}

}  // namespace

MAQ_NATIVE_OF(NativePipeline, jlong, create)
(JNIEnv* env, jclass, jlong context, jdoubleArray source_values, jint result_pool_size, jint nice, jobject changes) {
  return call(env, [&] {
    const maq_source_config source = maq_jni::source_config(env, source_values);
    maq_pipeline_config config;
    check(maq_pipeline_config_init(&config, sizeof config));
    config.result_pool_size = uint32_t(result_pool_size);
    config.source = &source;
    config.state_callback = tell;
    config.nice = nice;
    return ListenedPipeline::create(env, changes, [&](void* listened, maq_pipeline** pipeline) {
      config.state_user_data = listened;
      return maq_pipeline_create(object<maq_context>(context), &config, pipeline);
    });
  });
}

MAQ_NATIVE_OF(NativePipeline, void, destroy)(JNIEnv* env, jclass, jlong pipeline) {
  ListenedPipeline::destroy(env, pipeline, maq_pipeline_destroy);
}

MAQ_NATIVE_OF(NativePipeline, void, setSource)(JNIEnv* env, jclass, jlong pipeline, jbyteArray uri) {
  call(env, [&] { check(maq_pipeline_set_source(pipeline_of(pipeline), maq_jni::text(env, uri).c_str())); });
}

MAQ_NATIVE_OF(NativePipeline, jlong, createModel)
(JNIEnv* env, jclass, jlong context, jbyteArray folder, jobjectArray names, jobjectArray buffers, jdoubleArray values) {
  return call(env, [&] {
    const maq_jni::Bundle bundle(env, folder, names, buffers);
    const maq_densepose_config config = maq_jni::densepose_config(env, bundle, values);
    maq_model* model = nullptr;
    check(maq_densepose_model_create(object<maq_context>(context), &config, &model));
    return handle(model);
  });
}

MAQ_NATIVE_OF(NativePipeline, void, destroyModel)(JNIEnv*, jclass, jlong model) {
  maq_model_destroy(object<maq_model>(model));
}

MAQ_NATIVE_OF(NativePipeline, void, setModel)(JNIEnv* env, jclass, jlong pipeline, jlong model) {
  call(env, [&] { check(maq_pipeline_set_model(pipeline_of(pipeline), object<maq_model>(model))); });
}

MAQ_NATIVE_OF(NativePipeline, void, setRoll)(JNIEnv* env, jclass, jlong model, jfloat roll_rad) {
  call(env, [&] { check(maq_densepose_model_set_roll(object<maq_model>(model), roll_rad)); });
}

MAQ_NATIVE_OF(NativePipeline, void, setFrameBudget)(JNIEnv* env, jclass, jlong model, jdouble budget_ms) {
  call(env, [&] { check(maq_densepose_model_set_frame_budget(object<maq_model>(model), budget_ms)); });
}

// Key frame interval and long side.
MAQ_NATIVE_OF(NativePipeline, jintArray, quality)(JNIEnv* env, jclass, jlong model) {
  return call(env, [&]() -> jintArray {
    maq_densepose_model_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_densepose_model_get_stats(object<maq_model>(model), &stats));
    const jint two[] = {stats.key_frame_interval, stats.long_side_px};
    jintArray array = env->NewIntArray(2);
    maq_jni::check_pending(env);
    env->SetIntArrayRegion(array, 0, 2, two);
    return array;
  });
}

MAQ_NATIVE_OF(NativePipeline, void, setPaused)(JNIEnv* env, jclass, jlong pipeline, jboolean is_paused) {
  call(env, [&] { check(maq_pipeline_set_paused(pipeline_of(pipeline), is_paused)); });
}

// null ends the recording.
MAQ_NATIVE_OF(NativePipeline, void, setRecording)(JNIEnv* env, jclass, jlong pipeline, jbyteArray path) {
  call(env, [&] {
    const std::string to = maq_jni::text(env, path);
    check(maq_pipeline_set_recording(pipeline_of(pipeline), path == nullptr ? nullptr : to.c_str()));
  });
}

MAQ_NATIVE_OF(NativePipeline, void, stop)(JNIEnv* env, jclass, jlong pipeline) {
  call(env, [&] { check(maq_pipeline_stop(pipeline_of(pipeline))); });
}

// Writes result, frame, dense pose result and number to `objects`, and the times in milliseconds to `times`. False
// after the last frame and after a stop.
MAQ_NATIVE_OF(NativePipeline, jboolean, acquire)
(JNIEnv* env, jclass, jlong pipeline, jlong timeout_ns, jlongArray objects, jdoubleArray times) {
  return call(env, [&]() -> jboolean {
    maq_pipeline_result* result = nullptr;
    const maq_status status = maq_pipeline_acquire_result(pipeline_of(pipeline), timeout_ns, &result);
    if (status == MAQ_END_OF_STREAM || status == MAQ_CANCELLED) return JNI_FALSE;
    check(status);
    maq_pipeline_result_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_pipeline_result_get_stats(result, &stats));
    auto* const frame = const_cast<maq_frame*>(maq_pipeline_result_get_frame(result));
    auto* const densepose = const_cast<maq_densepose_result*>(maq_pipeline_result_get_densepose(result));
    const jlong four[] = {handle(result), handle(frame), handle(densepose), jlong(stats.number)};
    const jdouble ms[] = {stats.wait_ms, stats.run_ms, stats.age_ms};
    env->SetLongArrayRegion(objects, 0, 4, four);
    env->SetDoubleArrayRegion(times, 0, 3, ms);
    return JNI_TRUE;
  });
}

// State and status in `codes`; returns the problem and the URI of the source.
MAQ_NATIVE_OF(NativePipeline, jobjectArray, info)(JNIEnv* env, jclass, jlong pipeline, jintArray codes) {
  return call(env, [&] {
    maq_pipeline_info info{};
    info.struct_size = sizeof info;
    check(maq_pipeline_get_info(pipeline_of(pipeline), &info));
    const jint two[] = {info.state, info.status};
    env->SetIntArrayRegion(codes, 0, 2, two);
    return maq_jni::texts_of(env, {info.problem, info.source_uri});
  });
}

// In the order of maq_pipeline_stats.
MAQ_NATIVE_OF(NativePipeline, jdoubleArray, stats)(JNIEnv* env, jclass, jlong pipeline) {
  return call(env, [&] {
    maq_pipeline_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_pipeline_get_stats(pipeline_of(pipeline), &stats));
    return maq_jni::doubles_of(
        env, {double(stats.result_count), double(stats.dropped_result_count), double(stats.dropped_frame_count),
              stats.results_per_second, stats.wait_ms, stats.run_ms, stats.age_ms});
  });
}

MAQ_NATIVE_OF(NativePipeline, void, releaseResult)(JNIEnv*, jclass, jlong result) {
  maq_pipeline_result_release(object<maq_pipeline_result>(result));
}

// [24][nodes][nodes][3]; null before networks are loaded, and where they have no surface.
MAQ_NATIVE_OF(NativePipeline, jfloatArray, surface)(JNIEnv* env, jclass, jlong model) {
  return call(env, [&] {
    maq_densepose_surface surface{};
    surface.struct_size = sizeof surface;
    const maq_status status = maq_densepose_model_get_surface(object<maq_model>(model), &surface);
    return maq_jni::points_of(env, status, surface);
  });
}
