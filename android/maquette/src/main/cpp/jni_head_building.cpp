// Heads from photos: the builder and its callbacks.
#include "jni_config.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::numbers;
using maq_jni::object;
using maq_jni::sized;

namespace {

// A dev.maquette.HeadCallbacks that the fit of this thread calls. What Java throws cancels the fit, and the native
// method throws it: until then nothing else is called.
class FitCallbacks {
 public:
  FitCallbacks(JNIEnv* env, jobject callbacks, bool has_preview)
      : env_(env), callbacks_(callbacks), has_preview_(has_preview), of_outer_fit_(of_this_thread) {
    jclass type = env->GetObjectClass(callbacks);
    on_progress_ = env->GetMethodID(type, "onProgress", "(D[B)Z");
    maq_jni::check_pending(env);
    on_preview_ = env->GetMethodID(type, "onPreview", "(J)V");
    maq_jni::check_pending(env);
    of_this_thread = this;
  }
  ~FitCallbacks() { of_this_thread = of_outer_fit_; }
  FitCallbacks(const FitCallbacks&) = delete;
  FitCallbacks& operator=(const FitCallbacks&) = delete;

  // For the C API, which calls both on the thread that fits.
  static int32_t on_progress(void*, double done, const char* stage) {
    const FitCallbacks* const to = of_this_thread;
    if (to->env_->ExceptionCheck()) return 0;
    try {
      jbyteArray bytes = maq_jni::bytes_of(to->env_, stage);
      const jboolean goes_on = to->env_->CallBooleanMethod(to->callbacks_, to->on_progress_, done, bytes);
      maq_jni::check_pending(to->env_);
      to->env_->DeleteLocalRef(bytes);
      return goes_on == JNI_TRUE ? 1 : 0;
    } catch (const maq_jni::PendingException&) {
      return 0;
    }
  }
  static void on_preview(void*, maq_head* head) {
    const FitCallbacks* const to = of_this_thread;
    // Without one, it was set by another thread, whose fit is refused while this one runs.
    if (!to->has_preview_ || to->env_->ExceptionCheck()) return maq_head_destroy(head);
    to->env_->CallVoidMethod(to->callbacks_, to->on_preview_, handle(head));
  }

 private:
  static thread_local const FitCallbacks* of_this_thread;

  JNIEnv* env_;
  jobject callbacks_;
  bool has_preview_;
  jmethodID on_progress_ = nullptr, on_preview_ = nullptr;
  const FitCallbacks* of_outer_fit_;  // a callback may fit another head
};

thread_local const FitCallbacks* FitCallbacks::of_this_thread = nullptr;

}  // namespace

// `values` as in HeadBuilder.Config.
MAQ_NATIVE_OF(NativeHead, jlong, createBuilder)
(JNIEnv* env, jclass, jlong context, jbyteArray folder, jobjectArray names, jobjectArray buffers, jdoubleArray values) {
  return call(env, [&] {
    const maq_jni::Bundle bundle(env, folder, names, buffers);
    const std::vector<jdouble> from = numbers(env, values, 7);
    maq_head_builder_config config;
    check(maq_head_builder_config_init(&config, sizeof config));
    bundle.put_into(config.model);
    config.model.threads = int32_t(from[0]);
    config.model.spinning = from[1] != 0 ? MAQ_SPINNING_ON : MAQ_SPINNING_OFF;
    config.model.provider = maq_provider(int32_t(from[2]));
    config.texture = maq_head_texture(int32_t(from[3]));
    config.texture_px = maq_jni::count_of(from[4]);
    config.mirror_unseen = int32_t(from[5]);
    config.delight_texture = int32_t(from[6]);
    config.progress_callback = FitCallbacks::on_progress;
    maq_head_builder* builder = nullptr;
    check(maq_head_builder_create(object<maq_context>(context), &config, &builder));
    return handle(builder);
  });
}

MAQ_NATIVE_OF(NativeHead, void, destroyBuilder)(JNIEnv*, jclass, jlong builder) {
  maq_head_builder_destroy(object<maq_head_builder>(builder));
}

// `hints`: box, roll, focal length.
MAQ_NATIVE_OF(NativeHead, void, addPhoto)(JNIEnv* env, jclass, jlong builder, jlong photo, jfloatArray hints) {
  call(env, [&] {
    maq_head_photo known;
    check(maq_head_photo_init(&known, sizeof known));
    env->GetFloatArrayRegion(hints, 0, 4, known.box_px);
    env->GetFloatArrayRegion(hints, 4, 1, &known.roll_rad);
    env->GetFloatArrayRegion(hints, 5, 1, &known.focal_px);
    maq_jni::check_pending(env);
    check(maq_head_builder_add_photo(object<maq_head_builder>(builder), object<maq_frame>(photo), &known));
  });
}

MAQ_NATIVE_OF(NativeHead, void, addHead)(JNIEnv* env, jclass, jlong builder, jlong head) {
  call(env, [&] { check(maq_head_builder_add_head(object<maq_head_builder>(builder), object<maq_head>(head))); });
}

MAQ_NATIVE_OF(NativeHead, void, clear)(JNIEnv* env, jclass, jlong builder) {
  call(env, [&] { check(maq_head_builder_clear(object<maq_head_builder>(builder))); });
}

MAQ_NATIVE_OF(NativeHead, void, cancel)(JNIEnv* env, jclass, jlong builder) {
  call(env, [&] { check(maq_head_builder_cancel(object<maq_head_builder>(builder))); });
}

MAQ_NATIVE_OF(NativeHead, jlong, fit)
(JNIEnv* env, jclass, jlong builder, jdouble seconds, jobject callbacks, jboolean has_preview,
 jdouble preview_interval_s) {
  return call(env, [&] {
    const FitCallbacks called(env, callbacks, has_preview);
    auto* const of = object<maq_head_builder>(builder);
    check(maq_head_builder_set_preview(of, has_preview ? preview_interval_s : 0,
                                       has_preview ? FitCallbacks::on_preview : nullptr, nullptr));
    maq_head* head = nullptr;
    const maq_status status = maq_head_builder_fit(of, seconds, &head);
    if (env->ExceptionCheck()) maq_head_destroy(head);
    maq_jni::check_pending(env);
    check(status);
    return handle(head);
  });
}

// Left, top, right and bottom of the box, then in the order of maq_head_photo_info.
MAQ_NATIVE_OF(NativeHead, jfloatArray, photo)(JNIEnv* env, jclass, jlong builder, jint index) {
  return call(env, [&] {
    auto found = sized<maq_head_photo_info>();
    check(maq_head_builder_get_photo(object<maq_head_builder>(builder), uint32_t(index), &found));
    const jfloat values[] = {found.box_px[0],     found.box_px[1],      found.box_px[2], found.box_px[3],
                             found.head_coverage, float(found.is_used), found.focal_px,  found.rms_px};
    return maq_jni::floats_of(env, values, std::size(values));
  });
}

// In the order of maq_head_build_stats.
MAQ_NATIVE_OF(NativeHead, jdoubleArray, builderStats)(JNIEnv* env, jclass, jlong builder) {
  return call(env, [&] {
    auto s = sized<maq_head_build_stats>();
    check(maq_head_builder_get_stats(object<maq_head_builder>(builder), &s));
    return maq_jni::doubles_of(
        env, {double(s.photo_count), double(s.used_photo_count), s.encode_ms, s.pose_ms, s.fit_ms, s.total_ms,
              double(s.step_count), double(s.provider), double(s.threads)});
  });
}
