// Contexts, and names of statuses and body parts.
#include "jni_call.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::object;

#ifdef __ANDROID__
#include <android/log.h>

namespace {

// Log lines of the library go to logcat, under the tag "maquette".
void log_to_logcat(void*, maq_log_level level, const char* text) {
  const int priority = level == MAQ_LOG_ERROR     ? ANDROID_LOG_ERROR
                       : level == MAQ_LOG_WARNING ? ANDROID_LOG_WARN
                       : level == MAQ_LOG_INFO    ? ANDROID_LOG_INFO
                                                  : ANDROID_LOG_DEBUG;
  __android_log_write(priority, "maquette", text);
}

}  // namespace
#endif

MAQ_NATIVE(jlong, createContext)(JNIEnv* env, jclass, jint log_level, jbyteArray onnxruntime) {
  return call(env, [&] {
    maq_context_config config;
    check(maq_context_config_init(&config, sizeof config));
    config.log_level = log_level == 0 ? MAQ_LOG_OFF : maq_log_level(log_level);  // the order of LogLevel
#ifdef __ANDROID__
    config.log_callback = log_to_logcat;
#endif
    const std::string library = maq_jni::text(env, onnxruntime);
    if (onnxruntime != nullptr) config.onnxruntime_library = library.c_str();
    maq_context* context = nullptr;
    check(maq_context_create(MAQ_HEADER_VERSION, &config, &context));
    return handle(context);
  });
}

MAQ_NATIVE(void, destroyContext)(JNIEnv*, jclass, jlong context) { maq_context_destroy(object<maq_context>(context)); }

MAQ_NATIVE(jstring, onnxRuntimeVersion)(JNIEnv* env, jclass, jlong context) {
  return call(env, [&] {
    const char* version = nullptr;
    check(maq_context_get_onnxruntime(object<maq_context>(context), &version, nullptr));
    return env->NewStringUTF(version);
  });
}

MAQ_NATIVE(jstring, version)(JNIEnv* env, jclass) { return env->NewStringUTF(maq_get_sdk_version()); }

MAQ_NATIVE(jstring, partName)(JNIEnv* env, jclass, jint part) {
  return env->NewStringUTF(maq_densepose_get_part_name(part));
}

// 0xRRGGBB.
MAQ_NATIVE(jint, partColour)(JNIEnv*, jclass, jint part) {
  uint8_t rgb[3];
  maq_densepose_get_part_colour(part, rgb);
  return rgb[0] << 16 | rgb[1] << 8 | rgb[2];
}
