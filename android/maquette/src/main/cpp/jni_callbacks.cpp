// Callbacks of the C API: each calls a static method of dev.maquette.jni.Callbacks, on any thread.
#include "jni_call.h"

#ifdef __ANDROID__
#include <android/log.h>
#endif

namespace maq_jni {
namespace {

JavaVM* java = nullptr;
jclass callbacks = nullptr;
jmethodID on_state = nullptr, on_progress = nullptr, on_preview = nullptr, on_release = nullptr;

// Makes this thread known to Java for as long as the object lives, as one that Java's end does not wait for. `env` is
// NULL when the virtual machine ends, and all its objects with it.
class Attached {
 public:
  Attached() {
    if (java->GetEnv(reinterpret_cast<void**>(&env), JNI_VERSION_1_6) == JNI_OK) return;
#ifdef __ANDROID__
    const jint attached = java->AttachCurrentThreadAsDaemon(&env, nullptr);
#else
    const jint attached = java->AttachCurrentThreadAsDaemon(reinterpret_cast<void**>(&env), nullptr);
#endif
    detach_ = attached == JNI_OK;
    if (!detach_) env = nullptr;
  }
  // At once: a thread that ends while Java knows it ends the process on Android.
  ~Attached() {
    if (detach_) java->DetachCurrentThread();
  }
  Attached(const Attached&) = delete;
  Attached& operator=(const Attached&) = delete;

  JNIEnv* env = nullptr;

 private:
  bool detach_ = false;
};

// The methods catch what an app throws; the rest, such as a lack of memory, is dropped.
template <typename... Arguments>
void tell(jmethodID method, Arguments... arguments) {
  const Attached attached;
  if (attached.env == nullptr) return;
  attached.env->CallStaticVoidMethod(callbacks, method, arguments...);
  if (attached.env->ExceptionCheck()) attached.env->ExceptionClear();
}

void tell_source_state(void* id, maq_source_state state, const char* reason) {
  tell(on_state, address_of(id), jint(state), jint(MAQ_OK), address_of(reason));
}

void tell_pipeline_state(void* id, maq_pipeline_state state, maq_status status, const char* problem) {
  tell(on_state, address_of(id), jint(state), jint(status), address_of(problem));
}

int32_t tell_progress(void*, double done, const char* stage) {
  const Attached attached;
  if (attached.env == nullptr) return 1;
  const jboolean goes_on =
      attached.env->CallStaticBooleanMethod(callbacks, on_progress, jdouble(done), address_of(stage));
  if (!attached.env->ExceptionCheck()) return goes_on == JNI_TRUE ? 1 : 0;
  attached.env->ExceptionClear();
  return 0;
}

void tell_preview(void*, maq_head* head) { tell(on_preview, address_of(head)); }

// The frame is released on any thread, also one of the library's own.
void tell_release(void* id) { tell(on_release, address_of(id)); }

}  // namespace

void find_callbacks(JNIEnv* env, JavaVM* machine) {
  java = machine;
  jclass found = env->FindClass("dev/maquette/jni/Callbacks");
  if (found == nullptr) return;
  callbacks = static_cast<jclass>(env->NewGlobalRef(found));
  on_state = env->GetStaticMethodID(found, "onState", "(JIIJ)V");
  if (on_state != nullptr) on_progress = env->GetStaticMethodID(found, "onProgress", "(DJ)Z");
  if (on_progress != nullptr) on_preview = env->GetStaticMethodID(found, "onPreview", "(J)V");
  if (on_preview != nullptr) on_release = env->GetStaticMethodID(found, "onRelease", "(J)V");
}

}  // namespace maq_jni

using maq_jni::address_of;

MAQ_NATIVE(Addresses, jlong, ofSourceCallback)(JNIEnv*, jclass) { return address_of(maq_jni::tell_source_state); }
MAQ_NATIVE(Addresses, jlong, ofPipelineCallback)(JNIEnv*, jclass) { return address_of(maq_jni::tell_pipeline_state); }
MAQ_NATIVE(Addresses, jlong, ofProgressCallback)(JNIEnv*, jclass) { return address_of(maq_jni::tell_progress); }
MAQ_NATIVE(Addresses, jlong, ofPreviewCallback)(JNIEnv*, jclass) { return address_of(maq_jni::tell_preview); }
MAQ_NATIVE(Addresses, jlong, ofReleaseCallback)(JNIEnv*, jclass) { return address_of(maq_jni::tell_release); }

// Log lines of the library go to logcat, under the tag "maquette"; elsewhere to the library's own log.
MAQ_NATIVE(Addresses, jlong, ofLogCallback)(JNIEnv*, jclass) {
#ifdef __ANDROID__
  return address_of(+[](void*, maq_log_level level, const char* text) {
    const int priority = level == MAQ_LOG_ERROR     ? ANDROID_LOG_ERROR
                         : level == MAQ_LOG_WARNING ? ANDROID_LOG_WARN
                         : level == MAQ_LOG_INFO    ? ANDROID_LOG_INFO
                                                    : ANDROID_LOG_DEBUG;
    __android_log_write(priority, "maquette", text);
  });
#else
  return 0;
#endif
}
