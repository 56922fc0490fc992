// Sources: cameras, files, recordings and stubs; the cameras that are connected; recorders.
#include <memory>

#include "jni_config.h"
#include "jni_threads.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::object;

namespace {

using ListenedSource = maq_jni::Listened<maq_source>;

maq_source* source_of(jlong listened) { return ListenedSource::of(listened); }

void tell(void* listened, maq_source_state state, const char* reason) {
  ListenedSource::tell(listened, state, MAQ_OK, reason);
}

}  // namespace

MAQ_NATIVE_OF(NativeSource, jlong, create)
(JNIEnv* env, jclass, jlong context, jbyteArray uri, jdoubleArray values, jobject changes) {
  return call(env, [&] {
    const std::string from = maq_jni::text(env, uri);
    maq_source_config config = maq_jni::source_config(env, values);
    config.state_callback = tell;
    return ListenedSource::create(env, changes, [&](void* listened, maq_source** source) {
      config.state_user_data = listened;
      return maq_source_create(object<maq_context>(context), from.c_str(), &config, source);
    });
  });
}

MAQ_NATIVE_OF(NativeSource, void, destroy)(JNIEnv* env, jclass, jlong source) {
  ListenedSource::destroy(env, source, maq_source_destroy);
}

MAQ_NATIVE_OF(NativeSource, void, stop)(JNIEnv* env, jclass, jlong source) {
  call(env, [&] { check(maq_source_stop(source_of(source))); });
}

// 0 after the last frame and after a stop.
MAQ_NATIVE_OF(NativeSource, jlong, acquire)(JNIEnv* env, jclass, jlong source, jlong timeout_ns) {
  return call(env, [&]() -> jlong {
    maq_frame* frame = nullptr;
    const maq_status status = maq_source_acquire_frame(source_of(source), timeout_ns, &frame);
    if (status == MAQ_END_OF_STREAM || status == MAQ_CANCELLED) return 0;
    check(status);
    return handle(frame);
  });
}

MAQ_NATIVE_OF(NativeSource, void, seek)(JNIEnv* env, jclass, jlong source, jlong time_ns) {
  call(env, [&] { check(maq_source_seek(source_of(source), time_ns)); });
}

// In the order of maq_source_info.
MAQ_NATIVE_OF(NativeSource, jdoubleArray, info)(JNIEnv* env, jclass, jlong source) {
  return call(env, [&] {
    maq_source_info info{};
    info.struct_size = sizeof info;
    check(maq_source_get_info(source_of(source), &info));
    return maq_jni::doubles_of(
        env, {double(info.width_px), double(info.height_px), info.fps, double(info.frame_count), double(info.is_live),
              double(info.clock), double(info.frame_pool_size), double(info.dropped_frame_count)});
  });
}

// null when they are unknown.
MAQ_NATIVE_OF(NativeSource, jdoubleArray, intrinsics)(JNIEnv* env, jclass, jlong source) {
  return call(env, [&]() -> jdoubleArray {
    maq_intrinsics intrinsics{};
    const maq_status status = maq_source_get_intrinsics(source_of(source), &intrinsics);
    if (status == MAQ_ERROR_UNSUPPORTED) return nullptr;
    check(status);
    return maq_jni::doubles_of(env, maq_jni::values_of(intrinsics));
  });
}

// min, max, step, default and value; null when the device does not have the control.
MAQ_NATIVE_OF(NativeSource, jdoubleArray, control)(JNIEnv* env, jclass, jlong source, jint control) {
  return call(env, [&]() -> jdoubleArray {
    maq_source_control_info info{};
    info.struct_size = sizeof info;
    const maq_status status = maq_source_get_control(source_of(source), maq_source_control(control), &info);
    if (status == MAQ_ERROR_UNSUPPORTED) return nullptr;
    check(status);
    return maq_jni::doubles_of(env, {info.min, info.max, info.step, info.default_value, info.value});
  });
}

MAQ_NATIVE_OF(NativeSource, void, setControl)(JNIEnv* env, jclass, jlong source, jint control, jdouble value) {
  call(env, [&] { check(maq_source_set_control(source_of(source), maq_source_control(control), value)); });
}

MAQ_NATIVE_OF(NativeSource, jint, schemeCount)(JNIEnv*, jclass) { return jint(maq_source_get_scheme_count()); }

// Name, example, summary, and "1" for cameras, else "0".
MAQ_NATIVE_OF(NativeSource, jobjectArray, scheme)(JNIEnv* env, jclass, jint index) {
  return call(env, [&] {
    maq_source_scheme scheme{};
    scheme.struct_size = sizeof scheme;
    check(maq_source_get_scheme(uint32_t(index), &scheme));
    return maq_jni::texts_of(env, {scheme.name, scheme.example, scheme.summary, scheme.is_camera != 0 ? "1" : "0"});
  });
}

MAQ_NATIVE_OF(NativeSource, jlong, createCameraList)(JNIEnv* env, jclass, jlong context) {
  return call(env, [&] {
    maq_camera_list* list = nullptr;
    check(maq_camera_list_create(object<maq_context>(context), &list));
    return handle(list);
  });
}

MAQ_NATIVE_OF(NativeSource, void, destroyCameraList)(JNIEnv*, jclass, jlong list) {
  maq_camera_list_destroy(object<maq_camera_list>(list));
}

MAQ_NATIVE_OF(NativeSource, jint, cameraCount)(JNIEnv*, jclass, jlong list) {
  return jint(maq_camera_list_get_count(object<maq_camera_list>(list)));
}

// URI, name, bus, problem, then the format of each mode.
MAQ_NATIVE_OF(NativeSource, jobjectArray, cameraTexts)(JNIEnv* env, jclass, jlong list, jint index) {
  return call(env, [&] {
    const auto* const cameras = object<maq_camera_list>(list);
    maq_camera_info info{};
    info.struct_size = sizeof info;
    check(maq_camera_list_get_camera(cameras, uint32_t(index), &info));
    std::vector<const char*> texts = {info.uri, info.name, info.bus, info.problem};
    std::vector<maq_camera_mode> modes(info.mode_count);
    for (uint32_t i = 0; i < info.mode_count; ++i) {
      modes[i].struct_size = sizeof modes[i];
      check(maq_camera_list_get_mode(cameras, uint32_t(index), i, &modes[i]));
      texts.push_back(modes[i].format);
    }
    return maq_jni::texts_of(env, texts);
  });
}

// The status, then of each mode whether it is usable, width, height and rate.
MAQ_NATIVE_OF(NativeSource, jdoubleArray, cameraNumbers)(JNIEnv* env, jclass, jlong list, jint index) {
  return call(env, [&] {
    const auto* const cameras = object<maq_camera_list>(list);
    maq_camera_info info{};
    info.struct_size = sizeof info;
    check(maq_camera_list_get_camera(cameras, uint32_t(index), &info));
    std::vector<jdouble> numbers = {double(info.status)};
    for (uint32_t i = 0; i < info.mode_count; ++i) {
      maq_camera_mode mode{};
      mode.struct_size = sizeof mode;
      check(maq_camera_list_get_mode(cameras, uint32_t(index), i, &mode));
      numbers.insert(numbers.end(), {double(mode.is_usable), double(mode.width_px), double(mode.height_px), mode.fps});
    }
    return maq_jni::doubles_of(env, numbers);
  });
}

// `source` may be 0.
MAQ_NATIVE_OF(NativeSource, jlong, createRecorder)
(JNIEnv* env, jclass, jlong context, jbyteArray path, jlong source, jint jpeg_quality, jboolean keep_predicted) {
  return call(env, [&] {
    maq_recorder_config config;
    check(maq_recorder_config_init(&config, sizeof config));
    config.jpeg_quality = uint32_t(jpeg_quality);
    config.keep_predicted = keep_predicted == JNI_TRUE ? 1 : 0;
    maq_recorder* recorder = nullptr;
    check(maq_recorder_create(object<maq_context>(context), maq_jni::text(env, path).c_str(),
                              source == 0 ? nullptr : source_of(source), &config, &recorder));
    return handle(recorder);
  });
}

MAQ_NATIVE_OF(NativeSource, void, destroyRecorder)(JNIEnv*, jclass, jlong recorder) {
  maq_recorder_destroy(object<maq_recorder>(recorder));
}

MAQ_NATIVE_OF(NativeSource, void, record)(JNIEnv* env, jclass, jlong recorder, jlong frame) {
  call(env, [&] { check(maq_recorder_add_frame(object<maq_recorder>(recorder), object<maq_frame>(frame))); });
}

MAQ_NATIVE_OF(NativeSource, void, finishRecorder)(JNIEnv* env, jclass, jlong recorder) {
  call(env, [&] { check(maq_recorder_finish(object<maq_recorder>(recorder))); });
}

// Frames and bytes.
MAQ_NATIVE_OF(NativeSource, jdoubleArray, recorderInfo)(JNIEnv* env, jclass, jlong recorder) {
  return call(env, [&] {
    maq_recorder_info info{};
    info.struct_size = sizeof info;
    check(maq_recorder_get_info(object<maq_recorder>(recorder), &info));
    return maq_jni::doubles_of(env, {double(info.frame_count), double(info.size_bytes)});
  });
}
