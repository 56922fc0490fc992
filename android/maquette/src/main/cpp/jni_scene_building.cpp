// Scenes built from captures, and from clouds and photos of the app.
#include "jni_config.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::numbers;
using maq_jni::object;

namespace {

// The dev.maquette.NativeProgress of the call of this thread.
class ProgressOfCall {
 public:
  ProgressOfCall(JNIEnv* env, jobject progress) : env_(env), progress_(progress), of_outer_call_(of_this_thread) {
    if (progress != nullptr) {
      method_ = env->GetMethodID(env->GetObjectClass(progress), "onProgress", "(D[B)Z");
      maq_jni::check_pending(env);
    }
    of_this_thread = this;
  }
  ~ProgressOfCall() { of_this_thread = of_outer_call_; }
  ProgressOfCall(const ProgressOfCall&) = delete;
  ProgressOfCall& operator=(const ProgressOfCall&) = delete;

  // For the C API, which calls it on the thread that builds. What Java throws cancels, and the native method throws it.
  static int32_t tell(void*, double done, const char* stage) {
    return of_this_thread == nullptr || of_this_thread->goes_on(done, stage) ? 1 : 0;
  }

 private:
  bool goes_on(double done, const char* stage) const {
    if (progress_ == nullptr) return true;
    try {
      jbyteArray bytes = maq_jni::bytes_of(env_, stage);
      const jboolean goes_on = env_->CallBooleanMethod(progress_, method_, done, bytes);
      maq_jni::check_pending(env_);
      env_->DeleteLocalRef(bytes);
      return goes_on == JNI_TRUE;
    } catch (const maq_jni::PendingException&) {
      return false;
    }
  }

  static thread_local const ProgressOfCall* of_this_thread;

  JNIEnv* env_;
  jobject progress_;
  jmethodID method_ = nullptr;
  const ProgressOfCall* of_outer_call_;  // a progress may build another scene
};

thread_local const ProgressOfCall* ProgressOfCall::of_this_thread = nullptr;

// A Long of Kotlin; negative values and NaN are refused.
uint64_t size_of(jdouble value) {
  if (!(value >= 0)) maq_jni::refuse("A size or a count is negative.");
  return value < 9e18 ? uint64_t(value) : UINT64_MAX;
}

// `values` as in SceneBuildConfig.
maq_scene_build_config build_config(JNIEnv* env, const maq_jni::Bundle& bundle, jdoubleArray values) {
  const std::vector<jdouble> from = numbers(env, values, 10);
  maq_scene_build_config config;
  check(maq_scene_build_config_init(&config, sizeof config));
  bundle.put_into(config.model);
  config.model.threads = int32_t(from[0]);
  config.long_side_px = int32_t(from[1]);
  config.coefficient_bits = int32_t(from[2]);
  config.min_variation = from[3];
  config.visibility_scale = from[4];
  config.near_depth = from[5];
  config.max_points = size_of(from[6]);
  config.max_memory_bytes = size_of(from[7]);
  config.progress_callback = ProgressOfCall::tell;
  config.max_views = maq_jni::count_of(from[8]);
  config.use_held_out = int32_t(from[9]);
  return config;
}

std::vector<jdouble> values_of(const maq_scene_build_stats& s) {
  return {double(s.view_count),
          double(s.unused_view_count),
          double(s.cloud_point_count),
          double(s.seen_point_count),
          s.load_ms,
          s.visibility_ms,
          s.align_ms,
          s.extract_ms,
          s.accumulate_ms,
          s.solve_ms,
          s.pack_ms};
}

}  // namespace

MAQ_NATIVE_OF(NativeScene, jlong, build)
(JNIEnv* env, jclass, jlong context, jlong capture, jbyteArray folder, jobjectArray names, jobjectArray buffers,
 jdoubleArray values, jobject progress) {
  return call(env, [&] {
    const maq_jni::Bundle bundle(env, folder, names, buffers);
    const maq_scene_build_config config = build_config(env, bundle, values);
    maq_scene* scene = nullptr;
    const ProgressOfCall told(env, progress);
    const maq_status status =
        maq_scene_build(object<maq_context>(context), &config, object<maq_capture>(capture), &scene);
    if (env->ExceptionCheck()) maq_scene_destroy(scene);
    maq_jni::check_pending(env);
    check(status);
    return handle(scene);
  });
}

// In the order of maq_scene_build_stats.
MAQ_NATIVE_OF(NativeScene, jdoubleArray, buildStats)(JNIEnv* env, jclass, jlong scene) {
  return call(env, [&] {
    maq_scene_build_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_scene_get_build_stats(object<maq_scene>(scene), &stats));
    return maq_jni::doubles_of(env, values_of(stats));
  });
}

// `vectors`: origin and up.
MAQ_NATIVE_OF(NativeScene, jlong, createBuilder)
(JNIEnv* env, jclass, jlong context, jobject xyz, jlong point_count, jdoubleArray vectors, jbyteArray folder,
 jobjectArray names, jobjectArray buffers, jdoubleArray values) {
  return call(env, [&] {
    const maq_jni::Memory memory = maq_jni::memory_of(env, xyz);
    if (point_count < 0 || uint64_t(point_count) > memory.size_bytes / (3 * sizeof(float))) {
      throw maq_jni::StatusError{MAQ_ERROR_INVALID_ARGUMENT,
                                 "A cloud needs 12 bytes for each of its " + std::to_string(point_count) +
                                     " points, but its buffer has " + std::to_string(memory.size_bytes) + " bytes."};
    }
    const std::vector<jdouble> origin_and_up = numbers(env, vectors, 6);
    maq_point_cloud cloud{};
    cloud.struct_size = sizeof cloud;
    cloud.point_count = uint64_t(point_count);
    cloud.xyz = reinterpret_cast<const float*>(memory.data);
    std::copy_n(&origin_and_up[0], 3, cloud.origin);
    std::copy_n(&origin_and_up[3], 3, cloud.up);
    const maq_jni::Bundle bundle(env, folder, names, buffers);
    const maq_scene_build_config config = build_config(env, bundle, values);
    maq_scene_builder* builder = nullptr;
    check(maq_scene_builder_create(object<maq_context>(context), &config, &cloud, &builder));
    return handle(builder);
  });
}

MAQ_NATIVE_OF(NativeScene, void, destroyBuilder)(JNIEnv*, jclass, jlong builder) {
  maq_scene_builder_destroy(object<maq_scene_builder>(builder));
}

// Returns how many points the photo saw.
MAQ_NATIVE_OF(NativeScene, jlong, addView)
(JNIEnv* env, jclass, jlong builder, jlong photo, jdoubleArray camera, jobject progress) {
  return call(env, [&] {
    const maq_pinhole_camera from = maq_jni::pinhole_camera(env, camera);
    uint64_t seen_point_count = 0;
    const ProgressOfCall told(env, progress);
    const maq_status status = maq_scene_builder_add_view(object<maq_scene_builder>(builder), object<maq_frame>(photo),
                                                         &from, &seen_point_count);
    maq_jni::check_pending(env);
    check(status);
    return jlong(seen_point_count);
  });
}

MAQ_NATIVE_OF(NativeScene, void, cancelBuilder)(JNIEnv* env, jclass, jlong builder) {
  call(env, [&] { check(maq_scene_builder_cancel(object<maq_scene_builder>(builder))); });
}

// In the order of maq_scene_build_stats.
MAQ_NATIVE_OF(NativeScene, jdoubleArray, builderStats)(JNIEnv* env, jclass, jlong builder) {
  return call(env, [&] {
    maq_scene_build_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_scene_builder_get_stats(object<maq_scene_builder>(builder), &stats));
    return maq_jni::doubles_of(env, values_of(stats));
  });
}

MAQ_NATIVE_OF(NativeScene, jlong, finishBuilder)(JNIEnv* env, jclass, jlong builder) {
  return call(env, [&] {
    maq_scene* scene = nullptr;
    check(maq_scene_builder_finish(object<maq_scene_builder>(builder), &scene));
    return handle(scene);
  });
}
