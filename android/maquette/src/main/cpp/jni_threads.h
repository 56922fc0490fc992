// Threads of the library, which Java does not know: what they tell Java.
#pragma once

#include "jni_call.h"

namespace maq_jni {

// Makes this thread known to Java for as long as the object lives, as one that Java's end does not wait for. `env` is
// NULL when the virtual machine ends, and all its objects with it.
class Attached {
 public:
  Attached();
  ~Attached();
  Attached(const Attached&) = delete;
  Attached& operator=(const Attached&) = delete;

  JNIEnv* env = nullptr;

 private:
  bool detach_ = false;
};

// A dev.maquette.Changes that a thread of the library tells of changes of state.
class Listener {
 public:
  Listener(JNIEnv* env, jobject changes);
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  // Any thread. What Java throws is dropped: no Java code waits to catch it.
  void tell(jint state, jint status, const char* text) const noexcept;

  void release(JNIEnv* env);

 private:
  jobject changes_;
  jmethodID on_change_;
};

}  // namespace maq_jni
