#include "jni_threads.h"

namespace {

JavaVM* java = nullptr;

}  // namespace

extern "C" JNIEXPORT jint JNICALL JNI_OnLoad(JavaVM* machine, void*) {
  java = machine;
  return JNI_VERSION_1_6;
}

namespace maq_jni {

Attached::Attached() {
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
Attached::~Attached() {
  if (detach_) java->DetachCurrentThread();
}

Listener::Listener(JNIEnv* env, jobject changes) {
  if (changes == nullptr) throw StatusError{MAQ_ERROR_INTERNAL, "a listener is null"};
  on_change_ = env->GetMethodID(env->GetObjectClass(changes), "onChange", "(II[B)V");
  check_pending(env);
  changes_ = env->NewGlobalRef(changes);
  if (changes_ == nullptr) throw std::bad_alloc();
}

void Listener::tell(jint state, jint status, const char* text) const noexcept {
  const Attached attached;
  JNIEnv* const env = attached.env;
  if (env == nullptr) return;
  try {
    jbyteArray bytes = bytes_of(env, text == nullptr ? "" : text);
    env->CallVoidMethod(changes_, on_change_, state, status, bytes);
    env->DeleteLocalRef(bytes);
  } catch (const PendingException&) {
  }
  if (env->ExceptionCheck()) env->ExceptionClear();
}

void Listener::release(JNIEnv* env) { env->DeleteGlobalRef(changes_); }

}  // namespace maq_jni
